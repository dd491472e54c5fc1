"""Planning one sweep at a time: a backup of all states, and policy iteration made of sweeps."""

import math

import numpy as np
import pandas as pd

from rl_core.kernels import sweeps
from rl_core.kernels.bounds import error_bound, rounding_error, sweeps_allowed
from rl_core.kernels.sweeps import TIE, Transitions
from rl_core.mdp import MDP
from rl_core.planning import Plan, greedy_policy

COLUMNS = ["sweep", "residual", "norm", "policy_changes", "backups", "bound", "evaluation_sweeps"]


def backup(mdp: MDP, V: np.ndarray, *, gamma: float) -> np.ndarray:
    """Look one step ahead of V: return Q(s, a) = Σ_k p_k (r_k + γ V(s'_k)).

    Parameters
    ----------
    mdp : MDP
    V : float64 array of shape (S,)
        State values.
    gamma : float
        Discount.

    Returns
    -------
    ndarray of float64, shape (S, A)

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.mdp import MDP
    >>> from studies.by_sweeps import backup
    >>> lake = MDP.from_env("FrozenLake-v1")
    >>> backup(lake, np.zeros(16), gamma=0.99)[14].round(3).tolist()
    [0.0, 0.333, 0.333, 0.333]
    """
    transitions, reward = _as_kernels_take(mdp)
    Q = np.zeros((mdp.n_states, mdp.n_actions))
    sweeps.lookahead(transitions, reward, gamma, V, Q)
    return Q


def policy_iteration_by_sweeps(mdp: MDP, *, gamma: float, threshold: float) -> Plan:
    """Do as `rl_core.planning.policy_iteration`, but evaluate policies by synchronous sweeps.

    V ← Σ_k p_k (r_k + γ V(s'_k)), from the V before, is repeated until no value changes by as much
    as the threshold (θ in Sutton & Barto, section 4.3). It is S backups a sweep (one action a
    state) and S A an improvement; to find the first policy is one more.

    Parameters
    ----------
    mdp : MDP
    gamma : float
        Discount, below 1.
    threshold : float
        Above 0, in units of return.

    Returns
    -------
    Plan
        A further column of the table is `evaluation_sweeps`: those of the round's evaluation.

    Raises
    ------
    ArithmeticError
        If γ is so close to 1 that the threshold is too many sweeps away.

    Examples
    --------
    >>> from rl_core.mdp import MDP
    >>> from studies.by_sweeps import policy_iteration_by_sweeps
    >>> lake = MDP.from_env("FrozenLake-v1")
    >>> plan = policy_iteration_by_sweeps(lake, gamma=0.99, threshold=1e-9)
    >>> round(plan.V[0], 6), plan.table["policy_changes"].tolist()[-1]
    (np.float64(0.542026), 0)
    """
    transitions, reward = _as_kernels_take(mdp)
    Q, V = np.zeros((mdp.n_states, mdp.n_actions)), np.zeros(mdp.n_states)
    policy = greedy_policy(Q)
    sweeps.lookahead(transitions, reward, gamma, V, Q)
    sweeps.greedy(Q, V, policy)
    backups, changes = Q.size, -1
    Q[:], V[:] = 0, 0
    states, rows = np.arange(mdp.n_states), []
    while changes != 0:
        evaluations = _evaluate(mdp.following(policy), gamma, threshold, V)
        residual, squares = sweeps.lookahead(transitions, reward, gamma, V, Q)
        best = Q.max(axis=1)
        rounding = rounding_error(mdp.n_successors, max(np.abs(reward).max(), np.abs(V).max()))
        error = (np.abs(Q[states, policy] - V).max() + rounding) / (1 - gamma)
        gain = best - Q[states, policy]
        better = gain > np.maximum(2 * gamma * error, TIE * np.abs(Q).max(axis=1))
        policy = np.where(better, greedy_policy(Q), policy)
        changes = int(better.sum())
        bound = error_bound(float(np.abs(best - V).max()), gamma, rounding)
        backups += Q.size + evaluations * mdp.n_states
        row = residual, math.sqrt(squares), changes, backups, bound, evaluations
        rows.append((len(rows) + 1, *row))
    sweeps.greedy(Q, V, policy)
    return Plan(Q, V, policy, pd.DataFrame(rows, columns=COLUMNS))


def _evaluate(mdp: MDP, gamma: float, threshold: float, V: np.ndarray) -> int:
    """Sweep V for the one action there is until no value changes by `threshold`; count sweeps."""
    transitions, reward = _as_kernels_take(mdp)
    Q = V[:, None].copy()
    residual, done, limit = math.inf, 0, 1
    while residual >= threshold and done < limit:
        residual, _ = sweeps.lookahead(transitions, reward, gamma, V, Q)
        V[:] = Q[:, 0]
        done += 1
        if done == 1:
            limit += sweeps_allowed(residual, threshold, gamma)
    rounding = rounding_error(mdp.n_successors, max(np.abs(reward).max(), np.abs(V).max()))
    if residual >= max(threshold, rounding):
        raise ArithmeticError(
            f"threshold {threshold} is too many sweeps away for gamma {gamma}; ask for "
            f"{2 * residual:.0e} or more"
        )
    return done  # at the limit only rounding is left


def _as_kernels_take(mdp: MDP) -> tuple[Transitions, np.ndarray]:
    transitions = sweeps.transitions(mdp.successor, mdp.probability)
    return transitions, np.ascontiguousarray(mdp.reward)
