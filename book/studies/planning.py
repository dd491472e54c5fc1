"""Chapter 1: what the report claims about planning, what would bear it out, and how it is measured.

The claims speak of one maze. Each is put to that maze, where the answer is exact, and to random
mazes, one a seed, to see whether it is true of planning or only of that one maze.
"""

import time
from collections.abc import Iterator
from io import StringIO
from itertools import islice, pairwise

import numpy as np
import pandas as pd

from drawings.maze import Move
from report.claims import Claim, Criterion, Evidence, Finding, Reading
from report.seeds import SEEDS
from rl_core.maze import ACTIONS, Maze
from rl_core.mdp import MDP
from rl_core.planning import (
    greedy_policy,
    optimal_actions,
    policy_iteration,
    q_value_iteration,
    value_iteration,
)
from rl_core.statistics import bootstrap_interval
from studies.by_sweeps import backup, policy_iteration_by_sweeps
from studies.random_mazes import random_maze

GAMMA = 0.9
THRESHOLD = 1e-5
EXACT = 1e-10
"""How far from the fixed point what is called exact may be."""
RANDOM = {"rows": 8, "columns": 8, "flags": 3, "wall_fraction": 0.25}
"""What a random maze is like; its floor slips as the Maze's."""
# Stopping at a difference of THRESHOLD leaves an error of at most gamma / (1 - gamma) times that.
ERROR_BOUND = GAMMA / (1 - GAMMA) * THRESHOLD

CLAIMS = (
    Claim(
        "1a",
        "1.1",
        "Q-value iteration, stopped when successive tables differ by less than a threshold in "
        "Frobenius norm, yields the optimal Q-values.",
        (
            Criterion(
                "largest |Q - Q*| on the Maze at most gamma/(1 - gamma) times the threshold",
                at_most=ERROR_BOUND,
            ),
            Criterion("the same, mean over random mazes", at_most=ERROR_BOUND),
            Criterion("share of states with an optimal greedy action on the Maze is 1", at_least=1),
        ),
        "Figures 1-8, S1.1",
    ),
    Claim(
        "1b",
        "1.1",
        "Policy iteration reaches the same optimal policy.",
        (
            Criterion("share of states with an optimal action on the Maze is 1", at_least=1),
            Criterion("the same, mean over random mazes", at_least=1),
        ),
        "Table 1.4",
    ),
    Claim(
        "1c",
        "1.1",
        "Policy iteration needs less computation per iteration than value iteration.",
        (
            Criterion(
                "backups in a round of policy iteration at most those in a sweep of value "
                "iteration, on the Maze (ratio at most 1)",
                at_most=1,
            ),
            Criterion("the same, mean ratio over random mazes", at_most=1),
        ),
        "Table 1.2, S1.2",
        reading="an iteration is a round",
        readings=(
            Reading(
                "an iteration is a sweep",
                (
                    Criterion(
                        "backups in a sweep of policy iteration's evaluation at most those in a "
                        "sweep of value iteration, on the Maze (ratio at most 1)",
                        at_most=1,
                    ),
                    Criterion("the same, mean ratio over random mazes", at_most=1),
                ),
            ),
        ),
        amended="the second reading was added with the data known",
    ),
    Claim(
        "1d",
        "1.1",
        "Values much coarser than converged ones already give the optimal decisions.",
        (
            Criterion(
                "when every decision is first right for good, the error of the values on the Maze "
                "is at least 100 times the error at the end",
                at_least=100,
            ),
            Criterion("the same, median over random mazes", at_least=100),
        ),
        "Figure S1.3",
    ),
    Claim(
        "1e",
        "1.1",
        "Q-values give the optimal action without a transition model; V-values need one.",
        (
            Criterion(
                "argmax of Q*, no model used, is optimal in every state of the Maze (share 1)",
                at_least=1,
            ),
            Criterion(
                "share of the Maze's states in which no rule that sees only V* can be right both "
                "on the Maze and on its twin with renamed actions, at least a half",
                at_least=0.5,
            ),
            Criterion("the same, mean over random mazes", at_least=0.5),
        ),
        "Table 1.4",
    ),
)


