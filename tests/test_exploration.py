"""What rules and schedules take, refuse and promise."""

import dataclasses
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from odd_values import ODD, PLAIN, try_out

from rl_core.exploration import (
    EpsilonGreedy,
    HalfWay,
    Linear,
    Softmax,
    Trials,
    UnnormalisedSoftmax,
    VisitDecay,
    check_epsilon,
    schedule_state,
    values,
)
from rl_core.identity import describe


def by_episodes(start=0.5, end=0.1, episodes=3):
    return Linear(start, end, episodes=episodes)


def by_steps(start=0.5, end=0.1, steps=3):
    return Linear(start, end, steps=steps)


@settings(deadline=None)
@given(start=st.floats(1e-3, 1), end=st.floats(1e-3, 1), length=st.integers(1, 50))
def test_schedules_go_from_start_to_end_and_stay(start, end, length):
    course = by_episodes(start, end, length).values(length + 5)
    assert course[0] == start
    assert (course[length:] == end).all()
    assert min(start, end) <= course.min() <= course.max() <= max(start, end)
    changes = np.diff(course[: length + 1])
    assert (changes >= -1e-15).all() or (changes <= 1e-15).all()


def test_linear_steps_are_equal():
    assert by_episodes(0.2, 1.0, 4).values(5) == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])


# Schedules in the wrong unit


def test_a_schedule_is_by_the_episode_or_by_the_step():
    for arguments in ({}, {"episodes": 3, "steps": 3}):
        with pytest.raises(ValueError, match=r"^episodes, steps must be one of them a number"):
            Linear(1, 0, **arguments)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (EpsilonGreedy, "epsilon"),
        (Softmax, "temperature"),
        (VisitDecay, "initial"),
    ],
)
def test_tables_refuse_a_schedule_by_the_step(make, name):
    make(by_episodes())
    with pytest.raises(ValueError, match=rf"^{name} must be a schedule given in episodes, got"):
        make(by_steps())
    with pytest.raises(TypeError, match=rf"^{name} must be .*, got HalfWay"):
        make(HalfWay())


def test_networks_refuse_a_schedule_by_the_episode():
    assert check_epsilon("epsilon", by_steps()) == by_steps()
    with pytest.raises(ValueError, match=r"^epsilon must be a schedule given in steps"):
        check_epsilon("epsilon", by_episodes())
    with pytest.raises(ValueError, match=r"^epsilon.start must be a number from 0 to 1, got 1.5"):
        check_epsilon("epsilon", by_steps(start=1.5))


def test_a_schedule_by_the_step_has_no_values_by_the_episode():
    with pytest.raises(TypeError, match="episodes must be an integer where values are asked for"):
        by_steps().values(5)


def test_a_schedule_s_state_begins_at_its_start():
    for epsilon in (0.25, by_steps(0.25), HalfWay(0.25, 0.1)):
        assert schedule_state(epsilon)[0] == 0.25


