"""What policies draw, and the gradient of the log-probability of what was drawn."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rl_core import policies
from rl_core.kernels import likelihood, networks
from rl_core.kernels.likelihood import Policy
from rl_core.policies import Categorical, Gaussian, make_policy

POLICIES = {
    "categorical": (Categorical(), 3, 0),
    "weights": (Gaussian(mean="weights", sigma=0.5), 0, 1),
    "weights and constant": (Gaussian(mean="weights", sigma=0.3, constant_feature=True), 0, 2),
    "weights, learned sigma": (Gaussian(mean="weights", sigma=1.5, learn_sigma=True), 0, 2),
    "direct": (Gaussian(mean="direct", sigma=0.7, learn_sigma=True), 0, 1),
    "direct and constant": (Gaussian(mean="direct", sigma=2.0, constant_feature=True), 0, 3),
}
N_OBSERVATIONS = 4


def drawn(kind, seed=0, hidden=(5, 6)):
    """A policy and parameters with biases that are not zero."""
    distribution, n_actions, dimensions = POLICIES[kind]
    policy = make_policy(distribution, hidden, N_OBSERVATIONS, n_actions, dimensions)
    rng = np.random.default_rng(seed)
    parameters = policies.initial_parameters(policy, distribution, rng)
    parameters += rng.normal(0, 0.1, parameters.size).astype(np.float32)
    return policy, parameters, rng


def sample(policy, parameters, observation, rng, n, epsilon=0.0):
    actor = likelihood.make_actor(policy, parameters, epsilon)
    actions = np.empty((n, policy.action_width), np.float32)
    draw = rng.standard_normal if policy.gaussian else rng.random
    for action in actions:
        likelihood.choose_action(actor, observation, draw(policy.action_width), action)
    return actions


def outputs_and_features(policy, parameters, observations):
    """The network again, in float64 and without the package."""
    features = np.asarray(observations, float)
    if policy.constant_feature:
        features = np.column_stack([features, np.ones(len(features))])
    h, start = features, 0
    for n_in, n_out in pairwise(policy.sizes):
        weight = parameters[start : start + n_in * n_out].reshape(n_out, n_in)
        start += n_in * n_out
        z = h @ weight.T + parameters[start : start + n_out]
        start += n_out
        h = np.maximum(z, 0)
    return z, features


def means_of(policy, parameters, observations):
    outputs, features = outputs_and_features(policy, parameters, observations)
    if not policy.weighted_features:
        return outputs
    weights = outputs.reshape(len(features), policy.action_width, -1)
    return (weights * features[:, None, :]).sum(-1)


def log_probability(policy, parameters, observations, actions):
    if policy.gaussian:
        means = means_of(policy, parameters, observations)
        sigma = np.exp(parameters[-policy.action_width :])
        z = (actions - means) / sigma
        return (-0.5 * z**2 - np.log(sigma) - 0.5 * np.log(2 * np.pi)).sum(axis=1)
    scores, _ = outputs_and_features(policy, parameters, observations)
    logs = scores - np.log(np.exp(scores).sum(axis=1, keepdims=True))
    return logs[np.arange(len(actions)), actions[:, 0].astype(int)]


def gradient_of(policy, parameters, observations, actions, weights):
    columns = networks.padded(len(weights)) + 32
    scratch = np.full((2, policy.sizes.sum(), columns), np.nan, np.float32)  # must not matter
    gradient = np.full(parameters.size, np.nan, np.float32)
    likelihood.likelihood_gradient(
        policy, parameters, observations, actions, weights, *scratch, gradient
    )
    return gradient


@pytest.mark.parametrize("kind", POLICIES)
@pytest.mark.parametrize("n", [1, 2, 32, 45])
def test_gradient_is_that_of_finite_differences(kind, n):
    policy, parameters, rng = drawn(kind)
    observations = rng.normal(size=(n, N_OBSERVATIONS)).astype(np.float32)
    actions = np.concatenate([sample(policy, parameters, o, rng, 1) for o in observations])
    weights = rng.normal(size=n).astype(np.float32)
    found = gradient_of(policy, parameters, observations, actions, weights)
    exact = parameters.astype(float)

    def loss(changed):
        return -(weights * log_probability(policy, changed, observations, actions)).sum()

    for i in range(parameters.size):
        step = np.zeros(parameters.size)
        step[i] = 1e-6
        expected = (loss(exact + step) - loss(exact - step)) / 2e-6
        assert found[i] == pytest.approx(expected, rel=2e-3, abs=2e-3), i


def test_categorical_actions_come_with_their_probabilities():
    policy, parameters, rng = drawn("categorical")
    observation = rng.normal(size=N_OBSERVATIONS).astype(np.float32)
    every_action = np.arange(3.0)[:, None]
    observations = np.tile(observation, (3, 1))
    expected = np.exp(log_probability(policy, parameters, observations, every_action))
    assert expected.min() > 0.05
    n = 40_000
    counts = np.bincount(sample(policy, parameters, observation, rng, n)[:, 0].astype(int))
    assert (np.abs(counts / n - expected) < 4 * np.sqrt(expected * (1 - expected) / n)).all()


@pytest.mark.parametrize("kind", [kind for kind in POLICIES if kind != "categorical"])
def test_gaussian_actions_have_the_mean_and_spread_asked_for(kind):
    policy, parameters, rng = drawn(kind)
    observation = rng.normal(size=N_OBSERVATIONS).astype(np.float32)
    n = 40_000
    actions = sample(policy, parameters, observation, rng, n)
    sigma = np.exp(parameters[-policy.action_width :])
    expected = means_of(policy, parameters, observation[None])[0]
    assert (np.abs(actions.mean(axis=0) - expected) < 4 * sigma / np.sqrt(n)).all()
    np.testing.assert_allclose(actions.std(axis=0), sigma, rtol=4 / np.sqrt(2 * n))


@pytest.mark.parametrize("epsilon", [0.3, 1.0])
def test_an_epsilon_greedy_share_of_categorical_actions_is_uniform(epsilon):
    policy, parameters, rng = drawn("categorical")
    observation = rng.normal(size=N_OBSERVATIONS).astype(np.float32)
    every = np.arange(3.0)[:, None]
    own = np.exp(log_probability(policy, parameters, np.tile(observation, (3, 1)), every))
    expected = epsilon / 3 + (1 - epsilon) * own
    n = 40_000
    actions = sample(policy, parameters, observation, rng, n, epsilon)
    found = np.bincount(actions[:, 0].astype(int)) / n
    assert (np.abs(found - expected) < 4 * np.sqrt(expected * (1 - expected) / n)).all()


@settings(deadline=None, max_examples=200)
@given(
    st.lists(st.floats(-80, 80, width=32), min_size=1, max_size=6),
    st.floats(0, 1, exclude_max=True),
)
def test_first_action_whose_cumulative_probability_exceeds_the_uniform(scores, uniform):
    policy = Policy(np.array([1, len(scores)]), False, False, False, 1)
    parameters = np.concatenate([np.zeros(len(scores)), scores]).astype(np.float32)
    actor, action = likelihood.make_actor(policy, parameters), np.empty(1, np.float32)
    likelihood.choose_action(actor, np.zeros(1, np.float32), np.array([uniform]), action)
    k = int(action[0])
    powers = np.exp(np.array(scores) - max(scores))
    cumulative = powers.cumsum() / powers.sum()
    assert cumulative[k] > uniform - 1e-6
    assert k == 0 or cumulative[k - 1] <= uniform + 1e-6


def test_scores_that_are_not_numbers_still_give_an_action():
    policy, parameters, _ = drawn("categorical")
    actor, action = likelihood.make_actor(policy, parameters * np.nan), np.empty(1, np.float32)
    likelihood.choose_action(actor, np.zeros(4, np.float32), np.ones(1), action)
    assert action[0] in (0, 1, 2)


@pytest.mark.parametrize("kind", POLICIES)
def test_parts_are_named_and_are_views(kind):
    policy, parameters, _ = drawn(kind)
    named = likelihood.unpack(policy, parameters)
    assert sum(part.size for part in named.values()) == parameters.size
    assert ("log_sigma" in named) == policy.gaussian
    for part in named.values():
        part[...] = 7.0
    assert (parameters == 7.0).all()


@pytest.mark.parametrize("n", [1, 5, 7])
def test_learning_takes_the_steps_of_adam_in_the_order_given(n):
    """Minibatches of at most three: each the mean gradient of its steps, what is fixed left out."""
    policy, parameters, rng = drawn("weights, learned sigma")
    mask = policies.trainable(policy, POLICIES["weights, learned sigma"][0], biases=False)
    observations = rng.normal(size=(n, N_OBSERVATIONS)).astype(np.float32)
    actions = rng.normal(size=(n, 2)).astype(np.float32)
    returns, orders = rng.normal(size=n), np.stack([rng.permutation(n) for _ in range(2)])
    expected, moments, count = parameters.copy(), np.zeros((2, parameters.size), np.float32), 0
    for order in orders:
        for start in range(0, n, 3):
            batch = order[start : start + 3]
            weights = (returns[batch] / len(batch)).astype(np.float32)
            gradient = gradient_of(policy, expected, observations[batch], actions[batch], weights)
            count += 1
            networks.adam_step(expected, gradient * mask, *moments, count, 0.01)
    learner = likelihood.make_learner(policy, parameters, mask, 3, 0.01)
    likelihood.learn(learner, observations, actions, returns, orders)
    assert learner.updates[0] == count
    np.testing.assert_allclose(parameters, expected, rtol=1e-6, atol=1e-7)
