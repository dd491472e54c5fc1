"""Layouts as they are read, and their picture: its size, its colours, what tells states apart."""

import numpy as np

from rl_core.worlds.maze_layout import (
    BLUE,
    COURSE_LAYOUT,
    FLOOR,
    GROUND,
    INK,
    VERMILLION,
    draw_maze,
    find,
    read_layout,
)

ROWS = ["SWG", "FOF"]
FLAGS = {"A": (1, 0), "B": (1, 2)}


def test_the_course_layout_as_read() -> None:
    letters = read_layout(COURSE_LAYOUT)
    assert letters.shape == (4, 5)
    assert find(letters, "S") == [(0, 0)]
    assert find(letters, "F") == [(0, 2), (3, 0), (3, 3)]
    assert find(letters, "W") == [(0, 1), (0, 3), (2, 0), (2, 4), (3, 2), (3, 4)]


def draw(held: str, agent: tuple[int, int] = (1, 1)) -> np.ndarray:
    return draw_maze(ROWS, FLAGS, held, agent)


def pixels_of(picture: np.ndarray, row: int, column: int, colour: tuple[int, ...]) -> int:
    """How many pixels of a cell have exactly this colour."""
    cell = picture[row * 96 : (row + 1) * 96, column * 96 : (column + 1) * 96]
    return int((cell == colour).all(axis=2).sum())


def test_each_cell_shows_what_is_there() -> None:
    picture = draw(held="A")
    assert picture.shape == (192, 288, 3)
    assert picture.dtype == np.uint8
    assert pixels_of(picture, 0, 1, GROUND["W"]) == 96 * 96
    assert pixels_of(picture, 0, 0, GROUND["S"]) > 5000
    assert pixels_of(picture, 0, 2, GROUND["G"]) > 5000
    assert pixels_of(picture, 1, 0, VERMILLION) == 0  # held: the outline is left
    assert pixels_of(picture, 1, 0, INK) > 100
    assert pixels_of(picture, 1, 2, VERMILLION) > 500
    assert pixels_of(picture, 1, 1, BLUE) > 1000


def test_start_and_goal_bear_their_letters() -> None:
    assert 100 < pixels_of(draw(""), 0, 0, FLOOR) != pixels_of(draw(""), 0, 2, FLOOR) > 100


def test_the_agent_is_seen_wherever_it_is() -> None:
    for row, column in np.argwhere(np.array([[*row] for row in ROWS]) != "W"):
        assert pixels_of(draw("A", (row, column)), row, column, BLUE) > 1000


def test_large_mazes_get_smaller_cells() -> None:
    assert draw_maze(["S" + "O" * 398 + "G"] * 3, {}, "", (1, 1)).shape == (9, 1200, 3)
    assert draw_maze(["SO"] * 2000, {}, "", (1, 1)).shape == (2000, 2, 3)


def test_what_means_different_things_has_different_colours() -> None:
    palette = np.array([BLUE, VERMILLION, FLOOR, *GROUND.values()], dtype=float)
    distance = np.linalg.norm(palette[:, None] - palette, axis=2)
    assert distance[~np.eye(len(palette), dtype=bool)].min() > 70
