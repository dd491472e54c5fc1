"""Planning: against answers by hand, linear programs, direct solves and a plain-Python loop."""

import tracemalloc
from fractions import Fraction

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from bench.planning import held_bytes
from rl_core import planning
from rl_core.kernels import bounds, sweeps
from rl_core.kernels.bounds import error_bound
from rl_core.maze import Maze
from rl_core.mdp import MDP
from rl_core.planning import (
    greedy_policy,
    optimal_actions,
    policy_evaluation,
    policy_iteration,
    q_value_iteration,
    value_iteration,
)
from studies.by_sweeps import backup
from studies.random_mazes import random_maze

PLANNERS = {
    "q_value_iteration": lambda mdp, gamma: q_value_iteration(mdp, gamma=gamma, threshold=1e-10),
    "value_iteration": lambda mdp, gamma: value_iteration(mdp, gamma=gamma, tolerance=1e-8),
    "policy_iteration": lambda mdp, gamma: policy_iteration(mdp, gamma=gamma),
}
each_planner = pytest.mark.parametrize("planner", PLANNERS.values(), ids=PLANNERS.keys())


def model(successor, probability, reward, terminal=None):
    terminal = np.zeros(len(successor), bool) if terminal is None else terminal
    return MDP(successor, probability, reward, terminal, [0], [1.0])


def random_model(rng, n_states=8, n_actions=3, n_successors=3, terminals=1):
    """Dense enough that everything is connected; the last states are terminal."""
    shape = (n_states, n_actions, n_successors)
    successor = rng.integers(n_states, size=shape)
    probability = rng.dirichlet(np.full(n_successors, 0.5), size=shape[:2])
    reward = rng.normal(scale=3, size=shape) * (rng.random(shape) < 0.5)
    terminal = np.arange(n_states) >= n_states - terminals
    successor[terminal] = np.flatnonzero(terminal)[:, None, None]
    reward[terminal] = 0
    return model(successor, probability, reward, terminal)


def matrices(mdp):
    """P with shape (S, A, S) and r with shape (S, A)."""
    P = np.zeros((mdp.n_states, mdp.n_actions, mdp.n_states))
    for (s, a, k), following in np.ndenumerate(mdp.successor):
        P[s, a, following] += mdp.probability[s, a, k]
    return P, (mdp.probability * mdp.reward).sum(axis=2)


def exact_values(mdp, gamma):
    """V* by policy iteration with dense solves, until no action gains anything."""
    P, r = matrices(mdp)
    states = np.arange(mdp.n_states)
    policy = np.zeros(mdp.n_states, dtype=int)
    while True:
        V = np.linalg.solve(np.eye(mdp.n_states) - gamma * P[states, policy], r[states, policy])
        Q = r + gamma * P @ V
        better = Q.max(axis=1) > Q[states, policy] + 1e-11 * (1 + np.abs(V).max())
        if not better.any():
            return V
        policy = np.where(better, Q.argmax(axis=1), policy)


def linear_program(mdp, gamma):
    """V*: the smallest V that no action can improve."""
    P, r = matrices(mdp)
    A = (gamma * P - np.eye(mdp.n_states)[:, None]).reshape(-1, mdp.n_states)
    solution = linprog(np.ones(mdp.n_states), A_ub=A, b_ub=-r.ravel(), bounds=(None, None))
    assert solution.success
    return solution.x


def maze_values_by_hand(gamma=0.9, slip=0.1):
    """V* of the course's maze from its rules alone, with sets of flags and a dictionary."""
    rows = ["SWFWG", "OOOOO", "WOOOW", "FOWFW"]
    letter = {(r, c): x for r, row in enumerate(rows) for c, x in enumerate(row) if x != "W"}
    flags = {cell for cell, x in letter.items() if x == "F"}
    subsets = [
        frozenset(f for i, f in enumerate(sorted(flags)) if bits >> i & 1) for bits in range(8)
    ]
    directions = [(-1, 0), (0, 1), (1, 0), (0, -1)]  # clockwise

    def enter(cell, held, direction):
        target = (cell[0] + direction[0], cell[1] + direction[1])
        inside = 0 <= target[0] < 4 and 0 <= target[1] < 5
        if inside and target not in letter:
            return cell, held
        landed = target if inside else cell
        return landed, held | (flags & {landed})

    def worth(V, cell, held, direction):
        landed, now_held = enter(cell, held, direction)
        return len(now_held) if letter[landed] == "G" else gamma * V[landed, now_held]

    V = {(cell, held): 0.0 for cell in letter for held in subsets}
    for _ in range(600):
        V = {
            (cell, held): 0.0
            if letter[cell] == "G"
            else max(
                (1 - slip) * worth(V, cell, held, d)
                + slip * worth(V, cell, held, directions[(i + 1) % 4])
                for i, d in enumerate(directions)
            )
            for cell, held in V
        }
    return V


