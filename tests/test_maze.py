"""The Maze: its numbering and dynamics against a second writing of them, and Gymnasium's rules."""

import copy
import itertools
import subprocess
import sys
import tracemalloc
from collections import Counter
from fractions import Fraction
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

import rl_core  # noqa: F401  (registers the Maze)
from bench.planning import held_bytes
from rl_core.maze import CLOCKWISE, Maze
from rl_core.mdp import MDP
from rl_core.worlds.maze_layout import COURSE_LAYOUT
from studies.random_mazes import random_maze

COURSE_CELLS = [
    (0, 0), (1, 0), (3, 0), (1, 1), (2, 1), (3, 1), (0, 2),
    (1, 2), (2, 2), (1, 3), (2, 3), (3, 3), (0, 4), (1, 4),
]  # fmt: skip
FLAG_SETS = ("", "A", "B", "C", "AB", "AC", "BC", "ABC")


# A second writing of the maze: states are (row, column, frozenset of flags' cells), and the moves
# are points of a compass.
COMPASS = {"up": "north", "right": "east", "down": "south", "left": "west"}
TURN = {"north": "east", "east": "south", "south": "west", "west": "north"}
Place = tuple[int, int, frozenset[tuple[int, int]]]


def go(rows: list[str], place: Place, point: str) -> tuple[Place, float, bool]:
    row, column, held = place
    if rows[row][column] == "G":
        return place, 0.0, True
    if point in ("north", "south"):
        to = (row - 1, column) if point == "north" else (row + 1, column)
    else:
        to = (row, column - 1) if point == "west" else (row, column + 1)
    if not (0 <= to[0] < len(rows) and 0 <= to[1] < len(rows[0])):
        to = (row, column)  # pushed against the edge: enters its own cell again
    letter = rows[to[0]][to[1]]
    if letter == "W":
        return place, 0.0, False
    if letter == "F":
        held = held | {to}
    return (*to, held), float(len(held)) if letter == "G" else 0.0, letter == "G"


def places(rows: list[str]) -> list[Place]:
    """All states in the order of their numbers."""
    size = range(len(rows)), range(len(rows[0]))
    flags = [(r, c) for r in size[0] for c in size[1] if rows[r][c] == "F"]
    sets = [
        frozenset(chosen)
        for number in range(len(flags) + 1)
        for chosen in itertools.combinations(flags, number)
    ]
    cells = [(r, c) for c in size[1] for r in size[0] if rows[r][c] != "W"]
    return [(r, c, held) for r, c in cells for held in sets]


def assert_model_is_that_of(layout: str, slip: float) -> None:
    rows = layout.split()
    model = Maze(layout, slip).model()
    numbered = places(rows)
    number = {place: i for i, place in enumerate(numbered)}
    assert model.successor.shape == (len(numbered), 4, 2)
    for s, place in enumerate(numbered):
        assert model.terminal[s] == (rows[place[0]][place[1]] == "G")
        for a, action in enumerate(("up", "down", "left", "right")):
            point = COMPASS[action]
            for k, (towards, p) in enumerate(((point, 1 - slip), (TURN[point], slip))):
                following, reward, _ = go(rows, place, towards)
                assert model.successor[s, a, k] == number[following]
                assert model.reward[s, a, k] == reward
                assert model.probability[s, a, k] == p
    (start,) = [i for i, (r, c, held) in enumerate(numbered) if rows[r][c] == "S" and not held]
    assert model.start_state.tolist() == [start]
    assert model.start_probability.tolist() == [1.0]


def optimal_q(model: MDP, gamma: float, sweeps: int) -> np.ndarray:
    """Q* by value iteration over dense matrices."""
    s, a, k = model.successor.shape
    transition = np.zeros((s, a, s))
    for i in range(k):
        np.add.at(
            transition,
            (np.arange(s)[:, None], np.arange(a), model.successor[:, :, i]),
            model.probability[:, :, i],
        )
    expected = (model.probability * model.reward).sum(axis=2)
    q = np.zeros((s, a))
    for _ in range(sweeps):
        q = expected + gamma * transition @ q.max(axis=1)
    return q


# The course's maze


