"""Exploration: how actions are picked while a learner learns, and how that changes.

A rule is a small frozen object. Its parameter, and a step size, is a number or a schedule, by the
episode or by the environment step. The same rules and schedules serve tables and networks. Every
decision takes two uniforms u and v in [0, 1), so that the random stream of one rule lines up with
that of another.

Epsilon is used as in the field: the probability of a uniformly random action. (The 2018 report
calls the probability of exploiting epsilon, so its epsilon is 1 minus this one.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Literal

import numpy as np

from rl_core.checks import fields, instance, integer, number, optional, positive, require
from rl_core.kernels.arrays import F64
from rl_core.kernels.choices import EPSILON_GREEDY, SOFTMAX, UNNORMALISED_SOFTMAX

SHARE = partial(number, high=1, above=0)
"""The check of a share: above 0, at most 1."""


@dataclass(frozen=True)
class Linear:
    """A value that goes from `start` to `end` in equal steps, and stays there.

    It is start + (end - start) min(1, t / duration), where t counts from 0 the episodes or the
    environment steps of a seed, whichever the duration is given in.

    Attributes
    ----------
    start, end : float
        The first value and the last.
    episodes, steps : int or None
        The duration, at least 1: one of the two.

    Raises
    ------
    TypeError, ValueError
        An attribute is not as described.

    Examples
    --------
    >>> from rl_core.exploration import Linear
    >>> Linear(0.9, 0.1, episodes=4).values(6).round(3).tolist()
    [0.9, 0.7, 0.5, 0.3, 0.1, 0.1]
    >>> Linear(1.0, 0.1, steps=10_000).steps
    10000
    """

    start: float
    end: float
    episodes: int | None = None
    steps: int | None = None

    def __post_init__(self) -> None:
        lengths = {"episodes": (optional, integer, 1), "steps": (optional, integer, 1)}
        fields(self, start=(number,), end=(number,), **lengths)
        given = (self.episodes, self.steps)
        require(given.count(None) == 1, "episodes, steps", given, "one of them a number, one None")

    def values(self, episodes: int) -> F64:
        """Return the values of the first `episodes` episodes, float64 of shape (episodes,)."""
        allowed = "an integer where values are asked for by the episode"
        duration: int = instance("episodes", self.episodes, int, allowed)
        share = np.minimum(1.0, np.arange(integer("episodes", episodes)) / duration)
        course = (1.0 - share) * self.start + share * self.end
        course[duration:] = self.end  # and in range, where rounding would leave it
        low, high = sorted((self.start, self.end))
        return np.clip(course, low, high)


@dataclass(frozen=True)
class HalfWay:
    """The 2018 program's rule for DQN: epsilon jumps half-way, by events and not by time.

    It starts at `start`. After every episode that reached the goal it moves half-way to `end`, and
    half-way from there on is the mid-point aimed at next. At each copy of the target network it
    moves half-way to that mid-point. Before the first goal nothing changes.

    Attributes
    ----------
    start, end : float
        From 0 to 1. The program's exploitation probabilities 0.1 and 0.9 are 0.9 and 0.1 here.

    Raises
    ------
    TypeError, ValueError
        For any other value.

    Examples
    --------
    >>> from rl_core.exploration import HalfWay, schedule_state
    >>> from rl_core.kernels.choices import AIM, VALUE, after_copy, after_goal
    >>> state = schedule_state(HalfWay(0.9, 0.1))
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
        fields(self, start=(number, 0, 1), end=(number, 0, 1))


Epsilon = float | Linear | HalfWay
"""Epsilon of a deep Q-network: constant, by the environment step, or by events."""


def schedule_state(epsilon: Epsilon) -> F64:
    """Return the state in which a schedule of epsilon begins; see `rl_core.kernels.choices`.

    Returns
    -------
    float64 array of shape (6,)

    Examples
    --------
    >>> from rl_core.exploration import schedule_state
    >>> float(schedule_state(0.1)[0])
    0.1
    """
    epsilon = check_epsilon("epsilon", epsilon)
    start, end = (getattr(epsilon, name, epsilon) for name in ("start", "end"))
    share = 0.5 if isinstance(epsilon, HalfWay) else 0.0
    return np.array([start, start, end, getattr(epsilon, "steps", 0), share, start], np.float64)


