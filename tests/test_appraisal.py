"""What is written down of a table: errors by hand, and the exact value of its greedy policy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rl_core.kernels.appraisal import (
    COLUMNS,
    as_table,
    empty_record,
    env_steps,
    errors,
    new_appraisal,
    steps_so_far,
    value_lost,
    write_episode,
    write_evaluation,
)
from rl_core.maze import Maze
from rl_core.planning import value_iteration
from rl_core.q_learning import make_yardstick


def loss(mdp, Q, Q_star, gamma=0.9):
    """The value lost by the greedy policy, from the linear equations of its value."""
    greedy = np.isclose(Q, Q.max(axis=1, keepdims=True), rtol=0, atol=0)
    weight = (greedy / greedy.sum(axis=1, keepdims=True))[:, :, None] * mdp.probability
    P = np.zeros((mdp.n_states, mdp.n_states))
    np.add.at(P, (np.arange(mdp.n_states)[:, None, None], mdp.successor), weight)
    V = np.linalg.solve(np.eye(mdp.n_states) - gamma * P, (weight * mdp.reward).sum(axis=(1, 2)))
    return mdp.start_probability @ (Q_star.max(axis=1) - V)[mdp.start_state]


@pytest.fixture(scope="module")
def maze():
    return Maze().model()


@pytest.fixture(scope="module")
def Q_star(maze):
    return value_iteration(maze, gamma=0.9, tolerance=1e-10, progress=False).Q


def test_errors_by_hand(maze):
    Q_star = np.zeros((112, 4))
    Q_star[0] = [1, 0, 0, 0]
    yardstick = make_yardstick(maze, Q_star, (112, 4))
    visitable = np.flatnonzero(yardstick.visitable)
    hidden = np.flatnonzero(~yardstick.visitable)
    Q = Q_star.copy()
    Q[visitable[1], 2] += 3.0
    Q[hidden[0], 1] += 4.0
    norm, rmse, rmse_visitable, optimal_states = errors(Q, yardstick)
    assert norm == 5.0
    assert rmse == pytest.approx(5 / np.sqrt(448))
    assert rmse_visitable == pytest.approx(3 / np.sqrt(4 * len(visitable)))
    # Where all actions are optimal so is any; in state 0 one that is not is as good as the best.
    assert optimal_states == len(visitable)
    Q[0, 3] = 1.0
    *_, optimal_states = errors(Q, yardstick)
    assert optimal_states == len(visitable) - 1


def test_nothing_is_said_without_optimal_values_or_a_model(maze):
    assert np.isnan(errors(np.zeros((112, 4)), make_yardstick(maze, None, (112, 4)))).all()
    yardstick = make_yardstick(None, np.ones((3, 2)), (3, 2))
    found = errors(np.zeros((3, 2)), yardstick)
    assert found[:2] == (pytest.approx(np.sqrt(6)), 1.0)
    assert np.isnan(found[2:]).all()
    assert np.isnan(value_lost(np.zeros((3, 2)), yardstick, 0.9, new_appraisal(yardstick)))


def test_an_appraisal_goes_on_from_the_policy_before(maze, Q_star):
    yardstick = make_yardstick(maze, Q_star, Q_star.shape)
    appraisal, rng = new_appraisal(yardstick), np.random.default_rng(0)
    for noise in (0.0, 0.02, 0.02, 0.3, 5.0, 0.0):
        Q = Q_star + noise * rng.normal(size=Q_star.shape)
        lost = value_lost(Q, yardstick, 0.9, appraisal)
        assert lost == pytest.approx(loss(maze, Q, Q_star), abs=1e-9)
        assert value_lost(2 * Q, yardstick, 0.9, appraisal) == lost  # the same policy


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32), st.sampled_from([0.0, 0.1, 1.0]), st.sampled_from([0.0, 0.5, 0.9]))
def test_the_value_lost_is_exact_ties_included(maze, Q_star, seed, noise, gamma):
    rng = np.random.default_rng(seed)
    Q = np.round(Q_star + noise * rng.normal(size=Q_star.shape), 1)
    best = value_iteration(maze, gamma=gamma, tolerance=1e-10, progress=False).Q
    yardstick = make_yardstick(maze, best, best.shape)
    lost = value_lost(Q, yardstick, gamma, new_appraisal(yardstick))
    assert lost == pytest.approx(loss(maze, Q, best, gamma), abs=1e-9)


def test_rows_count_on_from_the_one_before(maze):
    record, yardstick = empty_record(1, 3), make_yardstick(None, None, (3, 2))
    for k, outcome in enumerate([(5, -5.0, True, 4), (2, 1.5, False, 1)]):
        assert steps_so_far(record[0], k) == (0, 5)[k]
        write_episode(record[0], k, outcome, np.zeros((3, 2)), yardstick)
    write_evaluation(record[0], 1, np.array([[1.0, 3.0], [2.0, 5.0]]))
    table = as_table(record, seeds=[8])
    assert list(table.columns) == ["seed", "episode", *COLUMNS]
    assert table["seed"].tolist() == [8, 8]  # the third was not played
    assert table["env_steps"].tolist() == [5, 7]
    assert table["visited_entries"].tolist() == [4, 5]
    assert table["terminated"].tolist() == [True, False]
    assert table["eval_return"].iloc[1] == 1.5
    assert table["eval_steps"].iloc[1] == 4.0
    assert env_steps(record) == 7
    assert {name: table[name].dtype for name in COLUMNS} == {
        n: np.dtype(d) for n, d in COLUMNS.items()
    }


@pytest.mark.parametrize(
    ("Q_star", "error"),
    [
        (np.zeros((3, 3)), ValueError),
        (np.full((3, 2), np.inf), ValueError),
        (np.full((3, 2), np.nan), ValueError),
        ([["a"] * 2] * 3, TypeError),
        ([[1.0], [1.0, 2.0]], ValueError),
        (7, ValueError),
    ],
)
def test_optimal_values_of_another_kind_are_refused(Q_star, error):
    with pytest.raises(error, match=r"^Q_star must be "):
        make_yardstick(None, Q_star, (3, 2))
