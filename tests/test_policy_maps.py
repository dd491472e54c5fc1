"""What a policy says of many states: values, mean actions, a grid over what is observed."""

import gymnasium
import numpy as np
import pytest
import torch

from rl_core import modules
from rl_core.kernels import networks
from rl_core.policies import MLP, Gaussian
from rl_core.reinforce import ReinforceConfig
from studies.policy_maps import action_values, mean_actions, state_grid

PUMP = {"layer0.weight": np.array([[1e-7, 0, -1e-7], [-1, 0, 1]], np.float32)}
"""Push the way the car moves, and to the right from rest: Q(s, a) = (a - 1) (v - 1e-7 x)."""


def test_values_are_those_of_the_same_network_in_torch():
    rng = np.random.default_rng(0)
    parameters = networks.xavier_uniform((6, 10, 20, 3), rng)
    weights = networks.unpack((6, 10, 20, 3), parameters)
    observations = rng.normal(size=(50, 6)).astype(np.float32)
    module = modules.perceptron((6, 10, 20, 3), parameters)
    expected = module(torch.from_numpy(observations)).detach().numpy()
    np.testing.assert_allclose(action_values(weights, observations), expected, atol=1e-5)


@pytest.mark.parametrize("shape", [(2,), (5, 1), (5, 3), (1, 5, 2)])
def test_observations_of_another_width_are_refused_not_broadcast(shape):
    with pytest.raises(ValueError, match=r"^observations must be .*\(any, 2\), got "):
        action_values(PUMP, np.ones(shape))


@pytest.mark.parametrize("mean", ["weights", "direct"])
@pytest.mark.parametrize("constant", [True, False])
def test_mean_actions_by_hand(mean, constant):
    policy = Gaussian(mean=mean, constant_feature=constant)
    config = ReinforceConfig(network=MLP((), biases=False), policy=policy)
    observations = np.array([[2.0, -1.0], [0.5, 3.0]])
    features = np.column_stack([observations, np.ones(2)]) if constant else observations
    n = features.shape[1]
    matrix = np.arange(1.0, 1 + n * (n if mean == "weights" else 1)).reshape(n, -1)
    outputs = features @ matrix
    expected = outputs if mean == "direct" else (outputs * features).sum(axis=1, keepdims=True)
    weights = {"layer0.weight": matrix.astype(np.float32), "log_sigma": np.zeros(1, np.float32)}
    found = mean_actions(config, weights, observations)
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_a_policy_without_a_mean_has_none():
    with pytest.raises(ValueError, match=r"^policy must be Gaussian\(\.\.\.\), got Categorical"):
        mean_actions(ReinforceConfig(), PUMP, np.ones((1, 2)))


def test_a_grid_covers_the_space_of_observations():
    space = gymnasium.make("MountainCarContinuous-v0").observation_space
    grid = state_grid(space, 7)
    assert grid.shape == (49, 2)
    np.testing.assert_array_equal(grid.min(axis=0), space.low)
    np.testing.assert_array_equal(grid.max(axis=0), space.high)
    np.testing.assert_allclose(grid.reshape(7, 7, 2)[3, 3], (space.low + space.high) / 2, atol=1e-7)
    assert len(np.unique(grid, axis=0)) == 49


def test_a_grid_without_end_is_refused():
    endless = gymnasium.make("CartPole-v1").observation_space.low.copy()
    endless[1] = -np.inf
    with pytest.raises(ValueError, match=r"^space must be a Box with finite bounds.*, got Box"):
        state_grid(gymnasium.spaces.Box(endless, 5.0), 3)
    with pytest.raises(ValueError, match=r"^space must be a Box of one axis, got Discrete"):
        state_grid(gymnasium.spaces.Discrete(3), 3)
    with pytest.raises(ValueError, match=r"^points must be an integer from 2, got 1"):
        state_grid(gymnasium.spaces.Box(-1.0, 1.0, (2,)), 1)