def mazes(seeds: range = SEEDS) -> dict[int, Maze]:
    """Random mazes of 8 x 8 cells with three flags, one a seed."""
    return {seed: random_maze(**RANDOM, rng=np.random.default_rng(seed)) for seed in seeds}


def settings(maze: Maze, seeds: range = SEEDS) -> pd.DataFrame:
    """All that decides the numbers of the chapter, a row a setting."""
    rows = {
        "layout of the Maze": " / ".join(maze.layout.split()),
        "slip: probability of a quarter turn clockwise": maze.slip,
        "discount, gamma": GAMMA,
        "Q-value iteration stops at a change (Frobenius norm) below": THRESHOLD,
        "values called exact are within": EXACT,
        "random mazes: cells": f"{RANDOM['rows']} × {RANDOM['columns']}",
        "random mazes: flags": RANDOM["flags"],
        "random mazes: share of walls": RANDOM["wall_fraction"],
        "random mazes: seeds": f"{seeds[0]} to {seeds[-1]}",
    }
    return pd.DataFrame(rows.items(), columns=["setting", "value"], dtype=str)


def sweeps(mdp: MDP, gamma: float) -> Iterator[np.ndarray]:
    """The tables Q_1, Q_2, ... of Q-value iteration from Q_0 = 0, without end."""
    Q = np.zeros((mdp.n_states, mdp.n_actions))
    while True:
        Q = backup(mdp, Q.max(axis=1), gamma=gamma)
        yield Q


def approach(mdp: MDP, Q_star: np.ndarray) -> pd.DataFrame:
    """Follow Q-value iteration sweep by sweep, until no entry is wrong by more than 1e-9.

    Columns: `sweep`; `error`, the largest of any entry; `percent_off`, the same as percentage of
    the largest value; `decided`, the share of states whose greedy action is optimal.
    """
    best = optimal_actions(Q_star)[~mdp.terminal]
    rows = []
    for sweep, Q in enumerate(sweeps(mdp, GAMMA), start=1):
        choice = greedy_policy(Q)[~mdp.terminal]
        right = best[np.arange(len(choice)), choice].mean()
        rows.append({"sweep": sweep, "error": np.abs(Q - Q_star).max(), "decided": right})
        if rows[-1]["error"] < 1e-9:
            break
    path = pd.DataFrame(rows)
    path["percent_off"] = 100 * path["error"] / Q_star.max()
    return path


def approach_of(maze: Maze) -> pd.DataFrame:
    """The approach of Q-value iteration to a maze's optimal values."""
    mdp = maze.model()
    return approach(mdp, value_iteration(mdp, gamma=GAMMA, tolerance=EXACT).Q)


def renamed(mdp: MDP) -> MDP:
    """The same model with the actions' names turned round: up means down, left means right."""
    turned = [1, 0, 3, 2]
    return MDP(
        successor=mdp.successor[:, turned],
        probability=mdp.probability[:, turned],
        reward=mdp.reward[:, turned],
        terminal=mdp.terminal,
        start_state=mdp.start_state,
        start_probability=mdp.start_probability,
    )


def misled(mdp: MDP) -> float:
    """The share of states in which a decision from V* alone must be wrong in one of two worlds.

    A model and its twin with renamed actions have the same V*. Where their optimal actions have
    none in common, no rule that looks at V* alone is right in both.
    """
    one, other = (value_iteration(m, gamma=GAMMA, tolerance=EXACT) for m in (mdp, renamed(mdp)))
    assert np.abs(one.V - other.V).max() < 1e-9
    common = optimal_actions(one.Q) & optimal_actions(other.Q)
    return float(1 - common.any(axis=1)[~mdp.terminal].mean())


def route(maze: Maze, moves: list[Move]) -> str:
    """In words: which flags an episode collects, in order, and where it ends."""
    held = [maze.locate(move.next_state)[2] for move in moves]
    steps = pairwise(["", *held])
    taken = [flag for before, after in steps for flag in after if flag not in before]
    return ", then ".join([f"flag {flag}" for flag in taken] + [f"the goal ({len(moves)} moves)"])