TWO_STATES = model(
    # State 0: stay for 1, or go to state 1 for nothing. State 1: stay for 2, or go back for 5.
    successor=[[[0], [1]], [[1], [0]]],
    probability=np.ones((2, 2, 1)),
    reward=[[[1.0], [0.0]], [[2.0], [5.0]]],
)


@each_planner
def test_two_states_by_hand(planner):
    # gamma 0.5: going to and fro is best: V0 = V1 / 2, V1 = 5 + V0 / 2, so V1 = 20/3, V0 = 10/3.
    plan = planner(TWO_STATES, 0.5)
    assert pytest.approx(np.array([[8 / 3, 10 / 3], [16 / 3, 20 / 3]]), abs=1e-8) == plan.Q
    assert pytest.approx([10 / 3, 20 / 3], abs=1e-8) == plan.V
    assert plan.policy.tolist() == [1, 1]
    assert plan.policy.dtype == np.int8


@each_planner
def test_no_discount_at_all_is_the_reward(planner):
    assert planner(TWO_STATES, 0.0).Q.tolist() == [[1, 0], [2, 5]]


def test_costs_without_end():
    mdp = model([[[0]], [[0]]], np.ones((2, 1, 1)), np.full((2, 1, 1), -1.0))
    assert pytest.approx(-100, abs=1e-9) == value_iteration(mdp, gamma=0.99, tolerance=1e-9).V


@pytest.mark.parametrize("limit", [planning.DIRECT_LIMIT, 0], ids=["solved", "swept"])
@pytest.mark.parametrize("gamma", [0.0, 0.9, 0.999])
def test_policy_evaluation_is_the_linear_solve(monkeypatch, gamma, limit):
    monkeypatch.setattr(planning, "DIRECT_LIMIT", limit)
    rng = np.random.default_rng(1)
    for mdp in (random_model(rng, 30), Maze().model(), MDP.from_env("Taxi-v4")):
        policy = rng.integers(mdp.n_actions, size=mdp.n_states)
        P, r = matrices(mdp)
        states = np.arange(mdp.n_states)
        expected = np.linalg.solve(
            np.eye(mdp.n_states) - gamma * P[states, policy], r[states, policy]
        )
        V = policy_evaluation(mdp, policy, gamma=gamma)
        assert pytest.approx(expected, abs=1e-9 * (1 + np.abs(r).max()) / (1 - gamma)) == V
        assert (V[mdp.terminal] == 0).all()


@each_planner
def test_maze_against_its_rules_in_plain_python(planner):
    maze = Maze()
    expected = maze_values_by_hand()
    cells = {letter: maze.flag_cells[letter] for letter in "ABC"}
    V = planner(maze.model(), 0.9).V
    for state in range(112):
        row, column, held = maze.locate(state)
        by_hand = expected[(row, column), frozenset(cells[letter] for letter in held)]
        assert V[state] == pytest.approx(by_hand, abs=1e-8)


@each_planner
def test_maze_norms(planner):
    maze = Maze()
    plan = planner(maze.model(), 0.9)
    assert round(np.linalg.norm(plan.Q), 3) == 25.256
    unreachable = ~maze.reachable_states() & ~maze.model().terminal
    assert unreachable.sum() == 12
    assert round(np.linalg.norm(plan.Q[unreachable]), 3) == 7.957
    assert (plan.Q[maze.model().terminal] == 0).all()


@each_planner
def test_frozen_lake(planner):
    lake = MDP.from_env("FrozenLake-v1")
    plan = planner(lake, 0.99)
    assert round(plan.V[0], 4) == 0.5420
    assert pytest.approx(linear_program(lake, 0.99), abs=1e-7) == plan.V


