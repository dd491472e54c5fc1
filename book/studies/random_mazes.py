"""Mazes of any size, drawn at random: what planning is tried on beside the course's Maze."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rl_core import checks
from rl_core.kernels.arrays import I32, Bools
from rl_core.kernels.compiled import compiled
from rl_core.maze import Maze
from rl_core.worlds.maze_layout import MAX_FLAGS


def random_maze(
    rows: int,
    columns: int,
    flags: int,
    wall_fraction: float,
    rng: np.random.Generator,
    slip: float = 0.1,
) -> Maze:
    """Draw a random maze whose goal and flags can all be reached from the start.

    See `random_layout` for how it is drawn.

    Parameters
    ----------
    rows, columns : int
        Size of the grid.
    flags : int
        How many flags there are, at most 16.
    wall_fraction : float
        Exactly `round(wall_fraction * rows * columns)` cells are walls.
    rng : numpy.random.Generator
        The same state of it gives the same maze.
    slip : float
        Probability of slipping, in [0, 1].

    Returns
    -------
    Maze
        The maze, not yet reset.

    Raises
    ------
    TypeError, ValueError
        As `random_layout` and `Maze` raise them.

    Examples
    --------
    >>> import numpy as np
    >>> from studies.random_mazes import random_maze
    >>> maze = random_maze(4, 6, flags=2, wall_fraction=0.25, rng=np.random.default_rng(1))
    >>> maze.observation_space
    Discrete(72)
    """
    letters = random_layout(rows, columns, flags, wall_fraction, rng)
    return Maze(["".join(row) for row in letters], slip=slip)


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
    >>> from rl_core.worlds.maze_layout import find
    >>> from studies.random_mazes import random_layout
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
