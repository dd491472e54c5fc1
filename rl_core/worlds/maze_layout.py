"""Maze layouts as text: reading and checking them, and drawing them at random.

A layout has one letter a cell: `S` start, `G` goal, `F` flag, `W` wall, `O` open floor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from rl_core import checks
from rl_core.kernels.arrays import I32, Bools
from rl_core.kernels.compiled import compiled

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
    _check_start_and_flags(letters)
    _check_goals(letters)
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


def random_layout(
    rows: int, columns: int, flags: int, wall_fraction: float, rng: np.random.Generator
) -> NDArray[np.str_]:
    """Draw the letters of a random maze whose goal and flags can be reached from the start.

    A random spanning tree of the grid grows from a random start; then leaves of the tree are
    walled up, one drawn at random after another, until the asked number of walls stands. The
    cells left are still joined by the tree, whatever was drawn, so no draw is ever thrown away. The
    goal is a leaf: without it the others are joined too. The flags lie on cells drawn from
    the rest.

    Parameters
    ----------
    rows, columns : int
        Size of the grid, at least 1 each.
    flags : int
        Number of flags, 0 to 16.
    wall_fraction : float
        Share of the cells that are walls, in [0, 1): exactly `round(wall_fraction * rows *
        columns)` cells are. Enough cells must be left for start, goal and flags.
    rng : numpy.random.Generator
        The source of randomness: the same state of it gives the same layout.

    Returns
    -------
    ndarray of str, shape (rows, columns)
        One letter a cell.

    Raises
    ------
    TypeError
        If an argument has the wrong type.
    ValueError
        If an argument is out of its range, or too few free cells would be left.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.worlds.maze_layout import find, random_layout
    >>> letters = random_layout(4, 6, flags=2, wall_fraction=0.25, rng=np.random.default_rng(1))
    >>> len(find(letters, "W"))
    6
    """
    rows = checks.integer("rows", rows, 1)
    columns = checks.integer("columns", columns, 1)
    flags = checks.integer("flags", flags, 0, MAX_FLAGS)
    wall_fraction = checks.number("wall_fraction", wall_fraction, 0, below=1)
    checks.generator("rng", rng)
    n_cells = rows * columns
    checks.require(n_cells < 2**31, "rows * columns", n_cells, "below 2**31")
    n_walls = round(wall_fraction * n_cells)
    free, needed = n_cells - n_walls, f"such that {2 + flags} cells are free, with {flags} flags"
    checks.require(free >= 2 + flags, "rows, columns and wall_fraction", free, needed)
    start = int(rng.integers(rows * columns))
    parent = _spanning_tree(rows, columns, start, rng)
    walls, leaves = _wall_up_leaves(parent, n_walls, rng)
    goal = int(rng.choice(leaves))
    others = np.flatnonzero(~walls)
    others = others[(others != start) & (others != goal)]
    letters = np.where(walls, "W", "O")
    letters[rng.choice(others, size=flags, replace=False)] = "F"
    letters[[start, goal]] = "S", "G"
    return letters.reshape(rows, columns)


def _rows(layout: object) -> list[str]:
    """Return the rows of a layout, checked to be equally long and of known letters."""
    if isinstance(layout, str):
        layout = layout.strip().splitlines()
    allowed = "a text or a sequence of texts, one a row"
    lines = [
        checks.instance("layout", line, str, allowed)
        for line in checks.instance("layout", layout, Sequence, allowed)
    ]
    rows = ["".join(line.split()) for line in lines]
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


def _check_start_and_flags(letters: NDArray[np.str_]) -> None:
    starts = find(letters, "S")
    places = " and ".join(f"at row {row}, column {column}" for row, column in starts[:2])
    _require(len(starts) == 1, "with one start S", f"{len(starts)} {places}".rstrip())
    n_flags = len(find(letters, "F"))
    _require(n_flags <= MAX_FLAGS, f"with at most {MAX_FLAGS} flags F", str(n_flags))


def _check_goals(letters: NDArray[np.str_]) -> None:
    """Check that there are goals and that each can be reached.

    A slip does not matter here: whatever its probability, some action leads in every direction.
    """
    goals = find(letters, "G")
    _require(goals, "with a goal G", "none")
    # Regions of cells joined by moves, but not through a goal, for there the episode ends.
    region, _ = ndimage.label((letters != "W") & (letters != "G"))
    (start,) = find(letters, "S")
    reached = ndimage.binary_dilation(region == region[start])
    for row, column in goals:
        found = f"one that cannot be reached, at row {row}, column {column}"
        _require(reached[row, column], "with goals that can be reached from the start", found)


@compiled
def _spanning_tree(rows: int, columns: int, root: int, rng: np.random.Generator) -> I32:
    """Return each cell's parent in a random tree over the grid; the root is its own parent.

    Cells are numbered row by row. The tree grows by an edge drawn from those that leave it.
    """
    n_cells = rows * columns
    parent = np.full(n_cells, -1, dtype=np.int32)
    edges = np.empty((4 * n_cells + 1, 2), dtype=np.int32)  # (cell, its parent if it is joined so)
    edges[0] = root
    n_edges = 1
    while n_edges > 0:
        drawn = rng.integers(0, n_edges)
        cell, origin = edges[drawn]
        n_edges -= 1
        edges[drawn] = edges[n_edges]
        if parent[cell] >= 0:  # joined by another edge meanwhile
            continue
        parent[cell] = origin
        row, column = cell // columns, cell % columns
        for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1)):
            if 0 <= row + down < rows and 0 <= column + right < columns:
                beside = cell + down * columns + right
                if parent[beside] < 0:
                    edges[n_edges, 0] = beside
                    edges[n_edges, 1] = cell
                    n_edges += 1
    return parent


@compiled
def _wall_up_leaves(parent: I32, n_walls: int, rng: np.random.Generator) -> tuple[Bools, I32]:
    """Take `n_walls` random leaves off the tree, one by one; return walls and the leaves left.

    The root stays and is not counted as a leaf.
    """
    n_cells = len(parent)
    children = np.zeros(n_cells, dtype=np.int32)
    for cell in range(n_cells):
        children[parent[cell]] += 1  # the root is its own child: never a leaf
    leaves = np.empty(n_cells, dtype=np.int32)
    n_leaves = 0
    for cell in range(n_cells):
        if children[cell] == 0:
            leaves[n_leaves] = cell
            n_leaves += 1
    walls = np.zeros(n_cells, dtype=np.bool_)
    for _ in range(n_walls):
        drawn = rng.integers(0, n_leaves)
        cell = leaves[drawn]
        n_leaves -= 1
        leaves[drawn] = leaves[n_leaves]
        walls[cell] = True
        children[parent[cell]] -= 1
        if children[parent[cell]] == 0:
            leaves[n_leaves] = parent[cell]
            n_leaves += 1
    return walls, leaves[:n_leaves]
