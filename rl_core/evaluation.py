"""How good a policy is: many fresh episodes, without learning, from the same starts for everyone.

An agent that was trained with some seed is tried out on streams that its training never saw. The
start states come from one of them, actions from another, so that all agents evaluated with a seed
face the same starts and can be compared pair by pair.

An agent is a network that puts out preferences for actions, or the mean of a continuous one. One
whose largest output is followed is no different kind: with probabilities proportional to
exp(Q / T), the largest value wins as T goes to 0 (Sutton and Barto, 2018, section 13.1). Neither is
one that acts at random: its preferences are equal. Greedy tables are evaluated likewise.
"""

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from gymnasium import spaces
from numpy.typing import NDArray

from rl_core.checks import floats, generator, instance, integer, number, require
from rl_core.kernels import likelihood, networks
from rl_core.kernels.choices import EPSILON_GREEDY, choose
from rl_core.kernels.compiled import compiled
from rl_core.kernels.likelihood import Policy
from rl_core.policies import MLP, Gaussian
from rl_core.reinforce import ReinforceConfig
from rl_core.worlds.discretise import GriddedTask, start_gridded, step_gridded
from rl_core.worlds.environments import EnvironmentLike, World, open_world
from rl_core.worlds.episodes import Trajectory, play_episode

SPAWN_KEY = (1_000,)
"""Names the streams of evaluation among a seed's; learners use small numbers."""

COLD = np.float32(2.0**40)
"""1 / T of a greedy policy. A power of two, so that it rounds nothing."""

COLUMNS = (
    *("episode", "steps", "return", "terminated"),
    *("limited_steps", "limited_return", "limited_terminated"),
)
"""The columns of a table of evaluation, besides the measures."""

Weights = Mapping[str, NDArray[np.float32]]
"""The weights of one seed by name, as `rl_core.training.weights_of` takes them out of a run."""

Measure = Callable[[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64]], float]
"""Observations, actions and rewards of an episode to a number."""


class Agent(NamedTuple):
    """A stochastic policy with its parameters, see `rl_core.kernels.likelihood`.

    Attributes
    ----------
    policy : Policy
    parameters : float32 array of shape (P,)
    epsilon : float
        Probability of a uniformly random action instead, where actions are discrete.
    """

    policy: Policy
    parameters: NDArray[np.float32]
    epsilon: float = 0.0


def as_learned(config: ReinforceConfig, weights: Mapping[str, NDArray[np.float32]]) -> Agent:
    """Return the stochastic policy that REINFORCE has learned.

    Parameters
    ----------
    config : ReinforceConfig
        Of the run that made the weights.
    weights : mapping of str to array
        Of one seed, as `rl_core.training.weights_of` gives them.

    Raises
    ------
    TypeError, ValueError
        `config` is no ReinforceConfig or its network no MLP, or the weights are not of one network,
        or without the `log_sigma` of a Gaussian.

    Examples
    --------
    >>> weights = {"layer0.weight": np.zeros((2, 3), np.float32)}
    >>> as_learned(ReinforceConfig(network=MLP(())), weights).policy.sizes
    array([2, 3])
    """
    instance("config", config, ReinforceConfig, "a ReinforceConfig")
    instance("weights", weights, Mapping, "a mapping of names to arrays")
    require(isinstance(config.network, MLP), "network", config.network, "an MLP(...)")
    sizes, network = networks.pack(weights)
    if not isinstance(config.policy, Gaussian):
        return Agent(Policy(np.array(sizes), False, False, False, 1), network)
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
    return Agent(policy, np.append(network, log_sigma).astype(np.float32))


def of_values(weights: Mapping[str, NDArray[np.float32]], epsilon: float = 0.0) -> Agent:
    """Return the epsilon-greedy policy of a network that puts out one action value an action.

    Examples
    --------
    >>> agent = of_values({"layer0.weight": np.array([[1, 2]], np.float32)})
    >>> agent.parameters[:2] / COLD
    array([1., 2.], dtype=float32)
    """
    sizes, parameters = networks.pack(weights)
    agent = greedy(Agent(Policy(np.array(sizes), False, False, False, 1), parameters))
    return agent._replace(epsilon=number("epsilon", epsilon, 0, 1))


