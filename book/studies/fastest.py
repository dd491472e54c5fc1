"""The fewest steps in which a mountain car can reach its goal, by planning on a fine grid.

The world is continuous and deterministic, and its exact optimum has no formula. It is approached in
two ways that share a grid of n x n points (position, velocity) but not their errors:

- *Values.* From a grid point, each push leads between grid points. If the next state is taken to be
  one of its four neighbours, with the weights of bilinear interpolation as probabilities, this is
  an `MDP`, and `value_iteration` solves it. Its values V are minus the steps to go.
- *Steps.* The policy that looks one step ahead, argmax_a V(s'), is then driven in the true
  dynamics. It needs whole steps, which a car really can do: never fewer than the optimum.

Both get closer to the optimum, and to each other, as n grows; how far they move from one grid to
the next tells how far to trust them.

Source: R. Munos and A. Moore (2002), Variable resolution discretization in optimal control.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rl_core.checks import floats, integer, one_of, require
from rl_core.kernels.compiled import compiled
from rl_core.mdp import MDP
from rl_core.planning import value_iteration
from rl_core.worlds.tasks import Kernel
from rl_core.worlds.twins import TASKS

PUSHES = np.array([-1.0, 0.0, 1.0])
"""Full force either way, or none: in the fastest way up there is no use for half of it."""

GAMMA = 0.99999
"""So near to 1 that discounting takes less than a tenth of a step off a hundred."""

TOLERANCE = 0.01
"""Error of the values, in steps."""

LOW, HIGH = (-1.2, -0.07), (0.6, 0.07)
MAX_STEPS = 10_000


class Fastest(NamedTuple):
    """What planning found.

    Attributes
    ----------
    points : int
        Grid points in each dimension.
    planned : float64 array of shape (starts,)
        Steps to the goal by the values, from each start.
    driven : float64 array of shape (starts,)
        Steps that the planned policy needs in the true dynamics; infinite if it gets nowhere.
    """

    points: int
    planned: NDArray[np.float64]
    driven: NDArray[np.float64]


def fastest(env: str, positions: NDArray[np.float64], *, points: int) -> Fastest:
    """Plan the fastest way to the goal.

    Parameters
    ----------
    env : str
        "MountainCar-v0" or "MountainCarContinuous-v0".
    positions : float64 array of shape (starts,)
        Where the car starts, at rest.
    points : int
        Grid points in each dimension, at least 2.

    Raises
    ------
    ValueError
        If an argument is not as described.

    Examples
    --------
    >>> found = fastest("MountainCarContinuous-v0", np.array([-0.5]), points=50)
    >>> found.driven.tolist()
    [66.0]
    """
    cars = ("MountainCar-v0", "MountainCarContinuous-v0")
    task, points = TASKS[one_of("env", env, cars)], integer("points", points, 2, 30_000)
    positions = floats("positions", positions, (None,))
    valid = bool(((positions >= LOW[0]) & (positions <= HIGH[0])).all())
    require(valid, "positions", positions, f"from {LOW[0]} to {HIGH[0]}")
    kernel = task.kernel()
    actions = (PUSHES if task.action_dimensions else PUSHES + 1).astype(np.float32)
    V = value_iteration(
        _model(kernel, actions, points), gamma=GAMMA, tolerance=TOLERANCE, progress=False
    ).V
    starts = np.column_stack([positions, np.zeros(len(positions))])
    values = np.array([_interpolated(V, points, *start) for start in starts])
    planned = np.log1p(values * (1 - GAMMA)) / math.log(GAMMA)
    driven = np.array([_drive(kernel, actions, V, points, start) for start in starts])
    return Fastest(points, planned, driven)


def _model(kernel: Kernel, actions: NDArray[np.float32], points: int) -> MDP:
    """Return the interpolated model; its last state is the goal."""
    goal = points * points
    shape = (goal + 1, len(actions), 4)
    successor, probability = np.full(shape, goal, np.int32), np.zeros(shape)
    probability[goal, :, 0] = 1.0
    _fill(kernel, actions, points, successor, probability)
    reward = np.full(shape, -1.0)
    reward[goal] = 0.0
    terminal = np.arange(goal + 1) == goal
    return MDP(successor, probability, reward, terminal, [0], [1.0])  # type: ignore[arg-type]


@compiled
def _fill(
    kernel: Kernel,
    actions: NDArray[np.float32],
    points: int,
    successor: NDArray[np.int32],
    probability: NDArray[np.float64],
) -> None:
    """Write where every grid point leads."""
    state = np.zeros(4)
    for s in range(points * points):
        for a in range(len(actions)):
            state[0] = LOW[0] + (HIGH[0] - LOW[0]) * (s // points) / (points - 1)
            state[1] = LOW[1] + (HIGH[1] - LOW[1]) * (s % points) / (points - 1)
            state[2] = 0.0
            _, arrived = kernel.step(state, actions[a : a + 1])
            if arrived:
                probability[s, a, 0] = 1.0
            else:
                _neighbours(points, state[0], state[1], successor[s, a], probability[s, a])


@compiled
def _neighbours(
    points: int,
    position: float,
    velocity: float,
    states: NDArray[np.int32],
    weights: NDArray[np.float64],
) -> None:
    """Write the four grid points around a state and their weights in bilinear interpolation."""
    x = (position - LOW[0]) / (HIGH[0] - LOW[0]) * (points - 1)
    y = (velocity - LOW[1]) / (HIGH[1] - LOW[1]) * (points - 1)
    i = min(max(int(x), 0), points - 2)
    j = min(max(int(y), 0), points - 2)
    u, w = min(max(x - i, 0.0), 1.0), min(max(y - j, 0.0), 1.0)
    for k in range(4):
        right, up = k // 2, k % 2
        states[k] = (i + right) * points + j + up
        weights[k] = (u if right else 1.0 - u) * (w if up else 1.0 - w)


@compiled
def _interpolated(V: NDArray[np.float64], points: int, position: float, velocity: float) -> float:
    """Value of any state."""
    states, weights = np.empty(4, np.int32), np.empty(4)
    _neighbours(points, position, velocity, states, weights)
    total = 0.0
    for k in range(4):
        total += weights[k] * V[states[k]]
    return total


@compiled
def _drive(
    kernel: Kernel,
    actions: NDArray[np.float32],
    V: NDArray[np.float64],
    points: int,
    start: NDArray[np.float64],
) -> float:
    """Steps to the goal in the true dynamics, each to where the values promise the most."""
    state, trial, best = np.zeros(4), np.empty(4), np.empty(4)
    state[:2] = start
    for t in range(MAX_STEPS):
        highest = -np.inf
        for a in range(len(actions)):
            trial[:] = state
            _, arrived = kernel.step(trial, actions[a : a + 1])
            if arrived:
                return t + 1.0
            value = _interpolated(V, points, trial[0], trial[1])
            if value > highest:
                highest = value
                best[:] = trial
        state[:] = best
    return np.inf
