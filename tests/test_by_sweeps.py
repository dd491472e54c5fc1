"""Policy iteration by sweeps against the exact one, and its cost in backups."""

import numpy as np
import pytest

from rl_core.kernels import bounds
from rl_core.maze import Maze
from rl_core.mdp import MDP
from rl_core.planning import policy_iteration, value_iteration
from studies.by_sweeps import policy_iteration_by_sweeps
from studies.random_mazes import random_maze


def ring(*rewards):
    """States in a circle, with one action that goes round."""
    n = len(rewards)
    successor = np.roll(np.arange(n), -1)[:, None, None]
    reward = np.reshape(rewards, (n, 1, 1))
    return MDP(successor, np.ones((n, 1, 1)), reward, np.zeros(n, bool), [0], [1.0])


@pytest.mark.parametrize("seed", range(5))
def test_the_rounds_are_those_of_the_exact_one(seed):
    mdp = random_maze(6, 7, 2, 0.2, np.random.default_rng(seed)).model()
    exact = policy_iteration(mdp, gamma=0.95)
    swept = policy_iteration_by_sweeps(mdp, gamma=0.95, threshold=1e-10)
    assert exact.table["policy_changes"].tolist() == swept.table["policy_changes"].tolist()
    np.testing.assert_array_equal(exact.policy, swept.policy)
    np.testing.assert_allclose(swept.Q, exact.Q, atol=1e-8)


def test_a_sweep_costs_one_backup_a_state_and_an_improvement_one_an_action():
    table = policy_iteration_by_sweeps(Maze().model(), gamma=0.9, threshold=1e-6).table
    cost = 448 + 112 * table["evaluation_sweeps"]
    assert table["backups"].tolist() == (448 + cost.cumsum()).tolist()
    assert (table["evaluation_sweeps"] > 0).all()
    assert table["policy_changes"].iloc[-1] == 0


def test_a_coarse_evaluation_ends_too_and_its_bound_holds():
    mdp = Maze().model()
    exact = value_iteration(mdp, gamma=0.99, tolerance=1e-9)
    for threshold in (5.0, 0.5, 0.01):
        plan = policy_iteration_by_sweeps(mdp, gamma=0.99, threshold=threshold)
        assert plan.table["policy_changes"].iloc[-1] == 0
        error = np.abs(plan.Q - exact.Q).max()
        assert 1e-3 < error <= plan.table["bound"].iloc[-1]


def test_what_would_take_too_many_sweeps_is_refused(monkeypatch):
    monkeypatch.setattr(bounds, "TRIED", 2000)
    with pytest.raises(ArithmeticError, match=r"threshold 1e-06 .*gamma 0.9999999.*ask for .* or"):
        policy_iteration_by_sweeps(ring(1.0, 2.0), gamma=1 - 1e-7, threshold=1e-6)


def test_where_only_rounding_is_left_it_ends():
    """Three states in a ring, whose last bits go round for ever."""
    model = ring(*np.random.default_rng(3).normal(size=3))
    swept = policy_iteration_by_sweeps(model, gamma=0.9, threshold=1e-18)
    assert pytest.approx(policy_iteration(model, gamma=0.9).V) == swept.V