def test_maze_against_a_linear_program():
    mdp = Maze().model()
    V = value_iteration(mdp, gamma=0.9, tolerance=1e-9).V
    assert pytest.approx(linear_program(mdp, 0.9), abs=1e-7) == V


@pytest.mark.parametrize(
    "name", ["rl_core/Maze-v0", "FrozenLake-v1", "FrozenLake8x8-v1", "CliffWalking-v1", "Taxi-v4"]
)
def test_planners_agree(name):
    with gym.make(name) as env:
        mdp = MDP.from_env(env)
    plans = [planner(mdp, 0.95) for planner in PLANNERS.values()]
    exact = exact_values(mdp, 0.95)
    best = optimal_actions(backup(mdp, exact, gamma=0.95), tolerance=1e-6)
    for plan in plans:
        assert pytest.approx(exact, abs=1e-7) == plan.V
        assert plan.V.tolist() == plan.Q.max(axis=1).tolist()
        assert best[np.arange(mdp.n_states), plan.policy].all()
        assert (optimal_actions(plan.Q, tolerance=1e-6) == best).all()


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    gamma=st.sampled_from([0.0, 0.3, 0.9, 0.99, 0.999]),
    tolerance=st.sampled_from([1.0, 1e-3, 1e-6, 1e-7]),
    terminals=st.integers(0, 2),
)
def test_value_iteration_keeps_its_tolerance(seed, gamma, tolerance, terminals):
    mdp = random_model(np.random.default_rng(seed), terminals=terminals)
    V = exact_values(mdp, gamma)
    plan = value_iteration(mdp, gamma=gamma, tolerance=tolerance)
    bound = plan.table["bound"].iloc[-1]
    exact_to = 1e-10  # of the solve above
    assert bound <= tolerance
    assert np.abs(plan.V - V).max() <= bound + exact_to
    assert np.abs(plan.Q - backup(mdp, V, gamma=gamma)).max() <= bound + exact_to
    assert (plan.Q[mdp.terminal] == 0).all()


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), gamma=st.sampled_from([0.0, 0.5, 0.9, 0.99]))
def test_every_bound_holds(seed, gamma):
    mdp = random_model(np.random.default_rng(seed))
    Q = backup(mdp, exact_values(mdp, gamma), gamma=gamma)
    for threshold in (1e3, 1.0, 0.1, 1e-3):
        plan = q_value_iteration(mdp, gamma=gamma, threshold=threshold)
        assert np.abs(plan.Q - Q).max() <= plan.table["bound"].iloc[-1] + 1e-10
    for planner in PLANNERS.values():
        plan = planner(mdp, gamma)
        assert np.abs(plan.Q - Q).max() <= plan.table["bound"].iloc[-1] + 1e-10


@pytest.mark.parametrize("rounds", [1, 3])
def test_tolerance_holds_without_evaluation_sweeps(monkeypatch, rounds):
    monkeypatch.setattr(planning, "MODIFIED_ROUNDS", rounds)
    mdp = random_maze(20, 20, 2, 0.0, np.random.default_rng(4)).model()
    plan = value_iteration(mdp, gamma=0.99)
    assert np.abs(plan.V - policy_iteration(mdp, gamma=0.99).V).max() <= 1e-6
    kinds = plan.table["kind"]
    assert (kinds.iloc[rounds * (planning.MAX_EVALUATIONS + 1) :] != "evaluation").all()


def test_random_mazes_against_synchronous_sweeps():
    for seed, wall_fraction in enumerate([0.0, 0.2, 0.35]):
        rng = np.random.default_rng(seed)
        mdp = random_maze(30, 40, 3, wall_fraction, rng, slip=0.3).model()
        plain = q_value_iteration(mdp, gamma=0.95, threshold=1e-10)
        assert np.abs(value_iteration(mdp, gamma=0.95).Q - plain.Q).max() <= 1e-6


