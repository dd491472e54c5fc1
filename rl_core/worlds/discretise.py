"""A continuous world cut into cells, so that a table can hold its values.

Every observed number o_k is sorted into one of n_k bins of equal width between its bounds,

    i_k = floor(n_k (o_k - low_k) / (high_k - low_k)),   kept within 0 .. n_k - 1,

and the cell is i_1, ..., i_d read as one number, the last index running fastest. A continuous
action becomes one of a few levels, evenly spaced from its lower to its upper bound. The agent sees
the cell only. Below the surface the world stays what it was: two states in one cell may behave
differently, so that the cells are no Markov states, and a table can only be an approximation.

`Discretised` does this to any Gymnasium environment. `GriddedTask` is the same for a compiled task
(`rl_core.worlds.tasks`), and gives the same cells and rewards.

Source: R. S. Sutton and A. G. Barto, Reinforcement Learning: An Introduction (2018), section 9.3
and 9.5.3 (state aggregation; a single tiling).
"""

import math
from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike

from rl_core.checks import floats, instance, integer, integers, optional, require
from rl_core.kernels.arrays import F32, F64, I64
from rl_core.kernels.compiled import compiled
from rl_core.worlds.environments import (
    EnvironmentLike,
    checked_reward,
    native_action,
    observed,
    opened,
    task_of,
)
from rl_core.worlds.tasks import Kernel, Task

MAX_CELLS, MAX_ACTIONS = 2**31 - 1, 2**16


class Grid(NamedTuple):
    """Bins of equal width in every dimension; made by `make_grid`.

    Attributes
    ----------
    low, high : float64 arrays of shape (d,)
        Where the first bin begins and the last one ends. What lies outside falls into these two.
    bins : int64 array of shape (d,)
        Bins in every dimension.
    """

    low: F64
    high: F64
    bins: I64

    @property
    def n_cells(self) -> int:
        """The number of cells."""
        return math.prod(self.bins.tolist())


def make_grid(
    space: spaces.Space[Any],
    bins: int | Sequence[int],
    *,
    low: ArrayLike | None = None,
    high: ArrayLike | None = None,
) -> Grid:
    """Lay a grid over an observation space.

    Parameters
    ----------
    space : gymnasium.spaces.Box
        Flattened, if it has several axes.
    bins : int or sequence of int
        Bins in every dimension, or in each.
    low, high : array of shape (d,), optional
        Bounds to use instead of the space's, for example where these are infinite.

    Raises
    ------
    TypeError, ValueError
        If the space is no Box, a bound is infinite or the lower not below the upper, a number of
        bins is not a positive integer, there is not one for each dimension, or a table would have
        more than 2^31 - 1 cells.

    Examples
    --------
    >>> import numpy as np
    >>> from gymnasium import spaces
    >>> from rl_core.worlds.discretise import make_grid
    >>> space = spaces.Box(np.array([-1.2, -0.07]), np.array([0.6, 0.07]), dtype=np.float64)
    >>> make_grid(space, (3, 2)).n_cells
    6
    """
    require(isinstance(space, spaces.Box), "env's observation space", space, "a Box")
    assert isinstance(space, spaces.Box)
    d = math.prod(space.shape)
    bounds = []
    for name, given, own in (("low", low, space.low), ("high", high, space.high)):
        bound = floats(name, np.ravel(own) if given is None else given, (d,), finite=False)
        finite = np.isfinite(bound).all()
        require(finite, name, bound.tolist(), "finite in every dimension; give bounds to use")
        bounds.append(bound)
    with np.errstate(over="ignore"):
        width = bounds[1] - bounds[0]
    allowed = f"below high, {bounds[1].tolist()}, by a finite width"
    require(((width > 0) & (width < np.inf)).all(), "low", bounds[0].tolist(), allowed)
    numbers = checked_bins("bins", bins)
    numbers = (numbers,) * d if isinstance(numbers, int) else numbers
    require(len(numbers) == d, "bins", bins, f"a positive integer, or {d} of them")
    cells = math.prod(numbers)
    require(cells <= MAX_CELLS, "bins", bins, f"such that there are at most {MAX_CELLS} cells")
    return Grid(bounds[0], bounds[1], np.array(numbers, np.int64))


