"""Stochastic policies: a network, and a rule that turns its outputs into a distribution of actions.

- Categorical: pi(k|s) = exp(y_k) / sum_j exp(y_j), with one output y_k an action.
- Gaussian: a_k ~ N(mu_k(s), sigma_k^2) for every component k of a continuous action, where mu_k is
  an output of the network or, in the form of the 2018 report, the inner product of the state
  features with weights that the network puts out.

`Categorical` and `Gaussian` are what a user writes down; `Policy` is what the compiled code takes.
The parameters of a policy are one float32 vector: the network's, as in `rl_core.networks`, and for
a Gaussian log sigma_k, one a component.

Sources: R. S. Sutton and A. G. Barto, Reinforcement Learning: An Introduction (2018), sections 13.1
(soft-max in action preferences) and 13.7 (Gaussian policies).
"""

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rl_core import networks
from rl_core.kernels.compiled import compiled


def require(condition: bool, name: str, value: object, allowed: str) -> None:
    """Raise a ValueError that names the argument, its value and what is allowed.

    Examples
    --------
    >>> require(False, "gamma", 2, "a number from 0 to 1")
    Traceback (most recent call last):
    ValueError: gamma must be a number from 0 to 1, got 2
    """
    if not condition:
        raise ValueError(f"{name} must be {allowed}, got {value!r}")


def is_integer(value: object, least: int) -> bool:
    """Tell whether a value is an integer, not a bool, of at least `least`."""
    return (
        isinstance(value, int | np.integer) and not isinstance(value, bool) and bool(value >= least)
    )


def is_number(value: object) -> bool:
    """Tell whether a value is a finite real number, Python's or numpy's, not a bool.

    Examples
    --------
    >>> is_number(np.float32(0.9)), is_number(True), is_number("0.9"), is_number(math.inf)
    (True, False, False, False)
    """
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    return math.isfinite(value)


def is_one_of(value: object, words: Collection[str]) -> bool:
    """Tell whether a value is one of some words; anything may be asked about.

    Examples
    --------
    >>> is_one_of("none", ("centre", "none")), is_one_of(np.array(["centre", "none"]), ("none",))
    (True, False)
    """
    return isinstance(value, str) and value in words


@dataclass(frozen=True)
class Categorical:
    """Discrete actions: pi(k|s) = exp(y_k) / sum_j exp(y_j), where the network puts out y."""


@dataclass(frozen=True)
class Gaussian:
    """Continuous actions: a_k ~ N(mu_k(s), sigma_k^2), independently for every component k.

    Actions are neither squashed nor clipped here: the log-probability is that of the raw sample,
    and the environment does with it what it does. So the bounds of its action space are not used,
    and need not be finite.

    Attributes
    ----------
    mean : {"weights", "direct"}
        "weights": the network puts out one weight a state feature (for each component), and
        mu = weights . features, the form of the 2018 report. "direct": it puts out mu.
    sigma : float
        Standard deviation, or its start if it is learned. Above 0.
    learn_sigma : bool
        Whether log sigma_k is learned too, the same for all states.
    constant_feature : bool
        Whether the features, which the network sees and its weights multiply, are the
        observation and a constant 1, or the observation alone.

    Raises
    ------
    ValueError
        For any other value.
    """

    mean: Literal["weights", "direct"] = "weights"
    sigma: float = 0.5
    learn_sigma: bool = False
    constant_feature: bool = False

    def __post_init__(self) -> None:
        named = is_one_of(self.mean, ("weights", "direct"))
        require(named, "mean", self.mean, "'weights' or 'direct'")
        valid = is_number(self.sigma) and self.sigma > 0
        require(valid, "sigma", self.sigma, "a finite number above 0")
        for name in ("learn_sigma", "constant_feature"):
            value = getattr(self, name)
            require(isinstance(value, bool), name, value, "a bool")


