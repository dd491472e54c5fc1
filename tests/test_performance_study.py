"""What appendix B reads from its measurements."""

import numpy as np
import pandas as pd
import pytest

from drawings import performance as drawings
from studies.performance import Amdahl, each, power, serial_share, whole


def turns(seconds):
    """Rows a turn of what takes `seconds(size, turn)`."""
    rows = [(n, turn, seconds(n, turn)) for n in (1, 2, 4, 8) for turn in range(5)]
    return pd.DataFrame(rows, columns=["size", "turn", "seconds"])


def test_a_power_is_found_through_a_slow_turn():
    measured = turns(lambda n, turn: 3 * n**1.5 * (10 if turn == 2 else 1))
    assert power(measured) == pytest.approx(1.5)
    assert each(measured).to_numpy() == pytest.approx(3 * np.sqrt([1, 2, 4, 8]))


@pytest.mark.parametrize("share", [0.0, 0.1, 0.6])
def test_the_serial_share_is_that_of_the_law(share):
    law = serial_share(turns(lambda n, _: share + (1 - share) / n))
    assert (law.low, law.share, law.high) == pytest.approx((share, share, share), abs=1e-6)


def test_a_speed_up_ends_at_one_over_the_serial_share():
    law = Amdahl(0.25, 0.2, 0.3)
    assert law.speed_up(1) == pytest.approx(1)
    assert law.speed_up(10**9) == pytest.approx(4)
    assert law.speed_up(10**9, law.low) == pytest.approx(5)


def test_two_cores_that_are_more_than_twice_as_fast_have_no_serial_share():
    assert serial_share(turns(lambda n, _: 1 / n**2)).share == 0


def test_waiting_is_what_the_cores_had_nothing_to_do():
    row = {"what": "book", "how": "x", "cores": 2, "seconds": 120.0, "processor_seconds": 180.0}
    shown = whole(pd.DataFrame([row])).iloc[0]
    assert (shown["minutes"], shown["processor minutes"], shown["waiting"]) == (2, 3, 0.25)


def test_the_figures_can_be_drawn():
    measured = turns(lambda n, turn: (1 + turn / 100) / n)
    drawings.growth(measured, "seeds")
    drawings.cores(measured, serial_share(measured))
    rows = [(name, "b", 2.0, 1.5, 2.5, name) for name in drawings.MARKS]
    columns = ["benchmark", "against", "ratio", "low", "high", "verdict"]
    places = drawings.ratios(pd.DataFrame(rows, columns=columns)).axes[0].get_yticklabels()
    assert len(places) == 3


def test_a_benchmark_s_rivals_stand_together_under_its_name():
    rows = [("a", "x", 2.0, 1.5, 2.5), ("b", "y", 3.0, 2.0, 4.0), ("a", "z", 1.5, 1.2, 1.8)]
    table = pd.DataFrame(rows, columns=["benchmark", "against", "ratio", "low", "high"])
    (axes,) = drawings.ratios(table.assign(verdict="faster")).axes
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["x", "z", "y"]
    marks = [line.get_xydata()[0] for line in axes.lines if len(line.get_xdata()) == 1]
    assert [ratio for ratio, _ in marks] == [2.0, 1.5, 3.0]
    assert [place for _, place in marks] == list(axes.get_yticks())


def test_a_ratio_is_told_with_its_interval_where_it_has_one():
    columns = ["benchmark", "against", "rival", "ours", "ratio", "verdict", "low", "high"]
    rows = [("a", "x", 4.0, 2.0, 2.0, "faster", 1.5, 2.5)]
    rows.append(("b", "limit", 200.0, 190.0, 1.05, "within", np.nan, np.nan))
    told = drawings.in_words(pd.DataFrame(rows, columns=columns))
    assert told["ratio [95%]"].tolist() == ["2 [1.5, 2.5]", "1.05"]
