"""What planning returns, how its values are turned into actions, and what it records on the way.

The algorithms are in `rl_core.planning`, which is also where to import `Plan`, `greedy_policy` and
`optimal_actions` from; these parts stand apart to leave that file to the algorithms.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from numbers import Integral, Real

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from tqdm import tqdm

from rl_core import sweeps
from rl_core.mdp import MDP
from rl_core.toy_text import SUM_TOLERANCE

PATIENCE = 2.0
"""Seconds before progress is shown."""


@dataclass(frozen=True, eq=False)
class Plan:
    """What planning found.

    Attributes
    ----------
    Q : ndarray of float64, shape (S, A)
        Action values, in units of return. Rows of terminal states are 0.
    V : ndarray of float64, shape (S,)
        State values, V(s) = max_a Q(s, a).
    policy : ndarray of int8 (int32 above 128 actions), shape (S,)
        The greedy policy, `greedy_policy(Q)`: of tied actions the lowest.
    table : pandas.DataFrame
        One row a sweep (of `policy_iteration`: a round), with at least the columns

        - `sweep`: its number, from 1;
        - `residual`, `norm`: largest absolute value and Frobenius norm of the change it made (to Q
          in `q_value_iteration` and `policy_iteration`, to V in `value_iteration`);
        - `policy_changes`: states whose greedy action changed;
        - `backups`: state-action backups done so far, those of terminal states included;
        - `bound`: no entry of Q or V is further than this from Q* or V* (NaN: not known).
    """

    Q: NDArray[np.float64]
    V: NDArray[np.float64]
    policy: NDArray[np.signedinteger]
    table: pd.DataFrame


def greedy_policy(Q: ArrayLike) -> NDArray[np.signedinteger]:
    """Return the lowest of the best actions of each state.

    Actions whose values differ by less than 1e-10 of the state's largest |Q| are tied: rounding
    must not decide between equals.

    Parameters
    ----------
    Q : array of float, shape (S, A)
        Action values.

    Returns
    -------
    ndarray of int8 (int32 above 128 actions), shape (S,)
        The actions.

    Raises
    ------
    ValueError
        If `Q` is not a table of finite numbers.

    Examples
    --------
    >>> greedy_policy([[0.0, 1.0 - 1e-14, 1.0], [2.0, 0.0, 2.0]]).tolist()
    [1, 0]
    """
    table = _checked_table(Q)
    policy = np.zeros(len(table), dtype=sweeps.action_type(table.shape[1]))
    sweeps.greedy(table, np.zeros(len(table)), policy)
    return policy


def optimal_actions(Q: ArrayLike, tolerance: float = 1e-9) -> NDArray[np.bool_]:
    """Mark all best actions of each state: those within `tolerance` of the best.

    Parameters
    ----------
    Q : array of float, shape (S, A)
        Action values.
    tolerance : float
        In units of return. Where Q is known to within e, 2 e misses no optimal action. The ties of
        `greedy_policy` count in any case.

    Returns
    -------
    ndarray of bool, shape (S, A)
        True where the action is among the best.

    Raises
    ------
    ValueError
        If `Q` is not a table of finite numbers, or `tolerance` is negative or infinite.
    TypeError
        If `tolerance` is not a number.

    Examples
    --------
    >>> optimal_actions([[0.0, 1.0, 0.99]], tolerance=0.1).tolist()
    [[False, True, True]]
    """
    table = _checked_table(Q)
    if tolerance != 0:
        check_positive("tolerance", tolerance)
    margin = np.maximum(tolerance, sweeps.TIE * np.abs(table).max(axis=1, keepdims=True))
    best: NDArray[np.bool_] = table >= table.max(axis=1, keepdims=True) - margin
    return best


class Record:
    """The rows of a plan's table, and the progress bar that shows the last of them."""

    def __init__(self, columns: tuple[str, ...], bar: tqdm[None]) -> None:
        self.rows: list[tuple[float | int | str, ...]] = []
        self._columns = columns
        self._bar = bar
        self._backups = 0

    def add(
        self,
        residual: float,
        norm: float,
        policy_changes: int,
        backups: int,
        bound: float,
        *more: int | str,
    ) -> None:
        """Note a sweep; `backups` are those of this sweep alone, `more` is for further columns."""
        self._backups += backups
        sweep = len(self.rows) + 1
        self.rows.append((sweep, residual, norm, policy_changes, self._backups, bound, *more))
        if not math.isnan(bound):
            self._bar.set_postfix_str(f"error at most {bound:.1e}", refresh=False)
        self._bar.update()

    def table(self) -> pd.DataFrame:
        """Return the rows as a table."""
        names = ("sweep", "residual", "norm", "policy_changes", "backups", "bound")
        return pd.DataFrame(self.rows, columns=[*names, *self._columns])


@contextmanager
def recording(name: str, progress: bool, *columns: str) -> Iterator[Record]:
    """Give a record with further `columns`, and show it on stderr if it takes a while."""
    with tqdm(desc=name, unit=" sweeps", delay=PATIENCE, disable=not progress) as bar:
        yield Record(columns, bar)


def blank(
    mdp: MDP,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.signedinteger]]:
    """Return Q and V of zeros, and the policy that always takes action 0."""
    S, A = mdp.n_states, mdp.n_actions
    return np.zeros((S, A)), np.zeros(S), np.zeros(S, dtype=sweeps.action_type(A))


def restricted(mdp: MDP, policy: NDArray[np.integer]) -> MDP:
    """Return the model with one action: that of the policy."""
    states = np.arange(mdp.n_states)
    return replace(
        mdp,
        successor=mdp.successor[states, policy][:, None],
        probability=mdp.probability[states, policy][:, None],
        reward=mdp.reward[states, policy][:, None],
    )


