"""Chapter 1: planning on the Maze, one sweep or round at a time."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from interactive.page import Widget, doubles
from rl_core.maze import Maze
from rl_core.planning import (
    greedy_policy,
    optimal_actions,
    policy_evaluation,
    policy_iteration,
    q_value_iteration,
)
from studies.by_sweeps import backup


@dataclass(frozen=True)
class Sweeps:
    """What planning did to the tables, from the zeros before the first sweep on.

    Attributes
    ----------
    gamma : float
        The discount.
    V : ndarray of float64, shape (sweeps + 1, S)
        Q-value iteration: max_a Q(s, a) after each sweep.
    best : ndarray of bool, shape (sweeps + 1, S, A)
        Its greedy actions.
    round_V : ndarray of float64, shape (rounds + 1, S)
        Policy iteration: the values of the policy that the round evaluates.
    round_policy : ndarray of int, shape (rounds + 1, S)
        The policy after the round's improvement; first the one that the first round evaluates.
    """

    gamma: float
    V: NDArray[np.float64]
    best: NDArray[np.bool_]
    round_V: NDArray[np.float64]
    round_policy: NDArray[np.integer[Any]]


def maze_sweeps(maze: Maze, gamma: float = 0.9, threshold: float = 1e-5) -> Sweeps:
    """Plan with both methods, keep every table, and check them against `rl_core.planning`.

    Parameters
    ----------
    maze : Maze
        The world.
    gamma : float
        Discount, in [0, 1).
    threshold : float
        Where Q-value iteration stops, as in `q_value_iteration`. Policies are evaluated exactly.

    Returns
    -------
    Sweeps
        The tables.

    Raises
    ------
    RuntimeError
        If what was recorded is not what the package computes.

    Examples
    --------
    >>> from rl_core.maze import Maze
    >>> sweeps = maze_sweeps(Maze(), gamma=0.9)
    >>> sweeps.V.shape, sweeps.round_V.shape
    ((29, 112), (6, 112))
    """
    mdp = maze.model()
    plan = q_value_iteration(mdp, gamma=gamma, threshold=threshold, progress=False)
    tables = [np.zeros((mdp.n_states, mdp.n_actions))]
    for _ in range(len(plan.table)):
        tables.append(backup(mdp, tables[-1].max(axis=1), gamma=gamma))
    _same(np.array_equal(tables[-1], plan.Q), "the tables of Q-value iteration")
    rounds = policy_iteration(mdp, gamma=gamma, progress=False)
    values = [np.zeros(mdp.n_states)]
    policies = [greedy_policy(backup(mdp, values[0], gamma=gamma))]
    for _ in range(len(rounds.table)):
        values.append(policy_evaluation(mdp, policies[-1], gamma=gamma))
        policies.append(_improved(backup(mdp, values[-1], gamma=gamma), policies[-1]))
    changes = [int((new != old).sum()) for old, new in pairwise(policies)]
    _same(changes == rounds.table["policy_changes"].tolist(), "the rounds of policy iteration")
    Q = np.array(tables)
    best = np.array([optimal_actions(table) for table in tables])
    return Sweeps(gamma, Q.max(axis=2), best, np.array(values), np.array(policies))


def _improved(Q: NDArray[np.float64], policy: NDArray[np.integer[Any]]) -> NDArray[Any]:
    """Move to the best action where it gains more than rounding could feign."""
    gain = Q.max(axis=1) - Q[np.arange(len(Q)), policy]
    return np.where(gain > 1e-9, greedy_policy(Q), policy)


def _same(equal: bool, what: str) -> None:
    if not equal:
        raise RuntimeError(f"{what} that were recorded differ from those of rl_core.planning")


def world_data(maze: Maze) -> dict[str, Any]:
    """Return what the scripts have to know of a maze: its plan and its model."""
    model = maze.model()
    return {
        "rows": maze.walls.shape[0],
        "columns": maze.walls.shape[1],
        "cells": maze.cells,
        "start": maze.start,
        "goals": maze.goals,
        "flags": maze.flag_cells,
        "flag_sets": maze.flag_sets,
        "reachable": maze.reachable_states().astype(int),
        "terminal": model.terminal.astype(int),
        "successor": model.successor.ravel(),
        "reward": model.reward.ravel(),
        "probability": model.probability[0, 0],
    }


def maze_widget(maze: Maze, sweeps: Sweeps, *, still: Any) -> Widget:
    """Let the reader go through the sweeps, and look into every backup.

    A slider goes over the sweeps, or over the rounds of policy iteration; a cell that is chosen
    shows its backup with numbers: both outcomes of the slip, and the maximum over the actions.

    Parameters
    ----------
    maze : Maze
        The world.
    sweeps : Sweeps
        What `maze_sweeps` recorded of it.
    still : matplotlib.figure.Figure or str or object with _repr_html_
        The picture where there are no scripts, such as a situation's figure.

    Returns
    -------
    Widget
        To be shown by a notebook.

    Examples
    --------
    >>> from rl_core.maze import Maze
    >>> widget = maze_widget(Maze(), maze_sweeps(Maze()), still="<p>no picture</p>")
    >>> len(widget.json) < 60_000
    True
    """
    powers = 2 ** np.arange(sweeps.best.shape[2])
    one_action = np.eye(sweeps.best.shape[2], dtype=bool)[sweeps.round_policy]
    methods = [
        ("Q-value iteration", "value", "sweep", sweeps.V, sweeps.best),
        ("policy iteration", "policy", "round", sweeps.round_V, one_action),
    ]
    data = {
        "gamma": sweeps.gamma,
        "world": {**world_data(maze), "top": float(sweeps.V.max())},
        "methods": [
            {
                "name": name,
                "kind": kind,
                "unit": unit,
                "V": doubles(V),
                "chosen": ["".join(f"{mask:x}" for mask in masks) for masks in chosen @ powers],
            }
            for name, kind, unit, V, chosen in methods
        ],
    }
    return Widget("sweeps", data, "The Maze's values and best actions, sweep by sweep.", still)
