"""How a tabular learner picks its actions, while it learns and while it is evaluated.

An exploration rule is a small frozen object. Its parameter is a number or a schedule: `Linear` or
`Geometric` in the episodes. So is a step size, which may also shrink with use (`VisitDecay`).
Every decision, whatever the rule, takes two uniforms u and v in [0, 1), so that the random stream
of one rule lines up with that of another.

Epsilon is used as in the field: the probability of a uniformly random action. (The 2018 report
calls the probability of exploiting epsilon, so its epsilon is 1 minus this one.)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from rl_core.kernels.compiled import compiled

EPSILON_GREEDY, SOFTMAX, UNNORMALISED_SOFTMAX = range(3)
"""The rules' numbers, by which `choose` knows them."""


@dataclass(frozen=True)
class Linear:
    """A value that goes from `start` to `end` in equal steps.

    In episode k = 1, 2, ... it is

        start + (end - start) min(1, (k - 1) / episodes).

    Attributes
    ----------
    start, end : float
        The value in the first episode, and in episode `episodes + 1` and all later ones.
    episodes : int
        How many episodes the change takes, at least 1.

    Examples
    --------
    >>> Linear(0.9, 0.1, episodes=4).values(6).round(3).tolist()
    [0.9, 0.7, 0.5, 0.3, 0.1, 0.1]
    """

    start: float
    end: float
    episodes: int

    def __post_init__(self) -> None:
        _check_schedule(self)

    def values(self, episodes: int) -> NDArray[np.float64]:
        """Return the values of the first `episodes` episodes, float64 of shape (episodes,)."""
        share = np.minimum(1.0, np.arange(episodes) / self.episodes)
        return _between(self, (1.0 - share) * self.start + share * self.end)


@dataclass(frozen=True)
class Geometric:
    """A value that goes from `start` to `end` by equal factors.

    In episode k = 1, 2, ... it is

        start (end / start) ** min(1, (k - 1) / episodes).

    Attributes
    ----------
    start, end : float
        As in `Linear`, and positive.
    episodes : int
        How many episodes the change takes, at least 1.

    Examples
    --------
    >>> Geometric(0.8, 0.1, episodes=3).values(5).round(3).tolist()
    [0.8, 0.4, 0.2, 0.1, 0.1]
    """

    start: float
    end: float
    episodes: int

    def __post_init__(self) -> None:
        _check_schedule(self)
        for name in ("start", "end"):
            check_number(name, getattr(self, name), lambda x: x > 0, "numbers above 0")

    def values(self, episodes: int) -> NDArray[np.float64]:
        """Return the values of the first `episodes` episodes, float64 of shape (episodes,)."""
        share = np.minimum(1.0, np.arange(episodes) / self.episodes)
        return _between(self, self.start * (self.end / self.start) ** share)


Schedule = Linear | Geometric


@dataclass(frozen=True)
class VisitDecay:
    """A step size that shrinks with use.

    At the n-th update of an entry it is

        alpha_n = initial / n ** exponent.

    With an exponent above 1/2 and up to 1 the sum of alpha_n diverges and that of its squares does
    not, so Q converges to Q* wherever it is visited for ever (Robbins & Monro 1951).

    Attributes
    ----------
    initial : float or Schedule
        In (0, 1].
    exponent : float
        Above 0, at most 1.

    Raises
    ------
    TypeError, ValueError
        An attribute is not as described.

    Examples
    --------
    >>> VisitDecay(initial=1.0, exponent=0.6)
    VisitDecay(initial=1.0, exponent=0.6)
    """

    initial: float | Schedule = 1.0
    exponent: float = 0.6

    def __post_init__(self) -> None:
        check_parameter("initial", self.initial, lambda x: 0 < x <= 1, "numbers in (0, 1]")
        check_number("exponent", self.exponent, lambda x: 0 < x <= 1, "numbers in (0, 1]")