class Policy(NamedTuple):
    """A stochastic policy without its parameters.

    Attributes
    ----------
    sizes : int64 array
        Widths of the network's layers, features first, outputs last.
    gaussian : bool
        Whether actions are drawn from a normal distribution; else they are categorical.
    weighted_features : bool
        Whether the outputs are weights on the features, and a Gaussian's mean is their product.
    constant_feature : bool
        Whether a feature that is always one follows the observation.
    action_width : int
        Components of an action: 1 for a categorical policy, whose action is an index.
    """

    sizes: NDArray[np.int64]
    gaussian: bool
    weighted_features: bool
    constant_feature: bool
    action_width: int


def make_policy(
    distribution: Categorical | Gaussian,
    hidden: tuple[int, ...],
    n_observations: int,
    n_actions: int,
    action_dimensions: int,
) -> Policy:
    """Fit a policy to an environment.

    Parameters
    ----------
    distribution : Categorical or Gaussian
    hidden : tuple of int
        Widths of the hidden layers.
    n_observations : int
        Length of an observation.
    n_actions : int
        Number of discrete actions, 0 where actions are continuous.
    action_dimensions : int
        Length of a continuous action, 0 where actions are discrete.

    Raises
    ------
    ValueError
        If the distribution is not one over such actions.

    Examples
    --------
    >>> make_policy(Gaussian(constant_feature=True), (10, 20), 2, 0, 1).sizes
    array([ 3, 10, 20,  3])
    """
    discrete = n_actions > 0
    if isinstance(distribution, Categorical):
        require(discrete, "policy", distribution, "Gaussian(...) where actions are continuous")
        return Policy(np.array([n_observations, *hidden, n_actions]), False, False, False, 1)
    require(not discrete, "policy", distribution, "Categorical() where actions are discrete")
    weighted = distribution.mean == "weights"
    n_features = n_observations + distribution.constant_feature
    n_outputs = action_dimensions * (n_features if weighted else 1)
    return Policy(
        np.array([n_features, *hidden, n_outputs]),
        True,
        weighted,
        distribution.constant_feature,
        action_dimensions,
    )