def q_value_table(maze: Maze, Q: np.ndarray) -> pd.DataFrame:
    """One row a state: where it is, which flags it holds, and the value of each action."""
    places = [maze.locate(state) for state in range(len(Q))]
    table = pd.DataFrame(places, columns=["row", "column", "flags"])
    table.insert(0, "state", np.arange(len(Q)))
    table["flags"] = table["flags"].replace("", "none")
    return table.assign(**dict(zip(ACTIONS, Q.T, strict=True)))


def decided_by_table(maze: Maze, Q: np.ndarray) -> float:
    """The share of states in which the table of Q-values, as it is published, decides rightly.

    Only the rounded text of the table is read: no model. What is optimal is found apart from it,
    from the exact values of a policy that no other improves on.
    """
    text = q_value_table(maze, Q).to_csv(index=False)
    choice = pd.read_csv(StringIO(text))[list(ACTIONS)].to_numpy().argmax(axis=1)
    mdp = maze.model()
    best = policy_iteration(mdp, gamma=GAMMA)
    acting = np.flatnonzero(~mdp.terminal)
    return float(optimal_actions(best.Q)[acting, choice[acting]].mean())


def decisions(q_values: pd.DataFrame) -> pd.DataFrame:
    """What a figure of a situation shows of `q_value_table`: each cell's value and best action."""
    values = q_values[list(ACTIONS)]
    best = {"value": values.max(axis=1), "action": values.idxmax(axis=1)}
    return q_values[["state", "row", "column", "flags"]].assign(**best)


def measure(maze: Maze) -> dict[str, float]:
    """Everything the claims ask of one maze."""
    mdp = maze.model()
    exact = value_iteration(mdp, gamma=GAMMA, tolerance=EXACT)
    by_value = q_value_iteration(mdp, gamma=GAMMA, threshold=THRESHOLD)
    by_policy = policy_iteration(mdp, gamma=GAMMA)
    best = optimal_actions(exact.Q)[~mdp.terminal]

    def decided(policy: np.ndarray) -> float:
        return float(best[np.arange(len(best)), policy[~mdp.terminal]].mean())

    path = approach(mdp, exact.Q)
    settled = path.loc[path["decided"] < 1, "sweep"].max() + 1
    at_settling = path.loc[path["sweep"] == settled, "error"].item()
    error = np.abs(by_value.Q - exact.Q).max()
    measured = {
        "error": error,
        "decided": decided(by_value.policy),
        "decided_pi": decided(by_policy.policy),
        "same": (by_policy.policy == by_value.policy)[~mdp.terminal].mean(),
        "decided_table": decided_by_table(maze, by_value.Q),
        **cost_ratios(mdp),
        "settled": settled,
        "settled_error": at_settling,
        "settled_percent": 100 * at_settling / exact.V.max(),
        "coarseness": at_settling / error,
        "misled": misled(mdp),
    }
    return {name: float(value) for name, value in measured.items()}


def findings(course: dict[str, float], sample: pd.DataFrame) -> list[Finding]:
    """Hold the course's maze (exact) and the random mazes (an interval) against the criteria."""
    rng = np.random.default_rng(np.random.SeedSequence(2018))

    def on_mazes(measure: str, statistic=np.mean) -> Evidence:
        interval = bootstrap_interval(sample[measure].to_numpy(), statistic, rng=rng)
        return Evidence(*interval, seeds=len(sample))

    def on_course(measure: str) -> Evidence:
        return Evidence.exact(course[measure])

    one_a, one_b, one_c, one_d, one_e = CLAIMS
    return [
        one_a.judge(on_course("error"), on_mazes("error"), on_course("decided")),
        one_b.judge(on_course("decided_pi"), on_mazes("decided_pi")),
        one_c.judge(
            *(on_course("round_cost"), on_mazes("round_cost")),
            readings=[[on_course("sweep_cost"), on_mazes("sweep_cost")]],
        ),
        one_d.judge(on_course("coarseness"), on_mazes("coarseness", np.median)),
        one_e.judge(on_course("decided_table"), on_course("misled"), on_mazes("misled")),
    ]


