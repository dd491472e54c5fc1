"""Gymnasium's transition tables, as its toy-text environments have them, read into arrays.

A table is `P[s][a] = [(probability, next state, reward, terminated), ...]`. It marks the end of an
episode on the transition; the arrays made here mark it on the state entered.
"""

from __future__ import annotations

from numbers import Integral, Real
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

SUM_TOLERANCE = 1e-9
"""How far probabilities may add up to from 1."""

Transition = tuple[float, int, float, bool]
"""Probability, next state, reward, terminated."""


def read_table(
    env: gym.Env[Any, Any], start_distribution: ArrayLike | None = None
) -> dict[str, NDArray[Any]]:
    """Return the arrays of an `rl_core.mdp.MDP` by name; see `MDP.from_env` for the rules.

    Examples
    --------
    >>> lake = gym.make("FrozenLake-v1").unwrapped
    >>> read_table(lake)["successor"].shape
    (16, 4, 3)
    """
    table = _table(env)
    start = _start_distribution(env, start_distribution, len(table))
    return _arrays(table, start)


def check_distribution(start_distribution: ArrayLike, n_states: int) -> NDArray[np.float64]:
    """Return a start distribution as float64, checked to have one entry a state.

    Examples
    --------
    >>> check_distribution([1, 0], n_states=2)
    array([1., 0.])
    """
    try:
        given = np.asarray(start_distribution)
        distribution = given.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"start_distribution is {start_distribution!r}; allowed is a number a state"
        ) from error
    if given.dtype.kind not in "iufb":
        raise ValueError(f"start_distribution must hold numbers, not {given.dtype}")
    if distribution.shape != (n_states,):
        raise ValueError(
            f"start_distribution must have shape ({n_states},), not {distribution.shape}"
        )
    return distribution


def start_arrays(start_distribution: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
    """Return the states of nonzero probability and their probabilities, by name.

    Examples
    --------
    >>> start_arrays(np.array([0.0, 0.25, 0.75]))["start_state"]
    array([1, 2], dtype=int32)
    """
    (start_state,) = np.nonzero(start_distribution)
    return {
        "start_state": start_state.astype(np.int32),
        "start_probability": start_distribution[start_state],
    }


def _table(env: gym.Env[Any, Any]) -> list[list[list[Transition]]]:
    """Return the environment's table as lists indexed by state and action."""
    name = type(env).__name__
    table = getattr(env, "P", None)
    if table is None:
        raise ValueError(f"env must have a transition table P, {name} has none")
    malformed = f"env: the table P of {name} is malformed:"
    rows = _rows(table, malformed)
    for s, actions in enumerate(rows):
        for a, row in enumerate(actions):
            for transition in row:
                if not _is_transition(transition, len(rows)):
                    raise ValueError(
                        f"{malformed} a transition must be (probability, next state, reward, "
                        f"terminated), at state {s}, action {a} there is {transition!r}"
                    )
            total = sum(transition[0] for transition in row)
            if abs(total - 1) > SUM_TOLERANCE:
                raise ValueError(
                    f"{malformed} probability must sum to 1, at state {s}, action {a} the sum is "
                    f"{total}"
                )
    return rows


def _rows(table: Any, malformed: str) -> list[list[list[Any]]]:
    """Return a table, whatever it is made of, as lists: states, actions and what they hold."""
    rows: list[list[list[Any]]] = []
    try:
        n_states = len(table)
        for s in range(n_states):
            rows.append([list(table[s][a]) for a in range(len(table[s]))])
    except (KeyError, IndexError):
        raise ValueError(
            f"{malformed} states and actions must be numbered from 0, not so at state {len(rows)}"
        ) from None
    except TypeError:
        raise ValueError(
            f"{malformed} it must hold, for each state and action, a list of transitions, "
            f"not so at state {len(rows)}"
        ) from None
    if not rows:
        raise ValueError(f"{malformed} it is empty")
    for s, actions in enumerate(rows):
        if len(actions) != len(rows[0]) or not actions:
            raise ValueError(
                f"{malformed} every state must have the same actions, at least one; "
                f"state {s} has {len(actions)}, state 0 has {len(rows[0])}"
            )
    return rows


def _is_transition(transition: object, n_states: int) -> bool:
    """Say whether it is (probability, next state, reward, terminated), with values that can be."""
    if not isinstance(transition, tuple | list) or len(transition) != 4:
        return False
    probability, following, reward, terminated = transition
    return (
        isinstance(probability, Real)
        and 0 <= float(probability) <= 1
        and not isinstance(following, bool)
        and isinstance(following, Integral)
        and 0 <= int(following) < n_states
        and isinstance(reward, Real)
        and isinstance(terminated, bool | np.bool_ | Integral)
    )


def _start_distribution(
    env: gym.Env[Any, Any], given: ArrayLike | None, n_states: int
) -> NDArray[np.float64]:
    """Return the probability of starting in each state: what was given, or the environment's."""
    if given is None:
        given = getattr(env, "initial_state_distrib", None)
    if given is None and hasattr(env, "start_state_index"):
        given = np.arange(n_states) == env.start_state_index
    if given is None:
        raise ValueError(
            f"start_distribution must be given, {type(env).__name__} does not say where it starts"
        )
    return check_distribution(given, n_states)


def _terminal_states(
    table: list[list[list[Transition]]], start: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Find the states that end every episode that enters them."""
    n_states = len(table)
    ends = np.zeros(n_states, dtype=np.bool_)
    goes_on = start > 0
    absorbs = np.ones(n_states, dtype=np.bool_)
    for s, actions in enumerate(table):
        for row in actions:
            for probability, following, reward, terminated in row:
                if probability == 0:
                    continue
                if following != s:
                    (ends if terminated else goes_on)[following] = True
                if following != s or reward != 0:
                    absorbs[s] = False
    return absorbs | (ends & ~goes_on)


def _arrays(
    table: list[list[list[Transition]]], start: NDArray[np.float64]
) -> dict[str, NDArray[Any]]:
    """Lay the table out as the arrays of an `MDP`, with the end of an episode as a state."""
    terminal = _terminal_states(table, start)
    redirected = any(
        p > 0 and terminated and not terminal[following]
        for s, actions in enumerate(table)
        if not terminal[s]
        for row in actions
        for p, following, _, terminated in row
    )
    extra = len(table)
    if redirected:
        terminal = np.append(terminal, True)
    n_states, n_actions = len(terminal), len(table[0])
    n_successors = max(len(row) for actions in table for row in actions)
    shape = (n_states, n_actions, n_successors)
    successor = np.empty(shape, dtype=np.int32)
    successor[:] = np.arange(n_states, dtype=np.int32)[:, None, None]
    probability = np.zeros(shape)
    probability[terminal, :, 0] = 1.0
    reward = np.zeros(shape)
    for s, actions in enumerate(table):
        if terminal[s]:
            continue
        for a, row in enumerate(actions):
            for k, (p, following, r, terminated) in enumerate(row):
                ended = p > 0 and terminated and not terminal[following]
                successor[s, a, k] = extra if ended else following
                probability[s, a, k] = p
                reward[s, a, k] = r
    return {
        "successor": successor,
        "probability": probability,
        "reward": reward,
        "terminal": terminal,
        **start_arrays(start),
    }