def check_epsilon(name: str, value: object) -> Epsilon:
    """Return epsilon of a deep Q-network if it is one.

    Examples
    --------
    >>> from rl_core.exploration import Linear, check_epsilon
    >>> check_epsilon("epsilon", Linear(1, 0, episodes=5))
    Traceback (most recent call last):
    ValueError: epsilon must be a schedule given in steps, got Linear(start=1.0, ...
    """
    if isinstance(value, HalfWay):
        return value
    checked: Epsilon = parameter_of(name, value, partial(number, low=0, high=1), "steps")
    return checked


@dataclass(frozen=True)
class VisitDecay:
    """A step size that shrinks with use.

    At the n-th update of an entry it is

        alpha_n = initial / n ** exponent.

    With an exponent above 1/2 and up to 1 the sum of alpha_n diverges and that of its squares does
    not, so Q converges to Q* wherever it is visited for ever (Robbins & Monro 1951).

    Attributes
    ----------
    initial : float or Linear
        In (0, 1].
    exponent : float
        Above 0, at most 1.

    Raises
    ------
    TypeError, ValueError
        An attribute is not as described.

    Examples
    --------
    >>> from rl_core.exploration import VisitDecay
    >>> VisitDecay(initial=1.0, exponent=0.6)
    VisitDecay(initial=1.0, exponent=0.6)
    """

    initial: float | Linear = 1.0
    exponent: float = 0.6

    def __post_init__(self) -> None:
        fields(self, initial=(parameter_of, SHARE), exponent=(SHARE,))


@dataclass(frozen=True)
class EpsilonGreedy:
    """With probability epsilon a uniformly random action, otherwise a greedy one.

    Among several greedy actions one is drawn uniformly (Sutton & Barto, section 2.2). If u is below
    epsilon the action is random; v picks it, from all actions or from the greedy ones.

    Attributes
    ----------
    epsilon : float or Linear
        In [0, 1]. 1 minus the report's epsilon.

    Raises
    ------
    TypeError, ValueError
        `epsilon` is not as described.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.exploration import EpsilonGreedy
    >>> from rl_core.kernels.choices import choose
    >>> rule = EpsilonGreedy(epsilon=0.1)
    >>> q = np.array([0.0, 2.0, 2.0, 1.0])
    >>> [choose(rule.kind, rule.epsilon, q, u, v) for u, v in ((0.5, 0.2), (0.5, 0.9), (0.0, 0.9))]
    [1, 2, 3]
    """

    kind: ClassVar[int] = EPSILON_GREEDY
    epsilon: float | Linear = 0.1

    def __post_init__(self) -> None:
        fields(self, epsilon=(parameter_of, partial(number, low=0, high=1)))

    @property
    def parameter(self) -> float | Linear:
        """Epsilon."""
        return self.epsilon


@dataclass(frozen=True)
class Softmax:
    """Action a with probability exp(Q(s, a) / T) / sum_b exp(Q(s, b) / T), with temperature T.

    Sutton & Barto, section 2.8 and 13.1 (soft-max in action preferences). u picks the action; v is
    not used.

    Attributes
    ----------
    temperature : float or Linear
        Above 0, in units of the return. The lower, the greedier.

    Raises
    ------
    TypeError, ValueError
        `temperature` is not as described.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.exploration import Softmax
    >>> from rl_core.kernels.choices import choose
    >>> rule = Softmax(temperature=0.5)
    >>> q = np.array([0.0, 0.5 * np.log(3)])  # probabilities 1/4 and 3/4
    >>> [choose(rule.kind, rule.temperature, q, u, 0.0) for u in (0.24, 0.26)]
    [0, 1]
    """

    kind: ClassVar[int] = SOFTMAX
    temperature: float | Linear = 1.0

    def __post_init__(self) -> None:
        fields(self, temperature=(parameter_of, positive))

    @property
    def parameter(self) -> float | Linear:
        """The temperature."""
        return self.temperature