def test_numbering_of_the_course() -> None:
    maze = Maze()
    assert [tuple(cell) for cell in maze.cells.tolist()] == COURSE_CELLS
    assert maze.flag_sets == FLAG_SETS
    assert maze.flag_cells == {"A": (0, 2), "B": (3, 0), "C": (3, 3)}
    assert maze.start == (0, 0)
    assert maze.goals == ((0, 4),)
    for state in range(112):
        cell, flag_set = divmod(state, 8)
        assert maze.locate(state) == (*COURSE_CELLS[cell], FLAG_SETS[flag_set])
        assert maze.state(*COURSE_CELLS[cell], FLAG_SETS[flag_set]) == state


def test_course_model_equals_the_second_writing() -> None:
    assert_model_is_that_of(COURSE_LAYOUT, 0.1)


def test_pushing_against_the_edge_collects_and_against_a_wall_does_not() -> None:
    maze = Maze()
    on_a, on_c = maze.state(0, 2), maze.state(3, 3)  # unreachable: on a flag without it
    up, down, left, right = range(4)
    intended = maze.model().successor[:, :, 0]
    assert intended[on_a, up] == maze.state(0, 2, "A")
    assert intended[on_a, left] == intended[on_a, right] == on_a
    assert intended[on_c, down] == maze.state(3, 3, "C")
    assert intended[on_c, left] == intended[on_c, right] == on_c


def test_counts_of_states() -> None:
    maze = Maze()
    model, reachable = maze.model(), maze.reachable_states()
    assert model.n_states == 112
    assert model.terminal.sum() == 8
    assert reachable.sum() == 100
    assert (reachable & ~model.terminal).sum() == 92
    unreachable = [maze.locate(s) for s in np.flatnonzero(~reachable)]
    flag_at = {cell: flag for flag, cell in maze.flag_cells.items()}
    assert len(unreachable) == 12
    assert all(flag_at[row, column] not in held for row, column, held in unreachable)


def test_norms_of_the_optimal_q_values() -> None:
    maze = Maze()
    q = optimal_q(maze.model(), 0.9, 1000)
    assert np.linalg.norm(q) == pytest.approx(25.256, abs=5e-4)
    assert np.linalg.norm(q[~maze.reachable_states()]) == pytest.approx(7.957, abs=5e-4)
    assert not q[maze.model().terminal].any()


# Other mazes


@st.composite
def layouts(draw: st.DrawFn, max_flags: int = 3) -> str:
    """Any grid of letters with one start and at least one goal; goals may be out of reach."""
    n_rows, n_columns = draw(st.integers(1, 5)), draw(st.integers(2, 5))
    n_cells = n_rows * n_columns
    letters = draw(st.lists(st.sampled_from("WOOF"), min_size=n_cells, max_size=n_cells))
    special = draw(st.permutations(range(n_cells)))
    letters[special[0]] = "S"
    for i in special[1 : 2 + draw(st.integers(0, min(1, n_cells - 2)))]:
        letters[i] = "G"
    flags = [i for i, letter in enumerate(letters) if letter == "F"]
    for i in flags[max_flags:]:
        letters[i] = "O"
    return "\n".join("".join(letters[r * n_columns :][:n_columns]) for r in range(n_rows))


def reached_cells(rows: list[str]) -> set[tuple[int, int]]:
    """Flood from the start; a goal is reached but not passed."""
    (start,) = [(r, row.index("S")) for r, row in enumerate(rows) if "S" in row]
    reached, front = {start}, [start]
    while front:
        r, c = front.pop()
        if rows[r][c] == "G":
            continue
        for to in ((r - 1, c), (r + 1, c), (r, c - 1), (r, c + 1)):
            inside = 0 <= to[0] < len(rows) and 0 <= to[1] < len(rows[0])
            if inside and rows[to[0]][to[1]] != "W" and to not in reached:
                reached.add(to)
                front.append(to)
    return reached


@given(layout=layouts(), slip=st.sampled_from([0.0, 0.1, 0.37, 1.0]))
@settings(max_examples=150, deadline=None)
def test_any_layout_is_refused_for_a_goal_out_of_reach_or_modelled_exactly(
    layout: str, slip: float
) -> None:
    rows = layout.split()
    goals = {(r, c) for r, row in enumerate(rows) for c in range(len(row)) if row[c] == "G"}
    lost = sorted(goals - reached_cells(rows))
    if lost:
        row, column = lost[0]
        with pytest.raises(ValueError, match=f"cannot be reached, at row {row}, column {column}$"):
            Maze(layout, slip)
    else:
        assert_model_is_that_of(layout, slip)


