"""Epsilon, the probability of a random action, and how it falls while a deep Q-network learns.

Epsilon is used as in the field. The 2018 report calls the probability of exploiting epsilon, so its
epsilon is 1 minus this one. (`rl_core.exploration` has the schedules of tabular Q-learning, which
go by the episode.)
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rl_core.kernels.compiled import compiled
from rl_core.policies import is_integer, is_number, require

VALUE, START, END, STEPS, SHARE, AIM = range(6)
"""Entries of the vector that holds the present state of a schedule."""


@dataclass(frozen=True)
class Decay:
    """Epsilon falls from `start` to `end` in equal steps, and stays there.

    At environment step t = 0, 1, ... of a seed it is

        start + (end - start) min(1, t / steps).

    Attributes
    ----------
    start, end : float
        From 0 to 1.
    steps : int
        Environment steps that the change takes, at least 1.

    Raises
    ------
    ValueError
        For any other value.

    Examples
    --------
    >>> state = initial(Decay(1.0, 0.1, steps=2))
    >>> after_step(state, 1)
    >>> float(state[VALUE])
    0.55
    """

    start: float = 1.0
    end: float = 0.05
    steps: int = 10_000

    def __post_init__(self) -> None:
        _check_ends(self.start, self.end)
        require(is_integer(self.steps, 1), "steps", self.steps, "a positive integer")


@dataclass(frozen=True)
class HalfWay:
    """The 2018 program's rule: epsilon jumps half-way, by events and not by time.

    It starts at `start`. After every episode that reached the goal it moves half-way to `end`, and
    half-way from there on is the mid-point aimed at next. At each copy of the target network it
    moves half-way to that mid-point. Before the first goal nothing changes.

    Attributes
    ----------
    start, end : float
        From 0 to 1. The program's exploitation probabilities 0.1 and 0.9 are 0.9 and 0.1 here.

    Raises
    ------
    ValueError
        For any other value.

    Examples
    --------
    >>> state = initial(HalfWay(0.9, 0.1))
    >>> after_copy(state)
    >>> float(state[VALUE])
    0.9
    >>> after_goal(state)
    >>> round(float(state[VALUE]), 6), round(float(state[AIM]), 6)
    (0.5, 0.3)
    >>> after_copy(state)
    >>> round(float(state[VALUE]), 6)
    0.4
    """

    start: float = 0.9
    end: float = 0.1

    def __post_init__(self) -> None:
        _check_ends(self.start, self.end)


Epsilon = float | Decay | HalfWay


def _check_ends(start: float, end: float) -> None:
    for name, value in (("start", start), ("end", end)):
        valid = is_number(value) and 0 <= value <= 1
        require(valid, f"epsilon.{name}", value, "a number from 0 to 1")


def initial(epsilon: Epsilon) -> NDArray[np.float64]:
    """Return the state in which a schedule begins: `VALUE` is epsilon itself.

    Parameters
    ----------
    epsilon : float, Decay or HalfWay

    Returns
    -------
    float64 array of shape (6,)

    Examples
    --------
    >>> initial(0.1)[VALUE]
    np.float64(0.1)
    """
    if isinstance(epsilon, Decay):
        entries = (epsilon.start, epsilon.start, epsilon.end, epsilon.steps, 0.0, epsilon.start)
    elif isinstance(epsilon, HalfWay):
        entries = (epsilon.start, epsilon.start, epsilon.end, 0, 0.5, epsilon.start)
    else:
        entries = (epsilon, epsilon, epsilon, 0, 0.0, epsilon)
    return np.array(entries, np.float64)


@compiled
def after_step(state: NDArray[np.float64], t: int) -> None:
    """Tell a schedule that t environment steps are over: `Decay` goes on.

    Parameters
    ----------
    state : float64 array of shape (6,)
        Of `initial`; changed in place.
    t : int
        Steps of the seed so far.

    Examples
    --------
    >>> state = initial(Decay(1.0, 0.0, steps=4))
    >>> after_step(state, 3)
    >>> state[VALUE]
    np.float64(0.25)
    """
    if state[STEPS] > 0.0:
        share = min(1.0, t / state[STEPS])
        state[VALUE] = state[START] + (state[END] - state[START]) * share


@compiled
def after_goal(state: NDArray[np.float64]) -> None:
    """Tell a schedule that an episode has reached its end by itself: `HalfWay` goes on.

    Parameters
    ----------
    state : float64 array of shape (6,)
        Of `initial`; changed in place.

    Examples
    --------
    >>> state = initial(HalfWay(1.0, 0.0))
    >>> after_goal(state)
    >>> state[VALUE]
    np.float64(0.5)
    """
    state[VALUE] += state[SHARE] * (state[END] - state[VALUE])
    state[AIM] = state[VALUE] + state[SHARE] * (state[END] - state[VALUE])


@compiled
def after_copy(state: NDArray[np.float64]) -> None:
    """Tell a schedule that the target network was copied: `HalfWay` goes to its mid-point.

    Parameters
    ----------
    state : float64 array of shape (6,)
        Of `initial`; changed in place.

    Examples
    --------
    >>> state = initial(HalfWay(1.0, 0.0))
    >>> after_goal(state)
    >>> after_copy(state)  # half-way from 0.5 to the mid-point 0.25
    >>> state[VALUE]
    np.float64(0.375)
    """
    state[VALUE] += state[SHARE] * (state[AIM] - state[VALUE])
