"""Policies: what they draw, and the gradient of the log-probability of what was drawn."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rl_core import networks, policies
from rl_core.policies import Categorical, Gaussian, Policy, make_policy

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


def sample(policy, parameters, observation, rng, n):
    units, noise = np.empty(policy.sizes.sum(), np.float32), np.empty(policy.action_width)
    actions = np.empty((n, policy.action_width), np.float32)
    for action in actions:
        policies.draw_noise(policy, rng, noise)
        policies.choose_action(policy, parameters, observation, noise, units, action)
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
    policies.likelihood_gradient(
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


@pytest.mark.parametrize("kind", ["categorical", "direct and constant"])
def test_noise_is_what_numpy_draws_from_the_same_stream(kind):
    policy, _, _ = drawn(kind)
    compiled, plain = np.random.default_rng(3), np.random.default_rng(3)
    noise = np.empty(policy.action_width)
    for _ in range(1000):
        policies.draw_noise(policy, compiled, noise)
        draw = plain.standard_normal if policy.gaussian else plain.random
        np.testing.assert_array_equal(noise, draw(policy.action_width))


@settings(deadline=None, max_examples=200)
@given(
    st.lists(st.floats(-80, 80, width=32), min_size=1, max_size=6),
    st.floats(0, 1, exclude_max=True),
)
def test_first_action_whose_cumulative_probability_exceeds_the_uniform(scores, uniform):
    policy = Policy(np.array([1, len(scores)]), False, False, False, 1)
    parameters = np.concatenate([np.zeros(len(scores)), scores]).astype(np.float32)
    units, action = np.empty(1 + len(scores), np.float32), np.empty(1, np.float32)
    policies.choose_action(
        policy, parameters, np.zeros(1, np.float32), np.array([uniform]), units, action
    )
    k = int(action[0])
    powers = np.exp(np.array(scores) - max(scores))
    cumulative = powers.cumsum() / powers.sum()
    assert cumulative[k] > uniform - 1e-6
    assert k == 0 or cumulative[k - 1] <= uniform + 1e-6


def test_scores_that_are_not_numbers_still_give_an_action():
    policy, parameters, _ = drawn("categorical")
    action, units = np.empty(1, np.float32), np.empty(policy.sizes.sum(), np.float32)
    policies.choose_action(
        policy, np.full_like(parameters, np.nan), np.zeros(4, np.float32), np.ones(1), units, action
    )
    assert action[0] in (0, 1, 2)


def test_sizes_follow_from_the_spaces():
    assert make_policy(Categorical(), (10, 20), 6, 3, 0).sizes.tolist() == [6, 10, 20, 3]
    assert make_policy(Categorical(), (), 6, 3, 0).sizes.tolist() == [6, 3]
    assert make_policy(Gaussian(), (10, 20), 2, 0, 1).sizes.tolist() == [2, 10, 20, 2]
    three = Gaussian(constant_feature=True)
    assert make_policy(three, (10, 20), 2, 0, 1).sizes.tolist() == [3, 10, 20, 3]
    assert make_policy(three, (7,), 2, 0, 4).sizes.tolist() == [3, 7, 12]
    assert make_policy(Gaussian(mean="direct"), (7,), 2, 0, 4).sizes.tolist() == [2, 7, 4]


@pytest.mark.parametrize("learned", [True, False])
@pytest.mark.parametrize("biases", [True, False])
def test_what_learns_and_what_does_not(learned, biases):
    distribution = Gaussian(sigma=0.3, learn_sigma=learned)
    policy = make_policy(distribution, (5,), 2, 0, 2)
    named = policies.unpack(policy, policies.trainable(policy, distribution, biases))
    assert {name: float(part.mean()) for name, part in named.items()} == {
        "layer0.weight": 1.0,
        "layer1.weight": 1.0,
        "layer0.bias": float(biases),
        "layer1.bias": float(biases),
        "log_sigma": float(learned),
    }
    parameters = policies.initial_parameters(policy, distribution, np.random.default_rng(0))
    np.testing.assert_allclose(np.exp(parameters[-2:]), 0.3, rtol=1e-6)


@pytest.mark.parametrize("sigma", [0.0, -1.0, np.inf, np.nan, "wide", True])
def test_sigma_out_of_range_is_refused(sigma):
    with pytest.raises(ValueError, match=r"sigma must be .* got"):
        Gaussian(sigma=sigma)


def test_an_unknown_form_of_the_mean_is_refused():
    with pytest.raises(ValueError, match="mean must be 'weights' or 'direct', got 'median'"):
        Gaussian(mean="median")


@pytest.mark.parametrize("name", ["learn_sigma", "constant_feature"])
@pytest.mark.parametrize("value", [1, 0, None, "yes", 0.5])
def test_switches_that_are_no_bools_are_refused(name, value):
    with pytest.raises(ValueError, match=rf"^{name} must be a bool, got "):
        Gaussian(**{name: value})


@pytest.mark.parametrize(
    ("distribution", "actions"), [(Categorical(), (0, 1)), (Gaussian(), (3, 0))]
)
def test_a_distribution_over_other_actions_is_refused(distribution, actions):
    with pytest.raises(ValueError, match=r"policy must be .* where actions are"):
        make_policy(distribution, (5,), 2, *actions)