def greedy(agent: Agent) -> Agent:
    """Return the agent that does what another most likely does: argmax of pi, or mu.

    Discrete actions: the last layer is divided by a temperature of 2^-40. Of several equal outputs,
    one is drawn. Continuous actions: sigma is 0.

    Examples
    --------
    >>> policy = Policy(np.array([1, 2]), False, False, False, 1)
    >>> greedy(Agent(policy, np.array([1, 2, 0, 0], np.float32))).parameters / COLD
    array([1., 2., 0., 0.], dtype=float32)
    """
    instance("agent", agent, Agent, "an Agent")
    policy, parameters = agent.policy, agent.parameters.copy()
    if policy.gaussian:
        parameters[parameters.size - policy.action_width :] = -np.inf
    else:
        inputs, outputs = policy.sizes[-2:]
        parameters[parameters.size - (inputs + 1) * outputs :] *= COLD
    return Agent(policy, parameters)


def uniform(n_observations: int, n_actions: int) -> Agent:
    """Return the agent that draws one of several discrete actions with equal probabilities.

    Examples
    --------
    >>> uniform(6, 3).parameters.any()
    np.False_
    """
    n_observations = integer("n_observations", n_observations, 1)
    n_actions = integer("n_actions", n_actions, 1)
    policy = Policy(np.array([n_observations, n_actions]), False, False, False, 1)
    return Agent(policy, np.zeros((n_observations + 1) * n_actions, np.float32))


def evaluation_streams(seed: int) -> tuple[int, np.random.Generator]:
    """Return what the environment is seeded with, and the stream of the policy.

    Examples
    --------
    >>> evaluation_streams(0)[0] == evaluation_streams(1)[0]
    False
    """
    seed = integer("seed", seed)
    environment, policy = np.random.SeedSequence(seed, spawn_key=SPAWN_KEY).spawn(2)
    return int(environment.generate_state(1)[0]), np.random.default_rng(policy)


def evaluate(
    env: EnvironmentLike,
    agent: Agent,
    *,
    seed: int,
    episodes: int,
    max_steps: int,
    limit: int | None = None,
    measures: Mapping[str, Measure] | None = None,
) -> pd.DataFrame:
    """Play episodes with a policy as it is.

    Parameters
    ----------
    env : str, gymnasium.Env or callable
        As for `rl_core.reinforce.reinforce`; the compiled tasks have no time limit of their own.
    agent : Agent
    seed : int
        The same seed gives the same starts to any agent, as long as the environment draws nothing
        after its `reset`.
    episodes : int
        How many.
    max_steps : int
        Where to stop an episode that has not ended.
    limit : int, optional
        A time limit, at most `max_steps`, under which the same episodes are counted as well.
    measures : mapping of str to callable, optional
        Further columns: `measure(observations, actions, rewards)` of the episode, with arrays of
        shape (T + 1, n_observations), (T, action_width) and (T,). Their names are not those of
        the other columns.

    Returns
    -------
    pandas.DataFrame
        One row an episode: `episode` (from 1), `steps`, `return` (undiscounted), `terminated`
        (false: stopped by `max_steps` or the environment's own time limit), and the measures. With
        a limit, `limited_steps`, `limited_return` and `limited_terminated`: what they would have
        been, had the episode been cut off there.

    Raises
    ------
    ValueError, TypeError
        If an argument is out of range, or the policy does not fit the environment.

    Examples
    --------
    >>> table = evaluate("MountainCar-v0", uniform(2, 3), seed=0, episodes=2, max_steps=50)
    >>> table["return"].tolist(), table["terminated"].tolist()
    ([-50.0, -50.0], [False, False])
    """
    seed, episodes, max_steps, limit = _checked(seed, episodes, max_steps, limit)
    instance("agent", agent, Agent, "an Agent")
    measures = _checked_measures(measures)
    environment_seed, rng = evaluation_streams(seed)
    with closing(open_world(env)) as world:
        check_fit(agent, world)
        world.seed(environment_seed)
        actor = likelihood.make_actor(*agent)
        trajectory = Trajectory(world.n_observations, agent.policy.action_width)
        rows = []
        for _ in range(episodes):
            steps, terminated = play_episode(world, actor, rng, max_steps, trajectory)
            _, actions, rewards = trajectory.first(steps)
            row = {"steps": steps, "return": rewards.sum(), "terminated": terminated}
            row["limited_return"] = rewards[: limit or max_steps].sum()
            for name, measure in measures.items():
                row[name] = measure(trajectory.observations[: steps + 1], actions, rewards)
            rows.append(row)
    return _table(pd.DataFrame(rows), limit)


