"""Episodes played with trained weights, and the policy seen as a function of the state."""

import gymnasium
import numpy as np
import pytest

from rl_core import reinforce, rollouts
from rl_core.policies import Gaussian
from rl_core.reinforce import ReinforceConfig

CONTINUOUS = ReinforceConfig(
    policy=Gaussian(sigma=0.5, constant_feature=True), biases=False, max_episode_steps=300
)


@pytest.fixture(scope="module")
def acrobot():
    config = ReinforceConfig(max_episode_steps=5000)
    return config, reinforce.reinforce(
        "Acrobot-v1", config, episodes=300, seeds=[0, 1], snapshots=(100,)
    )


def test_trained_weights_do_better_than_the_first(acrobot):
    config, run = acrobot
    rng = np.random.default_rng(0)
    median = {}
    for moment in ("initial/", "episode100/", ""):
        weights = rollouts.weights_of(run.arrays, 0, moment)
        played = [rollouts.rollout("Acrobot-v1", config, weights, rng, 3000) for _ in range(15)]
        median[moment] = np.median([len(one.actions) for one in played])
    assert median[""] < median["initial/"] / 2
    assert len(set(median.values())) == 3


@pytest.mark.parametrize("name", ["Acrobot-v1", "MountainCarContinuous-v0"])
def test_gymnasium_plays_a_rollout_again(name):
    config = ReinforceConfig() if name == "Acrobot-v1" else CONTINUOUS
    capped = ReinforceConfig(**{**vars(config), "max_episode_steps": 50})
    run = reinforce.reinforce(name, capped, episodes=1, seeds=[0])
    weights = rollouts.weights_of(run.arrays, 0)
    played = rollouts.rollout(name, config, weights, np.random.default_rng(0), 150)
    env = gymnasium.make(name, disable_env_checker=True).unwrapped
    observation, _ = env.reset(seed=played.environment_seed)
    np.testing.assert_array_equal(observation, played.observations[0])
    for t, action in enumerate(played.actions):
        native = int(action[0]) if name == "Acrobot-v1" else action
        observation, reward, terminated, _, _ = env.step(native)
        np.testing.assert_array_equal(observation, played.observations[t + 1])
        assert reward == played.rewards[t]
    assert terminated == played.terminated
    assert len(played.observations) == len(played.actions) + 1


def test_rollouts_are_a_function_of_the_generator(acrobot):
    config, run = acrobot
    weights = rollouts.weights_of(run.arrays, 0)
    first, again, other = (
        rollouts.rollout("Acrobot-v1", config, weights, np.random.default_rng(seed), 200)
        for seed in (0, 0, 1)
    )
    np.testing.assert_array_equal(first.observations, again.observations)
    assert first.environment_seed != other.environment_seed
    assert not np.array_equal(first.observations[0], other.observations[0])


def test_probabilities_by_hand(acrobot):
    config, run = acrobot
    weights = rollouts.weights_of(run.arrays, 0)
    observations = np.random.default_rng(0).uniform(-1, 1, (50, 6))
    h = observations
    for layer in range(3):
        h = h @ weights[f"layer{layer}.weight"] + weights[f"layer{layer}.bias"]
        h = np.maximum(h, 0) if layer < 2 else h
    expected = np.exp(h) / np.exp(h).sum(axis=1, keepdims=True)
    found = rollouts.action_probabilities(config, weights, observations)
    np.testing.assert_allclose(found, expected, rtol=1e-4)
    assert found.std(axis=0).min() > 0.01