def test_q_value_iteration_sweep_by_sweep():
    mdp = Maze().model()
    plan = q_value_iteration(mdp, gamma=0.9, threshold=1e-5)
    Q, policy, rows = np.zeros((112, 4)), np.zeros(112, int), []
    while not rows or rows[-1][2] >= 1e-5:
        updated = (mdp.probability * (mdp.reward + 0.9 * Q.max(axis=1)[mdp.successor])).sum(axis=2)
        changed = greedy_policy(updated)
        rows.append(
            (
                len(rows) + 1,
                np.abs(updated - Q).max(),
                np.linalg.norm(updated - Q),
                (changed != policy).sum(),
                448 * (len(rows) + 1),
            )
        )
        Q, policy = updated, changed
    assert pytest.approx(Q, abs=1e-12) == plan.Q
    assert plan.policy.tolist() == policy.tolist()
    columns = ["sweep", "residual", "norm", "policy_changes", "backups"]
    assert list(plan.table.columns) == [*columns, "bound"]
    assert plan.table[columns].to_numpy() == pytest.approx(np.array(rows), rel=1e-9, abs=1e-12)
    assert plan.table["norm"].iloc[-1] < 1e-5 <= plan.table["norm"].iloc[-2]


def test_residuals_contract():
    for mdp, gamma in ((Maze().model(), 0.9), (random_model(np.random.default_rng(3), 20), 0.99)):
        residual = q_value_iteration(mdp, gamma=gamma, threshold=1e-8).table["residual"].to_numpy()
        rounding = 1e-15 * residual[0] / (1 - gamma)
        assert (residual[1:] <= gamma * residual[:-1] + rounding).all()
        bound = gamma ** np.arange(len(residual)) * residual[0]
        assert (residual <= bound + rounding / (1 - gamma)).all()


def test_table_of_value_iteration():
    mdp = random_maze(12, 12, 2, 0.2, np.random.default_rng(0)).model()
    table = value_iteration(mdp, gamma=0.99, tolerance=1e-7).table
    columns = ["sweep", "residual", "norm", "policy_changes", "backups", "bound", "kind"]
    assert list(table.columns) == columns
    assert table["sweep"].tolist() == list(range(1, len(table) + 1))
    cost = table["kind"].map({"evaluation": mdp.n_states}).fillna(4 * mdp.n_states)
    assert table["backups"].tolist() == cost.cumsum().tolist()
    assert table["kind"].iloc[[0, -1]].tolist() == ["improvement", "check"]
    improvement = table[table["kind"] == "improvement"]
    assert (improvement["bound"].iloc[:-1] > 1e-7).all()
    assert improvement["bound"].iloc[-1] <= 1e-7
    assert table["bound"].isna().tolist() == (table["kind"] == "evaluation").tolist()
    assert (table["norm"] >= table["residual"]).all()


def test_table_of_policy_iteration():
    mdp = Maze().model()
    exact = policy_iteration(mdp, gamma=0.9).table
    assert exact["policy_changes"].iloc[-1] == 0
    assert (exact["policy_changes"].iloc[:-1] > 0).all()
    # One look ahead a round, and one before the first, for the policy to begin with.
    assert exact["backups"].tolist() == [448 * (sweep + 1) for sweep in exact["sweep"]]
    assert exact["bound"].iloc[-1] < 1e-10


def test_policy_iteration_improves_every_round():
    mdp = random_model(np.random.default_rng(9), 40)
    policy, values = np.zeros(40, int), []
    for _ in range(20):
        values.append(policy_evaluation(mdp, policy, gamma=0.95))
        policy = greedy_policy(backup(mdp, values[-1], gamma=0.95))
    assert (np.diff(values, axis=0) >= -1e-9).all()
    assert len(policy_iteration(mdp, gamma=0.95).table) < 20
    assert pytest.approx(policy_iteration(mdp, gamma=0.95).V) == values[-1]


def test_policy_iteration_sweeps_large_models(monkeypatch):
    monkeypatch.setattr(planning, "DIRECT_LIMIT", 100)
    plan = policy_iteration(Maze().model(), gamma=0.9)
    assert round(np.linalg.norm(plan.Q), 3) == 25.256
    assert plan.table["bound"].iloc[-1] < 1e-7


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_numbering_of_states_does_not_matter(seed):
    mdp = random_maze(9, 9, 2, 0.2, np.random.default_rng(5)).model()
    order = np.random.default_rng(seed).permutation(mdp.n_states)
    rank = np.argsort(order)
    shuffled = model(
        rank[mdp.successor[order]],
        mdp.probability[order],
        mdp.reward[order],
        mdp.terminal[order],
    )
    V = value_iteration(mdp, gamma=0.99, tolerance=1e-9).V
    again = value_iteration(shuffled, gamma=0.99, tolerance=1e-9).V
    assert np.abs(again - V[order]).max() <= 2e-9


