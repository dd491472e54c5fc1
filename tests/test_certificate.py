"""The exact certificate: it proves what is optimal, and refuses what is not."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from rl_core.maze import Maze
from rl_core.mdp import MDP
from rl_core.planning import policy_evaluation, policy_iteration, value_iteration
from studies.certificate import certify
from studies.random_mazes import random_maze

TENTH, THIRD = Fraction(1, 10), Fraction(1, 3)
COURSE = [TENTH, 9 * TENTH]


def test_the_maze_of_the_course_is_certified() -> None:
    maze = Maze(slip=TENTH)
    plan = value_iteration(maze.model(), gamma=0.9)
    certificate = certify(maze.model(), plan, gamma=9 * TENTH, fractions=COURSE)
    assert certificate.states == len(certificate.V) == 112
    bound = plan.table["bound"].iloc[-1]
    assert 0 < certificate.V_error <= certificate.Q_error <= bound
    # Beside the goal, with all flags: up is right with 9/10, and a slip hits the edge.
    beside = maze.state(1, 4, "ABC")
    assert certificate.V[beside] == Fraction(27, 10) / (1 - Fraction(9, 100))


def test_a_policy_that_is_not_optimal_is_refused() -> None:
    maze = Maze()
    plan = value_iteration(maze.model(), gamma=0.9)
    worse = (plan.V[:, None] - 1e-4 > plan.Q).argmax(axis=1)
    for state in (0, 17, maze.state(1, 4, "ABC")):
        wrong = plan.policy.copy()
        wrong[state] = worse[state]
        with pytest.raises(ValueError, match=r"plan must be optimal, in state \d+ action \d is b"):
            certify(maze.model(), replace(plan, policy=wrong), gamma=9 * TENTH, fractions=COURSE)


def test_what_planning_takes_for_a_tie_is_told_apart() -> None:
    more = 1 + Fraction(1, 10**11)
    mdp = MDP([[[0], [0]]], np.ones((1, 2, 1)), [[[1.0], [float(more)]]], [False], [0], [1.0])
    plan = value_iteration(mdp, gamma=0.5)
    assert plan.policy.tolist() == [0]
    with pytest.raises(ValueError, match=r"in state 0 action 1 is better than its 0, by 1e-11"):
        certify(mdp, plan, gamma=Fraction(1, 2), fractions=[more])
    better = replace(plan, policy=np.array([1]))
    assert (2 * more,) == certify(mdp, better, gamma=Fraction(1, 2), fractions=[more]).V


def test_the_distance_is_that_of_the_values_given() -> None:
    mdp = MDP([[[0]]], np.ones((1, 1, 1)), [[[1.0]]], [False], [0], [1.0])
    plan = value_iteration(mdp, gamma=0.5, tolerance=1e-9)
    shifted = replace(plan, V=plan.V - 0.25, Q=plan.Q + 0.5)
    certificate = certify(mdp, shifted, gamma=Fraction(1, 2))
    assert (certificate.V_error, certificate.Q_error) == (0.25, 0.5)


@pytest.mark.parametrize("slip", [Fraction(0), THIRD, Fraction(1)])
def test_random_mazes_against_the_float_solution(slip: Fraction) -> None:
    mdp = random_maze(5, 6, 2, 0.2, np.random.default_rng(3), slip=slip).model()
    plan = policy_iteration(mdp, gamma=0.95)
    certificate = certify(mdp, plan, gamma=Fraction(19, 20), fractions=[slip, 1 - slip])
    V = policy_evaluation(mdp, plan.policy, gamma=0.95)
    assert np.abs(V - np.array(certificate.V, dtype=float)).max() < 1e-12
    assert certificate.Q_error < 1e-12


def test_ties_are_no_fault() -> None:
    mdp = MDP(
        [[[1], [1]], [[1], [1]]],
        np.ones((2, 2, 1)),
        [[[1.0], [1.0]], [[0.0], [0.0]]],
        [False, True],
        [0],
        [1.0],
    )
    plan = value_iteration(mdp, gamma=0.5)
    for policy in ([0, 0], [1, 1]):
        assert certify(mdp, replace(plan, policy=np.array(policy)), gamma=Fraction(1, 2)).V == (
            1,
            0,
        )


def test_what_is_wrong_is_named() -> None:
    model = Maze().model()
    plan = value_iteration(model, gamma=0.9)
    with pytest.raises(ValueError, match=r"fractions must hold every .* at state 0, action 0 is 0"):
        certify(model, plan, gamma=9 * TENTH, fractions=[TENTH])
    with pytest.raises(TypeError, match=r"gamma must be a Fraction, got 0\.9"):
        certify(model, plan, gamma=0.9, fractions=COURSE)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="gamma must be from 0 to below 1"):
        certify(model, plan, gamma=Fraction(1), fractions=COURSE)
    with pytest.raises(TypeError, match=r"fractions must be of Fractions, got 0\.1"):
        certify(model, plan, gamma=9 * TENTH, fractions=[0.1])  # type: ignore[list-item]
    off = [Fraction(0.1), 9 * TENTH]  # what 0.1 is in binary
    with pytest.raises(ValueError, match="at state 0, action 0 must be of sum 1 in fractions"):
        certify(model, plan, gamma=9 * TENTH, fractions=off)
    with pytest.raises(TypeError, match="mdp must be an MDP"):
        certify(Maze(), plan, gamma=9 * TENTH)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="plan must be a Plan, got None"):
        certify(model, None, gamma=9 * TENTH)  # type: ignore[arg-type]