def cost_ratios(mdp: MDP) -> dict[str, float]:
    """Work of policy iteration in terms of value iteration's: a round, a sweep, start to end.

    Both count backups, so evaluation has to be by sweeps, stopped at the same threshold.
    """
    by_value = q_value_iteration(mdp, gamma=GAMMA, threshold=THRESHOLD).table
    by_policy = policy_iteration_by_sweeps(mdp, gamma=GAMMA, threshold=THRESHOLD).table
    work_by_value, work_by_policy = by_value["backups"].max(), by_policy["backups"].max()
    sweep = work_by_value / len(by_value)
    # A full sweep finds the first policy, and each round's improvement is another.
    evaluating = work_by_policy - (len(by_policy) + 1) * sweep
    return {
        "round_cost": (work_by_policy / len(by_policy)) / sweep,
        "sweep_cost": evaluating / by_policy["evaluation_sweeps"].sum() / sweep,
        "whole_cost": work_by_policy / work_by_value,
    }


ACCURACY = 1e-10
SOLVED = "policy iteration, evaluation by linear solve"
METHODS = {
    "Q-value iteration (the report's)": lambda mdp: q_value_iteration(
        mdp, gamma=GAMMA, threshold=ACCURACY * (1 - GAMMA) / GAMMA
    ),
    "value iteration in a good order": lambda mdp: value_iteration(
        mdp, gamma=GAMMA, tolerance=ACCURACY
    ),
    "policy iteration, evaluation by sweeps": lambda mdp: policy_iteration_by_sweeps(
        mdp, gamma=GAMMA, threshold=ACCURACY * (1 - GAMMA) / GAMMA
    ),
    SOLVED: lambda mdp: policy_iteration(mdp, gamma=GAMMA),
}


def costs(mdp: MDP, repeats: int = 20) -> pd.DataFrame:
    """What each method needs to find the values to within `ACCURACY`: sweeps, backups, time."""
    rows = []
    for method, solve in METHODS.items():
        table = solve(mdp).table
        times = []
        for _ in range(repeats):
            start = time.perf_counter()
            solve(mdp)
            times.append(time.perf_counter() - start)
        rows.append(
            {
                "method": method,
                "sweeps or rounds": len(table),
                **evaluations(method, table),
                "backups": int(table["backups"].max()),
                "time (ms)": 1000 * float(np.median(times)),
            }
        )
    return pd.DataFrame(rows)


def evaluations(method: str, table: pd.DataFrame) -> dict[str, int]:
    """How the policies of a plan were evaluated: by how many sweeps, and by how many solves.

    Value iteration in a good order has rows for its evaluation sweeps, policy iteration by sweeps
    a column; of linear solves there is one a round.
    """
    by_rows = table.get("kind", pd.Series(dtype=str)) == "evaluation"
    swept = table.get("evaluation_sweeps", pd.Series(dtype=int)).sum() + by_rows.sum()
    solves = len(table) if method == SOLVED else 0
    return {"evaluation sweeps": int(swept), "linear solves": solves}


def progress(mdp: MDP) -> dict[str, pd.DataFrame]:
    """Error of V against backups done, for value iteration and for policy iteration.

    Round n of policy iteration, which is deterministic, is seen by doing its evaluation sweeps
    again, from the values before.
    """
    V_star = value_iteration(mdp, gamma=GAMMA, tolerance=1e-12).V
    by_value = q_value_iteration(mdp, gamma=GAMMA, threshold=THRESHOLD).table
    by_policy = policy_iteration_by_sweeps(mdp, gamma=GAMMA, threshold=THRESHOLD).table
    tables = islice(sweeps(mdp, GAMMA), len(by_value))
    errors = [np.abs(Q.max(axis=1) - V_star).max() for Q in tables]
    states, V, policy_errors = np.arange(mdp.n_states), np.zeros(mdp.n_states), []
    for evaluation_sweeps in by_policy["evaluation_sweeps"]:
        policy = greedy_policy(backup(mdp, V, gamma=GAMMA))
        for _ in range(evaluation_sweeps):
            V = backup(mdp, V, gamma=GAMMA)[states, policy]
        policy_errors.append(np.abs(V - V_star).max())
    return {
        "value": by_value[["backups"]].assign(error=errors),
        "policy": by_policy[["backups"]].assign(error=policy_errors),
    }
