"""An exact certificate for a plan: values in fractions, which solve Bellman's equation.

A planner in floating point returns values with an error bound. If every number of a model is a
fraction, one can do without: the values of a policy solve linear equations, V = r_π + γ P_π V,
which are solved here in fractions, without any rounding. If these values satisfy the optimality
equation, V(s) = max_a Σ_k p_k (r_k + γ V(s'_k)), in every state, the policy is optimal: a proof.
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from rl_core import checks
from rl_core.mdp import MDP, checked_policy
from rl_core.planning import Plan

ROUNDING = Fraction(1, 2**51)
"""A float this close to a fraction, relative to it, stands for it: 1 - 1/3 is not quite 2/3."""

Outcomes = list[tuple[Fraction, int, Fraction]]
"""Probability, next state and reward, for one state and action."""


@dataclass(frozen=True)
class Certificate:
    """What was proved.

    Attributes
    ----------
    states : int
        In so many states, all of the model's, the optimality equation was checked.
    V : tuple of Fraction, length S
        The optimal values.
    V_error, Q_error : float
        No value of the plan is further than this from the exact one.
    """

    states: int
    V: tuple[Fraction, ...]
    V_error: float
    Q_error: float


def certify(
    mdp: MDP, plan: Plan, *, gamma: Fraction, fractions: Sequence[Fraction] | Set[Fraction] = ()
) -> Certificate:
    """Prove in fractions that the plan's policy is optimal, and say how far its values are off.

    Parameters
    ----------
    mdp : MDP
        The model. Its numbers are float64.
    plan : Plan
        What a planner found for it.
    gamma : Fraction
        The discount, from 0 to below 1.
    fractions : sequence or set of Fraction
        What the model's probabilities and rewards stand for; integers stand for themselves.

    Returns
    -------
    Certificate
        See there.

    Raises
    ------
    TypeError
        If an argument is of another type.
    ValueError
        If a number of the model is neither whole nor one of the fractions, probabilities do not
        add up to exactly 1, or the policy is not optimal: then the message names a state and the
        action that is better.

    Examples
    --------
    >>> from rl_core.maze import Maze
    >>> from rl_core.planning import value_iteration
    >>> maze = Maze().model()
    >>> plan = value_iteration(maze, gamma=0.9, tolerance=1e-12)
    >>> tenth = Fraction(1, 10)
    >>> certificate = certify(maze, plan, gamma=9 * tenth, fractions=[tenth, 9 * tenth])
    >>> certificate.states, certificate.V_error < 1e-12
    (112, True)
    """
    checks.instance("mdp", mdp, MDP, "an MDP (see MDP.from_env)")
    checks.instance("plan", plan, Plan, "a Plan")
    checks.instance("gamma", gamma, Fraction, "a Fraction")
    checks.require(0 <= gamma < 1, "gamma", gamma, "from 0 to below 1")
    policy = checked_policy("plan.policy", plan.policy, mdp).tolist()
    model = _in_fractions(mdp, fractions)
    V = _values([model[s][a] for s, a in enumerate(policy)], gamma)
    Q = [[sum(p * (r + gamma * V[to]) for p, to, r in row) for row in actions] for actions in model]
    for s, values in enumerate(Q):
        best = max(values)
        if V[s] != best:
            raise ValueError(
                f"plan must be optimal, in state {s} action {values.index(best)} is better than "
                f"its {policy[s]}, by {float(best - V[s]):.3g}"
            )
    return Certificate(mdp.n_states, tuple(V), _distance(plan.V, V), _distance(plan.Q, Q))


def _in_fractions(mdp: MDP, fractions: Sequence[Fraction] | Set[Fraction]) -> list[list[Outcomes]]:
    """Return the possible outcomes of every state and action."""
    checks.instance("fractions", fractions, Sequence | Set, "of Fractions")
    for fraction in fractions:
        checks.instance("fractions", fraction, Fraction, "of Fractions")
    meant: dict[float, Fraction] = {}

    def exact(number: float, name: str, where: str) -> Fraction:
        if number not in meant:
            itself = [Fraction(number)] if number.is_integer() else []
            near = [f for f in fractions if abs(f - Fraction(number)) <= abs(f) * ROUNDING] + itself
            if not near:
                raise ValueError(
                    f"fractions must hold every number of mdp, {name} {where} is {number}"
                )
            meant[number] = near[0]
        return meant[number]

    slots = list(range(mdp.n_successors))
    model: list[list[Outcomes]] = []
    arrays = mdp.probability, mdp.successor, mdp.reward
    for s, actions in enumerate(zip(*(array.tolist() for array in arrays), strict=True)):
        model.append([])
        for a in range(mdp.n_actions):
            where = f"at state {s}, action {a}"
            p, following, r = (array[a] for array in actions)
            row = [
                (exact(p[k], "probability", where), following[k], exact(r[k], "reward", where))
                for k in slots
                if p[k] > 0
            ]
            total = sum(outcome[0] for outcome in row)
            checks.require(total == 1, f"probability {where}", str(total), "of sum 1 in fractions")
            model[-1].append(row)
    return model


def _values(outcomes: list[Outcomes], gamma: Fraction) -> list[Fraction]:
    """Solve V = r + γ P V by elimination, in rows without their zeros.

    Row s of I - γ P is kept as {column: entry}. The matrix is diagonally dominant and elimination
    keeps it so: no pivot is 0, in whatever order. States with few successors go first.
    """
    rows: list[dict[int, Fraction]] = []
    right = [sum((p * r for p, _, r in row), Fraction(0)) for row in outcomes]
    for s, row in enumerate(outcomes):
        entries = {s: Fraction(1)}
        for p, following, _ in row:
            entries[following] = entries.get(following, Fraction(0)) - gamma * p
        rows.append({column: entry for column, entry in entries.items() if entry})
    users: list[set[int]] = [set() for _ in rows]  # rows that hold a column
    for s, entries in enumerate(rows):
        for column in entries:
            users[column].add(s)
    waiting, order = set(range(len(rows))), []
    while waiting:
        s = min(waiting, key=lambda i: ((len(rows[i]) - 1) * (len(users[i]) - 1), i))
        waiting.remove(s)
        order.append(s)
        for other in users[s] - {s}:
            if other not in waiting:
                continue
            factor = rows[other].pop(s) / rows[s][s]
            right[other] -= factor * right[s]
            for column in rows[s].keys() - {s}:
                entry = rows[other].get(column, Fraction(0)) - factor * rows[s][column]
                rows[other][column] = entry
                users[column].add(other)
    V = [Fraction(0)] * len(rows)
    for s in reversed(order):
        known = sum((entry * V[to] for to, entry in rows[s].items() if to != s), Fraction(0))
        V[s] = (right[s] - known) / rows[s][s]
    return V


def _distance(found: ArrayLike, exact: list[Fraction] | list[list[Fraction]]) -> float:
    """Return the largest distance of floats from fractions, itself rounded only at the end."""
    pairs = zip(np.ravel(found).tolist(), np.ravel(np.array(exact, dtype=object)), strict=True)
    return float(max(abs(Fraction(number) - value) for number, value in pairs))