def checked_bins(name: str, bins: object) -> int | tuple[int, ...]:
    """Return a number of bins, or a tuple of them, each at least 1.

    Examples
    --------
    >>> from rl_core.worlds.discretise import checked_bins
    >>> checked_bins("bins", [10, 20])
    (10, 20)
    """
    if isinstance(bins, tuple | list | range) or (isinstance(bins, np.ndarray) and bins.ndim):
        require(len(bins) > 0, name, bins, "a positive integer, or one a dimension")
        return integers(name, bins, 1)
    return integer(name, bins, 1)


@compiled
def cell(grid: Grid, observation: F32) -> int:
    """Number of the cell that an observation falls into, from 0.

    An infinity falls into the last or the first bin, like any number beyond the bounds.

    Raises
    ------
    ValueError
        For NaN, which has no cell.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.worlds.discretise import Grid, cell
    >>> grid = Grid(np.array([0.0, 0.0]), np.array([1.0, 1.0]), np.array([2, 5]))
    >>> [cell(grid, np.array(o, np.float32)) for o in ((0.1, 0.3), (0.6, 0.3), (7.0, 7.0))]
    [1, 6, 9]
    """
    index = 0
    for k in range(observation.size):
        width = grid.high[k] - grid.low[k]
        x = grid.bins[k] * ((np.float64(observation[k]) - grid.low[k]) / width)
        if math.isnan(x):
            raise ValueError("env must keep to its spaces: NaN was observed, which has no cell")
        index = index * grid.bins[k] + int(min(max(x, 0.0), grid.bins[k] - 1.0))
    return index


def action_levels(space: spaces.Space[Any], levels: int | None) -> F32:
    """Actions to choose from: all of a Discrete space, or a grid over a Box.

    Parameters
    ----------
    space : gymnasium.spaces.Discrete or gymnasium.spaces.Box
        A Box has to be bounded.
    levels : int or None
        Levels of each component of a continuous action, at least 2; None for a Discrete space.

    Returns
    -------
    float32 array of shape (n_actions, width)
        Indices counted from 0, or all combinations of the levels.

    Raises
    ------
    TypeError, ValueError
        If the space is neither, not bounded, or `levels` does not go with it, or makes more than
        2^16 actions.

    Examples
    --------
    >>> from gymnasium import spaces
    >>> from rl_core.worlds.discretise import action_levels
    >>> action_levels(spaces.Box(-1, 1, (1,)), 3).ravel()
    array([-1.,  0.,  1.], dtype=float32)
    """
    if isinstance(space, spaces.Discrete):
        require(levels is None, "levels", levels, "None where actions are discrete")
        return np.arange(int(space.n), dtype=np.float32)[:, None]
    require(isinstance(space, spaces.Box), "env's action space", space, "Discrete or a Box")
    assert isinstance(space, spaces.Box)
    low, high = space.low.ravel(), space.high.ravel()
    bounded = np.isfinite([low, high]).all()
    require(bounded, "env's action space", space, "bounded")
    require(levels is not None, "levels", levels, "an integer from 2 where actions are a Box")
    levels = integer("levels", levels, 2)
    few = levels ** len(low) <= MAX_ACTIONS
    require(few, "levels", levels, f"such that there are at most {MAX_ACTIONS} actions")
    ticks = [np.linspace(a, b, levels) for a, b in zip(low, high, strict=True)]
    return np.array(list(product(*ticks)), np.float32)


