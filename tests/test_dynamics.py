"""The compiled tasks against Gymnasium's own, step for step and bit for bit."""

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rl_core import dynamics
from rl_core.dynamics import ACROBOT, MOUNTAIN_CAR, MOUNTAIN_CAR_CONTINUOUS, TASKS

SEEDS = range(24)
STEPS = 1500


def original(name):
    return gymnasium.make(name, disable_env_checker=True).unwrapped


def choose(name, seed, state, rng):
    """Actions of three kinds, so that walls, bounds and goals are met as well as the valley."""
    along = {"Acrobot-v1": state[2], "MountainCar-v0": state[1]}.get(name, state[1])
    if name == "MountainCarContinuous-v0":
        scale, push = [(0.3, 0.0), (1.0, 1.0), (3.0, 0.5)][seed % 3]
        return np.float32(rng.normal(push * np.sign(along), scale))
    if seed % 3 == 0 or (seed % 3 == 1 and rng.random() < 0.3):
        return np.float32(rng.integers(3))
    return np.float32(2 if along >= 0 else 0)


def native(name, action):
    return np.array([action]) if name == "MountainCarContinuous-v0" else int(action)


@pytest.mark.parametrize("name", TASKS)
def test_twin_equals_gymnasium_bit_for_bit(name):
    goals = 0
    for seed in SEEDS:
        env, task = original(name), TASKS[name]
        rng, actions = np.random.default_rng(seed), np.random.default_rng(1000 + seed)
        expected, _ = env.reset(seed=seed)
        state, observation = dynamics.reset(task.code, rng)
        np.testing.assert_array_equal(observation, expected)
        for _ in range(STEPS):
            action = choose(name, seed, state, actions)
            expected, *outcome, _, _ = env.step(native(name, action))
            assert list(dynamics.step(task.code, state, np.array([action]))) == outcome
            dynamics.observe(task.code, state, observation)
            np.testing.assert_array_equal(observation, expected)
            np.testing.assert_array_equal(state[: len(env.state)], env.state)
            if outcome[1]:
                goals += 1
                expected, _ = env.reset()
                state, observation = dynamics.reset(task.code, rng)
                np.testing.assert_array_equal(observation, expected)
    assert goals > 0


@pytest.mark.parametrize("name", TASKS)
def test_starts_are_those_of_gymnasium(name):
    env, rng = original(name), np.random.default_rng(7)
    env.np_random = np.random.default_rng(7)
    for _ in range(2000):
        _, observation = dynamics.reset(TASKS[name].code, rng)
        np.testing.assert_array_equal(observation, env.reset()[0])
        assert observation.dtype == np.float32


@pytest.mark.parametrize("name", TASKS)
def test_tasks_have_gymnasiums_spaces(name):
    env, task = original(name), TASKS[name]
    assert env.observation_space.shape == (task.n_observations,)
    if task.n_actions:
        assert (env.action_space.n, task.action_dimensions) == (task.n_actions, 0)
    else:
        assert env.action_space.shape == (task.action_dimensions,)


def test_cost_is_charged_on_the_force_before_it_is_clipped():
    start = np.array([-0.5, 0.0, 1.0, 0.0])
    weak, strong = start.copy(), start.copy()
    cost, _ = dynamics.step(MOUNTAIN_CAR_CONTINUOUS, weak, np.array([1.5], np.float32))
    higher_cost, _ = dynamics.step(MOUNTAIN_CAR_CONTINUOUS, strong, np.array([3.0], np.float32))
    assert (cost, higher_cost) == pytest.approx((-0.225, -0.9))
    np.testing.assert_array_equal(weak, strong)


def test_goal_pays_a_hundred_and_ends_the_episode():
    state = np.array([0.44, 0.05, 1.0, 0.0])
    reward, terminated = dynamics.step(MOUNTAIN_CAR_CONTINUOUS, state, np.zeros(1, np.float32))
    assert terminated
    assert reward == 100.0


def test_acrobot_conserves_energy_without_torque():
    def energy(state):
        theta1, theta2, omega1, omega2 = state
        below = -np.cos(theta1), -np.cos(theta1) - 0.5 * np.cos(theta1 + theta2)
        kinetic1 = 0.5 * (0.25 + 1.0) * omega1**2
        centre = (
            omega1**2 + 0.25 * (omega1 + omega2) ** 2 + omega1 * (omega1 + omega2) * np.cos(theta2)
        )
        kinetic2 = 0.5 * centre + 0.5 * (omega1 + omega2) ** 2
        return kinetic1 + kinetic2 + 9.8 * (0.5 * below[0] + below[1])

    def gain(torque):
        state = np.array([0.3, -0.2, 0.1, 0.2])
        before = energy(state)
        for _ in range(20):
            dynamics.step(ACROBOT, state, np.array([1 + torque], np.float32))
        return energy(state) - before

    assert abs(gain(0)) < 0.01
    assert min(abs(gain(-1)), abs(gain(1))) > 0.1


@settings(deadline=None, max_examples=200)
@given(
    st.sampled_from([MOUNTAIN_CAR, MOUNTAIN_CAR_CONTINUOUS]),
    st.floats(-1.2, 0.6),
    st.floats(-0.07, 0.07),
    st.floats(-5, 5, width=32),
)
def test_car_stays_between_its_walls(code, position, velocity, force):
    state = np.array([position, velocity, 0.0, 0.0])
    action = np.array([force if code == MOUNTAIN_CAR_CONTINUOUS else round(force) % 3], np.float32)
    dynamics.step(code, state, action)
    assert np.float32(-1.2) <= state[0] <= np.float32(0.6)
    assert abs(state[1]) <= np.float32(0.07)
    assert state[0] > np.float32(-1.2) or state[1] >= 0


@settings(deadline=None, max_examples=200)
@given(st.lists(st.floats(-30, 30), min_size=4, max_size=4), st.integers(0, 2))
def test_acrobot_stays_within_its_bounds(start, action):
    state = np.array(start)
    dynamics.step(ACROBOT, state, np.array([action], np.float32))
    assert np.all(np.abs(state) <= np.array([1, 1, 4, 9]) * np.pi)
