"""Episodes played compiled and plain: one loop, the same bits."""

import random
import sys

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium import spaces
from toy_task import Corridor

from rl_core import modules, policies
from rl_core.kernels import likelihood
from rl_core.policies import Categorical, Gaussian, make_policy
from rl_core.training import spawn_streams
from rl_core.worlds import episodes
from rl_core.worlds.environments import TaskWorld, open_world
from rl_core.worlds.episodes import ModuleActor, Trajectory, play_episode
from rl_core.worlds.twins import TASKS


class Counter(gymnasium.Env):
    """Three steps, of which the observation and the reward are the number."""

    observation_space = spaces.Box(-1, 1, (2, 3), np.float64)
    action_space = spaces.Discrete(2)

    def __init__(self, truncates):
        self.truncates = truncates

    def reset(self, *, seed=None, options=None):
        """Begin."""
        self.t = 0
        return np.zeros((2, 3)), {}

    def step(self, action):
        """Count the steps."""
        self.t += 1
        over = self.t == 3
        ends = (False, over) if self.truncates else (over, False)
        return np.full((2, 3), self.t / 10), float(self.t), *ends, {}


def players(env, distribution=None, hidden=(5, 4), seed=0):
    """A world, an actor that fits it with initial parameters, and the policy's stream."""
    world = open_world(env)
    if distribution is None:
        distribution = Categorical() if world.n_actions else Gaussian(sigma=1.0)
    spaces_ = world.n_observations, world.n_actions, world.action_dimensions
    policy = make_policy(distribution, hidden, *spaces_)
    streams = spawn_streams(seed)
    world.seed(streams.environment_seed)
    parameters = policies.initial_parameters(policy, distribution, streams.network)
    return world, likelihood.make_actor(policy, parameters), streams.policy


def through_torch(actor):
    """The same policy as a module."""
    policy, parameters = actor.policy, actor.parameters
    module = modules.perceptron(policy.sizes.tolist(), parameters)
    sigmas = policy.action_width if policy.gaussian else 0
    log_sigma = torch.from_numpy(parameters[parameters.size - sigmas :])
    return ModuleActor(policy, module, log_sigma, actor.noise)


def episode(world, actor, rng, max_steps, capacity=4096):
    trajectory = Trajectory(world.n_observations, actor.policy.action_width, capacity)
    steps, terminated = play_episode(world, actor, rng, max_steps, trajectory)
    arrays = trajectory.observations[: steps + 1], *trajectory.first(steps)[1:]
    return terminated, [array.copy() for array in arrays]


def assert_same(found, expected):
    assert found[0] == expected[0]
    for array, wanted in zip(found[1], expected[1], strict=True):
        np.testing.assert_array_equal(array, wanted)


@pytest.mark.parametrize("name", TASKS)
def test_compiled_episodes_are_gymnasiums_bit_for_bit(name):
    compiled = players(name)
    plain = players(lambda: gymnasium.make(name, disable_env_checker=True).unwrapped)
    assert isinstance(compiled[0], TaskWorld)
    limit = compiled[0].max_episode_steps or 2000
    for max_steps in (1000, 1, 2000):
        assert_same(episode(*compiled, max_steps), episode(*plain, min(max_steps, limit)))


@pytest.mark.parametrize("name", ["MountainCar-v0", "MountainCarContinuous-v0"])
def test_the_loop_is_the_same_compiled_or_not(monkeypatch, name):
    compiled = episode(*players(name), 500)
    monkeypatch.setattr(episodes, "_play_compiled", episodes.play)
    assert_same(episode(*players(name), 500), compiled)


@pytest.mark.parametrize(
    ("name", "distribution"),
    [
        ("Acrobot-v1", Categorical()),
        ("MountainCarContinuous-v0", Gaussian(sigma=0.3)),
        ("MountainCarContinuous-v0", Gaussian(mean="direct", constant_feature=True)),
    ],
)
def test_a_module_acts_as_the_perceptron_does(name, distribution):
    world, actor, rng = players(name, distribution)
    _, (observations, actions, _) = episode(world, actor, rng, 300)
    world, actor, rng = players(name, distribution)
    _, (found, acted, _) = episode(world, through_torch(actor), rng, 300)
    np.testing.assert_allclose(acted, actions, atol=1e-4)
    np.testing.assert_allclose(found, observations, atol=1e-4)


