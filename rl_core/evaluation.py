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
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from rl_core import networks
from rl_core.discretise import Binned, start_binned, step_binned
from rl_core.episodes import EnvironmentLike, Trajectory, check_fit, open_environment
from rl_core.exploration import EPSILON_GREEDY, choose
from rl_core.kernels.compiled import compiled
from rl_core.policies import Policy, is_integer, require
from rl_core.reinforce import ReinforceConfig
from rl_core.rollouts import policy_of

SPAWN_KEY = (1_000,)
"""Names the streams of evaluation among a seed's; learners use small numbers."""

COLD = np.float32(2.0**40)
"""1 / T of a greedy policy. A power of two, so that it rounds nothing."""

COLUMNS = (
    *("episode", "steps", "return", "terminated"),
    *("limited_steps", "limited_return", "limited_terminated"),
)
"""The columns of a table of evaluation, besides the measures."""

Measure = Callable[[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64]], float]
"""Observations, actions and rewards of an episode to a number."""


class Agent(NamedTuple):
    """A stochastic policy with its parameters, see `rl_core.policies`.

    Attributes
    ----------
    policy : Policy
    parameters : float32 array of shape (P,)
    """

    policy: Policy
    parameters: NDArray[np.float32]


def as_learned(config: ReinforceConfig, weights: Mapping[str, NDArray[np.float32]]) -> Agent:
    """Return the stochastic policy that REINFORCE has learned.

    Parameters
    ----------
    config : ReinforceConfig
        Of the run that made the weights.
    weights : mapping of str to array
        Of one seed, as `rl_core.rollouts.weights_of` gives them.

    Raises
    ------
    ValueError
        As `rl_core.rollouts.policy_of`.

    Examples
    --------
    >>> weights = {"layer0.weight": np.zeros((2, 3), np.float32)}
    >>> as_learned(ReinforceConfig(hidden=()), weights).policy.sizes
    array([2, 3])
    """
    return Agent(*policy_of(config, weights))


def of_values(weights: Mapping[str, NDArray[np.float32]]) -> Agent:
    """Return the greedy policy of a network that puts out one action value an action.

    Examples
    --------
    >>> agent = of_values({"layer0.weight": np.array([[1, 2]], np.float32)})
    >>> agent.parameters[:2] / COLD
    array([1., 2.], dtype=float32)
    """
    sizes, parameters = networks.pack(weights)
    return greedy(Agent(Policy(np.array(sizes), False, False, False, 1), parameters))


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
    policy = Policy(np.array([n_observations, n_actions]), False, False, False, 1)
    return Agent(policy, np.zeros((n_observations + 1) * n_actions, np.float32))


def evaluation_streams(seed: int) -> tuple[int, np.random.Generator]:
    """Return what the environment is seeded with, and the stream of the policy.

    Examples
    --------
    >>> evaluation_streams(0)[0] == evaluation_streams(1)[0]
    False
    """
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
    _check(seed, episodes, max_steps, limit)
    require(isinstance(agent, Agent), "agent", agent, "an Agent")
    measures = _checked_measures(measures)
    policy, parameters = agent
    environment_seed, rng = evaluation_streams(seed)
    environment = open_environment(env)
    try:
        check_fit(policy, parameters, environment, "agent")
        environment.seed(environment_seed)
        trajectory = Trajectory(environment.n_observations, policy.action_width)
        rows = []
        for _ in range(episodes):
            steps, terminated = environment.play(policy, parameters, rng, max_steps, trajectory)
            _, actions, rewards = trajectory.first(steps)
            row = {"steps": steps, "return": rewards.sum(), "terminated": terminated}
            row["limited_return"] = rewards[: limit or max_steps].sum()
            for name, measure in measures.items():
                row[name] = measure(trajectory.observations[: steps + 1], actions, rewards)
            rows.append(row)
    finally:
        environment.close()
    return _table(pd.DataFrame(rows), limit)


def evaluate_table(
    world: Binned,
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
    world : Binned
        See `rl_core.discretise.binned`.
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
    >>> from rl_core.discretise import binned
    >>> world = binned("MountainCar-v0", 10)
    >>> table = evaluate_table(world, np.zeros(world.shape), seed=0, episodes=1, max_steps=9)
    >>> table["steps"].item(), table["terminated"].item()
    (9, False)
    """
    _check(seed, episodes, max_steps, limit)
    require(isinstance(world, Binned), "world", world, "a Binned")
    require(isinstance(Q, np.ndarray), "Q", Q, "an array of numbers")
    require(Q.shape == world.shape, "Q", Q.shape, f"of shape {world.shape}")
    require(Q.dtype.kind in "fiu", "Q", Q.dtype, "an array of numbers")
    unknown = int(np.isnan(Q).sum())
    require(unknown == 0, "Q", f"{unknown} of them", "without NaN")
    Q = Q.astype(np.float64)
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
    world: Binned,
    Q: NDArray[np.float64],
    starts: np.random.Generator,
    rng: np.random.Generator,
    max_steps: int,
    limit: int,
    played: NDArray[np.float64],
) -> None:
    """Write steps, return, end and limited return of every episode."""
    for k in range(len(played)):
        s = start_binned(world, starts)
        steps, total, limited, terminated = 0, 0.0, 0.0, False
        while steps < max_steps and not terminated:
            a = choose(EPSILON_GREEDY, 0.0, Q[s], rng.random(), rng.random())
            s, reward, terminated = step_binned(world, a)
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


def _check(seed: int, episodes: int, max_steps: int, limit: int | None) -> None:
    require(is_integer(seed, 0), "seed", seed, "an integer from 0")
    require(is_integer(episodes, 1), "episodes", episodes, "a positive integer")
    require(is_integer(max_steps, 1), "max_steps", max_steps, "a positive integer")
    valid = limit is None or (is_integer(limit, 1) and limit <= max_steps)
    require(valid, "limit", limit, f"None or an integer from 1 to max_steps ({max_steps})")
