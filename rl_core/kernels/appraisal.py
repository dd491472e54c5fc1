"""What a tabular learner writes down after every episode, one row each.

Besides what happened in the episode: how far the action values are from the optimal ones, and what
acting on them costs. Both are exact, computed from Q* and the model, not from episodes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from rl_core.kernels.arrays import F64, I32, I64, Bools
from rl_core.kernels.compiled import compiled
from rl_core.kernels.model import Model

TOLERANCE = 1e-12
"""How far values may still move in a sweep when a policy counts as evaluated."""
MAX_SWEEPS = 100_000

COLUMNS = {
    "steps": np.int32,
    "return": np.float64,
    "terminated": np.bool_,
    "env_steps": np.int64,
    "visited_entries": np.int32,
    "error_norm": np.float64,
    "rmse": np.float64,
    "rmse_visitable": np.float64,
    "optimal_states": np.float64,  # a count, but missing without Q*
    "value_lost": np.float64,
    "eval_return": np.float64,
    "eval_steps": np.float64,
}
_STEPS, RETURN, _TERMINATED, _ENV_STEPS, _VISITED, _NORM, _RMSE, _RMSE_VISITABLE = range(8)
_OPTIMAL, VALUE_LOST, _EVAL_RETURN, _EVAL_STEPS = range(8, 12)


class Yardstick(NamedTuple):
    """What Q is measured against. Empty arrays stand for what is not known.

    Attributes
    ----------
    Q_star : ndarray of float64, shape (S, A)
        The optimal action values.
    optimal : ndarray of bool, shape (S, A)
        Whether the action is optimal.
    visitable : ndarray of bool, shape (S,)
        States that are not terminal and can be reached from the start: those whose entries
        experience can ever change.
    model : Model
        The model.
    """

    Q_star: F64
    optimal: Bools
    visitable: Bools
    model: Model


class Appraisal(NamedTuple):
    """What is known of the greedy policy since it was last valued; changed by `value_lost`.

    Most episodes leave the policy as it was wherever it leads, and then its value is known. If it
    changed, the values of before are a good place to start from.

    Attributes
    ----------
    greedy : ndarray of bool, shape (S, A)
        The greedy actions, in the states that the policy can get to.
    order : ndarray of int32, shape (S,)
        These states, as a search from the start finds them.
    found : ndarray of int64, shape (1,)
        How many they are; -1 while nothing is known.
    V : ndarray of float64, shape (S,)
        Their values; of others, those they had when the policy last got there.
    lost : ndarray of float64, shape (1,)
        The value lost.
    """

    greedy: Bools
    order: I32
    found: I64
    V: F64
    lost: F64


def new_appraisal(yardstick: Yardstick) -> Appraisal:
    """Return an appraisal that knows nothing yet.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.appraisal import new_appraisal
    >>> from rl_core.maze import Maze
    >>> from rl_core.q_learning import make_yardstick
    >>> yardstick = make_yardstick(Maze().model(), np.zeros((112, 4)), (112, 4))
    >>> new_appraisal(yardstick).found
    array([-1])
    """
    n_states, n_actions = yardstick.model.successor.shape[:2]
    return Appraisal(
        np.zeros((n_states, n_actions), dtype=np.bool_),
        np.zeros(n_states, dtype=np.int32),
        np.full(1, -1, dtype=np.int64),
        np.zeros(n_states),
        np.full(1, np.nan),
    )


def empty_record(n_seeds: int, episodes: int) -> F64:
    """Return the record that a learner fills: float64 of shape (seeds, episodes, columns).

    >>> from rl_core.kernels.appraisal import COLUMNS, empty_record
    >>> empty_record(2, 5).shape == (2, 5, len(COLUMNS))
    True
    """
    return np.full((n_seeds, episodes, len(COLUMNS)), np.nan)


def as_table(record: F64, seeds: Sequence[int]) -> pd.DataFrame:
    """Return a record as a tidy table: `seed`, `episode`, `COLUMNS`; rows never written left out.

    >>> from rl_core.kernels.appraisal import COLUMNS, as_table, empty_record
    >>> as_table(empty_record(1, 5), seeds=[0]).shape == (0, 2 + len(COLUMNS))
    True
    """
    n_seeds, episodes, _ = record.shape
    written = np.isfinite(record[:, :, _STEPS]).ravel()
    table = {
        "seed": np.repeat(np.asarray(seeds, dtype=np.int64), episodes)[written],
        "episode": np.tile(np.arange(1, episodes + 1, dtype=np.int32), n_seeds)[written],
    }
    for column, (name, dtype) in enumerate(COLUMNS.items()):
        table[name] = record[:, :, column].ravel()[written].astype(dtype)
    return pd.DataFrame(table)


def env_steps(record: F64) -> int:
    """Return the environment steps of all seeds so far.

    >>> from rl_core.kernels.appraisal import empty_record, env_steps
    >>> env_steps(empty_record(2, 5))
    0
    """
    return int(np.nansum(record[:, :, _STEPS]))


@compiled
def steps_so_far(record: F64, k: int) -> int:
    """Return the environment steps of one seed before episode k (from 0)."""
    return int(record[k - 1, _ENV_STEPS]) if k > 0 else 0


@compiled
def write_episode(
    record: F64, k: int, outcome: tuple[int, float, bool, int], Q: F64, yardstick: Yardstick
) -> None:
    """Write the row of episode k (from 0) of one seed; running counts go on from the row before.

    `outcome` is the episode's steps, return, whether it terminated, and newly visited entries.
    """
    row = record[k]
    row[_STEPS], row[RETURN], row[_TERMINATED], row[_VISITED] = outcome
    row[_ENV_STEPS] = row[_STEPS]
    if k > 0:
        row[_ENV_STEPS] += record[k - 1, _ENV_STEPS]
        row[_VISITED] += record[k - 1, _VISITED]
    row[_NORM], row[_RMSE], row[_RMSE_VISITABLE], row[_OPTIMAL] = errors(Q, yardstick)


@compiled
def write_evaluation(record: F64, k: int, trials: F64) -> None:
    """Add to the row of episode k the evaluation's mean return and steps.

    `trials` has a row (return, steps) for each of the evaluation's episodes.
    """
    record[k, _EVAL_RETURN] = np.mean(trials[:, 0])
    record[k, _EVAL_STEPS] = np.mean(trials[:, 1])


@compiled
def errors(Q: F64, yardstick: Yardstick) -> tuple[float, float, float, float]:
    """Measure Q, float64 of shape (S, A), in one pass; NaN where the yardstick lacks.

    Returns
    -------
    norm : float
        The Frobenius norm of Q - Q*.
    rmse : float
        The root of the mean squared error over all entries, norm / sqrt(S A).
    rmse_visitable : float
        The same over the entries of visitable states.
    optimal_states : float
        Visitable states in which every greedy action is optimal.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.appraisal import errors
    >>> from rl_core.maze import Maze
    >>> from rl_core.q_learning import make_yardstick
    >>> yardstick = make_yardstick(Maze().model(), np.ones((112, 4)), (112, 4))
    >>> norm, rmse, rmse_visitable, optimal_states = errors(np.zeros((112, 4)), yardstick)
    >>> rmse
    1.0
    """
    Q_star, optimal, visitable = yardstick.Q_star, yardstick.optimal, yardstick.visitable
    if len(Q_star) == 0:
        return math.nan, math.nan, math.nan, math.nan
    n_states, n_actions = Q.shape
    total = total_visitable = 0.0
    n_visitable, n_optimal = 0, 0.0
    for s in range(n_states):
        squares, best = 0.0, Q[s, 0]
        for a in range(n_actions):
            squares += (Q[s, a] - Q_star[s, a]) ** 2
            best = max(best, Q[s, a])
        right = True
        for a in range(n_actions):
            right &= optimal[s, a] | (Q[s, a] < best)
        total += squares
        if len(visitable) > 0 and visitable[s]:
            total_visitable += squares
            n_visitable += 1
            n_optimal += 1.0 if right else 0.0
    norm, rmse = math.sqrt(total), math.sqrt(total / (n_states * n_actions))
    if n_visitable == 0:
        return norm, rmse, math.nan, math.nan
    return norm, rmse, math.sqrt(total_visitable / (n_visitable * n_actions)), n_optimal


@compiled
def value_lost(Q: F64, yardstick: Yardstick, gamma: float, appraisal: Appraisal) -> float:
    """Return v*(s_0) - v_pi(s_0) for the greedy policy pi, which draws among ties uniformly.

    Averaged over the start states. NaN if Q* or the model is not known, or if the values do not
    settle (gamma = 1 and a policy that may go on for ever).

    Parameters
    ----------
    Q : ndarray of float64, shape (S, A)
        The action values.
    yardstick : Yardstick
        What is known of the world.
    gamma : float
        Discount, in [0, 1].
    appraisal : Appraisal
        What is known of the policy; it is brought up to date.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.appraisal import new_appraisal, value_lost
    >>> from rl_core.maze import Maze
    >>> from rl_core.planning import value_iteration
    >>> from rl_core.q_learning import make_yardstick
    >>> model = Maze().model()
    >>> Q_star = value_iteration(model, gamma=0.9, tolerance=1e-10).Q
    >>> yardstick = make_yardstick(model, Q_star, Q_star.shape)
    >>> appraisal = new_appraisal(yardstick)
    >>> abs(value_lost(Q_star, yardstick, 0.9, appraisal)) < 1e-9
    True
    >>> round(value_lost(np.zeros((112, 4)), yardstick, 0.9, appraisal), 3)
    0.523
    """
    if len(yardstick.model.start_state) == 0 or len(yardstick.Q_star) == 0:
        return math.nan
    if not _as_before(Q, appraisal):
        _follow(Q, yardstick.model, appraisal)
        appraisal.lost[0] = _loss(yardstick, gamma, appraisal)
        if not math.isfinite(appraisal.lost[0]):
            appraisal.V[:] = 0.0
    return float(appraisal.lost[0])


@compiled
def _as_before(Q: F64, appraisal: Appraisal) -> bool:
    """Say whether the greedy policy takes the same actions in all states it can get to."""
    for i in range(appraisal.found[0]):
        s = appraisal.order[i]
        best = np.max(Q[s])
        for a in range(Q.shape[1]):
            if (Q[s, a] == best) != appraisal.greedy[s, a]:
                return False
    return bool(appraisal.found[0] >= 0)


@compiled
def _follow(Q: F64, model: Model, appraisal: Appraisal) -> None:
    """Note which non-terminal states the greedy policy can get to, and what it does there."""
    known = np.zeros(len(model.terminal), dtype=np.bool_)
    order, n_found, n_searched = appraisal.order, 0, 0
    for s in model.start_state:
        if not model.terminal[s]:
            known[s] = True
            order[n_found] = s
            n_found += 1
    while n_searched < n_found:
        s = order[n_searched]
        n_searched += 1
        best = np.max(Q[s])
        for a in range(Q.shape[1]):
            appraisal.greedy[s, a] = Q[s, a] == best
            for k in range(model.successor.shape[2] if Q[s, a] == best else 0):
                s_next = model.successor[s, a, k]
                possible = model.probability[s, a, k] > 0.0
                if possible and not known[s_next] and not model.terminal[s_next]:
                    known[s_next] = True
                    order[n_found] = s_next
                    n_found += 1
    appraisal.found[0] = n_found


@compiled
def _loss(yardstick: Yardstick, gamma: float, appraisal: Appraisal) -> float:
    """Value the policy by sweeps, in place, and compare it with the optimum; NaN: no values."""
    order, V, model = appraisal.order, appraisal.V, yardstick.model
    for _ in range(MAX_SWEEPS):
        change = 0.0
        for i in range(appraisal.found[0] - 1, -1, -1):  # what was found last is nearest to the end
            s = order[i]
            v = _backup(V, appraisal.greedy, model, gamma, s)
            change = max(change, abs(v - V[s]))
            V[s] = v
        if change <= TOLERANCE:
            lost = 0.0
            for i in range(len(model.start_state)):
                s = model.start_state[i]
                lost += model.start_probability[i] * (np.max(yardstick.Q_star[s]) - V[s])
            return lost
    return math.nan


@compiled
def _backup(V: F64, greedy: Bools, model: Model, gamma: float, s: int) -> float:
    """Return sum_a pi(a | s) sum_k p_k (r_k + gamma V(s'_k)) for the greedy policy pi."""
    total, ties = 0.0, 0
    for a in range(greedy.shape[1]):
        if greedy[s, a]:
            ties += 1
            for k in range(model.successor.shape[2]):
                after = model.reward[s, a, k] + gamma * V[model.successor[s, a, k]]
                total += model.probability[s, a, k] * after
    return total / ties