def test_same_bits_whether_probabilities_are_shared_or_not():
    mdp = random_maze(15, 15, 3, 0.2, np.random.default_rng(2)).model()
    assert mdp.probability.strides[0] == 0
    own = model(mdp.successor, mdp.probability.copy(), mdp.reward, mdp.terminal)
    for plan_of in (
        lambda mdp: value_iteration(mdp, gamma=0.99),
        lambda mdp: q_value_iteration(mdp, gamma=0.9),
    ):
        one, other, again = plan_of(mdp), plan_of(own), plan_of(mdp)
        assert one.Q.tobytes() == other.Q.tobytes() == again.Q.tobytes()
        assert one.policy.tobytes() == other.policy.tobytes() == again.policy.tobytes()
        assert one.table.equals(again.table)


def test_order_of_the_sweeps():
    # Without slips the search finds V* itself: the estimates are its values, in falling order.
    mdp = random_maze(20, 20, 3, 0.2, np.random.default_rng(6), slip=0).model()
    transitions, _ = planning._opened(mdp, 0.9)[1:]
    order, V = np.empty(mdp.n_states, np.int32), np.empty(mdp.n_states)
    r = backup(mdp, np.zeros(mdp.n_states), gamma=0.9)
    ordered = sweeps.in_order(transitions, r, mdp.terminal, 0.9, order, V)
    assert sorted(order) == list(range(mdp.n_states))
    assert (order[ordered.successor] == mdp.successor[order]).all()
    assert (np.diff(V[V > 0]) <= 0).all()
    assert np.abs(value_iteration(mdp, gamma=0.9).V[order] - V).max() <= 1e-6


@pytest.mark.parametrize(
    ("wall_fraction", "improvements", "work"),
    [
        (0.2, 10, 20),  # takes 7 and 12.5; in a random order 17 and 46
        (0.0, 15, 27),  # takes 11 and 21; without backward sweeps 21 and 31
    ],
)
def test_order_of_the_sweeps_saves_work(wall_fraction, improvements, work):
    seed = 1 if wall_fraction else 0
    mdp = random_maze(60, 60, 3, wall_fraction, np.random.default_rng(seed)).model()
    table = value_iteration(mdp, gamma=0.99).table
    assert (table["kind"] == "improvement").sum() <= improvements
    assert table["backups"].iloc[-1] <= work * 4 * mdp.n_states


def test_many_actions():
    n_actions = 200  # more than an int8 holds
    reward = np.zeros((2, n_actions, 1))
    reward[0, 150] = 1
    mdp = model(np.ones((2, n_actions, 1), int), np.ones((2, n_actions, 1)), reward, [False, True])
    for planner in PLANNERS.values():
        assert planner(mdp, 0.9).policy.tolist() == [150, 0]


def test_nothing_to_gain():
    mdp = random_maze(10, 10, 0, 0.2, np.random.default_rng(0)).model()
    plan = value_iteration(mdp, gamma=0.99)
    assert not plan.Q.any()
    assert plan.table["kind"].tolist() == ["check"]


def test_memory_within_200_bytes_a_state():
    mdp = random_maze(100, 100, 3, 0.2, np.random.default_rng(0)).model()
    value_iteration(mdp, gamma=0.99)  # compile
    tracemalloc.start()
    try:
        value_iteration(mdp, gamma=0.99)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert (held_bytes(mdp) + peak) / mdp.n_states <= 200