@dataclass(frozen=True)
class UnnormalisedSoftmax:
    """The 2018 program's faulty softmax, kept to show what it does; not for use.

    It weighs action a with w(a) = exp(Q(s, a)) / sum_b Q(s, b): the divisor is the sum of the
    values where it should be the sum of the exponentials, so the weights do not sum to 1. How the
    program drew from them is not known. Here they are taken at their word, as cumulative
    probabilities: the first action whose w(0) + ... + w(a) exceeds u, and action 0 if there is
    none, as Gymnasium's toy-text environments sample. In a state where all values are 0 the weights
    are infinite and the action is always 0. v is not used.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.exploration import UnnormalisedSoftmax
    >>> from rl_core.kernels.choices import choose
    >>> kind = UnnormalisedSoftmax().kind
    >>> choose(kind, 1.0, np.zeros(4), 0.99, 0.0)
    0
    >>> q = np.array([1.0, 1.1, 1.2, 0.9])  # weights 0.65, 0.72, ...: the others are never drawn
    >>> sorted({choose(kind, 1.0, q, u, 0.0) for u in np.linspace(0, 0.999, 50)})
    [0, 1]
    """

    kind: ClassVar[int] = UNNORMALISED_SOFTMAX
    parameter: ClassVar[float] = 1.0  # not used


ExplorationRule = EpsilonGreedy | Softmax | UnnormalisedSoftmax


@dataclass(frozen=True)
class Trials:
    """When and how the greedy policy is tried out. The defaults are the course's.

    Attributes
    ----------
    every : int
        After every so many episodes of learning.
    episodes : int
        Episodes played, in which nothing is learned.
    max_steps : int
        Cap on their length.
    epsilon : float
        They are played epsilon-greedily with this probability of a random action, in [0, 1].

    Raises
    ------
    TypeError, ValueError
        An attribute is not as described.

    Examples
    --------
    >>> from rl_core.exploration import Trials
    >>> Trials(every=100, epsilon=0)
    Trials(every=100, episodes=10, max_steps=100, epsilon=0.0)
    """

    every: int = 50
    episodes: int = 10
    max_steps: int = 100
    epsilon: float = 0.05

    def __post_init__(self) -> None:
        counts = dict.fromkeys(("every", "episodes", "max_steps"), (integer, 1))
        fields(self, epsilon=(number, 0, 1), **counts)


def values(parameter: float | Linear, episodes: int) -> F64:
    """Return a parameter's value in each of the first `episodes` episodes.

    Examples
    --------
    >>> from rl_core.exploration import Linear, values
    >>> values(0.5, 3).tolist(), values(Linear(1, 0, episodes=2), 3).tolist()
    ([0.5, 0.5, 0.5], [1.0, 0.5, 0.0])
    """
    if isinstance(parameter, Linear):
        return parameter.values(episodes)
    return np.full(integer("episodes", episodes), number("parameter", parameter))


def parameter_of(
    name: str, value: object, check: Any, unit: Literal["episodes", "steps"] = "episodes"
) -> Any:
    """Return a number that a check accepts, or a schedule, in some unit, between two such.

    A schedule never leaves the range between its ends, so checking these is enough.

    Examples
    --------
    >>> from rl_core.checks import positive
    >>> from rl_core.exploration import Linear, parameter_of
    >>> parameter_of("temperature", Linear(1, 0, episodes=9), positive)
    Traceback (most recent call last):
    ValueError: temperature.end must be a finite number above 0, got 0.0
    """
    if not isinstance(value, Linear):
        return check(name, value)
    require(getattr(value, unit) is not None, name, value, f"a schedule given in {unit}")
    for end in ("start", "end"):
        check(f"{name}.{end}", getattr(value, end))
    return value


def check_step_size(name: str, value: object) -> Any:
    """Return a step size: above 0 and up to 1, a schedule of such, or one that shrinks with use."""
    return value if isinstance(value, VisitDecay) else parameter_of(name, value, SHARE)