@dataclass(frozen=True)
class EpsilonGreedy:
    """With probability epsilon a uniformly random action, otherwise a greedy one.

    Among several greedy actions one is drawn uniformly (Sutton & Barto, section 2.2). If u is below
    epsilon the action is random; v picks it, from all actions or from the greedy ones.

    Attributes
    ----------
    epsilon : float or Schedule
        In [0, 1]. 1 minus the report's epsilon.

    Raises
    ------
    TypeError, ValueError
        `epsilon` is not as described.

    Examples
    --------
    >>> rule = EpsilonGreedy(epsilon=0.1)
    >>> q = np.array([0.0, 2.0, 2.0, 1.0])
    >>> [choose(rule.kind, rule.epsilon, q, u, v) for u, v in ((0.5, 0.2), (0.5, 0.9), (0.0, 0.9))]
    [1, 2, 3]
    """

    kind: ClassVar[int] = EPSILON_GREEDY
    epsilon: float | Schedule = 0.1

    def __post_init__(self) -> None:
        check_parameter("epsilon", self.epsilon, lambda x: 0 <= x <= 1, "numbers in [0, 1]")

    @property
    def parameter(self) -> float | Schedule:
        """Epsilon."""
        return self.epsilon


@dataclass(frozen=True)
class Softmax:
    """Action a with probability exp(Q(s, a) / T) / sum_b exp(Q(s, b) / T), with temperature T.

    Sutton & Barto, section 2.8 and 13.1 (soft-max in action preferences). u picks the action; v is
    not used.

    Attributes
    ----------
    temperature : float or Schedule
        Above 0, in units of the return. The lower, the greedier.

    Raises
    ------
    TypeError, ValueError
        `temperature` is not as described.

    Examples
    --------
    >>> rule = Softmax(temperature=0.5)
    >>> q = np.array([0.0, 0.5 * np.log(3)])  # probabilities 1/4 and 3/4
    >>> [choose(rule.kind, rule.temperature, q, u, 0.0) for u in (0.24, 0.26)]
    [0, 1]
    """

    kind: ClassVar[int] = SOFTMAX
    temperature: float | Schedule = 1.0

    def __post_init__(self) -> None:
        check_parameter(
            "temperature", self.temperature, lambda x: 0 < x < math.inf, "finite numbers above 0"
        )

    @property
    def parameter(self) -> float | Schedule:
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
    >>> kind = UnnormalisedSoftmax().kind
    >>> choose(kind, 1.0, np.zeros(4), 0.99, 0.0)
    0
    >>> q = np.array([1.0, 1.1, 1.2, 0.9])  # weights 0.65, 0.72, ...: the others are never drawn
    >>> sorted({choose(kind, 1.0, q, u, 0.0) for u in np.linspace(0, 0.999, 50)})
    [0, 1]
    """

    kind: ClassVar[int] = UNNORMALISED_SOFTMAX

    @property
    def parameter(self) -> float | Schedule:
        """Not used."""
        return 1.0


ExplorationRule = EpsilonGreedy | Softmax | UnnormalisedSoftmax


@dataclass(frozen=True)
class Evaluation:
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
    >>> Evaluation(every=100, epsilon=0)
    Evaluation(every=100, episodes=10, max_steps=100, epsilon=0)
    """

    every: int = 50
    episodes: int = 10
    max_steps: int = 100
    epsilon: float = 0.05

    def __post_init__(self) -> None:
        for name in ("every", "episodes", "max_steps"):
            check_integer(name, getattr(self, name), least=1)
        check_number("epsilon", self.epsilon, lambda x: 0 <= x <= 1, "numbers in [0, 1]")


def values(parameter: float | Schedule, episodes: int) -> NDArray[np.float64]:
    """Return a parameter's value in each of the first `episodes` episodes.

    Examples
    --------
    >>> values(0.5, 3).tolist(), values(Linear(1, 0, episodes=2), 3).tolist()
    ([0.5, 0.5, 0.5], [1.0, 0.5, 0.0])
    """
    if isinstance(parameter, Schedule):
        return parameter.values(episodes)
    return np.full(episodes, parameter, dtype=np.float64)


def check_parameter(
    name: str, value: object, allows: Callable[[float], bool], allowed: str
) -> None:
    """Raise unless `value` is a number that `allows` accepts, or a schedule between two such.

    A schedule never leaves the range between its ends, so checking these is enough.

    Examples
    --------
    >>> check_parameter("epsilon", Linear(0, 2, episodes=9), lambda x: 0 <= x <= 1, "0 to 1")
    Traceback (most recent call last):
    ValueError: epsilon.end is 2; allowed are 0 to 1
    """
    if isinstance(value, Schedule):
        check_number(f"{name}.start", value.start, allows, allowed)
        check_number(f"{name}.end", value.end, allows, allowed)
    else:
        check_number(name, value, allows, allowed)


