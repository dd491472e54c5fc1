"""Stochastic policies as compiled code takes them: actions, and the gradient of their likelihood.

The parameters of a policy are one float32 vector: the network's, as in `rl_core.kernels.networks`,
and for a Gaussian log sigma_k, one a component.

- Categorical: pi(k|s) = exp(y_k) / sum_j exp(y_j), with one output y_k an action.
- Gaussian: a_k ~ N(mu_k(s), sigma_k^2) for every component k of a continuous action, where mu_k is
  an output of the network or, in the form of the 2018 report, the inner product of the state
  features with weights that the network puts out.
"""

from typing import NamedTuple

import numpy as np

from rl_core.kernels import networks
from rl_core.kernels.arrays import F32, F64, I64
from rl_core.kernels.compiled import compiled, inlined, uncounted


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

    sizes: I64
    gaussian: bool
    weighted_features: bool
    constant_feature: bool
    action_width: int


def unpack(policy: Policy, parameters: F32) -> dict[str, F32]:
    """Name the parts of parameter vectors of shape (..., P): views.

    Returns
    -------
    dict of str to float32 array
        `layer0.weight`, `layer0.bias`, ... as `networks.unpack` names them, and for a Gaussian
        `log_sigma` of shape (..., action_width).
    """
    named = networks.unpack(policy.sizes.tolist(), parameters)
    if policy.gaussian:
        named["log_sigma"] = parameters[..., -policy.action_width :]
    return named


@inlined
def _write_features(policy: Policy, observation: F32, features: F32) -> None:
    """Write the network's inputs for one observation."""
    for i in range(observation.size):
        features[i] = observation[i]
    if policy.constant_feature:
        features[observation.size] = 1.0


@uncounted
def _gaussian_mean(policy: Policy, units: F32, k: int) -> np.float32:
    """Mean of component k of the action, from the units of a network that saw one state."""
    n_features = policy.sizes[0]
    outputs = units[units.size - policy.sizes[-1] :]
    if not policy.weighted_features:
        return np.float32(outputs[k])
    mean = np.float32(0.0)
    for i in range(n_features):
        mean += outputs[k * n_features + i] * units[i]
    return mean


@uncounted
def _choose_categorical(scores: F32, uniform: float) -> int:
    """First k whose cumulative probability exceeds `uniform`; overwrites the scores."""
    highest = scores[0]
    for k in range(1, scores.size):
        highest = max(highest, scores[k])
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


class Actor(NamedTuple):
    """Draws actions from the policy of a perceptron.

    Attributes
    ----------
    policy : Policy
    parameters : float32 array of shape (P,)
    epsilon : float
        Probability of a uniformly random action instead, where actions are discrete.
    units : float32 array of shape (sum(policy.sizes),)
        Scratch space.
    noise : float64 array of shape (action_width,)
        Room for what is drawn before each action.
    """

    policy: Policy
    parameters: F32
    epsilon: float
    units: F32
    noise: F64


def make_actor(policy: Policy, parameters: F32, epsilon: float = 0.0) -> Actor:
    """Return an actor that follows `parameters`, also as they change."""
    units = np.empty(int(policy.sizes.sum()), np.float32)
    return Actor(policy, parameters, epsilon, units, np.empty(policy.action_width))


@inlined
def choose_action(actor: Actor, observation: F32, noise: F64, action: F32) -> None:
    """Turn noise into an action drawn from pi(.|s), and write it to `action`.

    Parameters
    ----------
    actor : Actor
    observation : float32 array of shape (n_observations,)
    noise : float64 array of shape (action_width,)
        Uniform for a categorical policy, standard normal for a Gaussian one.
    action : float32 array of shape (action_width,)
        Overwritten. A Gaussian action is written as drawn, not clipped to any bounds.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.likelihood import Policy, choose_action, make_actor
    >>> policy = Policy(np.array([2, 3]), False, False, False, 1)
    >>> actor, action = make_actor(policy, np.zeros(9, np.float32)), np.empty(1, np.float32)
    >>> choose_action(actor, np.ones(2, np.float32), np.array([0.5]), action)
    >>> action
    array([1.], dtype=float32)
    """
    policy, parameters, epsilon, units, _ = actor
    if explores(policy, epsilon, noise, action):
        return
    _write_features(policy, observation, units)
    networks.forward_one(policy.sizes, parameters, units)
    draw_action(policy, parameters[parameters.size - policy.action_width :], units, noise, action)


