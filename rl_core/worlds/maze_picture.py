"""A picture of a maze as an array of pixels, for frames of an animation.

Shapes are given in cell units (a cell is the square [0, 1] × [0, 1], y downwards) and drawn by
Pillow at four times the size, which gives soft edges when it is made smaller again.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from math import cos, pi, sin

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from rl_core.kernels.arrays import Bools

Cell = tuple[int, int]
Colour = tuple[int, int, int]

CELL_PIXELS = 96
"""Side of a cell; less in mazes that would be wider or higher than `MAX_PIXELS`."""
MAX_PIXELS = 1536
SUPERSAMPLING = 4

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
    walls: Bools,
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
    tiles: dict[Cell, _Tile] = {}

    def tile(cell: Cell) -> _Tile:
        return tiles.setdefault(cell, _Tile(side))

    tile(start).square(0.06, SKY_BLUE)
    tile(start).square(0.12, FLOOR)
    for goal in goals:
        for radius, colour in ((0.40, GREEN), (0.28, WHITE), (0.16, GREEN)):
            tile(goal).disc(0.5, 0.5, radius, colour)
    for flag, cell in flag_cells.items():
        tile(cell).flag(taken=flag in held)
    for radius, colour in ((0.34, WHITE), (0.30, BLUE)):
        tile(agent).disc(0.5, 0.5, radius, colour)
    for x, y, radius in _dots(len(held)):
        tile(agent).disc(x, y, radius, YELLOW)

    # canvas[row, y, column, x] is a pixel; canvas[row, :, column] one cell.
    wall = np.full((side, side, 3), WALL, dtype=np.uint8)
    canvas = np.where(walls[:, None, :, None, None], wall[:, None], _Tile(side).pixels()[:, None])
    for (row, column), drawn in tiles.items():
        canvas[row, :, column] = drawn.pixels()
    rows, columns = walls.shape
    return canvas.reshape(rows * side, columns * side, 3)


class _Tile:
    """One cell of the floor, to draw on."""

    def __init__(self, side: int) -> None:
        self._size = SUPERSAMPLING * side
        self._image = Image.new("RGB", (self._size, self._size), LINE)
        self._draw = ImageDraw.Draw(self._image)
        self._polygon(FLOOR, (0, 0), (0.98, 0), (0.98, 0.98), (0, 0.98))  # the rest is the grid

    def pixels(self) -> NDArray[np.uint8]:
        """Return red, green and blue, shape (side, side, 3)."""
        return np.asarray(self._image.reduce(SUPERSAMPLING))

    def square(self, margin: float, colour: Colour) -> None:
        """Fill what lies inside a margin."""
        far = 1 - margin
        self._polygon(colour, (margin, margin), (far, margin), (far, far), (margin, far))

    def disc(self, x: float, y: float, radius: float, colour: Colour) -> None:
        """Fill a disc: as above, half a pixel smaller all round."""
        centre = x * self._size - 0.5, y * self._size - 0.5
        self._draw.circle(centre, radius * self._size - 0.5, colour)

    def flag(self, taken: bool) -> None:
        """Draw a pole with a pennant, or what is left of it."""
        self._polygon(POLE, (0.275, 0.12), (0.325, 0.12), (0.325, 0.88), (0.275, 0.88))
        self._polygon(POLE, (0.18, 0.83), (0.42, 0.83), (0.42, 0.88), (0.18, 0.88))
        self._polygon(POLE if taken else VERMILLION, (0.325, 0.13), (0.80, 0.31), (0.325, 0.49))
        if taken:
            self._polygon(FLOOR, (0.35, 0.168), (0.725, 0.31), (0.35, 0.452))

    def _polygon(self, colour: Colour, *corners: tuple[float, float]) -> None:
        """Fill a polygon: Pillow counts the pixels on the rim as inside."""
        last = self._size - 1
        self._draw.polygon([(x * last, y * last) for x, y in corners], colour)


def _dots(number: int) -> list[tuple[float, float, float]]:
    """Return x, y and radius of dots: one in the middle, several in a ring."""
    if number == 1:
        return [(0.5, 0.5, 0.08)]
    angles = [2 * pi * i / number for i in range(number)]
    radius = min(0.07, 0.5 / max(number, 1))
    return [(0.5 + 0.16 * sin(t), 0.5 - 0.16 * cos(t), radius) for t in angles]
