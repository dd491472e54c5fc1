"""What a policy says of many states at once: to draw it over the plane of its observations."""

from collections.abc import Mapping

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from rl_core.checks import floats, instance, integer, require
from rl_core.evaluation import as_learned
from rl_core.kernels import networks
from rl_core.kernels.arrays import F32
from rl_core.kernels.likelihood import Actor
from rl_core.policies import Gaussian
from rl_core.reinforce import ReinforceConfig


def action_values(weights: Mapping[str, F32], observations: NDArray[np.floating]) -> F32:
    """Q(s, a) for many states.

    Parameters
    ----------
    weights : mapping of str to array
        Of one seed.
    observations : array of shape (n, n_observations)

    Returns
    -------
    float32 array of shape (n, n_actions)

    Raises
    ------
    ValueError
        If the weights are not those of one network, or the observations have another shape.

    Examples
    --------
    >>> import numpy as np
    >>> from studies.policy_maps import action_values
    >>> weights = {"layer0.weight": np.array([[1, 2, 3], [0, 0, 10]], np.float32)}
    >>> action_values(weights, np.array([[1.0, 1.0]]))
    array([[ 1.,  2., 13.]], dtype=float32)
    """
    sizes, parameters = networks.pack(weights)
    return networks.output(
        sizes, parameters, floats("observations", observations, (None, sizes[0]))
    )


def mean_actions(
    config: ReinforceConfig,
    weights: Mapping[str, F32],
    observations: NDArray[np.floating],
) -> F32:
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
    >>> import numpy as np
    >>> from studies.policy_maps import mean_actions
    >>> from rl_core.policies import Gaussian, MLP
    >>> from rl_core.reinforce import ReinforceConfig
    >>> config = ReinforceConfig(network=MLP(()), policy=Gaussian(mean="direct"))
    >>> weights = {"layer0.weight": np.array([[1], [2]]), "log_sigma": np.zeros(1)}
    >>> mean_actions(config, weights, np.array([[1.0, 10.0]]))
    array([[21.]], dtype=float32)
    """
    instance("config", config, ReinforceConfig, "a ReinforceConfig")
    require(isinstance(config.policy, Gaussian), "policy", config.policy, "Gaussian(...)")
    actor = as_learned(config, weights).actor
    assert isinstance(actor, Actor)
    policy, parameters = actor.policy, actor.parameters
    width = int(policy.sizes[0]) - policy.constant_feature
    features = floats("observations", observations, (None, width)).astype(np.float32)
    if policy.constant_feature:
        features = np.column_stack([features, np.ones(len(features), np.float32)])
    outputs = networks.output(
        policy.sizes.tolist(), parameters[: parameters.size - policy.action_width], features
    )
    if not policy.weighted_features:
        return outputs
    per_feature = outputs.reshape(len(features), policy.action_width, features.shape[1])
    means: F32 = np.einsum("nkf,nf->nk", per_feature, features)
    return means


def state_grid(space: spaces.Box, points: int) -> F32:
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
    >>> import numpy as np
    >>> from gymnasium import spaces
    >>> from studies.policy_maps import state_grid
    >>> space = spaces.Box(np.array([0, -1], np.float32), np.array([1, 1], np.float32))
    >>> state_grid(space, 2).tolist()
    [[0.0, -1.0], [0.0, 1.0], [1.0, -1.0], [1.0, 1.0]]
    """
    valid = isinstance(space, spaces.Box) and len(space.shape) == 1
    require(valid, "space", space, "a Box of one axis")
    finite = bool(np.isfinite(space.low).all() and np.isfinite(space.high).all())
    require(finite, "space", space, "a Box with finite bounds, because a grid has to end somewhere")
    points = integer("points", points, 2)
    axes = [np.linspace(*bounds, points) for bounds in zip(space.low, space.high, strict=True)]
    grid = np.meshgrid(*axes, indexing="ij")
    return np.stack(grid, axis=-1).reshape(-1, len(axes)).astype(np.float32)