@inlined
def explores(policy: Policy, epsilon: float, noise: F64, action: F32) -> bool:
    """Write a uniformly random action with probability epsilon, where actions are discrete.

    If it does not, what is left of the uniform in `noise` is made uniform again.
    """
    if policy.gaussian or epsilon == 0.0:
        return False
    if noise[0] < epsilon:
        action[0] = int(noise[0] / epsilon * policy.sizes[-1])
        return True
    noise[0] = (noise[0] - epsilon) / (1.0 - epsilon)
    return False


@inlined
def draw_action(policy: Policy, log_sigma: F32, units: F32, noise: F64, action: F32) -> None:
    """Turn noise into an action, given the network's outputs.

    Parameters
    ----------
    policy : Policy
    log_sigma : float32 array of shape (action_width,)
        Not looked at for a categorical policy.
    units : float32 array
        The features first and the outputs last, whatever stands between; overwritten.
    noise, action
        As for `choose_action`.
    """
    if not policy.gaussian:
        action[0] = _choose_categorical(units[units.size - policy.sizes[-1] :], noise[0])
        return
    for k in range(policy.action_width):
        action[k] = _gaussian_mean(policy, units, k) + np.exp(log_sigma[k]) * noise[k]


@uncounted
def _categorical_deltas(
    policy: Policy, actions: F32, weights: F32, units: F32, deltas: F32
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


@uncounted
def _gaussian_deltas(
    policy: Policy,
    parameters: F32,
    actions: F32,
    weights: F32,
    units: F32,
    deltas: F32,
    gradient: F32,
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


@uncounted
def likelihood_gradient(
    policy: Policy,
    parameters: F32,
    observations: F32,
    actions: F32,
    weights: F32,
    units: F32,
    deltas: F32,
    gradient: F32,
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

    >>> import numpy as np
    >>> from rl_core.kernels import networks
    >>> from rl_core.kernels.likelihood import Policy, likelihood_gradient
    >>> policy = Policy(np.array([1, 2]), False, False, False, 1)
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


class Learner(NamedTuple):
    """What one seed learns with REINFORCE, compiled.

    Attributes
    ----------
    policy : Policy
    parameters : float32 array of shape (P,)
        Changed in place.
    trainable : float32 array of shape (P,)
        Ones where a parameter learns.
    first, second : float32 arrays of shape (P,)
        Adam's moments.
    updates : int64 array of shape (1,)
        Steps of Adam so far.
    batch_size : int
        Largest minibatch.
    learning_rate : float
        Adam's step size alpha.
    """

    policy: Policy
    parameters: F32
    trainable: F32
    first: F32
    second: F32
    updates: I64
    batch_size: int
    learning_rate: float


def make_learner(
    policy: Policy, parameters: F32, trainable: F32, batch_size: int, learning_rate: float
) -> Learner:
    """Return a learner that has not learned yet; it will change `parameters`."""
    moments = np.zeros_like(parameters), np.zeros_like(parameters)
    updates = np.zeros(1, np.int64)
    return Learner(policy, parameters, trainable, *moments, updates, batch_size, learning_rate)


@compiled
def learn(learner: Learner, observations: F32, actions: F32, returns: F64, orders: I64) -> None:
    """Climb the likelihood of an episode's actions, weighted by the returns: a step a minibatch.

    The compiled form of `rl_core.reinforce.TorchLearner.learn`, where the equation stands.

    Parameters
    ----------
    learner : Learner
        Changed in place.
    observations : float32 array of shape (T, n_observations)
    actions : float32 array of shape (T, action_width)
    returns : float64 array of shape (T,)
    orders : int64 array of shape (epochs, T)
        The order of the steps in each epoch.
    """
    policy, parameters = learner.policy, learner.parameters
    largest = min(learner.batch_size, returns.size)
    shape = (policy.sizes.sum(), networks.padded(largest))
    units, deltas = np.empty(shape, np.float32), np.empty(shape, np.float32)
    gradient = np.empty(parameters.size, np.float32)
    for order in orders:
        for start in range(0, returns.size, largest):
            batch = order[start : start + largest]
            examples = observations[batch], actions[batch]
            weights = (returns[batch] / batch.size).astype(np.float32)
            likelihood_gradient(policy, parameters, *examples, weights, units, deltas, gradient)
            gradient *= learner.trainable
            learner.updates[0] += 1
            moments = learner.first, learner.second
            count, rate = learner.updates[0], learner.learning_rate
            networks.adam_step(parameters, gradient, *moments, count, rate)