@given(layout=layouts(), seed=st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_terminal_states_absorb_and_flags_are_never_lost(layout: str, seed: int) -> None:
    try:
        maze = Maze(layout, slip=0.3)
    except ValueError:
        return
    model = maze.model()
    held = [set(maze.locate(s)[2]) for s in range(model.n_states)]
    for s, a, k in np.ndindex(model.successor.shape):
        following = model.successor[s, a, k]
        assert held[s] <= held[following]
        assert len(held[following] - held[s]) <= 1
        if model.terminal[s]:
            assert following == s
        rewarded = model.terminal[following] and not model.terminal[s]
        assert model.reward[s, a, k] == (len(held[following]) if rewarded else 0)
    # In whatever state an episode is, it is one of the reachable.
    reachable = maze.reachable_states()
    rng = np.random.default_rng(seed)
    state, _ = maze.reset(seed=seed)
    for _ in range(50):
        assert reachable[state]
        state, *_ = maze.step(int(rng.integers(4)))


@pytest.mark.parametrize("n_flags", [0, 1, 2, 4, 6, 9])
def test_flag_sets_are_ordered_by_size_then_alphabetically(n_flags: int) -> None:
    maze = Maze(["SG" + "F" * n_flags])
    letters = "ABCDEFGHI"[:n_flags]
    sets = [
        "".join(chosen)
        for number in range(n_flags + 1)
        for chosen in itertools.combinations(letters, number)
    ]
    assert maze.flag_sets == tuple(sets)
    for i, held in enumerate(sets):
        assert maze.state(0, 1, held) == 2**n_flags + i
        assert maze.locate(i) == (0, 0, held)


def test_sixteen_flags() -> None:
    maze = Maze("SFFFFFFFFFFFFFFFFG", slip=0.0)
    assert maze.observation_space.n == 18 * 2**16
    state, _ = maze.reset(seed=0)
    for _ in range(17):
        state, reward, terminated, _, info = maze.step(3)
    assert (reward, terminated, info["flags"]) == (16.0, True, "ABCDEFGHIJKLMNOP")
    assert state == maze.state(0, 17, "ABCDEFGHIJKLMNOP") == 18 * 2**16 - 1
    model = maze.model()
    assert model.reward.max() == 16
    assert model.reward[maze.state(0, 16, "ABC"), 3, 0] == 3


def test_always_slipping_is_never_slipping_turned_by_a_quarter() -> None:
    firm, icy = Maze(slip=0.0).model(), Maze(slip=1.0).model()
    turned = list(CLOCKWISE)
    np.testing.assert_array_equal(icy.successor[:, :, 1], firm.successor[:, turned, 0])
    assert icy.probability[0, 0].tolist() == [0.0, 1.0]
    np.testing.assert_allclose(optimal_q(icy, 0.9, 300), optimal_q(firm, 0.9, 300)[:, turned])


def test_without_slips_the_value_is_that_of_the_shortest_tour() -> None:
    maze = Maze("SOFOG", slip=0.0)
    q = optimal_q(maze.model(), 0.5, 100)
    assert q[maze.state(0, 0), 3] == 0.5**3
    assert q[maze.state(0, 3), 2] == 0.5**2
    assert q[maze.state(0, 3), 3] == 0.0


@pytest.mark.parametrize(
    "layout",
    [
        COURSE_LAYOUT,
        "SWFWG\nOOOOO\nWOOOW\nFOWFW",
        "\n  S W F W G \n  O O O O O\n  W O O O W\n  F O W F W\n",
        ["SWFWG", "OOOOO", "WOOOW", "FOWFW"],
        ("S W F W G", "O O O O O", "W O O O W", "F O W F W"),
    ],
)
def test_ways_to_write_a_layout(layout: Any) -> None:
    maze = Maze(layout)
    assert maze.layout == COURSE_LAYOUT
    np.testing.assert_array_equal(maze.model().successor, Maze().model().successor)


def test_several_goals_all_end_the_episode() -> None:
    maze = Maze("GSFG", slip=0.0)
    assert maze.goals == ((0, 0), (0, 3))
    maze.reset(seed=0)
    assert maze.step(2)[1:3] == (0.0, True)
    maze.reset(seed=0)
    maze.step(3)
    assert maze.step(3)[1:3] == (1.0, True)


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        ("SOG\nOO", r"layout.*equal length, got 2 letters in row 1, 3 in row 0"),
        ("SOG\n\nOOO", r"layout.*got 0 letters in row 1"),
        ("SOX", r"layout.*'X' at row 0, column 2"),
        ("SOG\nOgO", r"layout.*'g' at row 1, column 1"),
        ("SO0G", r"layout.*'0' at row 0, column 2"),
        ("SOëG", r"layout.*'ë' at row 0, column 2"),
        (["SO\0", "OOG"], r"layout.*'\\x00' at row 0, column 2"),
        ("OOG", r"layout.*one start S, got 0$"),
        ("SOG\nOOS", r"layout.*one start S, got 2 at row 0, column 0 and at row 1, column 2"),
        ("SOO", r"layout.*a goal G, got none"),
        ("SWG", r"layout.*cannot be reached, at row 0, column 2"),
        ("SOG\nWWW\nOGO", r"layout.*cannot be reached, at row 2, column 1"),
        ("SGG", r"layout.*cannot be reached, at row 0, column 2"),
        ("SW\nWG", r"layout.*cannot be reached, at row 1, column 1"),
        ("SG" + "F" * 17, r"layout.*at most 16 flags F, got 17"),
        ("", r"layout must be at least one row"),
        ([], r"layout must be at least one row"),
        (["", ""], r"layout must be at least one row"),
    ],
)
def test_malformed_layouts_are_named(layout: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Maze(layout)


@pytest.mark.parametrize("slip", [-0.1, 1.1, float("nan"), float("inf")])
def test_slip_outside_its_range(slip: float) -> None:
    with pytest.raises(ValueError, match=f"slip must be a number from 0 to 1, got {slip}"):
        Maze(slip=slip)


def test_arguments_of_the_wrong_type() -> None:
    with pytest.raises(TypeError, match=r"slip must be a number from 0 to 1, got '0\.1'"):
        Maze(slip="0.1")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="slip must be a number from 0 to 1, got True"):
        Maze(slip=True)
    with pytest.raises(TypeError, match=r"layout must be a text .*, got 1"):
        Maze([1, 2])  # type: ignore[list-item]
    with pytest.raises(TypeError, match="layout must be a text"):
        Maze(3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"render_mode .*'rgb_array' or None, got 'human'"):
        Maze(render_mode="human")
    assert Maze(slip=np.float32(0.25)).slip == 0.25
    assert Maze(slip=0).slip == 0.0
    assert Maze(slip=Fraction(1, 10)).model().probability[0, 0].tolist() == [0.9, 0.1]