# Wrong values


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: EpsilonGreedy(1.1), ValueError, "epsilon must be a number from 0 to 1, got 1.1"),
        (lambda: EpsilonGreedy(-0.1), ValueError, "epsilon must .*, got -0.1"),
        (lambda: EpsilonGreedy(math.nan), ValueError, "epsilon must .*, got nan"),
        (lambda: EpsilonGreedy("0.1"), TypeError, "epsilon must .*, got '0.1'"),
        (lambda: EpsilonGreedy(True), TypeError, "epsilon must .*, got True"),
        (lambda: EpsilonGreedy(by_episodes(0.5, 1.5)), ValueError, "epsilon.end must .*, got 1.5"),
        (lambda: Softmax(0), ValueError, "temperature must be a finite number above 0, got 0"),
        (lambda: Softmax(-1.0), ValueError, "temperature must .*, got -1.0"),
        (lambda: Softmax(math.inf), ValueError, "temperature must .*, got inf"),
        (lambda: Softmax(by_episodes(1.0, 0.0)), ValueError, "temperature.end must .*, got 0.0"),
        (lambda: by_episodes(0.5, math.nan), ValueError, "end must .*, got nan"),
        (lambda: by_episodes(episodes=0), ValueError, "episodes must be an integer from 1.*got 0"),
        (lambda: by_episodes(episodes=2.5), TypeError, "episodes must .*, got 2.5"),
        (lambda: by_steps(steps=0), ValueError, "steps must be an integer from 1 or None, got 0"),
        (lambda: HalfWay(1.1), ValueError, "start must be a number from 0 to 1, got 1.1"),
        (lambda: HalfWay(0.9, -0.1), ValueError, "end must be a number from 0 to 1, got -0.1"),
        (lambda: VisitDecay(initial=0), ValueError, "initial must .*, got 0"),
        (lambda: VisitDecay(exponent=0), ValueError, "exponent must be .* above 0 .*, got 0"),
        (lambda: VisitDecay(exponent=1.5), ValueError, "exponent must be .* to 1.*, got 1.5"),
        (lambda: VisitDecay(exponent=by_episodes()), TypeError, "exponent must .*, got Linear"),
        (lambda: Trials(every=0), ValueError, "every must be an integer from 1, got 0"),
        (lambda: Trials(episodes=1.5), TypeError, "episodes must .*, got 1.5"),
        (lambda: Trials(max_steps=0), ValueError, "max_steps must .*, got 0"),
        (lambda: Trials(epsilon=2), ValueError, "epsilon must .*, got 2"),
    ],
)
def test_wrong_values_are_refused(make, error, message):
    with pytest.raises(error, match=f"^{message}"):
        make()


def test_edges_that_are_allowed():
    assert VisitDecay(1, 1) == VisitDecay(1.0, 1.0)
    assert EpsilonGreedy(0).epsilon == 0.0
    assert EpsilonGreedy(1).epsilon == 1.0
    assert Softmax(5e-324).temperature > 0
    assert Trials(every=1, episodes=1, max_steps=1, epsilon=1).epsilon == 1.0


@pytest.mark.parametrize(
    "make",
    [by_episodes, by_steps, HalfWay, VisitDecay, EpsilonGreedy, Softmax, Trials],
    ids=lambda make: make.__name__,
)
@settings(max_examples=60, deadline=None)
@given(st.data())
def test_values_of_any_type_become_plain_or_are_refused_by_name(make, data):
    names = make.__code__.co_varnames if make.__name__.islower() else make.__annotations__
    name = data.draw(st.sampled_from([name for name in names if name != "kind"]))
    made = try_out(make, name, data.draw(ODD))
    if made is not None:
        assert all(type(value) in PLAIN for value in vars(made).values())
        json.dumps(dataclasses.asdict(made))


@given(ODD)
@settings(max_examples=60, deadline=None)
def test_values_are_a_number_an_episode_whatever_number_was_given(epsilon):
    rule = try_out(EpsilonGreedy, "epsilon", epsilon)
    if rule is not None:
        assert values(rule.parameter, 3).tolist() == [rule.epsilon] * 3


@pytest.mark.parametrize(
    "rule", [EpsilonGreedy(by_episodes(0.9)), Softmax(0.3), UnnormalisedSoftmax()]
)
def test_rules_can_be_written_as_json_and_told_apart(rule):
    json.dumps(dataclasses.asdict(rule))
    assert describe(rule)["class"] == f"rl_core.exploration:{type(rule).__name__}"
    assert "kind" not in dataclasses.asdict(rule)


@pytest.mark.parametrize(
    "rule",
    [
        *(Linear(1, 0, episodes=2), HalfWay(), VisitDecay(), Trials()),
        *(EpsilonGreedy(), Softmax()),
    ],
)
def test_rules_and_schedules_are_values(rule):
    for field in dataclasses.fields(rule):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(rule, field.name, 1)
    assert hash(rule) == hash(dataclasses.replace(rule))