def test_greedy_policy_and_optimal_actions():
    Q = np.array([[1.0, 1.0 + 1e-13, 0.0], [-1e6, -1e6 + 1e-7, -2e6], [0, 0, 0], [0.5, 1, 1.1]])
    assert greedy_policy(Q).tolist() == [0, 0, 0, 2]
    expected = [[1, 1, 0], [1, 1, 0], [1, 1, 1], [0, 0, 1]]
    assert optimal_actions(Q).astype(int).tolist() == expected
    assert optimal_actions(Q, tolerance=0).astype(int).tolist() == expected
    assert optimal_actions(Q, tolerance=0.1 + 1e-12)[3].tolist() == [False, True, True]
    assert optimal_actions(Q, tolerance=0.09)[3].tolist() == [False, False, True]
    assert greedy_policy(np.array([[1e-9, 2e-9]])).tolist() == [1]  # small is not equal
    rng = np.random.default_rng(0)
    Q = rng.integers(1, 4, size=(50, 4)) + rng.normal(scale=1e-13, size=(50, 4))
    assert greedy_policy(Q).tolist() == optimal_actions(Q).argmax(axis=1).tolist()


def test_progress_is_shown_after_a_while_and_can_be_switched_off(monkeypatch, capsys):
    mdp = Maze().model()
    q_value_iteration(mdp, gamma=0.9)
    assert capsys.readouterr().err == ""  # too quick to be shown
    monkeypatch.setattr(planning, "PATIENCE", 1e-9)
    for planner in (q_value_iteration, value_iteration, policy_iteration):
        planner(mdp, gamma=0.9, progress=False)
        assert capsys.readouterr().err == ""
        planner(mdp, gamma=0.9)
        assert "error at most" in capsys.readouterr().err


def test_what_float64_cannot_do_is_refused():
    mdp = Maze().model()
    with pytest.raises(ArithmeticError, match=r"tolerance 1e-16 is below .* ask for"):
        value_iteration(mdp, gamma=0.9, tolerance=1e-16)
    # Three states in a ring, whose last bits go round for ever.
    reward = np.random.default_rng(3).normal(size=(3, 1, 1))
    ring = model([[[1]], [[2]], [[0]]], np.ones((3, 1, 1)), reward)
    with pytest.raises(ArithmeticError, match="threshold 1e-18 is below"):
        q_value_iteration(ring, gamma=0.9, threshold=1e-18)


def test_the_tolerance_an_error_names_can_be_had():
    mdp = random_model(np.random.default_rng(0), 20, terminals=0)
    with pytest.raises(ArithmeticError) as caught:
        value_iteration(mdp, gamma=0.999, tolerance=1e-15)
    attainable = float(str(caught.value).split("ask for ")[1].split(" ")[0])
    assert attainable < 1e-7
    V = value_iteration(mdp, gamma=0.999, tolerance=attainable).V
    assert np.abs(V - exact_values(mdp, 0.999)).max() < attainable + 1e-9


def ring(*rewards):
    """A state a reward, round and round: nothing but the discount makes values finite."""
    n_states = len(rewards)
    following = (np.arange(n_states) + 1) % n_states
    return model(
        following[:, None, None], np.ones((n_states, 1, 1)), np.reshape(rewards, (-1, 1, 1))
    )


# Bounds that are attained: the errors are as large as the planners say they may be.

PAID_FOR_STAYING = model([[[0]]], np.ones((1, 1, 1)), np.ones((1, 1, 1)))


@pytest.mark.parametrize("gamma", [0.5, 0.9, 0.999])
def test_the_bound_of_q_value_iteration_is_attained(gamma):
    exact = 1 / (1 - gamma)
    for n_sweeps in (1, 2, 7, 40):  # number k changes Q by gamma ** (k - 1)
        threshold = 1.0001 * gamma ** (n_sweeps - 1)
        plan = q_value_iteration(PAID_FOR_STAYING, gamma=gamma, threshold=threshold)
        assert len(plan.table) == n_sweeps
        error, bound = exact - plan.V[0], plan.table["bound"].iloc[-1]
        assert bound == pytest.approx(error, rel=1e-5, abs=1e-12 / (1 - gamma))


@pytest.mark.parametrize("gamma", [0.5, 0.9, 0.999])
def test_the_bound_of_value_iteration_is_attained(gamma):
    # So large a tolerance allows V = 0; one sweep follows.
    plan = value_iteration(PAID_FOR_STAYING, gamma=gamma, tolerance=1.0001 / (1 - gamma))
    assert plan.V.tolist() == [1.0]
    assert plan.table["bound"].tolist() == [pytest.approx(1 / (1 - gamma) - 1, rel=1e-5)]
    again = value_iteration(PAID_FOR_STAYING, gamma=gamma, tolerance=0.9 * gamma / (1 - gamma))
    assert again.V[0] == pytest.approx(1 / (1 - gamma))


