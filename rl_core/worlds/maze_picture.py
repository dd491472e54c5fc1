"""A picture of a maze as an array of pixels, for frames of an animation."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

CELL_PIXELS, MAX_PIXELS = 96, 1536
"""Side of a cell; less in mazes that would be wider or higher than 1536 pixels."""

# The palette of Okabe and Ito, which colour-blind readers can tell apart, and greys.
GROUND = {"S": (86, 180, 233), "G": (0, 158, 115), "W": (60, 60, 60)}
FLOOR, INK, BLUE, VERMILLION = (246, 246, 246), (90, 90, 90), (0, 114, 178), (213, 94, 0)


def draw_maze(
    rows: Sequence[str],
    flag_cells: Mapping[str, tuple[int, int]],
    held: Collection[str],
    agent: tuple[int, int],
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
    >>> from rl_core.worlds.maze_picture import draw_maze
    >>> draw_maze(["SFG"], {"A": (0, 1)}, held="", agent=(0, 0)).shape
    (96, 288, 3)
    """
    side = max(1, min(CELL_PIXELS, MAX_PIXELS // max(len(rows), len(rows[0]))))
    ground = np.array([[GROUND.get(letter, FLOOR) for letter in row] for row in rows], np.uint8)
    image = Image.fromarray(ground.repeat(side, axis=0).repeat(side, axis=1))
    draw = ImageDraw.Draw(image)

    def at(cell: tuple[int, int], *points: tuple[float, float]) -> list[tuple[float, float]]:
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
