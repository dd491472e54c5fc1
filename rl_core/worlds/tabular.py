"""Worlds of finitely many states and actions, to be acted in one step at a time.

There are three kinds, with the same two verbs, `start` and `step`: an `MDP`, as arrays that
compiled code steps through (`Model`), a compiled task seen through a grid (`GriddedTask`), and any
discrete Gymnasium environment (`Played`). Given equal streams, an environment and its model behave
alike. A loop written with these verbs is plain Python for all kinds, and can be compiled for the
first two.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from operator import index
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numba.extending import overload

from rl_core.kernels.arrays import F64
from rl_core.kernels.compiled import compiled
from rl_core.kernels.model import Model
from rl_core.mdp import MDP
from rl_core.worlds.discretise import GriddedTask, cell
from rl_core.worlds.environments import EnvironmentLike, checked_reward, opened


class Draws(NamedTuple):
    """The random numbers of an agent in a world.

    Start states have a stream of their own, so that it does not matter to the transitions how many
    numbers a `reset` draws (the Maze's none, Gymnasium's toy-text environments one).
    """

    start: np.random.Generator
    step: np.random.Generator
    policy: np.random.Generator


def spawn_draws(seed: int, n: int) -> list[Draws]:
    """Spawn n independent sets of draws from `SeedSequence(seed)`.

    Each generator is the one that an environment's `reset(seed=number)` makes from the number
    drawn for it.

    Examples
    --------
    >>> from rl_core.worlds.tabular import spawn_draws
    >>> learning, evaluation = spawn_draws(0, 2)
    >>> learning.step.random() != evaluation.step.random()
    True
    """
    children = np.random.SeedSequence(seed).spawn(3 * n)
    numbers = [int(child.generate_state(1, np.uint64)[0]) for child in children]
    generators = [np.random.default_rng(number) for number in numbers]
    return [Draws(*generators[3 * i : 3 * i + 3]) for i in range(n)]


@dataclass
class Played:
    """An environment with Discrete spaces; its numbers are counted from 0 here.

    Attributes
    ----------
    env : gymnasium.Env
        The environment, wrapped or not.
    observations, actions : gymnasium.spaces.Discrete
        Its spaces.
    steps : int
        Steps of the episode so far.
    """

    env: gym.Env[Any, Any]
    observations: spaces.Discrete[Any]
    actions: spaces.Discrete[Any]
    steps: int = 0

    def __str__(self) -> str:
        return f"{self.env}, at step {self.steps} of an episode"


def played(env: EnvironmentLike) -> Played:
    """Open an environment, unless it is one already, and check that it is discrete.

    Raises
    ------
    TypeError, ValueError
        There is no such environment (`rl_core.worlds.environments.opened`), or a space is not
        Discrete.

    Examples
    --------
    >>> from rl_core.worlds.tabular import played
    >>> played("MountainCar-v0")
    Traceback (most recent call last):
    ValueError: env must have a Discrete observation space, got Box([-1.2  -0.07], [0.6  0.07], ...
    """
    made: Any = opened(env)
    for kind in ("observation", "action"):
        space = getattr(made, f"{kind}_space")
        if not isinstance(space, spaces.Discrete):
            if made is not env:
                made.close()
            raise ValueError(f"env must have a Discrete {kind} space, got {space}")
    return Played(made, made.observation_space, made.action_space)


def known_model(world: Played) -> MDP | None:
    """Return the environment's model, if it has one with its states (and one more for the end).

    Examples
    --------
    >>> from rl_core.worlds.tabular import known_model, played
    >>> known_model(played("FrozenLake-v1")).n_states
    16
    """
    try:
        model = MDP.from_env(world.env)
    except ValueError:
        return None
    n_states = int(world.observations.n)
    return model if model.n_states in (n_states, n_states + 1) else None


DiscreteWorld = Model | GriddedTask | Played


def start(world: DiscreteWorld, draws: Draws) -> int:
    """Begin an episode; return its start state."""
    return _VERBS[type(world)][0](world, draws)


def step(world: DiscreteWorld, s: int, a: int, draws: Draws) -> tuple[int, float, bool, bool]:
    """Take action a in the current state s; return s', r, terminated, truncated."""
    return _VERBS[type(world)][1](world, s, a, draws)


@compiled
def _start_on_model(model: Model, draws: Draws) -> int:
    """Draw a start state by one uniform."""
    return int(model.start_state[_slot(model.start_probability, draws.start.random())])


@compiled
def _step_on_model(model: Model, s: int, a: int, draws: Draws) -> tuple[int, float, bool, bool]:
    """Draw s' and r by one uniform. A terminal s' terminates; nothing truncates."""
    k = _slot(model.probability[s, a], draws.step.random())
    s_next = int(model.successor[s, a, k])
    return s_next, float(model.reward[s, a, k]), bool(model.terminal[s_next]), False


@compiled
def _slot(probability: F64, u: float) -> int:
    """Return the first slot whose cumulative probability exceeds u, as Gymnasium does."""
    cumulative = 0.0
    for k in range(len(probability)):
        cumulative += probability[k]
        if cumulative > u:
            return k
    return 0


@compiled
def _start_in_grid(world: GriddedTask, draws: Draws) -> int:
    """Draw the start of an episode as the environment's `reset` does; return its cell.

    The acrobot's first observation is here rounded as compiled code rounds a cosine, which may
    differ from numpy's in the last bit.
    """
    world.kernel.start(draws.start, world.kernel.state, world.observation)
    return cell(world.grid, world.observation)


@compiled
def _step_in_grid(
    world: GriddedTask, s: int, a: int, draws: Draws
) -> tuple[int, float, bool, bool]:
    """Take a step; nothing truncates."""
    r, terminated = world.kernel.step(world.kernel.state, world.actions[a])
    world.kernel.observe(world.kernel.state, world.observation)
    return cell(world.grid, world.observation), r, terminated, False


def _start_in_env(world: Played, draws: Draws) -> int:
    """Reset the environment; the draws take the place of its own generator."""
    base = world.env.unwrapped
    base.np_random = draws.start
    observation, _ = world.env.reset()
    world.steps = 0
    base.np_random = draws.step
    return _state(world, observation)


def _step_in_env(world: Played, s: int, a: int, draws: Draws) -> tuple[int, float, bool, bool]:
    world.steps += 1
    observation, r, terminated, truncated, _ = world.env.step(int(a + world.actions.start))
    s_next, r = _state(world, observation), checked_reward(world, r)
    return s_next, r, bool(terminated), bool(truncated)


def _state(world: Played, observation: Any) -> int:
    """Return a state's number, counted from 0; tables are indexed with it in compiled code."""
    try:
        state = index(observation) - int(world.observations.start)
    except TypeError:
        state = -1
    if not 0 <= state < world.observations.n:
        raise ValueError(
            f"env must keep to its observation space {world.observations}, from {world}, came "
            f"{observation!r}"
        )
    return state


# What the verbs mean is decided by the type of the world, in compiled code as well.
_VERBS: dict[type, tuple[Callable[..., int], Callable[..., tuple[int, float, bool, bool]]]] = {
    Model: (_start_on_model, _step_on_model),
    GriddedTask: (_start_in_grid, _step_in_grid),
    Played: (_start_in_env, _step_in_env),
}


@overload(start, strict=False)
def _compiled_start(world: Any, draws: Any) -> Any:
    kernel, _ = _VERBS[world.instance_class]
    return lambda world, draws: kernel(world, draws)


@overload(step, strict=False)
def _compiled_step(world: Any, s: Any, a: Any, draws: Any) -> Any:
    _, kernel = _VERBS[world.instance_class]
    return lambda world, s, a, draws: kernel(world, s, a, draws)