def test_the_bound_of_a_sweep_in_place_is_attained():
    # States are swept before their successors, but for the last, whose error is small enough to
    # change no more than the others: so the first goes on with all of its successor's error.
    gamma, n_states = 0.5, 60
    mdp = ring(*np.ones(n_states))
    _, transitions, reward = planning._opened(mdp, gamma)
    errors = np.ones(n_states)
    errors[-1] = 1 - gamma + gamma**2
    for s in range(n_states - 2, 0, -1):
        errors[s] = 1 - gamma + gamma * errors[s + 1]
    V, policy = 1 / (1 - gamma) - errors, np.zeros(n_states, np.int8)
    chosen = transitions.successor[:, 0].copy()
    residual, *_ = sweeps.improvement_sweep(
        transitions, reward[:, :, 0], gamma, V, policy, chosen, False
    )
    largest = np.abs(V - 1 / (1 - gamma)).max()
    assert error_bound(residual, gamma, rounding=0.0) == pytest.approx(largest, rel=1e-8)


# Discounts close to 1


@pytest.mark.parametrize(
    ("planner", "options", "name"),
    [
        (q_value_iteration, {"threshold": 1e-5}, "threshold 1e-05"),
        (value_iteration, {"tolerance": 1e-6}, "tolerance 1e-06"),
    ],
)
def test_what_would_take_too_many_sweeps_is_refused(monkeypatch, planner, options, name):
    monkeypatch.setattr(bounds, "TRIED", 2000)
    with pytest.raises(ArithmeticError, match=f"{name} .*gamma 0.9999999.*ask for .* or more"):
        planner(ring(1.0, 2.0), gamma=1 - 1e-7, progress=False, **options)
    # Where episodes end, values are found all the same.
    maze = Maze().model()
    assert planner(maze, gamma=1 - 1e-7, **options).V[0] == pytest.approx(3, abs=1e-4)


def test_equations_are_solved_for_a_discount_close_to_1():
    gamma = 1 - 1e-8
    plan = policy_iteration(ring(1.0, 2.0), gamma=gamma)
    assert plan.V[0] == pytest.approx((1 + 2 * gamma) / (1 - gamma**2), rel=1e-7)


def test_large_models_are_evaluated_as_exactly_as_float64_allows(monkeypatch):
    monkeypatch.setattr(planning, "DIRECT_LIMIT", 0)
    gamma = 1 - 1e-7
    mdp = model([[[1]], [[1]]], np.ones((2, 1, 1)), [[[0.0]], [[1.0]]])
    V = policy_evaluation(mdp, [0, 0], gamma=gamma)
    assert pytest.approx([gamma / (1 - gamma), 1 / (1 - gamma)], rel=1e-7) == V


@pytest.mark.parametrize("planner", [q_value_iteration, value_iteration, policy_iteration])
def test_returns_too_large_for_float64_are_refused(planner):
    with pytest.raises(ValueError, match="mdp must be of returns up to"):
        planner(ring(1e308), gamma=0.9)


@pytest.mark.parametrize(
    "gamma", [Fraction(9, 10), np.float64(0.9), np.float32(0.5), 0, np.int8(0)], ids=repr
)
def test_numbers_of_every_kind_are_numbers(gamma):
    mdp = Maze().model()
    exact = float(gamma)
    assert (
        value_iteration(mdp, gamma=gamma).Q.tolist() == value_iteration(mdp, gamma=exact).Q.tolist()
    )
    assert (
        q_value_iteration(mdp, gamma=gamma, threshold=Fraction(1, 1000)).V.tolist()
        == q_value_iteration(mdp, gamma=exact, threshold=0.001).V.tolist()
    )
    assert greedy_policy([[Fraction(1, 3), Fraction(1, 2)]]).tolist() == [1]


