"""Episodes played compiled and through Gymnasium."""

import random

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium import spaces

from rl_core import policies
from rl_core.dynamics import TASKS
from rl_core.episodes import (
    CompiledEnvironment,
    GymnasiumEnvironment,
    Trajectory,
    open_environment,
    spawn_streams,
)
from rl_core.policies import Categorical, Gaussian, make_policy


class Recorder(gymnasium.Env):
    """Two-dimensional observations, any action space; remembers what it was told."""

    def __init__(self, action_space, length=3, truncates=False):
        self.observation_space = spaces.Box(-1, 1, (2, 3), np.float64)
        self.action_space = action_space
        self.length, self.truncates = length, truncates
        self.seeds, self.actions, self.closed = [], [], False

    def reset(self, *, seed=None, options=None):
        """Draw the start."""
        super().reset(seed=seed)
        self.seeds.append(seed)
        self.t = 0
        return self.np_random.uniform(-1, 1, (2, 3)), {}

    def step(self, action):
        """Count the steps."""
        assert self.action_space.contains(action) or isinstance(self.action_space, spaces.Box)
        self.actions.append(action)
        self.t += 1
        over = self.t == self.length
        ends = (False, over) if self.truncates else (over, False)
        return np.full((2, 3), self.t % 10 / 10), float(self.t), *ends, {}

    def close(self):
        """Remember it."""
        self.closed = True


def players(env, hidden=(5, 4), seed=0, sigma=1.0):
    """An environment, a policy that fits it with initial parameters, and the policy's stream."""
    environment = open_environment(env)
    distribution = Categorical() if environment.n_actions else Gaussian(sigma=sigma)
    policy = make_policy(
        distribution,
        hidden,
        environment.n_observations,
        environment.n_actions,
        environment.action_dimensions,
    )
    streams = spawn_streams(seed)
    environment.seed(streams.environment_seed)
    parameters = policies.initial_parameters(policy, distribution, streams.network)
    return environment, policy, parameters, streams.policy


def episode(environment, policy, parameters, rng, max_steps, capacity=4096):
    trajectory = Trajectory(environment.n_observations, policy.action_width, capacity)
    steps, terminated = environment.play(policy, parameters, rng, max_steps, trajectory)
    arrays = trajectory.observations[: steps + 1], *trajectory.first(steps)[1:]
    return terminated, [array.copy() for array in arrays]


@pytest.mark.parametrize("name", TASKS)
def test_compiled_episodes_are_gymnasiums_bit_for_bit(name):
    compiled = players(name)
    plain = players(lambda: gymnasium.make(name, disable_env_checker=True).unwrapped)
    assert isinstance(compiled[0], CompiledEnvironment)
    assert isinstance(plain[0], GymnasiumEnvironment)
    for max_steps in (4000, 1, 2500, 4000):
        terminated, arrays = episode(*compiled, max_steps)
        expected_terminated, expected = episode(*plain, max_steps)
        assert terminated == expected_terminated
        for found, wanted in zip(arrays, expected, strict=True):
            np.testing.assert_array_equal(found, wanted)


def test_compiled_tasks_have_no_time_limit():
    terminated, (_, actions, rewards) = episode(*players("MountainCar-v0"), 5000)
    assert terminated or len(actions) == 5000
    assert len(actions) > 200
    assert (rewards == -1.0).all()


def test_an_episode_longer_than_its_room_is_the_same():
    for env in ("MountainCarContinuous-v0", lambda: gymnasium.make("MountainCarContinuous-v0").env):
        narrow, wide = (
            episode(*players(env, sigma=0.1), 3000, capacity=capacity) for capacity in (10, 10_000)
        )
        assert narrow[0] == wide[0]
        assert len(narrow[1][1]) > 1000
        for found, wanted in zip(narrow[1], wide[1], strict=True):
            np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize("truncates", [True, False])
def test_truncation_is_not_termination(truncates):
    env = Recorder(spaces.Discrete(2), truncates=truncates)
    terminated, (observations, actions, rewards) = episode(*players(env), 100)
    assert terminated is not truncates
    assert len(actions) == 3
    np.testing.assert_array_equal(rewards, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(observations[1:], [[t / 10] * 6 for t in (1, 2, 3)], rtol=1e-6)


def test_max_steps_stop_an_episode_without_terminating_it():
    terminated, (observations, actions, _) = episode(*players(Recorder(spaces.Discrete(2))), 2)
    assert not terminated
    assert (len(observations), len(actions)) == (3, 2)


def test_only_the_first_reset_is_seeded():
    env = Recorder(spaces.Discrete(2))
    player = players(env, seed=5)
    starts = [episode(*player, 10)[1][0][0] for _ in range(3)]
    assert env.seeds == [spawn_streams(5).environment_seed, None, None]
    assert not np.array_equal(starts[0], starts[1])


def test_discrete_actions_begin_where_the_space_begins():
    env = Recorder(spaces.Discrete(3, start=7), length=200)
    _, (_, actions, _) = episode(*players(env), 1000)
    assert env.actions == [7 + int(action) for action in actions[:, 0]]
    assert set(env.actions) == {7, 8, 9}


def test_continuous_actions_reach_the_environment_unclipped():
    env = Recorder(spaces.Box(-1, 1, (2, 2), np.float64), length=50)
    _, (_, actions, _) = episode(*players(env, sigma=3.0), 1000)
    told = np.array(env.actions)
    assert told.shape == (50, 2, 2)
    assert told.dtype == np.float64
    np.testing.assert_array_equal(told.reshape(50, 4), actions)
    assert np.abs(told).max() > 1


def test_what_was_made_here_is_closed_here():
    given, made = Recorder(spaces.Discrete(2)), Recorder(spaces.Discrete(2))
    open_environment(given).close()
    open_environment(lambda: made).close()
    assert not given.closed
    assert made.closed


def test_streams_differ_from_each_other_and_between_seeds():
    draws = [
        stream.random()
        for seed in range(20)
        for stream in (spawn_streams(seed).policy, spawn_streams(seed).network)
    ]
    draws += [spawn_streams(seed).replay.random() for seed in range(20)]
    environments = [spawn_streams(seed).environment_seed for seed in range(20)]
    assert len(set(draws)) == 60
    assert len(set(environments)) == 20
    assert environments == [spawn_streams(seed).environment_seed for seed in range(20)]


def test_global_random_states_are_left_alone():
    before = torch.get_rng_state(), str(np.random.get_state()), random.getstate()  # noqa: NPY002
    for env in ("Acrobot-v1", "CartPole-v1"):
        episode(*players(env), 50)
    assert torch.equal(before[0], torch.get_rng_state())
    assert before[1:] == (str(np.random.get_state()), random.getstate())  # noqa: NPY002


def test_an_unknown_id_is_refused():
    with pytest.raises(
        ValueError, match="env must be an id that Gymnasium knows, got 'Akrobot-v1'"
    ):
        open_environment("Akrobot-v1")


@pytest.mark.parametrize("env", [3, None, lambda: 3])
def test_what_is_no_environment_is_refused(env):
    with pytest.raises(TypeError, match="env must be a Gymnasium id, environment or a function"):
        open_environment(env)


def test_other_spaces_are_refused():
    with pytest.raises(ValueError, match="Box observation space, got Discrete"):
        open_environment("FrozenLake-v1")
    with pytest.raises(ValueError, match="Discrete or a Box action space, got MultiBinary"):
        open_environment(Recorder(spaces.MultiBinary(2)))