ODD = [
    None, True, "0.9", "", b"x", [], [[1.0], []], {}, object(), 1j, -1, 2.5, 1e308, 5e-324, 2**70,
    float("nan"), float("inf"), Fraction(1, 3), np.float32(0.25), np.uint8(200), np.int64(-3),
    np.array(3), np.zeros(2), np.array(["a", "b"]), np.array([0.0, np.nan]), [None, 1], iter("SG"),
    int, 2**31, range(3),
]  # fmt: skip
MADE = Maze()
CALLS = {
    Maze: {"layout": "SG", "slip": 0.1, "render_mode": None},
    MADE.state: {"row": 0, "column": 0, "flags": ""},
    MADE.locate: {"state": 0},
    MDP: {
        "successor": [[[0]]], "probability": [[[1.0]]], "reward": [[[1.0]]], "terminal": [False],
        "start_state": [0], "start_probability": [1.0],
    },
    MADE.model().following: {"policy": np.zeros(112, int)},
    MDP.from_env: {"env": "rl_core/Maze-v0", "start_distribution": None},
}  # fmt: skip


@pytest.mark.parametrize(
    ("function", "right", "name"),
    [(function, right, name) for function, right in CALLS.items() for name in right],
    ids=lambda value: getattr(value, "__qualname__", value if isinstance(value, str) else ""),
)
def test_odd_arguments_are_named_or_do(function: Any, right: dict[str, Any], name: str) -> None:
    for odd in ODD:
        message = name
        try:
            function(**{**right, name: odd})
        except (TypeError, ValueError) as error:
            message = str(error)
        assert name in message, odd