def initial_parameters(
    policy: Policy, distribution: Categorical | Gaussian, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Draw the parameters to start from: Xavier-uniform weights, zero biases, log sigma as asked.

    Examples
    --------
    >>> policy = make_policy(Gaussian(), (), 2, 0, 1)
    >>> initial_parameters(policy, Gaussian(sigma=1.0), np.random.default_rng(0))[6:]
    array([0.], dtype=float32)
    """
    network = networks.xavier_uniform(policy.sizes.tolist(), rng)
    if not isinstance(distribution, Gaussian):
        return network
    log_sigma = np.full(policy.action_width, math.log(distribution.sigma), np.float32)
    return np.concatenate([network, log_sigma])


def trainable(
    policy: Policy, distribution: Categorical | Gaussian, biases: bool
) -> NDArray[np.float32]:
    """Ones for the parameters that learn, zeros for those that stay as they are.

    Examples
    --------
    >>> policy = make_policy(Gaussian(), (), 2, 0, 1)
    >>> trainable(policy, Gaussian(), biases=False)
    array([1., 1., 1., 1., 0., 0., 0.], dtype=float32)
    """
    network = networks.trainable_mask(policy.sizes.tolist(), biases)
    if not isinstance(distribution, Gaussian):
        return network
    return np.append(network, np.full(policy.action_width, distribution.learn_sigma, np.float32))


def unpack(policy: Policy, parameters: NDArray[np.float32]) -> dict[str, NDArray[np.float32]]:
    """Name the parts of parameter vectors of shape (..., P): views.

    Returns
    -------
    dict of str to float32 array
        `layer0.weight`, `layer0.bias`, ... as `rl_core.networks.unpack` names them, and for a
        Gaussian `log_sigma` of shape (..., action_width).
    """
    named = networks.unpack(policy.sizes.tolist(), parameters)
    if policy.gaussian:
        named["log_sigma"] = parameters[..., -policy.action_width :]
    return named


@compiled
def _write_features(
    policy: Policy, observation: NDArray[np.float32], features: NDArray[np.float32]
) -> None:
    """Write the network's inputs for one observation."""
    for i in range(observation.size):
        features[i] = observation[i]
    if policy.constant_feature:
        features[observation.size] = 1.0


@compiled
def _gaussian_mean(policy: Policy, units: NDArray[np.float32], k: int) -> np.float32:
    """Mean of component k of the action, from the units of a network that saw one state."""
    n_features = policy.sizes[0]
    outputs = units[units.size - policy.sizes[-1] :]
    if not policy.weighted_features:
        return np.float32(outputs[k])
    mean = np.float32(0.0)
    for i in range(n_features):
        mean += outputs[k * n_features + i] * units[i]
    return mean


@compiled
def _choose_categorical(scores: NDArray[np.float32], uniform: float) -> int:
    """First k whose cumulative probability exceeds `uniform`; overwrites the scores."""
    highest = scores.max()
    total = 0.0
    for k in range(scores.size):
        scores[k] = np.exp(scores[k] - highest)
        total += scores[k]
    threshold = uniform * total
    cumulative = 0.0
    for k in range(scores.size - 1):
        cumulative += scores[k]
        if cumulative > threshold:
            return k
    return scores.size - 1


@compiled
def draw_noise(policy: Policy, rng: np.random.Generator, noise: NDArray[np.float64]) -> None:
    """Draw what an action is made from: uniforms for a categorical one, normals for a Gaussian one.

    Parameters
    ----------
    policy : Policy
    rng : numpy.random.Generator
        Stream of the policy.
    noise : float64 array of shape (action_width,)
        Overwritten.
    """
    for k in range(noise.size):
        noise[k] = rng.standard_normal() if policy.gaussian else rng.random()


@compiled
def choose_action(
    policy: Policy,
    parameters: NDArray[np.float32],
    observation: NDArray[np.float32],
    noise: NDArray[np.float64],
    units: NDArray[np.float32],
    action: NDArray[np.float32],
) -> None:
    """Turn noise into an action drawn from pi(.|s), and write it to `action`.

    Parameters
    ----------
    policy : Policy
    parameters : float32 array of shape (P,)
    observation : float32 array of shape (n_observations,)
    noise : float64 array of shape (action_width,)
        As `draw_noise` draws it.
    units : float32 array of shape (sum(policy.sizes),)
        Scratch space.
    action : float32 array of shape (action_width,)
        Overwritten. A Gaussian action is written as drawn, not clipped to any bounds.

    Examples
    --------
    >>> policy = make_policy(Categorical(), (), 2, 3, 0)
    >>> parameters, action = np.zeros(9, np.float32), np.empty(1, np.float32)
    >>> units = np.empty(5, np.float32)
    >>> choose_action(policy, parameters, np.ones(2, np.float32), np.array([0.5]), units, action)
    >>> action
    array([1.], dtype=float32)
    """
    _write_features(policy, observation, units)
    networks.forward_one(policy.sizes, parameters, units)
    if not policy.gaussian:
        action[0] = _choose_categorical(units[units.size - policy.sizes[-1] :], noise[0])
        return
    log_sigma = parameters[parameters.size - policy.action_width :]
    for k in range(policy.action_width):
        action[k] = _gaussian_mean(policy, units, k) + np.exp(log_sigma[k]) * noise[k]


@compiled
def _categorical_deltas(
    policy: Policy,
    actions: NDArray[np.float32],
    weights: NDArray[np.float32],
    units: NDArray[np.float32],
    deltas: NDArray[np.float32],
) -> None:
    """Derivatives of -w log pi(a|s) by the outputs: w (pi(.|s) - onehot(a))."""
    n_actions = policy.sizes[-1]
    scores, delta = units[len(units) - n_actions :], deltas[len(units) - n_actions :]
    for k in range(weights.size):
        highest = scores[0, k]
        for j in range(1, n_actions):
            highest = max(highest, scores[j, k])
        total = np.float32(0.0)
        for j in range(n_actions):
            delta[j, k] = np.exp(scores[j, k] - highest)
            total += delta[j, k]
        for j in range(n_actions):
            taken = np.float32(1.0) if j == int(actions[k, 0]) else np.float32(0.0)
            delta[j, k] = weights[k] * (delta[j, k] / total - taken)


@compiled
def _gaussian_deltas(
    policy: Policy,
    parameters: NDArray[np.float32],
    actions: NDArray[np.float32],
    weights: NDArray[np.float32],
    units: NDArray[np.float32],
    deltas: NDArray[np.float32],
    gradient: NDArray[np.float32],
) -> None:
    """Derivatives of -w log pi(a|s) by the outputs and by log sigma.

    With z = (a - mu) / sigma: d log pi / d mu = z / sigma, and d log pi / d log sigma = z^2 - 1.
    """
    n_features = policy.sizes[0]
    first_output = len(units) - policy.sizes[-1]
    first_sigma = parameters.size - policy.action_width
    for c in range(policy.action_width):
        sigma = np.exp(parameters[first_sigma + c])
        gradient[first_sigma + c] = 0.0
        for k in range(weights.size):
            z = (actions[k, c] - _gaussian_mean(policy, units[:, k], c)) / sigma
            gradient[first_sigma + c] -= weights[k] * (z * z - np.float32(1.0))
            slope = -weights[k] * z / sigma
            if policy.weighted_features:
                for i in range(n_features):
                    deltas[first_output + c * n_features + i, k] = slope * units[i, k]
            else:
                deltas[first_output + c, k] = slope


@compiled
def likelihood_gradient(
    policy: Policy,
    parameters: NDArray[np.float32],
    observations: NDArray[np.float32],
    actions: NDArray[np.float32],
    weights: NDArray[np.float32],
    units: NDArray[np.float32],
    deltas: NDArray[np.float32],
    gradient: NDArray[np.float32],
) -> None:
    """Gradient of -sum_k w_k log pi(a_k|s_k) by all parameters.

    Parameters
    ----------
    policy : Policy
    parameters : float32 array of shape (P,)
    observations : float32 array of shape (n, n_observations)
    actions : float32 array of shape (n, action_width)
    weights : float32 array of shape (n,)
        w.
    units, deltas : float32 arrays of shape (sum(policy.sizes), networks.padded(n) or more)
        Scratch space.
    gradient : float32 array of shape (P,)
        Overwritten.

    Examples
    --------
    With equal probabilities, the gradient by the output of action k is 1/2 - [k = a].

    >>> policy = make_policy(Categorical(), (), 1, 2, 0)
    >>> units, deltas = np.empty((2, 3, networks.padded(1)), np.float32)
    >>> parameters, gradient = np.zeros(4, np.float32), np.empty(4, np.float32)
    >>> state, action = np.ones((1, 1), np.float32), np.zeros((1, 1), np.float32)
    >>> weight = np.ones(1, np.float32)
    >>> likelihood_gradient(
    ...     policy, parameters, state, action, weight, units, deltas, gradient
    ... )
    >>> gradient
    array([-0.5,  0.5, -0.5,  0.5], dtype=float32)
    """
    n, n_padded = weights.size, networks.padded(weights.size)
    units[: policy.sizes[0], n:n_padded] = 0.0
    deltas[len(deltas) - policy.sizes[-1] :, n:n_padded] = 0.0
    for k in range(n):
        _write_features(policy, observations[k], units[:, k])
    networks.forward(policy.sizes, parameters, units, n_padded)
    if policy.gaussian:
        _gaussian_deltas(policy, parameters, actions, weights, units, deltas, gradient)
    else:
        _categorical_deltas(policy, actions, weights, units, deltas)
    networks.backward(policy.sizes, parameters, units, deltas, gradient, n_padded)
