"""Worlds of finitely many states and actions, to be acted in one step at a time.

There are three kinds, with the same two verbs, `start` and `step`: an `MDP`, as arrays that
compiled code steps through (`Model`), a compiled task seen through a grid (`Binned`), and any
discrete Gymnasium environment (`Played`). Given equal streams, an environment and its model behave
alike. A loop written with these verbs is plain Python for all kinds, and can be compiled for the
first two.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numba.extending import overload
from numpy.typing import NDArray

from rl_core.discretise import Binned, start_binned, step_binned
from rl_core.kernels.compiled import compiled
from rl_core.mdp import MDP

Environment = str | gym.Env[Any, Any] | Callable[[], gym.Env[Any, Any]]
"""An id, an environment, or a function that makes one."""


class Streams(NamedTuple):
    """The random numbers of an agent in a world.

    Start states have a stream of their own, so that it does not matter to the transitions how many
    numbers a `reset` draws (the Maze's none, Gymnasium's toy-text environments one).
    """

    start: np.random.Generator
    step: np.random.Generator
    policy: np.random.Generator


def spawn_streams(seed: int, n: int) -> list[Streams]:
    """Spawn n independent sets of streams from `SeedSequence(seed)`.

    Each generator is the one that an environment's `reset(seed=number)` makes from the number
    drawn for it.

    Examples
    --------
    >>> learning, evaluation = spawn_streams(0, 2)
    >>> learning.step.random() != evaluation.step.random()
    True
    """
    children = np.random.SeedSequence(seed).spawn(3 * n)
    numbers = [int(child.generate_state(1, np.uint64)[0]) for child in children]
    generators = [np.random.default_rng(number) for number in numbers]
    return [Streams(*generators[3 * i : 3 * i + 3]) for i in range(n)]


class Model(NamedTuple):
    """An `MDP` as compiled code steps through it: with cumulative probabilities."""

    successor: NDArray[np.int32]
    cumulative: NDArray[np.float64]
    reward: NDArray[np.float64]
    terminal: NDArray[np.bool_]
    start_state: NDArray[np.int32]
    start_cumulative: NDArray[np.float64]


def model_arrays(mdp: MDP) -> Model:
    """Return the arrays of a model.

    Examples
    --------
    >>> from rl_core.maze import Maze
    >>> model_arrays(Maze().model()).cumulative[0, 0].tolist()
    [0.9, 1.0]
    """
    return Model(
        mdp.successor,
        np.cumsum(mdp.probability, axis=2),
        mdp.reward,
        mdp.terminal,
        mdp.start_state,
        np.cumsum(mdp.start_probability),
    )


class Played(NamedTuple):
    """An environment with Discrete spaces; its numbers are counted from 0 here.

    Attributes
    ----------
    env : gymnasium.Env
        The environment, wrapped or not.
    observations, actions : gymnasium.spaces.Discrete
        Its spaces.
    """

    env: gym.Env[Any, Any]
    observations: spaces.Discrete[Any]
    actions: spaces.Discrete[Any]


def played(env: Environment) -> Played:
    """Make an environment, unless it is one already, and check that it is discrete.

    Raises
    ------
    TypeError
        `env` is neither an environment nor an id nor a function that makes one.
    ValueError
        Gymnasium does not know the id, or a space is not Discrete.

    Examples
    --------
    >>> played("MountainCar-v0")
    Traceback (most recent call last):
    ValueError: env has the observation space Box([-1.2  -0.07], [0.6  0.07], (2,), float32); ...
    """
    made: object
    if isinstance(env, str):
        try:
            made = gym.make(env)
        except gym.error.Error as error:
            raise ValueError(
                f"env is {env!r}; allowed are ids that Gymnasium knows ({error})"
            ) from error
    else:
        made = env() if callable(env) else env
    if not isinstance(made, gym.Env):
        raise TypeError(
            f"env is {env!r}; allowed is an MDP, a gymnasium.Env, an id, or a function making one"
        )
    observations, actions = made.observation_space, made.action_space
    for name, space in (("observation", observations), ("action", actions)):
        if not isinstance(space, spaces.Discrete):
            raise ValueError(f"env has the {name} space {space}; allowed is a Discrete space")
    assert isinstance(observations, spaces.Discrete)
    assert isinstance(actions, spaces.Discrete)
    return Played(made, observations, actions)


def known_model(world: Played) -> MDP | None:
    """Return the environment's model, if it has one with its states (and one more for the end).

    Examples
    --------
    >>> known_model(played("FrozenLake-v1")).n_states
    16
    """
    try:
        model = MDP.from_env(world.env)
    except ValueError:
        return None
    n_states = int(world.observations.n)
    return model if model.n_states in (n_states, n_states + 1) else None


World = Model | Binned | Played


def opened(env: Environment | MDP | Binned) -> tuple[World, MDP | None, tuple[int, int]]:
    """Return the world to act in, its model if it has one, and its numbers of states and actions.

    Raises
    ------
    TypeError, ValueError
        See `played`.

    Examples
    --------
    >>> world, model, shape = opened("FrozenLake-v1")
    >>> type(world).__name__, shape
    ('Played', (16, 4))
    """
    if isinstance(env, MDP):
        return model_arrays(env), env, (env.n_states, env.n_actions)
    if isinstance(env, Binned):
        return env, None, env.shape
    world = played(env)
    return world, known_model(world), (int(world.observations.n), int(world.actions.n))


def start(world: World, streams: Streams) -> int:
    """Begin an episode; return its start state."""
    if isinstance(world, Played):
        return _start_in_env(world, streams)
    if isinstance(world, Binned):
        return start_binned(world, streams.start)
    return _start_on_model(world, streams)


def step(world: World, s: int, a: int, streams: Streams) -> tuple[int, float, bool, bool]:
    """Take action a in the current state s; return s', r, terminated, truncated."""
    if isinstance(world, Played):
        return _step_in_env(world, a)
    if isinstance(world, Binned):
        return _step_in_grid(world, a)
    return _step_on_model(world, s, a, streams)


