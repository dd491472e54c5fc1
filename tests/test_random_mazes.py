"""Random mazes: always a maze, of exactly the size asked for, the same for the same seed."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rl_core.worlds.maze_layout import find, read_layout
from studies.random_mazes import random_layout, random_maze


def reached_cells(letters: np.ndarray) -> set[tuple[int, int]]:
    """Flood from the start; the goal is reached but not passed."""
    front = find(letters, "S")
    reached = set(front)
    while front:
        row, column = front.pop()
        if letters[row, column] == "G":
            continue
        for to in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
            inside = 0 <= to[0] < letters.shape[0] and 0 <= to[1] < letters.shape[1]
            if inside and to not in reached and letters[to] != "W":
                reached.add(to)
                front.append(to)
    return reached


@given(data=st.data(), seed=st.integers(0, 10**6))
@settings(max_examples=200, deadline=None)
def test_all_that_is_free_can_be_reached(data: st.DataObject, seed: int) -> None:
    rows = data.draw(st.integers(1, 9))
    columns = data.draw(st.integers(1 if rows > 1 else 2, 9))
    free = data.draw(st.integers(2, rows * columns))
    flags = data.draw(st.integers(0, min(16, free - 2)))
    wall_fraction = 1 - free / (rows * columns)
    letters = random_layout(rows, columns, flags, wall_fraction, np.random.default_rng(seed))
    assert letters.shape == (rows, columns)
    numbers = {letter: len(find(letters, letter)) for letter in "SGFWO"}
    assert numbers == {
        "S": 1,
        "G": 1,
        "F": flags,
        "W": rows * columns - free,
        "O": free - 2 - flags,
    }
    assert len(reached_cells(letters)) == free
    np.testing.assert_array_equal(read_layout(["".join(row) for row in letters]), letters)


def test_same_seed_same_layout() -> None:
    def draw(seed: int) -> str:
        return "".join(random_layout(12, 15, 3, 0.3, np.random.default_rng(seed)).ravel())

    assert draw(0) == draw(0)
    assert len({draw(seed) for seed in range(20)}) == 20


def test_narrow_integers_do_not_overflow() -> None:
    size = np.uint8(200)
    narrow = random_layout(size, size, np.uint8(3), 0.3, np.random.default_rng(0))
    wide = random_layout(200, 200, 3, 0.3, np.random.default_rng(0))
    np.testing.assert_array_equal(narrow, wide)


def test_every_cell_can_be_anything() -> None:
    rng = np.random.default_rng(0)
    seen: list[set[str]] = [set() for _ in range(9)]
    for _ in range(600):
        for cell, letter in enumerate(random_layout(3, 3, 1, 0.34, rng).ravel()):
            seen[cell].add(str(letter))
    assert all(letters == set("SGFWO") for letters in seen)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"rows": 0}, ValueError, "rows must be an integer from 1, got 0"),
        ({"columns": -2}, ValueError, "columns must be an integer from 1, got -2"),
        ({"flags": -1}, ValueError, "flags must be an integer from 0 to 16, got -1"),
        ({"flags": 17}, ValueError, "flags must be an integer from 0 to 16, got 17"),
        ({"wall_fraction": -0.1}, ValueError, "wall_fraction.*-0.1"),
        ({"wall_fraction": 1.0}, ValueError, "wall_fraction.*1.0"),
        ({"wall_fraction": float("nan")}, ValueError, "wall_fraction.*nan"),
        ({"wall_fraction": 0.9}, ValueError, "wall_fraction must be such that 4 cells .*got 2"),
        (
            {"rows": 1, "columns": 3},
            ValueError,
            "rows, columns and wall_.*2 flags, got 2",
        ),
        ({"rows": 2**16, "columns": 2**15}, ValueError, "rows . columns .*below 2..31, got 2147"),
        ({"wall_fraction": "0.3"}, TypeError, "wall_fraction must be a number .*'0.3'"),
        ({"rows": 2.0}, TypeError, "rows must be an integer .*2.0"),
        ({"flags": "2"}, TypeError, "flags must be an integer .*'2'"),
        ({"rng": 0}, TypeError, "rng must be a numpy.random.Generator, got 0"),
    ],
)
def test_impossible_requests_are_named(
    changes: dict[str, Any], error: type[Exception], message: str
) -> None:
    request: dict[str, Any] = {
        "rows": 4,
        "columns": 5,
        "flags": 2,
        "wall_fraction": 0.3,
        "rng": np.random.default_rng(0),
    }
    with pytest.raises(error, match=message):
        random_layout(**(request | changes))


def test_random_maze_is_a_maze_of_the_asked_size() -> None:
    maze = random_maze(7, 9, 2, 0.3, np.random.default_rng(0), slip=0.2)
    assert maze.walls.shape == (7, 9)
    assert maze.walls.sum() == round(0.3 * 63)
    assert maze.observation_space.n == (63 - 19) * 4
    assert maze.slip == 0.2
    other = random_maze(7, 9, 2, 0.3, np.random.default_rng(0), slip=0.2)
    assert maze.layout == other.layout
    with pytest.raises(ValueError, match="slip"):
        random_maze(7, 9, 2, 0.3, np.random.default_rng(0), slip=2.0)
