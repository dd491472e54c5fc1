"""Gymnasium's transition tables, as its toy-text environments have them, read into arrays.

A table is `P[s][a] = [(probability, next state, reward, terminated), ...]`. It marks the end of an
episode on the transition; the arrays made here mark it on the state entered.
"""

from __future__ import annotations

import math
from numbers import Integral, Real
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike

from rl_core import checks
from rl_core.kernels.arrays import Arrays
from rl_core.kernels.bounds import SUM_TOLERANCE


def read_table(env: gym.Env[Any, Any], start_distribution: ArrayLike | None = None) -> Arrays:
    """Return the arrays of an `rl_core.mdp.MDP` by name; see `MDP.from_env` for the rules.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from rl_core.worlds.tables import read_table
    >>> lake = gym.make("FrozenLake-v1").unwrapped
    >>> read_table(lake)["successor"].shape
    (16, 4, 3)
    """
    table = _table(env)
    n_states, n_actions = len(table), len(table[0])
    start = start_arrays(_start_distribution(env, start_distribution, n_states), n_states)
    rows = [
        (s, a, k, float(p), int(following), float(r), bool(terminated))
        for s, actions in enumerate(table)
        for a, row in enumerate(actions)
        for k, (p, following, r, terminated) in enumerate(row)
    ]
    s, a, k, p, following, r, terminated = map(np.array, zip(*rows, strict=True))
    possible, moves = p > 0, following != s
    absorbs, ends, goes_on = np.ones(n_states, np.bool_), *np.zeros((2, n_states), np.bool_)
    absorbs[s[possible & (moves | (r != 0))]] = False
    ends[following[possible & moves & terminated]] = True
    goes_on[following[possible & moves & ~terminated]] = True
    goes_on[start["start_state"]] = True
    terminal = absorbs | (ends & ~goes_on)
    redirected = possible & terminated & ~terminal[following] & ~terminal[s]
    if redirected.any():  # to an extra state, which ends the episode
        terminal = np.append(terminal, True)
    shape = len(terminal), n_actions, int(k.max()) + 1
    successor = np.empty(shape, dtype=np.int32)
    successor[:] = np.arange(shape[0])[:, None, None]
    probability, reward = np.zeros((2, *shape))
    probability[terminal, :, 0] = 1.0
    live = ~terminal[s]
    slots = s[live], a[live], k[live]
    successor[slots] = np.where(redirected, n_states, following)[live]
    probability[slots], reward[slots] = p[live], r[live]
    return start | {
        "successor": successor,
        "probability": probability,
        "reward": reward,
        "terminal": terminal,
    }


def start_arrays(start_distribution: ArrayLike, n_states: int) -> Arrays:
    """Return the states of nonzero probability and their probabilities, by name.

    Examples
    --------
    >>> from rl_core.worlds.tables import start_arrays
    >>> start_arrays([0.0, 0.25, 0.75], 3)["start_state"]
    array([1, 2], dtype=int32)
    """
    distribution = checks.floats("start_distribution", start_distribution, (n_states,))
    (start_state,) = np.nonzero(distribution)
    return {
        "start_state": start_state.astype(np.int32),
        "start_probability": distribution[start_state],
    }


def _table(env: gym.Env[Any, Any]) -> list[list[list[Any]]]:
    """Return the environment's table, whatever it is made of, as lists: states, actions, rows."""
    name = type(env).__name__
    table: Any = getattr(env, "P", None)
    if table is None:
        raise ValueError(f"env must have a transition table P, {name} has none")
    malformed = f"env: the table P of {name} is malformed:"
    rows: list[list[list[Any]]] = []
    try:
        for s in range(len(table)):
            rows.append([list(table[s][a]) for a in range(len(table[s]))])
    except (KeyError, IndexError, TypeError):
        raise ValueError(
            f"{malformed} states and actions must be numbered from 0 and each hold a list of "
            f"transitions, not so at state {len(rows)}"
        ) from None
    if not rows:
        raise ValueError(f"{malformed} it is empty")
    for s, actions in enumerate(rows):
        if len(actions) != len(rows[0]) or not actions:
            raise ValueError(
                f"{malformed} every state must have the same actions, at least one; "
                f"state {s} has {len(actions)}, state 0 has {len(rows[0])}"
            )
        for a, row in enumerate(actions):
            _check_row(row, len(rows), f"at state {s}, action {a}", malformed)
    return rows


def _check_row(row: list[Any], n_states: int, where: str, malformed: str) -> None:
    """Raise unless these are transitions, and their probabilities add up to 1."""
    for transition in row:
        if not _is_transition(transition, n_states):
            raise ValueError(
                f"{malformed} a transition must be (probability, next state, reward, terminated), "
                f"{where} there is {transition!r}"
            )
    total = sum(float(transition[0]) for transition in row)
    if abs(total - 1) > SUM_TOLERANCE:
        raise ValueError(f"{malformed} probability must sum to 1, {where} the sum is {total}")


def _is_transition(transition: object, n_states: int) -> bool:
    """Say whether it is (probability, next state, reward, terminated), with values that can be."""
    match transition:
        case [_, bool(), _, _]:  # which would count as an integer
            return False
        case [Real() as p, Integral() as state, Real() as r, Integral() | np.bool_()]:
            return 0 <= float(p) <= 1 and 0 <= int(state) < n_states and math.isfinite(r)
    return False


def _start_distribution(env: gym.Env[Any, Any], given: ArrayLike | None, n_states: int) -> Any:
    """Return the probability of starting in each state: what was given, or the environment's."""
    if given is None:
        given = getattr(env, "initial_state_distrib", None)
    if given is None and hasattr(env, "start_state_index"):
        start = checks.integer("start_state_index", env.start_state_index, 0, n_states - 1)
        given = np.where(np.arange(n_states) == start, 1.0, 0.0)
    if given is None:
        raise ValueError(
            f"start_distribution must be given, {type(env).__name__} does not say where it starts"
        )
    return given