def test_tasks_without_a_limit_are_played_on():
    terminated, (_, actions, rewards) = episode(*players("MountainCar-v0"), 5000)
    assert terminated or len(actions) == 5000
    assert len(actions) > 200
    assert (rewards == -1.0).all()


def test_the_limit_of_a_task_truncates():
    world, actor, rng = players(Corridor)
    actor.parameters[-2:] = 9.0, -9.0  # back, always
    terminated, (_, actions, _) = episode(world, actor, rng, 5000)
    assert (terminated, len(actions)) == (False, 100)
    actor.parameters[-2:] = -9.0, 9.0
    terminated, (observations, actions, _) = episode(world, actor, rng, 5000)
    assert terminated
    assert observations[-1] == 1.0


def test_an_episode_longer_than_its_room_is_the_same():
    name = "MountainCarContinuous-v0"
    for env in (name, lambda: gymnasium.make(name).env):
        narrow, wide = (
            episode(*players(env, Gaussian(sigma=0.1)), 3000, capacity=capacity)
            for capacity in (10, 10_000)
        )
        assert_same(narrow, wide)
        assert len(narrow[1][1]) > 1000


@pytest.mark.parametrize("truncates", [True, False])
def test_truncation_is_not_termination(truncates):
    found = episode(*players(lambda: Counter(truncates)), 100)
    terminated, (observations, actions, rewards) = found
    assert terminated is not truncates
    assert len(actions) == 3
    np.testing.assert_array_equal(rewards, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(observations[1:], [[t / 10] * 6 for t in (1, 2, 3)], rtol=1e-6)


def test_max_steps_stop_an_episode_without_terminating_it():
    terminated, (observations, actions, _) = episode(*players(lambda: Counter(False)), 2)
    assert not terminated
    assert (len(observations), len(actions)) == (3, 2)
    terminated, (_, actions, _) = episode(*players(lambda: Counter(False)), 3)
    assert terminated  # in the last step allowed


def test_continuous_actions_are_played_as_drawn():
    _, (_, actions, rewards) = episode(
        *players("MountainCarContinuous-v0", Gaussian(sigma=3.0)), 50
    )
    assert np.abs(actions).max() > 1
    np.testing.assert_allclose(rewards, -0.1 * actions[:, 0].astype(float) ** 2, rtol=1e-6)


def test_noise_is_drawn_from_the_policys_stream_one_number_a_component():
    world, actor, rng = players(lambda: Counter(False))
    twin = spawn_streams(0).policy
    episode(world, actor, rng, 2)
    twin.random(2)
    assert rng.bit_generator.state == twin.bit_generator.state
    world, actor, rng = players("MountainCarContinuous-v0")
    twin = spawn_streams(0).policy
    episode(world, actor, rng, 7)
    twin.standard_normal(7)
    assert rng.bit_generator.state == twin.bit_generator.state


def test_a_constant_follows_the_observation_where_there_is_one():
    observations = np.arange(6, dtype=np.float32).reshape(3, 2)
    with_one = make_policy(Gaussian(constant_feature=True), (), 2, 0, 1)
    found = episodes.with_constant(with_one, observations)
    assert found.tolist() == [[0, 1, 1], [2, 3, 1], [4, 5, 1]]
    assert found.dtype == np.float32
    assert (
        episodes.with_constant(make_policy(Gaussian(), (), 2, 0, 1), observations) is observations
    )


def test_global_random_states_are_left_alone():
    before = torch.get_rng_state(), str(np.random.get_state()), random.getstate()  # noqa: NPY002
    for env in ("Acrobot-v1", "CartPole-v1", lambda: gymnasium.make("CartPole-v1")):
        world, actor, rng = players(env)
        episode(world, actor, rng, 50)
        episode(world, through_torch(actor), rng, 50)
    assert torch.equal(before[0], torch.get_rng_state())
    assert before[1:] == (str(np.random.get_state()), random.getstate())  # noqa: NPY002


def test_a_generator_is_released_after_its_episodes():
    world, rng = open_world("MountainCar-v0"), np.random.default_rng(0)
    policy = make_policy(Categorical(), (4,), 2, 3, 0)
    actor = likelihood.make_actor(policy, np.zeros(27, np.float32))
    held = sys.getrefcount(rng)
    for _ in range(3):
        play_episode(world, actor, rng, 10, Trajectory(2, 1))
    assert sys.getrefcount(rng) == held