ODD = st.sampled_from(
    [
        None, True, np.True_, "0.9", "", b"x", [], [[1.0], []], {}, object(), 1j, 0, -1, 0.5, 2.5,
        1 - 1e-15, 1 - 1e-9, 1, 1e308, -1e308, 5e-324, 2**70, float("nan"), float("inf"),
        -float("inf"), Fraction(1, 3), np.float32(0.25), np.uint8(200), np.int64(-3),
        np.zeros(2), np.zeros((2, 2)), np.array(["a", "b"]), np.array([0.0, np.nan]),
        np.array([np.inf, 0.0]), np.array([0, 1]), np.array([True, False]), [0, 5], [None, 1],
    ]
)  # fmt: skip
CALLS = {
    "q_value_iteration": (
        q_value_iteration,
        {"mdp", "gamma", "threshold", "progress"},
    ),
    "value_iteration": (value_iteration, {"mdp", "gamma", "tolerance", "progress"}),
    "policy_iteration": (policy_iteration, {"mdp", "gamma", "progress"}),
    "policy_evaluation": (policy_evaluation, {"mdp", "gamma", "policy"}),
    "greedy_policy": (greedy_policy, {"Q"}),
    "optimal_actions": (optimal_actions, {"Q", "tolerance"}),
}


def complaint(function, arguments):
    """Return what the function says; nothing to say is right for any argument."""
    try:
        function(**arguments)
    except (TypeError, ValueError, ArithmeticError) as error:
        return str(error)
    return " ".join(arguments)


@settings(max_examples=400, deadline=None)
@given(name=st.sampled_from(sorted(CALLS)), data=st.data())
def test_odd_arguments_are_named_or_do(name, data):
    function, names = CALLS[name]
    given_right = {
        "mdp": ring(1.0, 2.0), "gamma": 0.5, "policy": [0, 0], "V": [0.0, 1.0], "Q": [[0.0, 1.0]],
        "progress": False,
    }  # fmt: skip
    arguments = {key: value for key, value in given_right.items() if key in names}
    odd = data.draw(st.sampled_from(sorted(names)))
    arguments[odd] = data.draw(ODD)
    assert odd in complaint(function, arguments)


@pytest.mark.parametrize("planner", [q_value_iteration, value_iteration, policy_iteration])
@pytest.mark.parametrize("gamma", [1, 1.0, -0.1, 1.5, float("nan"), float("inf"), 1 - 1e-9])
def test_gamma_out_of_range(planner, gamma):
    with pytest.raises(ValueError, match="gamma must be a number from 0"):
        planner(Maze().model(), gamma=gamma)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda m: value_iteration(Maze(), gamma=0.9), TypeError, "mdp must be an MDP .*Maze"),
        (lambda m: value_iteration(m, gamma="0.9"), TypeError, "gamma must be a number .*'0.9'"),
        (lambda m: value_iteration(m, gamma=True), TypeError, "gamma must be a number .*True"),
        (
            lambda m: value_iteration(m, gamma=0.9, tolerance=0),
            ValueError,
            "tolerance must be a fin",
        ),
        (lambda m: value_iteration(m, gamma=0.9, tolerance=np.inf), ValueError, "tolerance .* inf"),
        (lambda m: value_iteration(m, gamma=0.9, tolerance=None), TypeError, "tolerance must be a"),
        (lambda m: q_value_iteration(m, gamma=0.9, threshold=-1), ValueError, "threshold .* -1"),
        (
            lambda m: policy_evaluation(m, np.full(112, 4), gamma=0.9),
            ValueError,
            "policy must be an array of integers from 0 to 3, in state 0 it is 4",
        ),
        (lambda m: policy_evaluation(m, np.full(112, -1), gamma=0.9), ValueError, "it is -1"),
        (
            lambda m: policy_evaluation(m, np.zeros(112), gamma=0.9),
            TypeError,
            "policy .*integers .*float64",
        ),
        (lambda m: greedy_policy([1.0, 2.0]), ValueError, "Q must be an array of numbers of shape"),
        (lambda m: greedy_policy([[1.0], [np.nan]]), ValueError, r"Q must be finite, at \(1, 0\)"),
        (
            lambda m: optimal_actions([[1.0]], tolerance=-1),
            ValueError,
            "tolerance must be a fin",
        ),
    ],
)
def test_wrong_arguments(call, error, message):
    with pytest.raises(error, match=message):
        call(Maze().model())