def evaluate_table(
    world: GriddedTask,
    Q: NDArray[np.float64],
    *,
    seed: int,
    episodes: int,
    max_steps: int,
    limit: int | None = None,
) -> pd.DataFrame:
    """Play episodes with the greedy policy of a table, from the starts of `evaluate`.

    Parameters
    ----------
    world : GriddedTask
        See `rl_core.worlds.discretise.gridded`.
    Q : float64 array of shape `world.shape`
        Action values, without NaN. Of several largest ones, one is drawn.
    seed, episodes, max_steps, limit
        As for `evaluate`.

    Returns
    -------
    pandas.DataFrame
        As `evaluate` returns it.

    Raises
    ------
    ValueError
        If an argument is out of range, or Q is no array of the world's shape or has a NaN.

    Examples
    --------
    >>> from rl_core.worlds.discretise import gridded
    >>> world = gridded("MountainCar-v0", 10)
    >>> table = evaluate_table(world, np.zeros(world.shape), seed=0, episodes=1, max_steps=9)
    >>> table["steps"].item(), table["terminated"].item()
    (9, False)
    """
    seed, episodes, max_steps, limit = _checked(seed, episodes, max_steps, limit)
    instance("world", world, GriddedTask, "a GriddedTask (rl_core.worlds.discretise.gridded)")
    Q = floats("Q", Q, world.shape, finite=False)
    environment_seed, rng = evaluation_streams(seed)
    starts = np.random.default_rng(environment_seed)
    played = np.empty((episodes, 4))
    _play_table(world, Q, starts, rng, max_steps, limit or max_steps, played)
    table = pd.DataFrame(played, columns=["steps", "return", "terminated", "limited_return"])
    return _table(table.astype({"steps": int, "terminated": bool}), limit)


def _table(table: pd.DataFrame, limit: int | None) -> pd.DataFrame:
    """Number the episodes, and count them under the limit if there is one."""
    table.insert(0, "episode", np.arange(1, len(table) + 1))
    if limit is None:
        return table.drop(columns="limited_return")
    table["limited_steps"] = table["steps"].clip(upper=limit)
    table["limited_terminated"] = table["terminated"] & (table["steps"] <= limit)
    return table


@compiled
def _play_table(
    world: GriddedTask,
    Q: NDArray[np.float64],
    starts: np.random.Generator,
    rng: np.random.Generator,
    max_steps: int,
    limit: int,
    played: NDArray[np.float64],
) -> None:
    """Write steps, return, end and limited return of every episode."""
    for k in range(len(played)):
        s = start_gridded(world, starts)
        steps, total, limited, terminated = 0, 0.0, 0.0, False
        while steps < max_steps and not terminated:
            a = choose(EPSILON_GREEDY, 0.0, Q[s], rng.random(), rng.random())
            s, reward, terminated = step_gridded(world, a)
            total += reward
            limited += reward if steps < limit else 0.0
            steps += 1
        played[k, 0], played[k, 1] = steps, total
        played[k, 2], played[k, 3] = 1.0 if terminated else 0.0, limited


def _checked_measures(measures: Mapping[str, Measure] | None) -> Mapping[str, Measure]:
    """Return the measures if they are functions under names of their own."""
    if measures is None:
        return {}
    valid = isinstance(measures, Mapping) and all(callable(one) for one in measures.values())
    require(valid, "measures", measures, "a mapping of names to functions, or None")
    taken = sorted(set(measures) & set(COLUMNS))
    require(not taken, "measures", taken, f"under names other than {', '.join(COLUMNS)}")
    return measures