def rounding_error(mdp: MDP, magnitude: float) -> float:
    """Bound the rounding of one backup, with rewards and values up to `magnitude`.

    Each product, sum and quotient is off by ε/2 at most, relative to its size: 2 K of them for the
    reward, K + 2 for a value, and the quotient by 1 - γ l comes to one more. That is
    (3 K + 3) ε/2, rounded up to 2 (K + 1) ε.

    Examples
    --------
    >>> lake = MDP.from_env("FrozenLake-v1")  # K = 3
    >>> rounding_error(lake, magnitude=1.0) == 8 * 2.0**-52
    True
    """
    return float(2 * (mdp.n_successors + 1) * np.finfo(np.float64).eps * magnitude)


def error_bound(residual: float, gamma: float, rounding: float) -> float:
    """Bound |V' - V*| after a sweep that changed V by `residual`, in the largest entry.

    It is (γ residual + rounding) / (1 - γ), where γ makes room for rows of probabilities that add
    up to a little more than 1, as `MDP` lets them.

    Examples
    --------
    >>> round(error_bound(residual=1e-5, gamma=0.9, rounding=0.0), 9)
    9e-05
    """
    factor = gamma * (1 + SUM_TOLERANCE)
    return (factor * residual + rounding) / (1 - factor) if factor < 1 else math.inf


def sweeps_needed(change: float, target: float, gamma: float) -> int:
    """After how many sweeps, in exact arithmetic, a change contracted by γ is below `target`."""
    if gamma == 0 or change <= target:
        return 1
    return 1 + math.ceil(math.log(target / change) / math.log(gamma))


def check_model(mdp: object, gamma: object) -> None:
    """Raise unless `mdp` is a model and `gamma` a discount below 1.

    Examples
    --------
    >>> check_model(MDP.from_env("FrozenLake-v1"), 1.0)
    Traceback (most recent call last):
    ValueError: gamma must lie in [0, 1), it is 1.0
    """
    if not isinstance(mdp, MDP):
        raise TypeError(f"mdp must be an MDP (see MDP.from_env), not {type(mdp).__name__}")
    if isinstance(gamma, bool) or not isinstance(gamma, Real):
        raise TypeError(f"gamma must be a number, not {type(gamma).__name__}")
    if not 0 <= float(gamma) < 1:
        raise ValueError(f"gamma must lie in [0, 1), it is {gamma}")


def check_positive(name: str, value: object) -> None:
    """Raise unless `value` is a positive finite number.

    Examples
    --------
    >>> check_positive("threshold", 0)
    Traceback (most recent call last):
    ValueError: threshold must be positive and finite, it is 0
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError(f"{name} must be a number, not {type(value).__name__}")
    if not 0 < float(value) < math.inf:
        raise ValueError(f"{name} must be positive and finite, it is {value}")


def check_count(name: str, value: object) -> None:
    """Raise unless `value` is an integer of at least 1.

    Examples
    --------
    >>> check_count("max_sweeps", 2.5)
    Traceback (most recent call last):
    TypeError: max_sweeps must be an integer, not float
    """
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise TypeError(f"{name} must be an integer, not {type(value).__name__}")
    if value < 1:
        raise ValueError(f"{name} must be at least 1, it is {value}")


def checked_policy(name: str, policy: ArrayLike, mdp: MDP) -> NDArray[np.integer]:
    """Return `policy` as an array; raise unless it has one of the actions for every state."""
    actions = np.asarray(policy)
    if actions.dtype.kind not in "iu":
        raise TypeError(f"{name} must hold integers, not {actions.dtype}")
    if actions.shape != (mdp.n_states,):
        raise ValueError(f"{name} must have shape ({mdp.n_states},), not {actions.shape}")
    wrong = np.flatnonzero((actions < 0) | (actions >= mdp.n_actions))
    if len(wrong):
        raise ValueError(
            f"{name} must lie in 0..{mdp.n_actions - 1}, "
            f"in state {wrong[0]} it is {actions[wrong[0]]}"
        )
    return actions


def checked_values(V: ArrayLike, mdp: MDP) -> NDArray[np.float64]:
    """Return `V` as an array of its own; raise unless it has one finite number for every state.

    Raises
    ------
    TypeError, ValueError
        `V` is not made of numbers; it has another shape, or an entry is not finite.

    Examples
    --------
    >>> lake = MDP.from_env("FrozenLake-v1")
    >>> checked_values([0.0, 1.0], lake)
    Traceback (most recent call last):
    ValueError: V must have shape (16,), not (2,)
    """
    values = _as_floats("V", V)
    if values.shape != (mdp.n_states,):
        raise ValueError(f"V must have shape ({mdp.n_states},), not {values.shape}")
    wrong = np.flatnonzero(~np.isfinite(values))
    if len(wrong):
        raise ValueError(f"V must be finite, in state {wrong[0]} it is {values[wrong[0]]}")
    return values


def _as_floats(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Return a copy as float64; numpy's own messages do not say which argument they are about."""
    try:
        given = np.asarray(values)
    except ValueError as error:  # ragged nesting
        raise ValueError(f"{name} must be an array of numbers, it is {values!r}") from error
    if given.dtype.kind not in "iuf":
        raise TypeError(f"{name} must hold numbers, not {given.dtype}")
    return given.astype(np.float64)


def _checked_table(Q: ArrayLike) -> NDArray[np.float64]:
    table = _as_floats("Q", Q)
    if table.ndim != 2 or 0 in table.shape:
        raise ValueError(f"Q must have shape (states, actions), not {table.shape}")
    if not np.isfinite(table).all():
        state = int(np.flatnonzero(~np.isfinite(table).all(axis=1))[0])
        raise ValueError(f"Q must be finite, in state {state} it is {table[state].tolist()}")
    return table
