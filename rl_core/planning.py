"""Planning: the optimal values and policy of a known model, by dynamic programming.

The Bellman optimality equation (Sutton & Barto, section 3.6) is a fixed point,

    Q*(s, a) = Σ_k p_k (r_k + γ max_a' Q*(s'_k, a')),

where k runs over the successors of (s, a). Replacing Q by the right-hand side brings its largest
error down by the factor γ: the right-hand side is a contraction. So

- `q_value_iteration` repeats that step on the whole table: simplest, and the report's method;
- `value_iteration` takes the states in a good order and guarantees an error (fastest);
- `policy_iteration` alternates the values of a policy and a better policy.

All of them return a `Plan`. Their cost is counted in *backups*: one is the evaluation of the
right-hand side for one state and action.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.sparse import csr_matrix, identity
from scipy.sparse.linalg import splu
from tqdm import tqdm

from rl_core import checks
from rl_core.kernels import bounds, sweeps
from rl_core.kernels.arrays import F64, Bools, Ints
from rl_core.kernels.bounds import error_bound, rounding_error, sweeps_allowed
from rl_core.kernels.sweeps import TIE, Transitions
from rl_core.mdp import MDP

DIRECT_LIMIT = 20_000
"""The most states for which equations are solved directly: the factors fill in, to gigabytes."""

MAX_EVALUATIONS, ENOUGH = 8, 0.1
"""After an improvement sweep come at most 8 evaluation sweeps; 0.1 of its residual is enough."""

SLOW = 0.5
"""If a residual is above this share of the last one's, the next improvement sweep is a backward
one: it carries values through where the estimated order is the wrong way round."""

MODIFIED_ROUNDS = 200
"""After so many rounds the evaluation sweeps, there for speed, are left out: improvement sweeps
alone contract from any values, so that convergence is certain."""

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

    Q: F64
    V: F64
    policy: Ints
    table: pd.DataFrame


def q_value_iteration(
    mdp: MDP, *, gamma: float, threshold: float = 1e-5, progress: bool = True
) -> Plan:
    """Repeat Q ← Σ_k p_k (r_k + γ max_a' Q(s'_k, a')) until Q hardly changes.

    Sweeps are synchronous (each uses the table of the one before), start from Q = 0 and stop when
    ||Q_new - Q_old||_F < `threshold`. Residual number k + 1 is at most γ^k times the first.

    Parameters
    ----------
    mdp : MDP
        The model.
    gamma : float
        Discount, in [0, 1 - 1e-8].
    threshold : float
        Where to stop, above 0, in units of return.
    progress : bool
        Show sweeps and bound on stderr once two seconds have passed.

    Returns
    -------
    Plan
        See there; `bound` is γ / (1 - γ) times the residual, and rounding.

    Raises
    ------
    ValueError, TypeError
        If an argument is out of range or has the wrong type.
    ArithmeticError
        If rounding, or a γ close to 1, keeps the changes above `threshold`.

    Notes
    -----
    The method and the stopping rule of the report, section 1.1; for V, Sutton & Barto, section 4.4.

    Examples
    --------
    >>> from rl_core.mdp import MDP
    >>> from rl_core.planning import q_value_iteration
    >>> lake = MDP.from_env("FrozenLake-v1")
    >>> q_value_iteration(lake, gamma=0.99, threshold=1e-9).Q[14].round(3).tolist()
    [0.733, 0.863, 0.821, 0.781]
    """
    gamma, transitions, reward = _opened(mdp, gamma)
    threshold = checks.positive("threshold", threshold)
    Q, V, policy = _blank(mdp)
    largest, norm, limit = _largest(reward, gamma), math.inf, math.inf
    record = _Record("Q-value iteration", progress)
    while norm >= threshold and len(record.rows) < limit:
        residual, squares = sweeps.lookahead(transitions, reward, gamma, V, Q)
        _, _, changes = sweeps.greedy(Q, V, policy)
        norm = math.sqrt(squares)
        magnitude = max(largest, _magnitude(V) + residual)
        bound = error_bound(residual, gamma, rounding_error(mdp.n_successors, magnitude))
        record.add(residual, norm, changes, Q.size, bound)
        if len(record.rows) == 1:
            limit = 1 + sweeps_allowed(norm * math.sqrt(Q.size), threshold, gamma)
    if norm >= threshold:
        raise ArithmeticError(
            f"threshold {threshold} is below what rounding and gamma {gamma} allow: after "
            f"{len(record.rows)} sweeps the norm of the change is {norm:.1e}; ask for "
            f"{2 * norm:.0e} or more"
        )
    return Plan(Q, V, policy, record.table())


def value_iteration(
    mdp: MDP, *, gamma: float, tolerance: float = 1e-6, progress: bool = True
) -> Plan:
    """Find Q* and V* to within `tolerance`, with the states swept in the order values flow in.

    What makes it fast, beside compiled code (`rl_core.kernels.sweeps`):

    - *Order.* States are swept by falling value, as estimated beforehand by a search
      backwards from the rewards; a sweep works in place and so carries values all the way.
    - *No waiting.* The chance to stay in the same state is solved for instead of swept for.
    - *Evaluation sweeps.* Up to eight sweeps that follow the greedy actions only come after each
      improvement sweep, over all actions (modified policy iteration).

    A last synchronous sweep writes Q and V = max_a Q: the table's row of kind "check".

    Parameters
    ----------
    mdp : MDP
        The model.
    gamma : float
        Discount, in [0, 1 - 1e-8].
    tolerance : float
        Largest error allowed in any entry of Q and V, above 0, in units of return.
    progress : bool
        Show sweeps and bound on stderr once two seconds have passed.

    Returns
    -------
    Plan
        The table has a further column `kind`: "improvement", "evaluation" or "check".

    Raises
    ------
    ValueError, TypeError
        If an argument is out of range or has the wrong type.
    ArithmeticError
        If rounding, or a γ close to 1, keeps the bound above `tolerance`; the message says what
        can be had.

    Notes
    -----
    *The bound* is (γ |V' - V| + rounding) / (1 - γ) after a sweep V → V', in the largest entry; see
    `rl_core.kernels.bounds`. Sweeps in place contract by γ as others do, and staying solved for by
    even less, γ (1 - l) / (1 - γ l) for an action that stays with probability l.

    *Memory.* With 4 actions, 2 successors and probabilities shared by all states: 97 bytes a state
    for the model and at most 90 for planning; 8 A K more if states have their own probabilities.

    References
    ----------
    Sutton & Barto, section 4.4. Puterman, Markov Decision Processes, 6.3.3 (sweeps in place) and
    6.5 (modified policy iteration). Dai & Goldsmith, Topological value iteration, IJCAI 2007.

    Examples
    --------
    >>> from rl_core.mdp import MDP
    >>> from rl_core.planning import value_iteration
    >>> lake = MDP.from_env("FrozenLake-v1")
    >>> plan = value_iteration(lake, gamma=0.99, tolerance=1e-9)
    >>> round(plan.V[0], 6), bool(plan.table["bound"].iloc[-1] <= 1e-9)
    (np.float64(0.542026), True)
    """
    gamma, transitions, reward = _opened(mdp, gamma)
    tolerance = checks.positive("tolerance", tolerance)
    Q, V, policy = _blank(mdp)
    magnitude = _largest(reward, gamma)
    sweeps.lookahead(transitions, reward, gamma, V, Q)  # V is 0, so that Q is r(s, a) for now
    bound = error_bound(magnitude, gamma, rounding_error(mdp.n_successors, magnitude))
    record = _Record("value iteration", progress)
    if bound > tolerance:  # else V = 0 will do
        order = np.empty(mdp.n_states, dtype=np.int32)
        ordered = sweeps.in_order(transitions, Q, mdp.terminal, gamma, order, V)
        bound = _sweep(mdp, ordered, Q, gamma, tolerance, V, policy, magnitude, record)
        del ordered
        V[order], policy[order] = V.copy(), policy.copy()
    sweeps.lookahead(transitions, reward, gamma, V, Q)
    residual, squares, changes = sweeps.greedy(Q, V, policy)
    magnitude = max(magnitude, _magnitude(V) + residual)
    bound = min(bound, error_bound(residual, gamma, rounding_error(mdp.n_successors, magnitude)))
    record.add(residual, math.sqrt(squares), changes, Q.size, bound, "check")
    return Plan(Q, V, policy, record.table("kind"))


def _sweep(
    mdp: MDP,
    ordered: Transitions,
    r: F64,
    gamma: float,
    tolerance: float,
    V: F64,
    policy: Ints,
    magnitude: float,
    record: _Record,
) -> float:
    """Sweep V in place until its error bound is within the tolerance, and return the bound."""
    chosen = ordered.successor[:, 0].copy()  # the successors of the policy, which is action 0
    arrays = ordered, r, gamma, V, policy, chosen
    backward, before, rounds, limit = False, math.inf, 0, math.inf
    while True:
        rounds += 1
        residual, squares, changes, largest = sweeps.improvement_sweep(*arrays, backward)
        rounding = rounding_error(mdp.n_successors, max(magnitude, largest + residual))
        bound = error_bound(residual, gamma, rounding)
        record.add(residual, math.sqrt(squares), changes, r.size, bound, "improvement")
        if bound <= tolerance:
            return bound
        if residual <= rounding or rounds > limit:
            attainable = 2 * error_bound(max(residual, rounding), gamma, rounding)
            raise ArithmeticError(
                f"tolerance {tolerance} is below what float64 can guarantee for this model and "
                f"gamma {gamma}, or too many sweeps away; ask for {attainable:.0e} or more"
            )
        backward, before = not backward and residual > SLOW * before, residual
        if rounds == MODIFIED_ROUNDS:
            error = residual / (1 - gamma)
            limit = rounds + sweeps_allowed(2 * error, (1 - gamma) * tolerance / 2, gamma)
        for _ in range(MAX_EVALUATIONS if rounds < MODIFIED_ROUNDS else 0):
            change, squares = sweeps.evaluation_sweep(*arrays)
            record.add(change, math.sqrt(squares), 0, len(V), math.nan, "evaluation")
            if change <= max(ENOUGH * residual, (1 - gamma) * tolerance):
                break


def policy_iteration(mdp: MDP, *, gamma: float, progress: bool = True) -> Plan:
    """Alternate the values of a policy, V^π, and the policy that is greedy for them.

    Each round evaluates π, looks one step ahead, Q(s, a) = Σ_k p_k (r_k + γ V^π(s'_k)), and moves
    π(s) to the best action, until no action changes: then V^π solves the optimality equation. An
    action changes only if it gains more than the error of V^π could feign (and more than a tie
    of `greedy_policy`): so every change is an improvement, and the rounds come to an end.

    Parameters
    ----------
    mdp : MDP
        The model.
    gamma : float
        Discount, in [0, 1 - 1e-8]. With γ = 1 a policy that never ends has no finite value.
    progress : bool
        Show rounds and bound on stderr once two seconds have passed.

    Returns
    -------
    Plan
        Q is one step ahead of V^π.

    Raises
    ------
    ValueError, TypeError
        If an argument is out of range or has the wrong type.

    Notes
    -----
    Policies are evaluated exactly (`policy_evaluation`). A linear solve is not made of backups:
    `backups` counts the improvements only, S A each. The first policy is greedy for the immediate
    rewards. To find it looks one step ahead everywhere: S A more, in the first round.

    Examples
    --------
    >>> from rl_core.mdp import MDP
    >>> from rl_core.planning import policy_iteration
    >>> lake = MDP.from_env("FrozenLake-v1")
    >>> plan = policy_iteration(lake, gamma=0.99)
    >>> round(plan.V[0], 6), plan.table["policy_changes"].tolist()[-1]
    (np.float64(0.542026), 0)
    """
    gamma, transitions, reward = _opened(mdp, gamma)
    largest = _largest(reward, gamma)
    Q, V, policy = _blank(mdp)
    sweeps.lookahead(transitions, reward, gamma, V, Q)
    sweeps.greedy(Q, V, policy)
    Q[:], backups = 0, 2 * Q.size
    states, changes = np.arange(mdp.n_states), -1
    record = _Record("policy iteration", progress)
    while changes != 0:
        V = policy_evaluation(mdp, policy, gamma=gamma)
        residual, squares = sweeps.lookahead(transitions, reward, gamma, V, Q)
        best = Q.max(axis=1)
        rounding = rounding_error(mdp.n_successors, max(largest, _magnitude(V)))
        error = (np.abs(Q[states, policy] - V).max() + rounding) / (1 - gamma)
        gain = best - Q[states, policy]
        better = gain > np.maximum(2 * gamma * error, TIE * np.abs(Q).max(axis=1))
        policy = np.where(better, greedy_policy(Q), policy)
        changes = int(better.sum())
        bound = error_bound(float(np.abs(best - V).max()), gamma, rounding)
        record.add(residual, math.sqrt(squares), changes, backups, bound)
        backups = Q.size
    sweeps.greedy(Q, V, policy)
    return Plan(Q, V, policy, record.table())


def policy_evaluation(mdp: MDP, policy: ArrayLike, *, gamma: float) -> F64:
    """Return the values of a deterministic policy, the solution of V = r_π + γ P_π V.

    Up to 20,000 states the equations are solved directly (sparse LU factors). In larger models
    `value_iteration` sweeps the model with the policy's actions only, until V is right to
    within 1e-10 of the largest value there could be, max |r| / (1 - γ).

    Parameters
    ----------
    mdp : MDP
        The model.
    policy : array of int, shape (S,)
        The action taken in each state.
    gamma : float
        Discount, in [0, 1 - 1e-8].

    Returns
    -------
    ndarray of float64, shape (S,)
        V^π; terminal states are worth 0.

    Raises
    ------
    ValueError, TypeError
        If an argument is out of range or has the wrong shape or type.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.mdp import MDP
    >>> from rl_core.planning import policy_evaluation
    >>> lake = MDP.from_env("FrozenLake-v1")
    >>> always_right = np.full(16, 2)
    >>> policy_evaluation(lake, always_right, gamma=0.99)[0].round(4)
    np.float64(0.0288)
    """
    gamma, _, _ = _opened(mdp, gamma)
    followed = mdp.following(policy)
    largest = _largest(followed.reward, gamma) / (1 - gamma)
    if mdp.n_states > DIRECT_LIMIT:
        rounding = 4 * rounding_error(mdp.n_successors, largest) / (1 - gamma)
        tolerance = max(1e-10 * largest, rounding, np.finfo(np.float64).tiny)
        return value_iteration(followed, gamma=gamma, tolerance=tolerance, progress=False).V
    S, _, K = followed.successor.shape
    entries = followed.probability.ravel(), followed.successor.ravel(), np.arange(0, S * K + 1, K)
    P = csr_matrix(entries, shape=(S, S))
    r = (followed.probability * followed.reward).sum(axis=(1, 2))
    V: F64 = splu((identity(S) - gamma * P).tocsc()).solve(r)
    V[mdp.terminal] = 0  # exactly
    return V


def greedy_policy(Q: ArrayLike) -> Ints:
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
    ValueError, TypeError
        If `Q` is not a table of finite numbers.

    Examples
    --------
    >>> from rl_core.planning import greedy_policy
    >>> greedy_policy([[0.0, 1.0 - 1e-14, 1.0], [2.0, 0.0, 2.0]]).tolist()
    [1, 0]
    """
    table = _action_values(Q)
    policy = np.zeros(len(table), dtype=sweeps.action_type(table.shape[1]))
    sweeps.greedy(table, np.zeros(len(table)), policy)
    return policy


def optimal_actions(Q: ArrayLike, tolerance: float = 1e-9) -> Bools:
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
    ValueError, TypeError
        If `Q` is not a table of finite numbers, or `tolerance` no number, negative or infinite.

    Examples
    --------
    >>> from rl_core.planning import optimal_actions
    >>> optimal_actions([[0.0, 1.0, 0.99]], tolerance=0.1).tolist()
    [[False, True, True]]
    """
    table = _action_values(Q)
    tolerance = checks.number("tolerance", tolerance, 0)
    margin = np.maximum(tolerance, TIE * np.abs(table).max(axis=1, keepdims=True))
    with np.errstate(over="ignore"):
        return np.asarray(table >= table.max(axis=1, keepdims=True) - margin)


class _Record:
    """The rows of a plan's table, and the last of them on stderr if it takes a while."""

    def __init__(self, name: str, progress: bool) -> None:
        hidden = not checks.truth("progress", progress)
        self.rows: list[tuple[float | int | str, ...]] = []
        self._bar = tqdm(desc=name, unit=" sweeps", delay=PATIENCE, disable=hidden)

    def add(self, residual: float, norm: float, changes: int, backups: int, *more: Any) -> None:
        """Note a sweep, with its own backups; `more` is the bound and further columns."""
        self.rows.append((residual, norm, changes, backups, *more))
        if not math.isnan(more[0]):
            self._bar.set_postfix_str(f"error at most {more[0]:.1e}", refresh=False)
        self._bar.update()

    def table(self, *columns: str) -> pd.DataFrame:
        """Return the rows as a table, and end the display; `columns` are the further ones."""
        self._bar.close()
        names = ["residual", "norm", "policy_changes", "backups", "bound", *columns]
        table = pd.DataFrame(self.rows, columns=names)
        table["backups"] = table["backups"].cumsum()
        table.insert(0, "sweep", np.arange(1, len(table) + 1))
        return table


def _opened(mdp: MDP, gamma: float) -> tuple[float, Transitions, F64]:
    """Return discount, transitions and rewards, checked, as the kernels take them."""
    checks.instance("mdp", mdp, MDP, "an MDP (see MDP.from_env)")
    found = bounds.discount(gamma)
    transitions = sweeps.transitions(mdp.successor, mdp.probability)
    return found, transitions, np.ascontiguousarray(mdp.reward)


def _largest(reward: F64, gamma: float) -> float:
    """Return the largest |r|, checked to be one from which returns can be summed."""
    largest = _magnitude(reward)
    bounds.check_returns("mdp", largest, gamma)
    return largest


def _magnitude(values: F64) -> float:
    """Return the largest absolute value, without an array of them all."""
    return max(abs(float(values.max())), abs(float(values.min())))


def _action_values(Q: ArrayLike) -> F64:
    table = checks.floats("Q", Q, (None, None))
    checks.require(table.size, "Q", table.shape, "an array with states and actions")
    return table


def _blank(mdp: MDP) -> tuple[F64, F64, Ints]:
    """Return Q and V of zeros, and the policy that always takes action 0."""
    S, A = mdp.n_states, mdp.n_actions
    return np.zeros((S, A)), np.zeros(S), np.zeros(S, dtype=sweeps.action_type(A))
