"""Maze layouts as text: reading and checking them, and drawing them at random.

A layout has one letter a cell: `S` start, `G` goal, `F` flag, `W` wall, `O` open floor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
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
