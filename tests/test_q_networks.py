"""Trained Q-networks: their values against torch, and their episodes against Gymnasium."""

import gymnasium
import numpy as np
import pytest
import torch

from rl_core import networks
from rl_core.dqn import DQNConfig, dqn
from rl_core.q_networks import action_values, evaluate, q_rollout
from rl_core.rollouts import weights_of

BY_SPEED = {"layer0.weight": np.array([[0, 0, 0], [-1, 0, 1]], np.float32)}  # push where it goes
CART = {"layer0.weight": np.array([[0, 0], [0, 0], [-1, 1], [-0.5, 0.5]], np.float32)}


def plain(name):
    return gymnasium.make(name, disable_env_checker=True).unwrapped


def trained(name):
    config = DQNConfig(batch_size=16, learning_starts=50, max_episode_steps=300)
    return weights_of(dqn(name, config, episodes=2, seeds=[0]).arrays, 0)


def test_values_are_those_of_the_same_network_in_torch():
    weights = trained("Acrobot-v1")
    observations = np.random.default_rng(0).normal(size=(50, 6)).astype(np.float32)
    module = networks.to_torch(*networks.pack(weights))
    with torch.no_grad():
        expected = module(torch.from_numpy(observations)).numpy()
    np.testing.assert_allclose(action_values(weights, observations), expected, atol=1e-5)


@pytest.mark.parametrize("shape", [(2,), (5, 1), (5, 3), (1, 5, 2)])
def test_observations_of_another_width_are_refused_not_broadcast(shape):
    with pytest.raises(ValueError, match=r"^observations must be .*\(n, 2\)"):
        action_values(BY_SPEED, np.ones(shape))


def test_a_seed_in_the_place_of_a_generator_is_refused():
    with pytest.raises(TypeError, match=r"rng must be a numpy.random.Generator, got 0"):
        q_rollout("MountainCar-v0", BY_SPEED, 0, 10)
    with pytest.raises(TypeError, match=r"rng must be a numpy.random.Generator, got 0"):
        evaluate("MountainCar-v0", BY_SPEED, 0, episodes=1, max_steps=10)


@pytest.mark.parametrize("epsilon", [0.0, 0.3])
@pytest.mark.parametrize("name", ["Acrobot-v1", "MountainCar-v0"])
def test_compiled_and_plain_episodes_are_the_same(name, epsilon):
    weights, seen = trained(name), []
    for env in (name, lambda: plain(name)):
        rng = np.random.default_rng(1)
        seen.append(evaluate(env, weights, rng, episodes=5, max_steps=700, epsilon=epsilon))
        seen.append(q_rollout(env, weights, rng, 200, epsilon))
    for compiled, through in ((seen[0], seen[2]), (vars(seen[1]).values(), vars(seen[3]).values())):
        for one, other in zip(compiled, through, strict=True):
            np.testing.assert_array_equal(one, other)


def test_greedy_episodes_take_the_action_of_largest_value():
    episode = q_rollout("MountainCar-v0", BY_SPEED, np.random.default_rng(0), 500)
    q = action_values(BY_SPEED, episode.observations[:-1])
    taken = q[np.arange(len(q)), episode.actions[:, 0].astype(int)]
    np.testing.assert_array_equal(taken, q.max(axis=1))
    assert episode.terminated
    np.testing.assert_array_equal(episode.rewards, -1.0)


def test_a_rollout_can_be_played_again_from_its_seed_and_actions():
    episode = q_rollout("MountainCar-v0", BY_SPEED, np.random.default_rng(3), 500, 0.2)
    env = plain("MountainCar-v0")
    first, _ = env.reset(seed=episode.environment_seed)
    np.testing.assert_array_equal(first, episode.observations[0])
    for t, action in enumerate(episode.actions[:, 0]):
        observation, _, terminated, _, _ = env.step(int(action))
        np.testing.assert_array_equal(observation, episode.observations[t + 1])
    assert terminated == episode.terminated


def test_an_evaluation_counts_what_a_rollout_shows():
    found = evaluate("Acrobot-v1", trained("Acrobot-v1"), np.random.default_rng(5), episodes=1,
                     max_steps=5_000, epsilon=0.5)  # fmt: skip
    episode = q_rollout("Acrobot-v1", trained("Acrobot-v1"), np.random.default_rng(5), 5_000, 0.5)
    assert found.steps.tolist() == [len(episode.rewards)]
    assert found.returns.tolist() == [episode.rewards.sum()]
    assert found.terminated.tolist() == [episode.terminated]


def test_any_environment_is_played_and_its_time_limit_is_no_end():
    found = evaluate("CartPole-v1", CART, np.random.default_rng(0), episodes=3, max_steps=10_000)
    assert (found.steps == found.returns).all()
    assert found.steps.max() == 500
    assert not found.terminated[found.steps == 500].any()


@pytest.mark.parametrize(
    ("argument", "value"),
    [("episodes", 0), ("max_steps", 0), ("epsilon", 1.5), ("epsilon", np.nan), ("weights", CART)],
)
def test_an_argument_out_of_range_is_refused(argument, value):
    arguments = {
        "weights": BY_SPEED,
        "episodes": 1,
        "max_steps": 5,
        "epsilon": 0.0,
        argument: value,
    }
    with pytest.raises(ValueError, match=rf"^{argument} must be .*, got "):
        evaluate("MountainCar-v0", rng=np.random.default_rng(0), **arguments)
