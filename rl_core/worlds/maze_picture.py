"""A picture of a maze as an array of pixels, for frames of an animation.

Shapes are given in units of a cell, which is the square [0, 1] × [0, 1], y downwards.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from rl_core.kernels.arrays import Bools

Cell = tuple[int, int]
Colour = tuple[int, int, int]

CELL_PIXELS = 96
"""Side of a cell; less in mazes that would be wider or higher than `MAX_PIXELS`."""
MAX_PIXELS = 1536

# The palette of Okabe and Ito, which colour-blind readers can tell apart, and greys.
BLUE = (0, 114, 178)
SKY_BLUE = (86, 180, 233)
GREEN = (0, 158, 115)
VERMILLION = (213, 94, 0)
YELLOW = (240, 228, 66)
WHITE = (255, 255, 255)
FLOOR = (246, 246, 246)
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
    >>> import numpy as np
    >>> from rl_core.worlds.maze_picture import draw_maze
    >>> walls = np.zeros((1, 3), dtype=bool)
    >>> picture = draw_maze(walls, (0, 0), [(0, 2)], {"A": (0, 1)}, held="", agent=(0, 0))
    >>> picture.shape, picture.dtype
    ((96, 288, 3), dtype('uint8'))
    """
    side = max(1, min(CELL_PIXELS, MAX_PIXELS // max(walls.shape)))
    ground = np.where(walls[:, :, None], WALL, FLOOR).astype(np.uint8)
    image = Image.fromarray(ground.repeat(side, axis=0).repeat(side, axis=1))
    draw = ImageDraw.Draw(image)

    def at(cell: Cell, *points: tuple[float, float]) -> list[tuple[float, float]]:
        row, column = cell
        return [((column + x) * side, (row + y) * side) for x, y in points]

    def disc(cell: Cell, x: float, y: float, radius: float, colour: Colour) -> None:
        draw.ellipse(at(cell, (x - radius, y - radius), (x + radius, y + radius)), colour)

    draw.rectangle(at(start, (0.06, 0.06), (0.94, 0.94)), outline=SKY_BLUE, width=1 + side // 16)
    for goal in goals:
        for radius, colour in ((0.40, GREEN), (0.28, WHITE), (0.16, GREEN)):
            disc(goal, 0.5, 0.5, radius, colour)
    for flag, cell in flag_cells.items():
        draw.rectangle(at(cell, (0.27, 0.12), (0.33, 0.88)), POLE)
        pennant = at(cell, (0.33, 0.13), (0.80, 0.31), (0.33, 0.49))
        draw.polygon(pennant, FLOOR if flag in held else VERMILLION, outline=POLE)
    for radius, colour in ((0.34, WHITE), (0.30, BLUE)):
        disc(agent, 0.5, 0.5, radius, colour)
    for i in range(len(held)):
        down, right = divmod(i, 4)
        disc(agent, 0.35 + 0.1 * right, 0.35 + 0.1 * down, 0.04, YELLOW)
    return np.asarray(image)