def test_too_many_states() -> None:
    row = "O" * 200
    layout = ["S" + row[1:], *[row] * 198, "F" * 16 + row[17:] + "G"]
    with pytest.raises(ValueError, match=r"layout must be of fewer .*40000 free cells and 16 f"):
        Maze(layout)


def test_places_and_states_that_do_not_exist() -> None:
    maze = Maze()
    for row, column in ((-1, 0), (4, 0)):
        with pytest.raises(ValueError, match=f"row must be an integer from 0 to 3, got {row}"):
            maze.state(row, column)
    with pytest.raises(ValueError, match="column must be an integer from 0 to 4, got 5"):
        maze.state(0, 5)
    with pytest.raises(ValueError, match=r"row, column must be a free cell, got \(0, 1\)"):
        maze.state(0, 1)
    for row, column in ((0.5, 0), (0, "1"), (True, 0), (None, 0)):
        with pytest.raises(TypeError, match=r"(row|column) must be an integer from 0"):
            maze.state(row, column)
    for flags in ("AD", [3], [["A"]]):
        with pytest.raises(ValueError, match=r"flags must be among \['A', 'B', 'C'\], got "):
            maze.state(0, 0, flags)
    with pytest.raises(TypeError, match="flags must be letters of flags, got 1"):
        maze.state(0, 0, 1)  # type: ignore[arg-type]
    for state in (-1, 112):
        with pytest.raises(ValueError, match=f"state must be .* from 0 to 111, got {state}"):
            maze.locate(state)
    for state in (1.5, True, "1"):
        with pytest.raises(TypeError, match=f"state must be an integer .*, got {state!r}"):
            maze.locate(state)  # type: ignore[arg-type]
    assert maze.locate(np.int16(111)) == (1, 4, "ABC")  # type: ignore[arg-type]


# Episodes


def test_step_draws_one_uniform_and_reset_none() -> None:
    maze = Maze(slip=0.3)
    model = maze.model()
    state, info = maze.reset(seed=7)
    assert (state, info["prob"]) == (0, 1.0)
    stream = np.random.default_rng(7)
    rng = np.random.default_rng(8)
    ended = 0
    for _ in range(3000):
        action = int(rng.integers(4))
        slot = int(np.argmax(np.cumsum(model.probability[state, action]) > stream.random()))
        expected = model.successor[state, action, slot]
        reward = model.reward[state, action, slot]
        state, given_reward, terminated, truncated, info = maze.step(action)
        assert (state, given_reward, terminated) == (expected, reward, model.terminal[expected])
        assert not truncated
        row, column, flags = maze.locate(state)
        assert info == {
            "prob": (0.7, 0.3)[slot],
            "row": row,
            "column": column,
            "flags": flags,
            "slipped": slot == 1,
        }
        if terminated:
            ended += 1
            state, _ = maze.reset()
            assert state == 0
    assert ended > 10


def test_observed_frequencies_agree_with_the_model() -> None:
    maze = Maze()
    model = maze.model()
    counts: Counter[tuple[int, int, int]] = Counter()
    visits: Counter[tuple[int, int]] = Counter()
    rng = np.random.default_rng(1)
    state, _ = maze.reset(seed=1)
    for action in rng.integers(4, size=40_000).tolist():
        following, _, terminated, _, _ = maze.step(action)
        counts[state, action, following] += 1
        visits[state, action] += 1
        state = maze.reset()[0] if terminated else following
    tested = 0
    for (s, a), n in visits.items():
        expected: Counter[int] = Counter()
        for k in range(2):
            expected[int(model.successor[s, a, k])] += model.probability[s, a, k]
        seen = {f: c for (s_, a_, f), c in counts.items() if (s_, a_) == (s, a)}
        assert seen.keys() <= expected.keys()
        for following, p in expected.items():
            error = abs(seen.get(following, 0) - n * p)
            assert error <= 5.5 * np.sqrt(n * p * (1 - p)) + 1e-6
            tested += n > 100 and p < 1
    assert tested > 50


