"""How actions are picked from values, and how epsilon and step sizes fall, as compiled."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rl_core.exploration import (
    EpsilonGreedy,
    HalfWay,
    Linear,
    Softmax,
    UnnormalisedSoftmax,
    schedule_state,
    values,
)
from rl_core.kernels.choices import (
    VALUE,
    after_copy,
    after_goal,
    after_step,
    choose,
    greedy_action,
    step_size,
)

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
@settings(deadline=None)
@given(q=ACTION_VALUES, u=UNIT, v=UNIT)
def test_any_two_uniforms_pick_an_action(rule, q, u, v):
    assert 0 <= choose(rule.kind, rule.parameter, q, u, v) < len(q)


@pytest.mark.parametrize("kind", [EpsilonGreedy.kind, Softmax.kind, UnnormalisedSoftmax.kind])
@settings(deadline=None)
@given(
    st.lists(st.sampled_from([0.0, 1.0, np.nan, np.inf, -np.inf]), min_size=1, max_size=4),
    UNIT,
    UNIT,
)
def test_an_action_is_picked_whatever_the_values_have_become(kind, q, u, v):
    """A learner that diverges must not index beyond its table on the way."""
    assert 0 <= choose(kind, 0.5, np.array(q), u, v) < len(q)


@settings(deadline=None)
@given(q=ACTION_VALUES, v=UNIT)
def test_the_greedy_action_has_the_largest_value(q, v):
    assert q[choose(EpsilonGreedy.kind, 0.0, q, 0.0, v)] == q.max()
    assert q[greedy_action(q, v)] == q.max()


@settings(deadline=None)
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


def test_a_step_size_decays_with_visits():
    assert [step_size(0.5, 1.0, n) for n in (1, 2, 10)] == pytest.approx([0.5, 0.25, 0.05])
    assert step_size(0.5, 0.5, 4) == pytest.approx(0.25)
    assert step_size(0.3, 0.0, 1000) == 0.3


def test_the_report_s_exploration_by_hand():
    state = schedule_state(HalfWay(0.9, 0.1))
    course = []
    for event in (after_copy, after_goal, after_copy, after_copy):
        event(state)
        after_step(state, 10_000)
        course.append(state[VALUE])
    np.testing.assert_allclose(course, [0.9, 0.5, 0.4, 0.35])
    for _ in range(60):
        after_goal(state)
    assert state[VALUE] == pytest.approx(0.1)


def test_a_schedule_by_the_step_is_linear_and_then_constant_and_a_number_stays():
    falling = Linear(1.0, 0.2, steps=8)
    for schedule, expected in ((falling, [1, 0.9, 0.6, 0.2, 0.2]), (0.3, [0.3] * 5)):
        state = schedule_state(schedule)
        found = []
        for t in (0, 1, 4, 8, 100):
            after_step(state, t)
            after_copy(state)
            after_goal(state)
            found.append(state[VALUE])
        np.testing.assert_allclose(found, expected)


@settings(deadline=None)
@given(st.floats(0, 1), st.floats(0, 1), st.integers(1, 30))
def test_the_same_schedule_by_steps_and_by_episodes_takes_the_same_course(start, end, duration):
    state = schedule_state(Linear(start, end, steps=duration))
    course = []
    for t in range(duration + 3):
        after_step(state, t)
        course.append(state[VALUE])
    expected = Linear(start, end, episodes=duration).values(duration + 3)
    np.testing.assert_allclose(course, expected, atol=1e-15)


@settings(deadline=None)
@given(st.floats(0, 1), st.floats(0, 1), st.lists(st.booleans(), max_size=40))
def test_half_way_never_leaves_the_range_between_its_ends(start, end, goals):
    state = schedule_state(HalfWay(start, end))
    for goal in goals:
        (after_goal if goal else after_copy)(state)
        assert min(start, end) - 1e-15 <= state[VALUE] <= max(start, end) + 1e-15
