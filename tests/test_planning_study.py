"""Chapter 1's measures against hand calculations."""

import numpy as np
import pandas as pd
import pytest

from drawings.maze import follow_policy
from rl_core.maze import Maze
from rl_core.planning import q_value_iteration, value_iteration
from studies import planning as study
from studies.by_sweeps import policy_iteration_by_sweeps


@pytest.fixture(scope="module")
def maze():
    return Maze()


def test_the_sweeps_are_those_of_q_value_iteration(maze):
    plan = q_value_iteration(maze.model(), gamma=0.9, threshold=1e-5)
    tables = study.sweeps(maze.model(), 0.9)
    last = [next(tables) for _ in range(len(plan.table))][-1]
    np.testing.assert_array_equal(last, plan.Q)


def test_renaming_actions_keeps_the_values_and_turns_the_decisions_round(maze):
    one = value_iteration(maze.model(), gamma=0.9)
    other = value_iteration(study.renamed(maze.model()), gamma=0.9)
    np.testing.assert_allclose(one.V, other.V, atol=1e-6)
    np.testing.assert_allclose(one.Q[:, [1, 0, 3, 2]], other.Q, atol=1e-6)


def test_a_state_whose_best_actions_are_opposite_misleads_nobody():
    # In a corridor with a goal at either end, the middle may go left or right.
    corridor = Maze("GOSOG", slip=0)
    assert study.misled(Maze("GOSOGF", slip=0).model()) < 1
    assert corridor.model().n_states == 5
    assert study.misled(corridor.model()) == 0  # without flags nothing pays: all actions tie


def test_the_route_names_flags_in_the_order_they_are_taken():
    maze = Maze("SFFG", slip=0)
    moves = follow_policy(maze, np.full(maze.model().n_states, 3), seed=0)
    assert study.route(maze, moves) == "flag A, then flag B, then the goal (3 moves)"


def test_the_table_of_q_values_has_the_columns_and_order_promised(maze):
    Q = np.arange(448.0).reshape(112, 4)
    table = study.q_value_table(maze, Q)
    assert list(table.columns) == [
        *("state", "row", "column", "flags"),
        *("up", "down", "left", "right"),
    ]
    assert table.loc[111].tolist() == [111, 1, 4, "ABC", 444.0, 445.0, 446.0, 447.0]
    assert table["flags"].tolist()[:8] == ["none", "A", "B", "C", "AB", "AC", "BC", "ABC"]


def test_a_round_of_policy_iteration_costs_its_sweeps(maze):
    ratios = study.cost_ratios(maze.model())
    # At least the improvement (448 backups) and one evaluation sweep (112) for a sweep's 448.
    assert ratios["round_cost"] >= 1.25
    assert ratios["sweep_cost"] == pytest.approx(1 / 4)  # of four actions it backs up one


def test_the_costs_count_evaluations_of_every_kind(maze):
    table = study.costs(maze.model(), repeats=1).set_index("method")
    q, ordered, swept, solved = (table.loc[method] for method in study.METHODS)
    counts = ["evaluation sweeps", "linear solves"]
    assert q[counts].tolist() == [0, 0]
    assert q["backups"] == 448 * q["sweeps or rounds"]
    # In a good order: 112 backups an evaluation sweep, 448 any other.
    others = ordered["sweeps or rounds"] - ordered["evaluation sweeps"]
    assert ordered["evaluation sweeps"] > 0
    assert ordered["linear solves"] == 0
    assert ordered["backups"] == 448 * others + 112 * ordered["evaluation sweeps"]
    # Policy iteration: 448 an improvement, one of them before the first round.
    improvements = 448 * (swept["sweeps or rounds"] + 1)
    assert swept["backups"] == improvements + 112 * swept["evaluation sweeps"]
    assert swept["linear solves"] == 0
    assert solved["linear solves"] == solved["sweeps or rounds"] > 1
    assert solved["evaluation sweeps"] == 0


def test_the_progress_of_policy_iteration_is_that_of_its_swept_values(maze):
    mdp = maze.model()
    progress = study.progress(mdp)
    V_star = value_iteration(mdp, gamma=0.9, tolerance=1e-12).V
    for name, plan in (
        ("value", q_value_iteration(mdp, gamma=0.9, threshold=1e-5)),
        ("policy", policy_iteration_by_sweeps(mdp, gamma=0.9, threshold=1e-5)),
    ):
        table = progress[name]
        assert table["backups"].tolist() == plan.table["backups"].tolist()
        assert (table["error"].diff().dropna() < 0).all()
    # The last round's Q is one step ahead of its values, which sweeps leave a little wrong.
    error = progress["policy"]["error"].iloc[-1]
    ahead = np.abs(plan.Q.max(axis=1) - V_star).max()
    assert 0 < ahead <= 0.9 * error <= 0.9 * study.ERROR_BOUND * 1.2
    assert error > 1e-8


def test_the_table_decides_by_itself_and_a_wrong_one_is_found_out(maze):
    Q = value_iteration(maze.model(), gamma=0.9).Q
    assert study.decided_by_table(maze, Q) == 1
    wrong = Q.copy()
    wrong[maze.state(*maze.start)] = [9.0, 0.0, 0.0, 0.0]  # up, into the edge
    assert study.decided_by_table(maze, wrong) == pytest.approx(1 - 1 / 104)


def test_the_claims_are_judged_from_the_measures(maze):
    course = study.measure(maze)
    sample = pd.DataFrame([{**course, "seed": seed} for seed in range(4)])
    sample = sample.assign(
        error=[1e-6, 2e-6, 3e-6, 4e-6],
        decided_pi=[1.0, 0.5, 1.0, 0.5],
        round_cost=[2.0, 3.0, 4.0, 5.0],
        sweep_cost=[0.2, 0.3, 0.4, 0.5],
        coarseness=[50.0, 60.0, 70.0, 1e6],
        misled=[0.8, 0.9, 0.8, 0.9],
    )
    found = {f.claim.id: f for f in study.findings(course, sample)}
    estimates = {name: [e.estimate for e in f.evidence] for name, f in found.items()}
    assert list(found) == [claim.id for claim in study.CLAIMS] == ["1a", "1b", "1c", "1d", "1e"]
    assert estimates == {
        "1a": pytest.approx([course["error"], 2.5e-6, 1.0]),
        "1b": pytest.approx([1.0, 0.75]),
        "1c": pytest.approx([course["round_cost"], 3.5]),
        "1d": pytest.approx([course["coarseness"], 65.0]),
        "1e": pytest.approx([1.0, course["misled"], 0.85]),
    }
    assert {name: f.verdict for name, f in found.items()} == {
        "1a": "holds",
        "1b": "holds in part",
        "1c": "depends on the reading",
        "1d": "holds in part",  # the interval of the median reaches from 50 to a million
        "1e": "holds",
    }
    worse = study.findings({**course, "decided_table": 0.99}, sample)[-1]
    assert worse.answers == ("no", "yes", "yes")
