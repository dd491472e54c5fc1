"""What a trained Q-network does: its values, its greedy action anywhere, and whole episodes.

Weights are those of one seed by name, as `rl_core.rollouts.weights_of` takes them out of a run.
Nothing is learned here.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rl_core import dynamics, networks
from rl_core.episodes import EnvironmentLike
from rl_core.kernels.compiled import compiled
from rl_core.policies import is_integer, is_number, require
from rl_core.q_episodes import CompiledWorld, GymnasiumWorld, open_world
from rl_core.q_update import epsilon_greedy
from rl_core.rollouts import Rollout, Weights


def action_values(weights: Weights, observations: NDArray[np.floating]) -> NDArray[np.float32]:
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
    observations = np.asarray(observations)
    fits = observations.ndim == 2 and observations.shape[1] == sizes[0]
    allowed = f"an array whose shape is (n, {sizes[0]}), for this network"
    require(fits, "observations", observations.shape, allowed)
    return networks.output(sizes, parameters, observations)


class Evaluation(NamedTuple):
    """What is told of many episodes.

    Attributes
    ----------
    steps : int64 array of shape (episodes,)
    returns : float64 array of shape (episodes,)
        Undiscounted, of the environment's own rewards.
    terminated : bool array of shape (episodes,)
        False: stopped at `max_steps`, or truncated by the environment.
    """

    steps: NDArray[np.int64]
    returns: NDArray[np.float64]
    terminated: NDArray[np.bool_]


@compiled
def _play(
    code: int,
    state: NDArray[np.float64],
    observation: NDArray[np.float32],
    sizes: NDArray[np.int64],
    parameters: NDArray[np.float32],
    epsilon: float,
    rng: np.random.Generator,
    max_steps: int,
    observations: NDArray[np.float32],
    actions: NDArray[np.float32],
    rewards: NDArray[np.float64],
) -> tuple[int, float, bool]:
    """Play an episode of a compiled task, and keep as many of its first steps as there is room."""
    units, action = np.empty(sizes.sum(), np.float32), np.empty(1, np.float32)
    total, room = 0.0, len(rewards)
    for t in range(max_steps):
        u, v = rng.random(), rng.random()
        action[0] = epsilon_greedy(sizes, parameters, epsilon, observation, u, v, units)
        reward, terminated = dynamics.step(code, state, action)
        dynamics.observe(code, state, observation)
        total += reward
        if t < room:
            observations[t + 1] = observation
            actions[t, 0] = action[0]
            rewards[t] = reward
        if terminated:
            return t + 1, total, True
    return max_steps, total, False


def evaluate(
    env: EnvironmentLike,
    weights: Weights,
    rng: np.random.Generator,
    *,
    episodes: int,
    max_steps: int,
    epsilon: float = 0.0,
) -> Evaluation:
    """Play many episodes with given weights, greedily or epsilon-greedily.

    Parameters
    ----------
    env : str, gymnasium.Env or callable
        As for `rl_core.dqn.dqn`: the compiled tasks take well under a microsecond a step.
    weights : mapping of str to array
        Of one seed.
    rng : numpy.random.Generator
        Draws the environment's seed, then the actions.
    episodes, max_steps : int
        How many episodes, and where to stop one that has not ended.
    epsilon : float
        Probability of a random action; 0: greedy.

    Returns
    -------
    Evaluation

    Raises
    ------
    TypeError
        If `rng` is not a numpy.random.Generator.
    ValueError
        If an argument is out of range, or the weights do not fit the environment.

    Examples
    --------
    >>> weights = {"layer0.weight": np.array([[0, 0, 0], [-1, 0, 1]], np.float32)}  # with the speed
    >>> found = evaluate(
    ...     "MountainCar-v0", weights, np.random.default_rng(0), episodes=100, max_steps=1000
    ... )
    >>> bool(found.terminated.all()), bool(found.steps.max() < 200)
    (True, True)
    """
    require(is_integer(episodes, 1), "episodes", episodes, "a positive integer")
    _check(rng, max_steps, epsilon)
    sizes, parameters = networks.pack(weights)
    world = _open(env, sizes)
    world.seed(int(rng.integers(2**32)))
    try:
        played = [
            _episode(world, sizes, parameters, rng, max_steps, epsilon, room=0)[1:]
            for _ in range(episodes)
        ]
    finally:
        world.close()
    steps, totals, terminated = zip(*played, strict=True)
    return Evaluation(np.array(steps), np.array(totals), np.array(terminated))


def q_rollout(
    env: EnvironmentLike,
    weights: Weights,
    rng: np.random.Generator,
    max_steps: int,
    epsilon: float = 0.0,
) -> Rollout:
    """Play one episode with given weights and keep all of it, for a picture or an animation.

    Parameters
    ----------
    env, weights, rng, max_steps, epsilon
        As for `evaluate`.

    Returns
    -------
    rl_core.rollouts.Rollout

    Raises
    ------
    TypeError, ValueError
        As for `evaluate`.

    Examples
    --------
    >>> weights = {"layer0.weight": np.zeros((2, 3), np.float32)}
    >>> episode = q_rollout("MountainCar-v0", weights, np.random.default_rng(0), 100)
    >>> episode.observations.shape, episode.terminated
    ((101, 2), False)
    """
    _check(rng, max_steps, epsilon)
    sizes, parameters = networks.pack(weights)
    world = _open(env, sizes)
    environment_seed = int(rng.integers(2**32))
    world.seed(environment_seed)
    try:
        kept, steps, _, terminated = _episode(
            world, sizes, parameters, rng, max_steps, epsilon, room=max_steps
        )
    finally:
        world.close()
    observations, actions, rewards = kept
    return Rollout(
        observations[: steps + 1], actions[:steps], rewards[:steps], terminated, environment_seed
    )


_Kept = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64]]


def _check(rng: object, max_steps: int, epsilon: float) -> None:
    if not isinstance(rng, np.random.Generator):
        raise TypeError(f"rng must be a numpy.random.Generator, got {rng!r}")
    require(is_integer(max_steps, 1), "max_steps", max_steps, "a positive integer")
    valid = is_number(epsilon) and 0 <= epsilon <= 1
    require(valid, "epsilon", epsilon, "a number from 0 to 1")


def _open(env: EnvironmentLike, sizes: tuple[int, ...]) -> CompiledWorld | GymnasiumWorld:
    world = open_world(env)
    if (sizes[0], sizes[-1]) != (world.n_observations, world.n_actions):
        world.close()
        allowed = f"of a network with {world.n_observations} inputs and {world.n_actions} outputs"
        require(False, "weights", sizes, allowed)
    return world


def _episode(
    world: CompiledWorld | GymnasiumWorld,
    sizes: tuple[int, ...],
    parameters: NDArray[np.float32],
    rng: np.random.Generator,
    max_steps: int,
    epsilon: float,
    room: int,
) -> tuple[_Kept, int, float, bool]:
    """Play an episode: its first `room` steps, and its steps, return and whether it terminated."""
    widths = np.array(sizes)
    observations = np.empty((room + 1, sizes[0]), np.float32)
    actions, rewards = np.empty((room, 1), np.float32), np.empty(room)
    if isinstance(world, CompiledWorld):
        state, observation = world.reset()
        observations[0] = observation
        told = _play(
            world.code,
            state,
            observation,
            widths,
            parameters,
            float(epsilon),
            rng,
            max_steps,
            observations,
            actions,
            rewards,
        )
        return (observations, actions, rewards), *told
    observation = world.reset()
    observations[0] = observation
    units, total = np.empty(widths.sum(), np.float32), 0.0
    for t in range(max_steps):
        u, v = rng.random(2)
        action = epsilon_greedy(widths, parameters, float(epsilon), observation, u, v, units)
        observation, reward, terminated, truncated = world.step(action)
        total += reward
        if t < room:
            observations[t + 1], actions[t, 0], rewards[t] = observation, action, reward
        if terminated or truncated:
            return (observations, actions, rewards), t + 1, total, terminated
    return (observations, actions, rewards), max_steps, total, False
