"""The picture of a maze: its size, its colours, and what tells states apart."""

import numpy as np

from rl_core.worlds.maze_picture import (
    BLUE,
    FLOOR,
    GREEN,
    SKY_BLUE,
    VERMILLION,
    WALL,
    YELLOW,
    draw_maze,
)

WALLS = np.array([[False, True, False], [False, False, False]])


def draw(held: str, agent: tuple[int, int] = (1, 1)) -> np.ndarray:
    return draw_maze(WALLS, (0, 0), [(0, 2)], {"A": (1, 0), "B": (1, 2)}, held, agent)


def pixels_of(picture: np.ndarray, row: int, column: int, colour: tuple[int, ...]) -> int:
    """How many pixels of a cell have exactly this colour."""
    cell = picture[row * 96 : (row + 1) * 96, column * 96 : (column + 1) * 96]
    return int((cell == colour).all(axis=2).sum())


def test_each_cell_shows_what_is_there() -> None:
    picture = draw(held="A")
    assert picture.shape == (192, 288, 3)
    assert picture.dtype == np.uint8
    assert pixels_of(picture, 0, 1, WALL) == 96 * 96
    assert pixels_of(picture, 0, 0, SKY_BLUE) > 500
    assert pixels_of(picture, 0, 2, GREEN) > 1000
    assert pixels_of(picture, 1, 0, VERMILLION) == 0  # held: the outline is left
    assert pixels_of(picture, 1, 2, VERMILLION) > 500
    assert pixels_of(picture, 1, 1, BLUE) > 1000
    assert pixels_of(picture, 0, 0, FLOOR) > 5000


def test_a_held_flag_leaves_an_outline_and_gives_a_dot() -> None:
    cell = np.s_[96:192, 0:96]
    taken, bare = draw(held="A")[cell], draw_maze(WALLS, (0, 0), [], {}, "", (1, 1))[cell]
    assert (taken != bare).any(axis=2).sum() > 200
    dots = [pixels_of(draw(held), 1, 1, YELLOW) for held in ("", "A", "AB")]
    assert dots[0] == 0 < dots[1] < dots[2]


def test_area_of_the_disc_is_right() -> None:
    # Its radius is 0.30 cells.
    assert abs(pixels_of(draw(held=""), 1, 1, BLUE) / (np.pi * 0.09 * 96**2) - 1) < 0.03


def test_large_mazes_get_smaller_cells() -> None:
    walls = np.zeros((3, 400), dtype=bool)
    assert draw_maze(walls, (0, 0), [(2, 399)], {}, "", (1, 1)).shape == (9, 1200, 3)
    walls = np.zeros((2000, 2), dtype=bool)
    assert draw_maze(walls, (0, 0), [(1999, 1)], {}, "", (1, 1)).shape == (2000, 2, 3)


def test_sixteen_flags_fit_on_the_agent() -> None:
    flags = dict.fromkeys("ABCDEFGHIJKLMNOP", (1, 2))
    picture = draw_maze(WALLS, (0, 0), [(0, 2)], flags, "ABCDEFGHIJKLMNOP", (1, 1))
    assert pixels_of(picture, 1, 1, YELLOW) > 16 * 5


def test_what_means_different_things_has_different_colours() -> None:
    picture = draw(held="A", agent=(0, 0))  # on the start: the frame is seen around the agent
    assert pixels_of(picture, 0, 0, SKY_BLUE) > 500
    assert pixels_of(picture, 0, 0, BLUE) > 1000
    palette = np.array([BLUE, SKY_BLUE, GREEN, VERMILLION, YELLOW, FLOOR, WALL], dtype=float)
    distance = np.linalg.norm(palette[:, None] - palette, axis=2)
    assert distance[~np.eye(len(palette), dtype=bool)].min() > 70
