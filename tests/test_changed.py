"""A few seeds of another arm over every seed as reported."""

import numpy as np
import pandas as pd

from drawings.changed import over_reported


def runs(seeds, episodes):
    rows = [(seed, k, float(seed + k)) for seed in seeds for k in range(1, episodes + 1)]
    return pd.DataFrame(rows, columns=["seed", "episode", "steps"])


def test_each_seed_is_a_line_of_running_medians_as_far_as_the_others_go():
    few = runs([5, 6], 130)
    (axes,) = over_reported(runs([0, 1, 2], 200), {"changed": few}).axes
    drawn = [line.get_xydata() for line in axes.lines if len(line.get_xdata())]
    assert [len(line) for line in drawn] == [130] * 5
    steps = few.loc[few["seed"] == 6, "steps"].to_numpy()
    assert drawn[-1][-1].tolist() == [130, np.median(steps[-100:])]
    assert drawn[-1][0].tolist() == [1, steps[0]]
    shown = [text.get_text() for text in axes.get_legend().get_texts()]
    assert shown == ["as reported, every seed", "changed"]
