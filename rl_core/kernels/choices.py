"""How an action is chosen from action values, and how epsilon falls, as compiled code does it.

`rl_core.exploration` holds the rules and schedules that a user writes down.
"""

import math

from rl_core.kernels.arrays import F64
from rl_core.kernels.compiled import compiled

EPSILON_GREEDY, SOFTMAX, UNNORMALISED_SOFTMAX = range(3)
"""The rules' numbers, by which `choose` knows them."""

VALUE, START, END, STEPS, SHARE, AIM = range(6)
"""Entries of the vector that holds the present state of a schedule of epsilon."""


@compiled
def choose(kind: int, parameter: float, q: F64, u: float, v: float) -> int:
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
    >>> from rl_core.kernels.choices import EPSILON_GREEDY, choose
    >>> import numpy as np
    >>> choose(EPSILON_GREEDY, 0.1, np.array([0.0, 2.0, 1.0]), u=0.5, v=0.9)
    1
    """
    if kind == SOFTMAX:
        return _softmax_action(q, parameter, u)
    if kind == UNNORMALISED_SOFTMAX:
        return _unnormalised_softmax_action(q, u)
    if u < parameter:
        return int(v * len(q))
    return greedy_action(q, v)


@compiled
def greedy_action(q: F64, v: float) -> int:
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
def _softmax_action(q: F64, temperature: float, u: float) -> int:
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
def _unnormalised_softmax_action(q: F64, u: float) -> int:
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


@compiled
def after_step(state: F64, t: int) -> None:
    """Tell a schedule that t environment steps are over: `Linear` goes on.

    Parameters
    ----------
    state : float64 array of shape (6,)
        Changed in place.
    t : int
        Steps of the seed so far.

    Examples
    --------
    >>> from rl_core.kernels.choices import VALUE, after_step
    >>> import numpy as np
    >>> state = np.array([1.0, 1.0, 0.0, 4, 0.0, 1.0])  # from 1 to 0 in four steps
    >>> after_step(state, 3)
    >>> state[VALUE]
    np.float64(0.25)
    """
    if state[STEPS] > 0.0:
        share = min(1.0, t / state[STEPS])
        state[VALUE] = state[START] + (state[END] - state[START]) * share


@compiled
def after_goal(state: F64) -> None:
    """Tell a schedule that an episode has reached its end by itself: `HalfWay` goes on.

    Parameters
    ----------
    state : float64 array of shape (6,)
        Changed in place.

    Examples
    --------
    >>> from rl_core.kernels.choices import VALUE, after_goal
    >>> import numpy as np
    >>> state = np.array([1.0, 1.0, 0.0, 0, 0.5, 1.0])  # half-way from 1 to 0
    >>> after_goal(state)
    >>> state[VALUE]
    np.float64(0.5)
    """
    state[VALUE] += state[SHARE] * (state[END] - state[VALUE])
    state[AIM] = state[VALUE] + state[SHARE] * (state[END] - state[VALUE])


@compiled
def after_copy(state: F64) -> None:
    """Tell a schedule that the target network was copied: `HalfWay` goes to its mid-point.

    Parameters
    ----------
    state : float64 array of shape (6,)
        Changed in place.

    Examples
    --------
    >>> from rl_core.kernels.choices import VALUE, after_copy, after_goal
    >>> import numpy as np
    >>> state = np.array([1.0, 1.0, 0.0, 0, 0.5, 1.0])  # half-way from 1 to 0
    >>> after_goal(state)
    >>> after_copy(state)  # half-way from 0.5 to the mid-point 0.25
    >>> state[VALUE]
    np.float64(0.375)
    """
    state[VALUE] += state[SHARE] * (state[AIM] - state[VALUE])
