"""Shaping: the report's two and CartPole's by hand, and what a function must be to shape."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_shaping import balance

from rl_core.dqn import DQNConfig, check_dqn, dqn
from rl_core.policies import MLP
from rl_core.worlds.shaping import Shaping, compiled_shape, original, shape_for, shaped_reward
from studies.rewards import distance_from_start, tip_height

REWARDS = ("studies.rewards:tip_height", "studies.rewards:distance_from_start")
SHAPES = {
    "rl_core.worlds.shaping:original": original,
    **dict(zip(REWARDS, (tip_height, distance_from_start), strict=True)),
    "toy_shaping:balance": balance,
}


def beyond(observation, reward):
    """Looks at a number that a mountain car does not show."""
    return observation[2] + reward


def late(observation, reward):
    """Looks beyond the end once the car is left of the middle."""
    return observation[2] if observation[0] < -0.5 else reward


def strings(observation, reward):
    """Returns no number."""
    return "good"


def of_one(observation):
    """Takes no reward."""
    return observation[0]


def test_by_hand_with_numbers_that_all_differ():
    o = np.array([0.6, -0.8, 0.28, 0.96, 3.0, 5.0], np.float32)
    assert tip_height(o, 9.0) == pytest.approx(-(0.6 + (0.6 * 0.28 - -0.8 * 0.96)), rel=1e-6)
    assert distance_from_start(np.array([-0.9, 0.07], np.float32), 9.0) == pytest.approx(0.4)
    assert distance_from_start(np.array([0.3, 0.07], np.float32), 9.0) == pytest.approx(0.8)
    for sign in (1, -1):
        o = np.array([sign * 1.2, 0.7, -sign * 0.1, 0.9], np.float32)
        assert balance(o, 3.0) == pytest.approx((3.0 - 0.5 - 0.2) / 20)
    assert original(o, 4.5) == 4.5


@settings(deadline=None)
@given(st.floats(-np.pi, np.pi), st.floats(-np.pi, np.pi))
def test_the_tip_is_as_high_as_its_links_reach(theta1, theta2):
    angles = [np.cos(theta1), np.sin(theta1), np.cos(theta2), np.sin(theta2), 1, 2]
    expected = -np.cos(theta1) - np.cos(theta1 + theta2)
    assert tip_height(np.array(angles, np.float32), -1.0) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("path", SHAPES)
def test_compiled_shapes_are_the_functions(path):
    """To the precision of the observation, in which compiled code multiplies."""
    plain, compiled = SHAPES[path], compiled_shape(path)
    for o in np.random.default_rng(0).normal(size=(50, 6)).astype(np.float32):
        assert shaped_reward(compiled, o, -1.0) == pytest.approx(plain(o, -1.0), abs=1e-6)


@pytest.mark.parametrize("function", ["test_shaping:strings", "test_shaping:of_one", "math:pi"])
def test_what_numba_cannot_compile_is_refused_with_its_name(function):
    with pytest.raises(ValueError, match=rf"^function must be .*, got '{function}'"):
        Shaping(function)


@pytest.mark.parametrize("function", [3, None, b"math:floor"])
def test_what_is_no_path_is_refused(function):
    with pytest.raises(TypeError, match=r"^function must be an import path"):
        Shaping(function)


def test_a_shaping_for_longer_observations_is_refused_before_anything_runs():
    assert shape_for(None, 1)(np.ones(1, np.float32), 2.5) == 2.5
    for function in ("test_shaping:beyond", REWARDS[0], "toy_shaping:balance"):
        config = DQNConfig(network=MLP(()), shaping=Shaping(function))
        message = rf"^shaping must be a function of observations of 2 numbers, got '{function}'"
        with pytest.raises(ValueError, match=message):
            check_dqn("MountainCar-v0", config)
        with pytest.raises(ValueError, match=message):
            dqn("MountainCar-v0", config, episodes=1, seeds=[0])


def test_an_index_beyond_the_observation_ends_the_loop_and_reads_nothing():
    config = DQNConfig(network=MLP(()), shaping=Shaping("test_shaping:late"), max_episode_steps=50)
    with pytest.raises(IndexError):
        dqn("MountainCar-v0", config, episodes=9, seeds=[0])