@pytest.mark.parametrize("mean", ["weights", "direct"])
@pytest.mark.parametrize("constant", [True, False])
def test_mean_actions_by_hand(mean, constant):
    config = ReinforceConfig(
        hidden=(), policy=Gaussian(mean=mean, constant_feature=constant), biases=False
    )
    observations = np.array([[2.0, -1.0], [0.5, 3.0]])
    features = np.column_stack([observations, np.ones(2)]) if constant else observations
    n = features.shape[1]
    matrix = np.arange(1.0, 1 + n * (n if mean == "weights" else 1)).reshape(n, -1)
    outputs = features @ matrix
    expected = outputs if mean == "direct" else (outputs * features).sum(axis=1, keepdims=True)
    weights = {"layer0.weight": matrix.astype(np.float32), "log_sigma": np.zeros(1, np.float32)}
    found = rollouts.mean_actions(config, weights, observations)
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_a_grid_covers_the_space_of_observations():
    space = gymnasium.make("MountainCarContinuous-v0").observation_space
    grid = rollouts.state_grid(space, 7)
    assert grid.shape == (49, 2)
    np.testing.assert_array_equal(grid.min(axis=0), space.low)
    np.testing.assert_array_equal(grid.max(axis=0), space.high)
    np.testing.assert_allclose(grid.reshape(7, 7, 2)[3, 3], (space.low + space.high) / 2, atol=1e-7)
    assert len(np.unique(grid, axis=0)) == 49


def test_a_grid_without_end_is_refused():
    endless = gymnasium.make("CartPole-v1").observation_space.low.copy()
    endless[1] = -np.inf
    with pytest.raises(ValueError, match=r"space must be a Box with finite bounds.*, got Box"):
        rollouts.state_grid(gymnasium.spaces.Box(endless, 5.0), 3)
    with pytest.raises(ValueError, match=r"space must be a Box of one axis, got Discrete"):
        rollouts.state_grid(gymnasium.spaces.Discrete(3), 3)
    with pytest.raises(ValueError, match=r"points must be an integer from 2, got 1"):
        rollouts.state_grid(gymnasium.spaces.Box(-1.0, 1.0, (2,)), 1)


def test_rollouts_scatter_around_the_mean_action():
    run = reinforce.reinforce("MountainCarContinuous-v0", CONTINUOUS, episodes=1, seeds=[3])
    weights = rollouts.weights_of(run.arrays, 0)
    rng = np.random.default_rng(0)
    played = rollouts.rollout("MountainCarContinuous-v0", CONTINUOUS, weights, rng, 3000)
    means = rollouts.mean_actions(CONTINUOUS, weights, played.observations[:-1])
    noise = (played.actions - means) / 0.5
    assert abs(noise.mean()) < 4 / np.sqrt(len(noise))
    assert noise.std() == pytest.approx(1, abs=4 / np.sqrt(2 * len(noise)))


def test_a_snapshot_that_was_not_kept_is_refused(acrobot):
    with pytest.raises(ValueError, match="moment must be"):
        rollouts.weights_of(acrobot[1].arrays, 0, "episode7/")


@pytest.mark.parametrize("position", [99, 2, -1, None, 0.5])
def test_a_seed_that_was_not_run_is_refused(acrobot, position):
    with pytest.raises(
        ValueError, match=f"position must be an integer from 0 to 1, got {position}"
    ):
        rollouts.weights_of(acrobot[1].arrays, position)


def test_the_view_of_another_policy_is_refused(acrobot):
    config, run = acrobot
    weights = rollouts.weights_of(run.arrays, 0)
    with pytest.raises(ValueError, match="policy must be"):
        rollouts.mean_actions(config, weights, np.ones((1, 6)))
    with pytest.raises(ValueError, match="policy must be"):
        rollouts.action_probabilities(CONTINUOUS, weights, np.ones((1, 6)))


def test_weights_for_another_environment_are_refused(acrobot):
    config, run = acrobot
    weights = rollouts.weights_of(run.arrays, 0)
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="weights must be a network of 2 inputs"):
        rollouts.rollout("MountainCar-v0", config, weights, rng, 10)
    with pytest.raises(ValueError, match=r"rng must be a numpy\.random.Generator, got None"):
        rollouts.rollout("Acrobot-v1", config, weights, None, 10)
    with pytest.raises(ValueError, match="config must be a ReinforceConfig, got None"):
        rollouts.rollout("Acrobot-v1", None, weights, rng, 10)
    with pytest.raises(ValueError, match="weights must be with 'log_sigma'"):
        rollouts.rollout("MountainCarContinuous-v0", CONTINUOUS, weights, rng, 10)
    with pytest.raises(ValueError, match="max_steps must be a positive integer"):
        rollouts.rollout("Acrobot-v1", config, weights, rng, 0)