@compiled
def _start_on_model(model: Model, streams: Streams) -> int:
    """Draw a start state by one uniform."""
    return int(model.start_state[_slot(model.start_cumulative, streams.start.random())])


@compiled
def _step_on_model(model: Model, s: int, a: int, streams: Streams) -> tuple[int, float, bool, bool]:
    """Draw s' and r by one uniform. A terminal s' terminates; nothing truncates."""
    k = _slot(model.cumulative[s, a], streams.step.random())
    s_next = int(model.successor[s, a, k])
    return s_next, float(model.reward[s, a, k]), bool(model.terminal[s_next]), False


@compiled
def _step_in_grid(world: Binned, a: int) -> tuple[int, float, bool, bool]:
    """Take a step; nothing truncates."""
    s_next, r, terminated = step_binned(world, a)
    return s_next, r, terminated, False


@compiled
def _slot(cumulative: NDArray[np.float64], u: float) -> int:
    """Return the first slot whose cumulative probability exceeds u, as Gymnasium does."""
    for k in range(len(cumulative)):
        if cumulative[k] > u:
            return k
    return 0


# What the verbs mean in compiled code is decided by the type of the world.
_starts: dict[type, Callable[..., int]] = {
    Model: lambda world, streams: _start_on_model(world, streams),
    Binned: lambda world, streams: start_binned(world, streams.start),
}
_steps: dict[type, Callable[..., tuple[int, float, bool, bool]]] = {
    Model: lambda world, s, a, streams: _step_on_model(world, s, a, streams),
    Binned: lambda world, s, a, streams: _step_in_grid(world, a),
}
overload(start)(lambda world, streams: _starts[world.instance_class])
overload(step)(lambda world, s, a, streams: _steps[world.instance_class])


def _start_in_env(world: Played, streams: Streams) -> int:
    """Reset the environment; the streams take the place of its own generator."""
    base = world.env.unwrapped
    base.np_random = streams.start
    observation, _ = world.env.reset()
    base.np_random = streams.step
    return int(observation - world.observations.start)


def _step_in_env(world: Played, a: int) -> tuple[int, float, bool, bool]:
    observation, r, terminated, truncated, _ = world.env.step(int(a + world.actions.start))
    return int(observation - world.observations.start), float(r), bool(terminated), bool(truncated)