class Discretised(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment whose observation is the number of a cell, and whose actions are numbered.

    It has a Discrete observation and a Discrete action space, so that tabular learners take it.
    Time limits and other wrappers below it stay in force.

    Parameters
    ----------
    env : str, gymnasium.Env or callable
        A Gymnasium id, an environment, or a function that makes one; with a Box observation space
        and a Discrete or bounded Box action space.
    bins, low, high
        See `make_grid`.
    levels : int or None
        See `action_levels`.

    Raises
    ------
    TypeError, ValueError
        If an argument is not as described.

    Examples
    --------
    >>> from rl_core.worlds.discretise import Discretised
    >>> env = Discretised("MountainCarContinuous-v0", bins=20, levels=3)
    >>> env.observation_space, env.action_space
    (Discrete(400), Discrete(3))
    >>> observation, _ = env.reset(seed=0)
    >>> divmod(observation, 20)
    (8, 10)
    """

    def __init__(
        self,
        env: EnvironmentLike,
        bins: int | Sequence[int],
        *,
        levels: int | None = None,
        low: ArrayLike | None = None,
        high: ArrayLike | None = None,
    ) -> None:
        made = opened(env)
        self.grid = make_grid(made.observation_space, bins, low=low, high=high)
        self.levels = action_levels(made.action_space, levels)
        self._steps = 0
        super().__init__(made)
        self.observation_space = spaces.Discrete(self.grid.n_cells)
        self.action_space = spaces.Discrete(len(self.levels))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[int, dict[str, Any]]:
        """Begin an episode; see `gymnasium.Env.reset`."""
        optional("options", options, instance, dict, "a dict")
        seed = optional("seed", seed, integer)
        observation, info = self.env.reset(seed=seed, options=options)
        self._steps = 0
        return self._cell(observation), info

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        """Take the action of this number; see `gymnasium.Env.step`."""
        chosen = self.levels[integer("action", action, 0, len(self.levels) - 1)]
        taken = native_action(self.env.action_space, chosen)
        self._steps += 1
        observation, reward, terminated, truncated, info = self.env.step(taken)
        reward = checked_reward(self._where(), reward)
        return self._cell(observation), reward, terminated, truncated, info

    def _cell(self, observation: Any) -> int:
        """Number the cell."""
        space = self.env.observation_space
        seen = observed(space, observation, self._where())
        if np.isnan(seen).any():
            raise ValueError(
                f"env must keep to its observation space {space}, from {self._where()}, came "
                f"{observation!r}, which has no cell"
            )
        with np.errstate(over="ignore"):
            return int(cell(self.grid, seen.ravel().astype(np.float32)))

    def _where(self) -> str:
        return f"{self.env}, at step {self._steps} of an episode"


class GriddedTask(NamedTuple):
    """A compiled task seen through a grid: what `Discretised` makes of it, without time limit.

    Attributes
    ----------
    kernel : Kernel
        The task, with its state.
    grid : Grid
    actions : float32 array of shape (n_actions, width)
        What the task's `step` takes.
    observation : float32 array of shape (d,)
        What would be seen of it; overwritten.
    max_steps : int
        The task's own time limit; 0 where it has none.
    """

    kernel: Kernel
    grid: Grid
    actions: F32
    observation: F32
    max_steps: int

    @property
    def shape(self) -> tuple[int, int]:
        """Cells and actions."""
        return self.grid.n_cells, len(self.actions)


def gridded(
    env: str | Task, bins: int | Sequence[int], *, levels: int | None = None
) -> GriddedTask:
    """Lay a grid over a compiled task.

    Parameters
    ----------
    env : str or Task
        An id of `rl_core.worlds.twins.TASKS`, the import path of a task, or a task.
    bins, levels
        As for `Discretised`.

    Raises
    ------
    TypeError, ValueError
        If an argument is not as described.

    Examples
    --------
    >>> from rl_core.worlds.discretise import gridded
    >>> gridded("MountainCar-v0", bins=10).shape
    (100, 3)
    """
    task: Task = instance("env", task_of(env) or env, Task, "a compiled task")
    grid = make_grid(task.observation_space, bins)
    actions = action_levels(task.action_space, levels)
    seen = np.zeros(task.n_observations, np.float32)
    return GriddedTask(task.kernel(), grid, actions, seen, task.max_episode_steps or 0)