def check_number(name: str, value: object, allows: Callable[[float], bool], allowed: str) -> None:
    """Raise unless `value` is a number that `allows` accepts; NaN should fail its comparisons.

    Examples
    --------
    >>> check_number("gamma", "0.9", lambda x: 0 <= x <= 1, "numbers in [0, 1]")
    Traceback (most recent call last):
    TypeError: gamma is '0.9'; allowed are numbers in [0, 1]
    """
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        raise TypeError(f"{name} is {value!r}; allowed are {allowed}")
    if not allows(float(value)):
        raise ValueError(f"{name} is {value}; allowed are {allowed}")


def check_integer(name: str, value: object, least: int) -> None:
    """Raise unless `value` is an integer from `least`.

    Examples
    --------
    >>> check_integer("episodes", 0, least=1)
    Traceback (most recent call last):
    ValueError: episodes is 0; allowed are integers from 1
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise TypeError(f"{name} is {value!r}; allowed are integers from {least}")
    if value < least:
        raise ValueError(f"{name} is {value}; allowed are integers from {least}")


def _between(schedule: Schedule, course: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the course without what rounding adds: in range, and at its end from then on."""
    course[schedule.episodes :] = schedule.end
    low, high = sorted((schedule.start, schedule.end))
    return np.minimum(high, np.maximum(low, course))


def _check_schedule(schedule: Schedule) -> None:
    for name in ("start", "end"):
        check_number(name, getattr(schedule, name), math.isfinite, "finite numbers")
    check_integer("episodes", schedule.episodes, least=1)


@compiled
def choose(kind: int, parameter: float, q: NDArray[np.float64], u: float, v: float) -> int:
    """Return the action that a rule takes; a pure function of the values and two uniforms.

    Parameters
    ----------
    kind : int
        The rule's `kind`.
    parameter : float
        Epsilon or the temperature in this episode.
    q : ndarray of float64, shape (A,)
        The action values of the state.
    u, v : float
        Two uniforms in [0, 1); see the rules for what each decides.

    Returns
    -------
    int
        The action, from 0 to A - 1.

    Examples
    --------
    >>> choose(EPSILON_GREEDY, 0.1, np.array([0.0, 2.0, 1.0]), u=0.5, v=0.9)
    1
    """
    if kind == SOFTMAX:
        return _softmax_action(q, parameter, u)
    if kind == UNNORMALISED_SOFTMAX:
        return _unnormalised_softmax_action(q, u)
    if u < parameter:
        return int(v * len(q))
    return _greedy_action(q, v)


@compiled
def _greedy_action(q: NDArray[np.float64], v: float) -> int:
    """Draw one of the actions with the largest value, uniformly."""
    best, ties = q[0], 1
    for a in range(1, len(q)):
        if q[a] > best:
            best, ties = q[a], 1
        elif q[a] == best:
            ties += 1
    skip = int(v * ties)
    for a in range(len(q)):
        if q[a] == best:
            if skip == 0:
                return a
            skip -= 1
    return 0  # only if a value is NaN


@compiled
def _softmax_action(q: NDArray[np.float64], temperature: float, u: float) -> int:
    """Draw by the cumulative weights exp((q - max q) / T), which cannot overflow."""
    best = q[0]
    for a in range(1, len(q)):
        best = max(best, q[a])
    total = 0.0
    for a in range(len(q)):
        total += math.exp((q[a] - best) / temperature)
    threshold, cumulative = u * total, 0.0
    for a in range(len(q)):
        cumulative += math.exp((q[a] - best) / temperature)
        if cumulative > threshold:
            return a
    return len(q) - 1  # only if u * total is rounded up to the total


@compiled
def _unnormalised_softmax_action(q: NDArray[np.float64], u: float) -> int:
    """Draw by the cumulative weights exp(q) / sum(q), whatever they sum to."""
    total = 0.0
    for a in range(len(q)):
        total += q[a]
    cumulative = 0.0
    for a in range(len(q)):
        cumulative += math.exp(q[a]) / total
        if cumulative > u:
            return a
    return 0


@compiled
def step_size(initial: float, exponent: float, n: int) -> float:
    """Return alpha for the n-th update of an entry; the exponent is 0 where it does not decay."""
    return initial if exponent == 0.0 else initial / n**exponent
