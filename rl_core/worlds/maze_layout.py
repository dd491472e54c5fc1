"""Maze layouts as text: reading and checking them, and pictures of them.

A layout has one letter a cell: `S` start, `G` goal, `F` flag, `W` wall, `O` open floor.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy import ndimage

from rl_core import checks

COURSE_LAYOUT = """\
SWFWG
OOOOO
WOOOW
FOWFW
"""
"""The maze of the course (ESE 650, University of Pennsylvania, 2018)."""

LETTERS = frozenset("SGFWO")
MAX_FLAGS = 16

Cell = tuple[int, int]
"""A cell as (row, column); row 0 is at the top."""

CELL_PIXELS, MAX_PIXELS = 96, 1536
"""Side of a cell; less in mazes that would be wider or higher than 1536 pixels."""

# The palette of Okabe and Ito, which colour-blind readers can tell apart, and greys.
GROUND = {"S": (86, 180, 233), "G": (0, 158, 115), "W": (60, 60, 60)}
FLOOR, INK, BLUE, VERMILLION = (246, 246, 246), (90, 90, 90), (0, 114, 178), (213, 94, 0)


def read_layout(layout: str | Sequence[str]) -> NDArray[np.str_]:
    """Return the letters of a layout as an array of shape (rows, columns), checked to be a maze.

    Parameters
    ----------
    layout : str or sequence of str
        The rows, as lines of one text or one by one; blanks between letters are ignored.

    Raises
    ------
    TypeError
        If `layout` is not text.
    ValueError
        If a row is ragged, a letter unknown, there is not exactly one start, no goal, a goal that
        cannot be reached from the start without passing through another, or more than 16 flags.

    Examples
    --------
    >>> from rl_core.worlds.maze_layout import read_layout
    >>> read_layout("SOG")
    array([['S', 'O', 'G']], dtype='<U1')
    """
    rows = _rows(layout)
    letters = np.array(rows).view("U1").reshape(len(rows), -1)
    starts, goals = find(letters, "S"), find(letters, "G")
    places = " and ".join(f"at row {row}, column {column}" for row, column in starts[:2])
    _require(len(starts) == 1, "with one start S", f"{len(starts)} {places}".rstrip())
    n_flags = np.count_nonzero(letters == "F")
    _require(n_flags <= MAX_FLAGS, f"with at most {MAX_FLAGS} flags F", str(n_flags))
    _require(goals, "with a goal G", "none")
    # Regions of cells joined by moves, but not through a goal, for there the episode ends. A slip
    # does not matter: whatever its probability, some action leads in every direction.
    region, _ = ndimage.label((letters != "W") & (letters != "G"))
    reached = ndimage.binary_dilation(region == region[starts[0]])
    for row, column in goals:
        found = f"one that cannot be reached, at row {row}, column {column}"
        _require(reached[row, column], "with goals that can be reached from the start", found)
    return letters


def find(letters: NDArray[np.str_], letter: str) -> list[Cell]:
    """Return the cells with a letter, row by row.

    Examples
    --------
    >>> from rl_core.worlds.maze_layout import COURSE_LAYOUT, find, read_layout
    >>> find(read_layout(COURSE_LAYOUT), "F")
    [(0, 2), (3, 0), (3, 3)]
    """
    return [(row, column) for row, column in np.argwhere(letters == letter).tolist()]


def _rows(layout: object) -> list[str]:
    """Return the rows of a layout, checked to be equally long and of known letters."""
    if isinstance(layout, str):
        layout = layout.strip().splitlines()
    allowed = "a text or a sequence of texts, one a row"
    lines = checks.instance("layout", layout, Sequence, allowed)
    rows = ["".join(checks.instance("layout", line, str, allowed).split()) for line in lines]
    checks.require(rows and rows[0], "layout", layout, "at least one row with at least one letter")
    for number, row in enumerate(rows):
        found = f"{len(row)} letters in row {number}, {len(rows[0])} in row 0"
        _require(len(row) == len(rows[0]), "of rows of equal length", found)
        for column in (row.index(letter) for letter in set(row) - LETTERS):
            found = f"{row[column]!r} at row {number}, column {column}"
            _require(False, "of the letters S, G, F, W, O", found)
    return rows


def _require(condition: object, allowed: str, found: str) -> None:
    if not condition:
        raise ValueError(f"layout must be {allowed}, got {found}")


def draw_maze(
    rows: Sequence[str],
    flag_cells: Mapping[str, Cell],
    held: Collection[str],
    agent: Cell,
) -> NDArray[np.uint8]:
    """Draw a maze and the agent in it.

    Walls are dark squares, start and goals are coloured ones with their letter, a flag is a
    vermillion pennant, of which only the outline is left once it is held. The agent is a blue disc.

    Parameters
    ----------
    rows : sequence of str
        The layout, a letter a cell.
    flag_cells : mapping of str to tuple of int
        Each flag's cell as (row, column).
    held : collection of str
        The flags held.
    agent : tuple of int
        The agent's cell.

    Returns
    -------
    ndarray of uint8, shape (rows * side, columns * side, 3)
        Red, green and blue; `side` is 96 pixels, or less in mazes of more than 16 rows or columns.

    Examples
    --------
    >>> from rl_core.worlds.maze_layout import draw_maze
    >>> draw_maze(["SFG"], {"A": (0, 1)}, held="", agent=(0, 0)).shape
    (96, 288, 3)
    """
    side = max(1, min(CELL_PIXELS, MAX_PIXELS // max(len(rows), len(rows[0]))))
    ground = np.array([[GROUND.get(letter, FLOOR) for letter in row] for row in rows], np.uint8)
    image = Image.fromarray(ground.repeat(side, axis=0).repeat(side, axis=1))
    draw = ImageDraw.Draw(image)

    def at(cell: Cell, *points: tuple[float, float]) -> list[tuple[float, float]]:
        return [((cell[1] + x) * side, (cell[0] + y) * side) for x, y in points]

    for row, column in np.ndindex(len(rows), len(rows[0])):
        if (letter := rows[row][column]) in "SG":
            (middle,) = at((row, column), (0.5, 0.5))
            draw.text(middle, letter, fill=FLOOR, anchor="mm", font_size=side / 2)
    for flag, cell in flag_cells.items():
        pennant = at(cell, (0.3, 0.1), (0.8, 0.3), (0.3, 0.5), (0.3, 0.9))
        draw.polygon(pennant, FLOOR if flag in held else VERMILLION, outline=INK)
    draw.ellipse(at(agent, (0.2, 0.2), (0.8, 0.8)), BLUE, outline=FLOOR, width=1 + side // 32)
    return np.asarray(image)
