"""Exploration rules give the probabilities they promise; schedules stay between their ends."""

import dataclasses
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rl_core.exploration import (
    EpsilonGreedy,
    Evaluation,
    Geometric,
    Linear,
    Softmax,
    UnnormalisedSoftmax,
    VisitDecay,
    choose,
    step_size,
    values,
)
from rl_core.identity import describe

UNIT = st.floats(0, 1, exclude_max=True)
ACTION_VALUES = st.lists(st.floats(-100, 100), min_size=1, max_size=6).map(np.array)


def shares(rule, q, n=400):
    """How often each action is taken over an even grid of the two uniforms."""
    grid = (np.arange(n) + 0.5) / n
    vs = grid if isinstance(rule, EpsilonGreedy) else [0.5]
    parameter = float(values(rule.parameter, 1)[0])
    taken = [choose(rule.kind, parameter, np.array(q), u, v) for u in grid for v in vs]
    return np.bincount(taken, minlength=len(q)) / len(taken)


@pytest.mark.parametrize(
    ("epsilon", "q", "expected"),
    [
        (0.0, [0.0, 1.0, 0.0, 0.0], [0, 1, 0, 0]),
        (0.2, [0.0, 1.0, 0.0, 0.0], [0.05, 0.85, 0.05, 0.05]),
        (1.0, [0.0, 1.0, 0.0, 0.0], [0.25, 0.25, 0.25, 0.25]),
        (0.0, [2.0, 1.0, 2.0, 2.0], [1 / 3, 0, 1 / 3, 1 / 3]),
        (0.4, [-1.0, -1.0, -3.0, -2.0], [0.4, 0.4, 0.1, 0.1]),
        (0.9, [0.0, 0.0, 0.0, 0.0], [0.25, 0.25, 0.25, 0.25]),
    ],
)
def test_epsilon_is_the_probability_of_a_random_action_and_ties_are_shared(epsilon, q, expected):
    assert shares(EpsilonGreedy(epsilon), q) == pytest.approx(expected, abs=0.004)


@pytest.mark.parametrize("temperature", [0.01, 0.1, 1.0, 50.0])
@pytest.mark.parametrize("q", [[0.0, 0.1, 0.3], [1000.0, 1000.1, 999.0], [-5.0, -5.0, -5.2]])
def test_softmax_weighs_actions_by_the_exponential_of_their_values(temperature, q):
    weights = [math.exp((x - max(q)) / temperature) for x in q]
    expected = np.array(weights) / sum(weights)
    assert shares(Softmax(temperature), q, n=20_000) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("rule", [EpsilonGreedy(0.3), Softmax(0.7), Softmax(1e-6)])
@given(q=ACTION_VALUES, u=UNIT, v=UNIT)
def test_any_two_uniforms_pick_an_action(rule, q, u, v):
    assert 0 <= choose(rule.kind, rule.parameter, q, u, v) < len(q)


@given(q=ACTION_VALUES, v=UNIT)
def test_the_greedy_action_has_the_largest_value(q, v):
    assert q[choose(EpsilonGreedy.kind, 0.0, q, 0.0, v)] == q.max()


@given(q=st.lists(st.floats(0, 5), min_size=4, max_size=4).map(np.array), u=UNIT)
def test_the_unnormalised_softmax_divides_by_the_sum_of_the_values(q, u):
    if q.sum() == 0:
        expected = 0
    else:
        with np.errstate(over="ignore"):
            cumulative = np.cumsum(np.exp(q) / q.sum())
        if np.any(np.abs(cumulative - u) < 1e-9):  # a rounding error decides
            return
        expected = int(np.argmax(cumulative > u))
    assert choose(UnnormalisedSoftmax.kind, 1.0, q, u, 0.0) == expected


@pytest.mark.parametrize("schedule", [Linear, Geometric])
@given(start=st.floats(1e-3, 1), end=st.floats(1e-3, 1), length=st.integers(1, 50))
def test_schedules_go_from_start_to_end_and_stay(schedule, start, end, length):
    course = schedule(start, end, length).values(length + 5)
    assert course[0] == start
    assert (course[length:] == end).all()
    assert min(start, end) <= course.min() <= course.max() <= max(start, end)
    changes = np.diff(course[: length + 1])
    assert (changes >= -1e-15).all() or (changes <= 1e-15).all()


def test_linear_steps_are_equal_and_geometric_factors_are():
    linear, geometric = Linear(0.2, 1.0, 4).values(5), Geometric(0.1, 0.8, 3).values(4)
    assert linear == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    assert geometric == pytest.approx([0.1, 0.2, 0.4, 0.8])


def test_a_step_size_decays_with_visits():
    assert [step_size(0.5, 1.0, n) for n in (1, 2, 10)] == pytest.approx([0.5, 0.25, 0.05])
    assert step_size(0.5, 0.5, 4) == pytest.approx(0.25)
    assert step_size(0.3, 0.0, 1000) == 0.3


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: EpsilonGreedy(1.1), ValueError, r"epsilon is 1.1; allowed .* \[0, 1\]"),
        (lambda: EpsilonGreedy(-0.1), ValueError, "epsilon is -0.1"),
        (lambda: EpsilonGreedy(math.nan), ValueError, "epsilon is nan"),
        (lambda: EpsilonGreedy("0.1"), TypeError, "epsilon is '0.1'"),
        (lambda: EpsilonGreedy(True), TypeError, "epsilon is True"),
        (lambda: EpsilonGreedy(Linear(0.5, 1.5, 9)), ValueError, "epsilon.end is 1.5"),
        (lambda: Softmax(0), ValueError, "temperature is 0; allowed are finite numbers above 0"),
        (lambda: Softmax(-1.0), ValueError, "temperature is -1.0"),
        (lambda: Softmax(math.inf), ValueError, "temperature is inf"),
        (lambda: Softmax(Linear(1.0, 0.0, 9)), ValueError, "temperature.end is 0.0"),
        (lambda: Geometric(0.5, 0.0, 9), ValueError, "end is 0.0; allowed are numbers above 0"),
        (lambda: Linear(0.5, math.nan, 9), ValueError, "end is nan"),
        (lambda: Linear(0.5, 0.1, 0), ValueError, "episodes is 0; allowed are integers from 1"),
        (lambda: Linear(0.5, 0.1, 2.5), TypeError, "episodes is 2.5"),
        (lambda: VisitDecay(initial=0), ValueError, "initial is 0; allowed"),
        (lambda: VisitDecay(exponent=1.5), ValueError, "exponent is 1.5"),
        (lambda: VisitDecay(exponent=Linear(0.6, 1, 9)), TypeError, "exponent is Linear"),
        (lambda: Evaluation(every=0), ValueError, "every is 0"),
        (lambda: Evaluation(episodes=1.5), TypeError, "episodes is 1.5"),
        (lambda: Evaluation(epsilon=2), ValueError, "epsilon is 2"),
    ],
)
def test_wrong_values_are_refused(make, error, message):
    with pytest.raises(error, match=message):
        make()


@pytest.mark.parametrize(
    "rule", [EpsilonGreedy(Linear(0.9, 0.1, 100)), Softmax(0.3), UnnormalisedSoftmax()]
)
def test_rules_can_be_written_as_json_and_told_apart(rule):
    json.dumps(dataclasses.asdict(rule))
    assert describe(rule)["class"] == type(rule).__name__
    assert "kind" not in dataclasses.asdict(rule)
