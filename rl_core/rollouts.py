"""What a trained policy does: episodes played with given weights, and its choice in any state."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from rl_core import networks
from rl_core.episodes import EnvironmentLike, Trajectory, check_fit, open_environment
from rl_core.policies import Gaussian, Policy, is_integer, require
from rl_core.reinforce import ReinforceConfig

Weights = Mapping[str, NDArray[np.float32]]
"""The weights of one policy by name, as `weights_of` takes them out of a run."""


def weights_of(
    arrays: Mapping[str, NDArray[np.float32]], position: int, moment: str = ""
) -> dict[str, NDArray[np.float32]]:
    """Take the weights of one seed out of a run's arrays.

    Parameters
    ----------
    arrays : mapping of str to array
        `Run.arrays`.
    position : int
        Which seed, counted from 0 in the order asked for.
    moment : str
        "" for the last weights, "initial/" for the first, "episode1000/" for a snapshot.

    Returns
    -------
    dict of str to float32 array
        For example `layer0.weight` of shape (inputs, outputs).

    Raises
    ------
    ValueError
        If the run has no such snapshot, or no such seed.

    Examples
    --------
    >>> arrays = {f"{moment}layer0.weight": np.zeros((30, 2, 3)) for moment in ("", "initial/")}
    >>> weights_of(arrays, 0, "initial/")["layer0.weight"].shape
    (2, 3)
    """
    names = [name for name in arrays if name.rpartition("/")[0] == moment.rstrip("/")]
    require(bool(names), "moment", moment, f"one of which the arrays are: {sorted(arrays)}")
    n_seeds = min(len(arrays[name]) for name in names)
    valid = is_integer(position, 0) and position < n_seeds
    require(valid, "position", position, f"an integer from 0 to {n_seeds - 1}")
    return {name.rpartition("/")[2]: arrays[name][position] for name in names}


def policy_of(config: ReinforceConfig, weights: Weights) -> tuple[Policy, NDArray[np.float32]]:
    """Put a policy and its parameter vector together again.

    Parameters
    ----------
    config : ReinforceConfig
        Of the run that made the weights.
    weights : mapping of str to array
        Of one seed, as `weights_of` gives them.

    Returns
    -------
    policy : Policy
    parameters : float32 array of shape (P,)

    Raises
    ------
    ValueError
        If `config` is no ReinforceConfig, the weights are not those of one network, or a Gaussian's
        `log_sigma` is missing.

    Examples
    --------
    >>> weights = {"layer0.weight": np.zeros((2, 3), np.float32)}
    >>> policy, parameters = policy_of(ReinforceConfig(hidden=()), weights)
    >>> policy.sizes, parameters.shape
    (array([2, 3]), (9,))
    """
    require(isinstance(config, ReinforceConfig), "config", config, "a ReinforceConfig")
    require(isinstance(weights, Mapping), "weights", weights, "a mapping of names to arrays")
    sizes, network = networks.pack(weights)
    if not isinstance(config.policy, Gaussian):
        return Policy(np.array(sizes), False, False, False, 1), network
    given = "log_sigma" in weights
    require(given, "weights", sorted(weights), "with 'log_sigma', since the policy is Gaussian")
    log_sigma = weights["log_sigma"]
    policy = Policy(
        np.array(sizes),
        True,
        config.policy.mean == "weights",
        config.policy.constant_feature,
        len(log_sigma),
    )
    return policy, np.append(network, log_sigma)


def action_probabilities(
    config: ReinforceConfig, weights: Weights, observations: NDArray[np.floating]
) -> NDArray[np.float32]:
    """pi(k|s) of a categorical policy.

    Parameters
    ----------
    config : ReinforceConfig
        Of the run that made the weights.
    weights : mapping of str to array
        Of one seed, as `weights_of` gives them.
    observations : array of shape (n, n_observations)

    Returns
    -------
    float32 array of shape (n, n_actions)
        Rows sum to 1.

    Raises
    ------
    ValueError
        If the policy is Gaussian.

    Examples
    --------
    >>> config = ReinforceConfig(hidden=())
    >>> weights = {"layer0.weight": np.zeros((2, 4), np.float32)}
    >>> action_probabilities(config, weights, np.ones((1, 2)))
    array([[0.25, 0.25, 0.25, 0.25]], dtype=float32)
    """
    require(not isinstance(config.policy, Gaussian), "policy", config.policy, "Categorical()")
    policy, parameters = policy_of(config, weights)
    scores = networks.output(policy.sizes.tolist(), parameters, observations)
    powers = np.exp(scores - scores.max(axis=1, keepdims=True))
    probabilities: NDArray[np.float32] = powers / powers.sum(axis=1, keepdims=True)
    return probabilities


def mean_actions(
    config: ReinforceConfig, weights: Weights, observations: NDArray[np.floating]
) -> NDArray[np.float32]:
    """mu(s) of a Gaussian policy: what it does on average, before any clipping.

    Parameters
    ----------
    config : ReinforceConfig
        Of the run that made the weights.
    weights : mapping of str to array
        Of one seed, as `weights_of` gives them.
    observations : array of shape (n, n_observations)

    Returns
    -------
    float32 array of shape (n, action_width)

    Raises
    ------
    ValueError
        If the policy is categorical.

    Examples
    --------
    >>> config = ReinforceConfig(hidden=(), policy=Gaussian(mean="direct"))
    >>> weights = {"layer0.weight": np.array([[1], [2]]), "log_sigma": np.zeros(1)}
    >>> mean_actions(config, weights, np.array([[1.0, 10.0]]))
    array([[21.]], dtype=float32)
    """
    require(isinstance(config.policy, Gaussian), "policy", config.policy, "Gaussian(...)")
    policy, parameters = policy_of(config, weights)
    features = np.asarray(observations, np.float32)
    if policy.constant_feature:
        features = np.column_stack([features, np.ones(len(features), np.float32)])
    outputs = networks.output(
        policy.sizes.tolist(), parameters[: parameters.size - policy.action_width], features
    )
    if not policy.weighted_features:
        return outputs
    per_feature = outputs.reshape(len(features), policy.action_width, features.shape[1])
    means: NDArray[np.float32] = np.einsum("nkf,nf->nk", per_feature, features)
    return means


def state_grid(space: spaces.Box, points: int) -> NDArray[np.float32]:
    """Lay an even grid over a space of observations, to look at a policy in every part of it.

    Parameters
    ----------
    space : gymnasium.spaces.Box
        Of n-dimensional observations; its bounds have to be finite.
    points : int
        Points along each dimension, at least 2; the bounds are among them.

    Returns
    -------
    float32 array of shape (points ** n, n)
        The last dimension runs fastest.

    Raises
    ------
    ValueError
        If the space is no such Box, a bound is not finite, or `points` is too small.

    Examples
    --------
    >>> space = spaces.Box(np.array([0, -1], np.float32), np.array([1, 1], np.float32))
    >>> state_grid(space, 2).tolist()
    [[0.0, -1.0], [0.0, 1.0], [1.0, -1.0], [1.0, 1.0]]
    """
    valid = isinstance(space, spaces.Box) and len(space.shape) == 1
    require(valid, "space", space, "a Box of one axis")
    finite = bool(np.isfinite(space.low).all() and np.isfinite(space.high).all())
    require(finite, "space", space, "a Box with finite bounds, because a grid has to end somewhere")
    require(is_integer(points, 2), "points", points, "an integer from 2")
    axes = [np.linspace(*bounds, points) for bounds in zip(space.low, space.high, strict=True)]
    grid = np.meshgrid(*axes, indexing="ij")
    return np.stack(grid, axis=-1).reshape(-1, len(axes)).astype(np.float32)


@dataclass(frozen=True)
class Rollout:
    """One episode, for a picture or an animation.

    Attributes
    ----------
    observations : float32 array of shape (T + 1, n_observations)
    actions : float32 array of shape (T, action_width)
        Indices of discrete actions, or continuous actions as drawn.
    rewards : float64 array of shape (T,)
    terminated : bool
        False if stopped at `max_steps`, or truncated by the environment.
    environment_seed : int
        `env.reset(seed=environment_seed)` and the actions play the episode again in Gymnasium.
    """

    observations: NDArray[np.float32]
    actions: NDArray[np.float32]
    rewards: NDArray[np.float64]
    terminated: bool
    environment_seed: int


def rollout(
    env: EnvironmentLike,
    config: ReinforceConfig,
    weights: Mapping[str, NDArray[np.float32]],
    rng: np.random.Generator,
    max_steps: int,
) -> Rollout:
    """Play one episode with given weights, without learning.

    Parameters
    ----------
    env : str, gymnasium.Env or callable
        As for `reinforce`.
    config : ReinforceConfig
        Of the run that made the weights.
    weights : mapping of str to array
        Of one seed, as `weights_of` gives them.
    rng : numpy.random.Generator
        Draws the environment's seed and the actions.
    max_steps : int
        Where to stop an episode that has not ended.

    Returns
    -------
    Rollout

    Raises
    ------
    ValueError, TypeError
        If an argument is out of range, the environment unknown, or the policy does not fit it.

    Examples
    --------
    >>> config = ReinforceConfig(hidden=())
    >>> weights = {"layer0.weight": np.zeros((2, 3), np.float32)}
    >>> episode = rollout("MountainCar-v0", config, weights, np.random.default_rng(0), 100)
    >>> episode.observations.shape, episode.terminated
    ((101, 2), False)
    """
    require(is_integer(max_steps, 1), "max_steps", max_steps, "a positive integer")
    require(isinstance(rng, np.random.Generator), "rng", rng, "a numpy.random.Generator")
    policy, parameters = policy_of(config, weights)
    environment_seed = int(rng.integers(2**32))
    environment = open_environment(env)
    try:
        check_fit(policy, parameters, environment, "weights")
        environment.seed(environment_seed)
        trajectory = Trajectory(environment.n_observations, policy.action_width)
        steps, terminated = environment.play(policy, parameters, rng, max_steps, trajectory)
    finally:
        environment.close()
    return Rollout(
        trajectory.observations[: steps + 1],
        trajectory.actions[:steps],
        trajectory.rewards[:steps],
        terminated,
        environment_seed,
    )
