"""Chapter 1's measures against hand calculations."""

import numpy as np
import planning_study as study
import pytest

from rl_core.maze import Maze
from rl_core.maze_figures import follow_policy
from rl_core.planning import q_value_iteration, value_iteration


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


def test_every_claim_of_the_section_has_criteria_and_is_judged_once(maze):
    assert [claim.id for claim in study.CLAIMS] == ["1a", "1b", "1c", "1d", "1e"]
    assert all(claim.criteria for claim in study.CLAIMS)
