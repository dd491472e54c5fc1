"""The figures' data: what is written is what was drawn."""

import numpy as np
import pandas as pd
import pytest

from report import figure_data


def test_every_point_of_every_curve_is_a_row():
    x, rng = np.array([5, 10, 15]), np.random.default_rng(0)
    arms = {name: rng.normal(size=(2, 3)) for name in ("one", "other")}
    table = figure_data.tidy(x, arms, value="steps", seeds=range(4, 6))
    assert len(table) == 12
    for arm, seed, episode, steps in table.itertuples(index=False):
        assert steps == arms[arm][seed - 4, np.flatnonzero(x == episode)[0]]


def test_curves_of_another_shape_are_refused():
    with pytest.raises(ValueError, match=r"arms\['one'\] must be .*\(2, 3\), got \(3, 2\)"):
        figure_data.tidy(np.arange(3), {"one": np.zeros((3, 2))}, value="y", seeds=range(2))


def test_what_is_offered_can_be_read_again(tmp_path):
    table = pd.DataFrame({"episode": [1, 20_000_000], "error": [1 / 3, np.nan]})
    figure_data.offer("figure_0", table, folder=tmp_path / "figures")
    again = pd.read_csv(tmp_path / "figures" / "figure_0.csv")
    pd.testing.assert_frame_equal(again, table, rtol=1e-5)


@pytest.mark.parametrize("name", ["../figure_0", "figures/figure_0", "figure 0", ""])
def test_a_name_is_never_a_path(tmp_path, name):
    with pytest.raises(ValueError, match="name must be a name of letters"):
        figure_data.offer(name, pd.DataFrame(), folder=tmp_path / "figures")
    assert list(tmp_path.iterdir()) == []