def _checked(
    seed: int, episodes: int, max_steps: int, limit: int | None
) -> tuple[int, int, int, int | None]:
    max_steps = integer("max_steps", max_steps, 1)
    if limit is not None:
        limit = integer("limit", limit, 1, max_steps)
    return integer("seed", seed), integer("episodes", episodes, 1), max_steps, limit


def check_fit(agent: Agent, world: World) -> None:
    """Raise unless an agent takes the observations of a world and puts out its actions.

    Raises
    ------
    ValueError
        If the number of inputs, the kind or number of actions, or of parameters is another.

    Examples
    --------
    >>> check_fit(uniform(2, 5), open_world("MountainCar-v0"))
    Traceback (most recent call last):
    ValueError: agent must be a categorical policy of 3 actions, got a categorical policy of 5
    """
    instance("agent", agent, Agent, "an Agent")
    instance("world", world, World, "a world that was opened")
    policy, parameters, _ = agent
    inputs = world.n_observations + policy.constant_feature
    sizes = policy.sizes.tolist()
    require(sizes[0] == inputs, "agent", sizes, f"a network of {inputs} inputs")
    if world.n_actions > 0:
        allowed = f"a categorical policy of {world.n_actions} actions"
        fits = not policy.gaussian and sizes[-1] == world.n_actions
    else:
        allowed = f"a Gaussian policy of {world.action_dimensions} components"
        fits = policy.gaussian and policy.action_width == world.action_dimensions
    if not fits:
        kind = "Gaussian" if policy.gaussian else "categorical"
        width = policy.action_width if policy.gaussian else sizes[-1]
        raise ValueError(f"agent must be {allowed}, got a {kind} policy of {width}")
    count = networks.count_parameters(sizes) + policy.gaussian * policy.action_width
    shape = np.shape(parameters)
    require(shape == (count,), "agent", shape, f"a policy with parameters of shape ({count},)")


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
    env: EnvironmentLike, agent: Agent, rng: np.random.Generator, max_steps: int
) -> Rollout:
    """Play one episode and keep all of it, for a picture or an animation.

    Parameters
    ----------
    env : str, Make, Task, gymnasium.Env or callable
        See `rl_core.worlds.environments.open_world`.
    agent : Agent
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
    >>> episode = rollout("MountainCar-v0", uniform(2, 3), np.random.default_rng(0), 100)
    >>> episode.observations.shape, episode.terminated
    ((101, 2), False)
    """
    instance("agent", agent, Agent, "an Agent")
    max_steps, rng = integer("max_steps", max_steps, 1), generator("rng", rng)
    environment_seed = int(rng.integers(2**32))
    with closing(open_world(env)) as world:
        check_fit(agent, world)
        world.seed(environment_seed)
        trajectory = Trajectory(world.n_observations, agent.policy.action_width)
        actor = likelihood.make_actor(*agent)
        steps, terminated = play_episode(world, actor, rng, max_steps, trajectory)
    return Rollout(
        trajectory.observations[: steps + 1],
        trajectory.actions[:steps],
        trajectory.rewards[:steps],
        terminated,
        environment_seed,
    )


def action_values(
    weights: Mapping[str, NDArray[np.float32]], observations: NDArray[np.floating]
) -> NDArray[np.float32]:
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
    weights: Mapping[str, NDArray[np.float32]],
    observations: NDArray[np.floating],
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
    >>> config = ReinforceConfig(network=MLP(()), policy=Gaussian(mean="direct"))
    >>> weights = {"layer0.weight": np.array([[1], [2]]), "log_sigma": np.zeros(1)}
    >>> mean_actions(config, weights, np.array([[1.0, 10.0]]))
    array([[21.]], dtype=float32)
    """
    instance("config", config, ReinforceConfig, "a ReinforceConfig")
    require(isinstance(config.policy, Gaussian), "policy", config.policy, "Gaussian(...)")
    policy, parameters, _ = as_learned(config, weights)
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
    points = integer("points", points, 2)
    axes = [np.linspace(*bounds, points) for bounds in zip(space.low, space.high, strict=True)]
    grid = np.meshgrid(*axes, indexing="ij")
    return np.stack(grid, axis=-1).reshape(-1, len(axes)).astype(np.float32)