def test_same_seed_same_episode() -> None:
    def run(seed: int) -> list[tuple[int, float]]:
        maze = gym.make("rl_core/Maze-v0").unwrapped
        maze.reset(seed=seed)
        return [maze.step(action)[:2] for action in [1, 3, 1, 3, 0, 2, 1, 3] * 20]

    assert run(3) == run(3)
    assert run(3) != run(4)


def test_goal_absorbs_in_the_environment_too() -> None:
    maze = Maze("SFG", slip=0.0)
    maze.reset(seed=0)
    maze.step(3)
    state, reward, terminated, _, _ = maze.step(3)
    assert (reward, terminated) == (1.0, True)
    assert maze.step(2)[:3] == (state, 0.0, True)


def test_misuse_is_named() -> None:
    maze = Maze(render_mode="rgb_array")
    with pytest.raises(gym.error.ResetNeeded):
        maze.step(0)
    with pytest.raises(gym.error.ResetNeeded):
        maze.render()
    maze.reset()
    for action in (4, -1, 0.5, True, "up", None):
        with pytest.raises(ValueError, match=f"action must be 0, 1, 2 or 3, got {action!r}"):
            maze.step(action)  # type: ignore[arg-type]


# Gymnasium


@pytest.mark.parametrize("render_mode", [None, "rgb_array"])
def test_check_env_has_nothing_to_say(render_mode: str | None) -> None:
    check_env(Maze(render_mode=render_mode))
    check_env(gym.make("rl_core/Maze-v0", render_mode=render_mode).unwrapped)


def test_made_with_other_arguments() -> None:
    env = gym.make("rl_core/Maze-v0", layout="SOFOG", slip=0.5)
    assert env.observation_space == gym.spaces.Discrete(10)
    env.reset(seed=0)
    assert env.step(3)[4]["prob"] == 0.5
    assert env.get_wrapper_attr("model")().n_states == 10


def test_an_environment_can_make_another_like_it() -> None:
    maze = Maze("SOFOG", slip=0.25, render_mode="rgb_array")
    assert maze.spec is not None
    other = maze.spec.make().unwrapped
    assert isinstance(other, Maze)
    assert (other.layout, other.slip, other.render_mode) == ("SOFOG\n", 0.25, "rgb_array")


def test_a_copy_goes_on_from_where_the_maze_is() -> None:
    maze = Maze()
    maze.reset(seed=2)
    maze.step(1)
    other = copy.deepcopy(maze)
    actions = [3, 1, 3, 0] * 25
    assert [maze.step(a) for a in actions] == [other.step(a) for a in actions]


def test_vectorised() -> None:
    envs = gym.make_vec("rl_core/Maze-v0", num_envs=3, vectorization_mode="sync")
    states, _ = envs.reset(seed=0)
    assert states.tolist() == [0, 0, 0]
    states, *_ = envs.step(np.array([1, 1, 1]))
    assert set(states.tolist()) <= {8, 0}
    envs.close()


def test_rgb_array_shows_every_state_differently() -> None:
    maze = Maze(render_mode="rgb_array")
    maze.reset(seed=0)
    pictures = set()
    for state in np.flatnonzero(maze.reachable_states()):
        maze._state = int(state)
        picture = maze.render()
        assert picture.dtype == np.uint8
        assert picture.shape == (4 * 96, 5 * 96, 3)
        pictures.add(picture.tobytes())
    assert len(pictures) == 100


def test_rendering_without_a_mode_warns() -> None:
    maze = Maze()
    maze.reset()
    with pytest.warns(UserWarning, match="render_mode"):
        assert maze.render() is None


# Size


def test_a_model_of_a_million_states_takes_a_hundred_bytes_a_state() -> None:
    Maze().model()  # compile first
    maze = random_maze(354, 354, 3, 0.0, np.random.default_rng(0))
    tracemalloc.start()
    try:
        model = maze.model()
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert model.n_states == 354 * 354 * 8
    assert held_bytes(model) <= 98 * model.n_states
    assert peak <= 100 * model.n_states
    assert maze.model() is model


def test_importing_the_package_does_not_import_torch() -> None:
    code = "import sys, rl_core, rl_core.maze; sys.exit('torch' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
