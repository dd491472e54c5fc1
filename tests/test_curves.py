"""Learning curves against their definitions, seed by seed and episode by episode."""

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from rl_core.statistics import bootstrap_interval
from studies.curves import episodes_to_threshold, learning_curves, paired_difference_interval

quick = settings(max_examples=40, deadline=None)


def generator():
    return np.random.default_rng(0)


def episodes_table(steps_by_seed):
    rows = [
        (seed, episode, float(steps))
        for seed, column in steps_by_seed.items()
        for episode, steps in enumerate(column, start=1)
    ]
    return pd.DataFrame(rows, columns=["seed", "episode", "steps"])


def test_curves_are_aligned_by_seed_and_end_where_the_seed_stopped():
    table = episodes_table({3: [30, 10, 20, 40], 8: [7, 5]}).sample(frac=1, random_state=0)
    curves = learning_curves(table, seeds=[8, 1, 3], episodes=5, window=3)
    nan = np.nan
    np.testing.assert_array_equal(curves, [[7, 6, nan, nan, nan], [nan] * 5, [30, 20, 20, 20, nan]])


@quick
@given(
    hnp.arrays(
        np.float64,
        st.tuples(st.integers(1, 4), st.integers(1, 12)),
        elements=st.floats(-1e6, 1e6),
    ),
    st.integers(1, 15),
)
def test_curves_are_trailing_medians(steps, window):
    n_seeds, n_episodes = steps.shape
    curves = learning_curves(
        episodes_table(dict(enumerate(steps))),
        **{"seeds": range(n_seeds), "episodes": n_episodes, "window": window},
    )
    for t in range(n_episodes):
        part = steps[:, max(0, t + 1 - window) : t + 1]
        np.testing.assert_allclose(curves[:, t], np.median(part, axis=1), rtol=1e-9, atol=1e-6)


def test_an_arm_without_rows_has_empty_curves():
    nothing = learning_curves(episodes_table({0: [1]})[:0], seeds=[0, 1], episodes=2)
    np.testing.assert_array_equal(nothing, np.full((2, 2), np.nan))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"seeds": [1]}, r"must be all that the table has, got not \(\{0\}, set\(\)\)"),
        ({"episodes": 2}, r"must be all that the table has, got not \(set\(\), \{3\}\)"),
        ({"table": pd.concat([episodes_table({0: [1]})] * 2)}, "duplicate entries"),
        ({"table": episodes_table({0: [1, math.nan]})}, "table must be of finite steps"),
        ({"table": episodes_table({0: [1, math.inf]})}, "table must be of finite steps"),
    ],
)
def test_curves_refuse(change, message):
    arguments = {"table": episodes_table({0: [1, 2, 3], 1: [1]}), "seeds": [0, 1], "episodes": 3}
    with pytest.raises(ValueError, match=message):
        learning_curves(**(arguments | change))


@quick
@given(hnp.arrays(np.float64, (3, 12), elements=st.integers(0, 9).map(float)), st.integers(0, 9))
def test_episodes_to_threshold_is_the_first_at_or_below(curves, threshold):
    for curve, first in zip(curves, episodes_to_threshold(curves, threshold), strict=True):
        low = [episode for episode, steps in enumerate(curve, 1) if steps <= threshold]
        assert first == min(low, default=math.inf)


def test_a_seed_that_never_gets_there_has_an_infinite_difference_unless_neither_does():
    a, b = np.array([np.inf, np.inf, 5, 7, 9]), np.array([np.inf, 3, np.inf, 6, 6])
    interval = paired_difference_interval(a, b, rng=generator())
    assert interval == bootstrap_interval([0, np.inf, -np.inf, 1, 3], rng=generator())
    assert interval == (1, -np.inf, np.inf)


def test_half_the_seeds_better_and_half_worse_without_end_is_no_difference():
    a, b = np.array([np.inf, 1]), np.array([2, np.inf])
    assert paired_difference_interval(a, b, rng=generator()) == (0, -np.inf, np.inf)
