"""A picture of a maze as an array of pixels, for frames of an animation.

Shapes are given in cell units (a cell is the square [0, 1] × [0, 1], y downwards) and drawn with
soft edges: a pixel takes on a colour by the share of it that the shape covers.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from functools import cache

import numpy as np
from numpy.typing import NDArray

Cell = tuple[int, int]
Mask = NDArray[np.float64]

CELL_PIXELS = 96
"""Side of a cell; less in mazes that would be wider or higher than `MAX_PIXELS`."""
MAX_PIXELS = 1536
SUBPIXELS = 4
"""A pixel's coverage is measured at `SUBPIXELS` × `SUBPIXELS` points."""

# The palette of Okabe and Ito, which colour-blind readers can tell apart, and greys.
BLUE = (0, 114, 178)
SKY_BLUE = (86, 180, 233)
GREEN = (0, 158, 115)
VERMILLION = (213, 94, 0)
YELLOW = (240, 228, 66)
WHITE = (255, 255, 255)
FLOOR = (246, 246, 246)
LINE = (214, 214, 214)
POLE = (90, 90, 90)
WALL = (60, 60, 60)


def draw_maze(
    walls: NDArray[np.bool_],
    start: Cell,
    goals: Iterable[Cell],
    flag_cells: Mapping[str, Cell],
    held: Collection[str],
    agent: Cell,
) -> NDArray[np.uint8]:
    """Draw a maze and the agent in it.

    Walls are dark squares, the start is a sky-blue frame, a goal a green target, a flag a
    vermillion pennant, of which only the outline is left once it is held. The agent is a blue disc
    with a yellow dot for each flag held. No meaning hangs on colour alone.

    Parameters
    ----------
    walls : ndarray of bool, shape (rows, columns)
        Where the walls are.
    start, agent : tuple of int
        Cells as (row, column).
    goals : iterable of tuple of int
        The goals' cells.
    flag_cells : mapping of str to tuple of int
        Each flag's cell.
    held : collection of str
        The flags held.

    Returns
    -------
    ndarray of uint8, shape (rows * side, columns * side, 3)
        Red, green and blue; `side` is 96 pixels, or less in mazes of more than 16 rows or columns.

    Examples
    --------
    >>> walls = np.zeros((1, 3), dtype=bool)
    >>> picture = draw_maze(walls, (0, 0), [(0, 2)], {"A": (0, 1)}, held="", agent=(0, 0))
    >>> picture.shape, picture.dtype
    ((96, 288, 3), dtype('uint8'))
    """
    side = max(1, min(CELL_PIXELS, MAX_PIXELS // max(walls.shape)))
    floor = _painted(np.full((side, side, 3), FLOOR, dtype=np.float64), _edge(side), LINE)
    wall = np.full((side, side, 3), WALL, dtype=np.float64)
    canvas = np.where(walls[:, None, :, None, None], wall[:, None], floor[:, None])
    # canvas[row, y, column, x] is a pixel; canvas[row, :, column] one cell.
    _stamp(canvas, start, _frame(side), SKY_BLUE)
    for goal in goals:
        for radius, colour in ((0.40, GREEN), (0.28, WHITE), (0.16, GREEN)):
            _stamp(canvas, goal, _disc(side, 0.5, 0.5, radius), colour)
    for flag, cell in flag_cells.items():
        _stamp(canvas, cell, _pole(side), POLE)
        if flag in held:
            _stamp(canvas, cell, _pennant_outline(side), POLE)
        else:
            _stamp(canvas, cell, _pennant(side), VERMILLION)
    for radius, colour in ((0.34, WHITE), (0.30, BLUE)):
        _stamp(canvas, agent, _disc(side, 0.5, 0.5, radius), colour)
    for x, y, radius in _dots(len(held)):
        _stamp(canvas, agent, _disc(side, x, y, radius), YELLOW)
    rows, columns = walls.shape
    return np.rint(canvas).astype(np.uint8).reshape(rows * side, columns * side, 3)


def _stamp(canvas: NDArray[np.float64], cell: Cell, mask: Mask, colour: tuple[int, ...]) -> None:
    row, column = cell
    canvas[row, :, column] = _painted(canvas[row, :, column], mask, colour)


def _painted(
    pixels: NDArray[np.float64], mask: Mask, colour: tuple[int, ...]
) -> NDArray[np.float64]:
    """Lay a colour over pixels where, and as far as, the mask covers them."""
    return pixels + mask[:, :, None] * (np.array(colour) - pixels)


def _dots(number: int) -> list[tuple[float, float, float]]:
    """Return x, y and radius of dots: one in the middle, several in a ring."""
    if number == 1:
        return [(0.5, 0.5, 0.08)]
    angles = 2 * np.pi * np.arange(number) / max(number, 1)
    radius = min(0.07, 0.5 / max(number, 1))
    return [(0.5 + 0.16 * np.sin(t), 0.5 - 0.16 * np.cos(t), radius) for t in angles.tolist()]


def _coverage(inside: NDArray[np.bool_]) -> Mask:
    """Return the covered share of each pixel, from points inside or outside a shape."""
    side = len(inside) // SUBPIXELS
    share: Mask = inside.reshape(side, SUBPIXELS, side, SUBPIXELS).mean(axis=(1, 3))
    return share


def _points(side: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x (as a row) and y (as a column) of the points at which shapes are measured."""
    at = (np.arange(side * SUBPIXELS) + 0.5) / (side * SUBPIXELS)
    return at[None, :], at[:, None]


@cache
def _disc(side: int, centre_x: float, centre_y: float, radius: float) -> Mask:
    x, y = _points(side)
    return _coverage((x - centre_x) ** 2 + (y - centre_y) ** 2 < radius**2)


@cache
def _edge(side: int) -> Mask:
    """Cover the right and lower edge of a cell: together, the lines of the grid."""
    x, y = _points(side)
    return _coverage(np.maximum(x, y) > 0.98)


@cache
def _frame(side: int) -> Mask:
    x, y = _points(side)
    from_centre = np.maximum(abs(x - 0.5), abs(y - 0.5))
    return _coverage((from_centre > 0.38) & (from_centre < 0.44))


@cache
def _pole(side: int) -> Mask:
    x, y = _points(side)
    upright = (abs(x - 0.30) < 0.025) & (y > 0.12) & (y < 0.88)
    foot = (abs(x - 0.30) < 0.12) & (y > 0.83) & (y < 0.88)
    return _coverage(upright | foot)


def _in_pennant(side: int, margin: float) -> NDArray[np.bool_]:
    """Tell which points lie in the pennant, at least `margin` from its rim."""
    x, y = _points(side)
    left, tip, middle, half_height = 0.325, 0.80, 0.31, 0.18
    slope = half_height / (tip - left)
    rim = (tip - x) * slope - margin * np.hypot(1, slope)
    inside: NDArray[np.bool_] = (x > left + margin) & (abs(y - middle) < rim)
    return inside


@cache
def _pennant(side: int) -> Mask:
    return _coverage(_in_pennant(side, margin=0.0))


@cache
def _pennant_outline(side: int) -> Mask:
    return _coverage(_in_pennant(side, margin=0.0) & ~_in_pennant(side, margin=0.025))
