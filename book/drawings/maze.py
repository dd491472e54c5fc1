"""Drawings of the Maze: values and optimal actions by situation, and a film of an agent."""

from collections.abc import Iterator
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from numpy.typing import NDArray

from drawings.look import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILLION
from rl_core.checks import floats, integer, integers, one_of, require
from rl_core.maze import CLOCKWISE, MOVES, Maze
from rl_core.planning import optimal_actions

WALL = "#3b3b3b"
FLOOR = "#f4f1e8"
# The light part of a scale that gets darker evenly, from yellow to blue: told apart with every
# common colour blindness, and black numbers and arrows stay readable on all of it.
VALUES: Colormap = ListedColormap(plt.get_cmap("YlGnBu")(np.linspace(0.0, 0.58, 256)))


def situation_figure(
    maze: Maze, Q: NDArray[np.float64], flags: str, *, highest: float | None = None
) -> Figure:
    """Draw the maze with the value and the optimal action of each cell, for one set of flags.

    The value is V(s) = max_a Q(s, a); an arrow stands for each action within 1e-9 of it. A cell
    that no episode can be in with these flags (a flag's cell without its flag) is hatched.

    Parameters
    ----------
    maze : Maze
        The maze.
    Q : ndarray of float64, shape (S, 4)
        Action values.
    flags : str
        The letters of the flags held.
    highest : float, optional
        The value of the darkest colour; by default the largest in `Q`, so that the figures
        of all situations share one scale.

    Returns
    -------
    matplotlib.figure.Figure
        Closed for pyplot, so that a notebook shows it only where it is asked to.

    Raises
    ------
    TypeError, ValueError
        If `Q` has another shape or a value that is not finite, or the maze no such flags.

    Examples
    --------
    >>> maze = Maze()
    >>> figure = situation_figure(maze, np.zeros((112, 4)), "AB")
    >>> figure.axes[0].get_title(loc="left")
    'Situation 5: flags A and B held'
    """
    one_of("flags", flags, maze.flag_sets)
    Q = floats("Q", Q, (len(maze.reachable_states()), len(MOVES)))
    rows, columns = maze.walls.shape
    figure = plt.figure(figsize=(0.92 * columns + 0.2, 0.92 * rows + 0.5))
    axes = figure.add_subplot()
    draw_maze(axes, maze, flags)
    reachable = maze.reachable_states()
    best = optimal_actions(Q)
    top = float(Q.max()) if highest is None else highest
    for row, column in maze.cells.tolist():
        if (row, column) in maze.goals:
            note = f"pays {len(flags)}"
            axes.text(column + 0.5, row + 0.8, note, ha="center", va="center", fontsize=10)
            continue
        state = maze.state(row, column, flags)
        value = float(Q[state].max())
        colour = VALUES(value / top if top else 0.0)
        axes.add_patch(Rectangle((column, row), 1, 1, fc=colour, lw=0, zorder=1))
        if not reachable[state]:
            hatch = Rectangle((column, row), 1, 1, fc="none", ec="#00000055", lw=0, hatch="////")
            axes.add_patch(hatch)
        axes.text(
            *(column + 0.5, row + 0.82, f"{value:.3f}"),
            ha="center",
            va="center",
            fontsize=11,
            style="normal" if reachable[state] else "italic",
            bbox={"fc": colour, "ec": "none", "pad": 1.2},
        )
        for action in np.flatnonzero(best[state]):
            _arrow(axes, row, column, int(action))
    number = maze.flag_sets.index(flags) + 1
    axes.set_title(f"Situation {number}: {_held(flags)}", loc="left", fontsize=12)
    plt.close(figure)
    return figure


def draw_maze(axes: Axes, maze: Maze, flags: str) -> None:
    """Draw walls, grid, start, goals and flags (held: an empty outline) into `axes`."""
    rows, columns = maze.walls.shape
    axes.set(xlim=(-0.04, columns + 0.04), ylim=(rows + 0.04, -0.04), aspect="equal")
    axes.axis("off")
    for row, column in np.ndindex(maze.walls.shape):
        wall = bool(maze.walls[row, column])
        colour = WALL if wall else FLOOR
        axes.add_patch(Rectangle((column, row), 1, 1, fc=colour, ec="white", lw=1.5, zorder=0))
    for edge in range(rows + 1):
        axes.plot([0, columns], [edge, edge], color="white", lw=1.5, ls="-", zorder=3)
    for edge in range(columns + 1):
        axes.plot([edge, edge], [0, rows], color="white", lw=1.5, ls="-", zorder=3)
    start_row, start_column = maze.start
    _letter(axes, start_row, start_column, "S", BLUE)
    for row, column in maze.goals:
        axes.add_patch(
            Rectangle((column + 0.05, row + 0.05), 0.9, 0.9, fc="none", ec=GREEN, lw=3, zorder=4)
        )
        axes.text(
            *(column + 0.5, row + 0.42, "G"),
            ha="center",
            va="center",
            fontsize=20,
            weight="bold",
            color="#00563f",
            zorder=5,
        )
    for letter, (row, column) in maze.flag_cells.items():
        _flag(axes, row, column, letter, held=letter in flags)


def _held(flags: str) -> str:
    if not flags:
        return "no flag held"
    if len(flags) == 1:
        return f"flag {flags} held"
    return f"flags {', '.join(flags[:-1])} and {flags[-1]} held"


def _letter(axes: Axes, row: int, column: int, letter: str, colour: str) -> None:
    axes.text(
        *(column + 0.14, row + 0.2, letter),
        ha="center",
        va="center",
        fontsize=12,
        weight="bold",
        color=colour,
        zorder=5,
    )


def _flag(axes: Axes, row: int, column: int, letter: str, *, held: bool) -> None:
    """Draw a flag on its pole: filled where it waits, a dashed outline where it was taken."""
    x, y = column + 0.09, row + 0.08
    axes.plot([x, x], [y, y + 0.46], color=BLACK, lw=1.5, ls="-", zorder=5)
    axes.add_patch(
        Polygon(
            [(x, y), (x + 0.26, y + 0.12), (x, y + 0.24)],
            fc="none" if held else VERMILLION,
            ec=BLACK,
            lw=0.9,
            ls="--" if held else "-",
            zorder=5,
        )
    )
    axes.text(x + 0.06, y + 0.37, letter, ha="left", va="center", fontsize=9, zorder=5)


def _arrow(axes: Axes, row: int, column: int, action: int) -> None:
    """Draw an arrow from the middle of the cell's upper part towards the move."""
    down, right = MOVES[action]
    x, y = column + 0.56, row + 0.4
    axes.annotate(
        "",
        xy=(x + 0.27 * right, y + 0.27 * down),
        xytext=(x - 0.05 * right, y - 0.05 * down),
        arrowprops={"arrowstyle": "-|>,head_length=0.45,head_width=0.24", "lw": 2.2, "fc": BLACK},
        zorder=6,
    )


class Move(NamedTuple):
    """One step of an episode: where from, what was meant, whether it slipped, where to."""

    state: int
    action: int
    slipped: bool
    next_state: int
    reward: float


def follow_policy(maze: Maze, policy: NDArray[np.integer], *, seed: int) -> list[Move]:
    """Run one episode of a policy in the environment and note every move.

    Parameters
    ----------
    maze : Maze
        The environment; it is reset.
    policy : ndarray of int, shape (S,)
        The action of each state.
    seed : int
        Seeds the environment.

    Returns
    -------
    list of Move
        The moves up to the goal.

    Raises
    ------
    TypeError, ValueError
        If the policy has another shape, or something else than actions.
    RuntimeError
        If the goal is not reached within 10,000 moves.

    Examples
    --------
    >>> down_right = np.ones(112, dtype=int)
    >>> down_right[8:] = 3
    >>> down_right[13 * 8 :] = 0
    >>> moves = follow_policy(Maze(slip=0), down_right, seed=0)
    >>> len(moves), moves[-1].next_state
    (6, 96)
    """
    actions = integers("policy", policy, 0, len(MOVES) - 1)
    n_states = len(maze.reachable_states())
    require(len(actions) == n_states, "policy", len(actions), f"of {n_states} actions")
    state, _ = maze.reset(seed=integer("seed", seed))
    moves: list[Move] = []
    for _ in range(10_000):
        action = actions[state]
        next_state, reward, terminated, _, info = maze.step(action)
        moves.append(Move(state, action, info["slipped"], next_state, reward))
        state = next_state
        if terminated:
            return moves
    raise RuntimeError("policy did not reach the goal within 10,000 moves")


def episode_frames(
    maze: Maze, moves: list[Move], *, frames_per_move: int = 8
) -> Iterator[NDArray[np.uint8]]:
    """Draw an episode as frames of a film: the agent, what it meant, and where it slipped.

    Each move shows first the arrow of the intended action; the disc then glides to where the move
    led. A slip turns the arrow to an outline, the disc orange, and the caption says so.

    Parameters
    ----------
    maze : Maze
        The maze.
    moves : list of Move
        The episode, as `follow_policy` returns it.
    frames_per_move : int
        Frames for one move, at least 3.

    Returns
    -------
    iterator of ndarray of uint8, shape (height, width, 3)
        The frames.

    Raises
    ------
    TypeError, ValueError
        If there is no move, or fewer than three frames for one.
    """
    frames_per_move = integer("frames_per_move", frames_per_move, 3)
    require(moves, "moves", moves, "one move or more")
    return _frames(maze, moves, frames_per_move)


def _frames(maze: Maze, moves: list[Move], frames_per_move: int) -> Iterator[NDArray[np.uint8]]:
    stages = {held: _Stage(maze, held) for held in maze.flag_sets}
    slips = 0
    for number, move in enumerate(moves, start=1):
        slips += move.slipped
        for t in np.linspace(0, 1, frames_per_move):
            yield _frame(maze, stages, move, float(t), f"move {number}, slips so far {slips}")
    last = moves[-1]
    ending = f"goal after {len(moves)} moves, {slips} slips: reward {last.reward:.0f}"
    for _ in range(2 * frames_per_move):
        yield _frame(maze, stages, last, 1.0, ending)


class _Stage:
    """The maze as the agent finds it, drawn once; what moves is drawn over a copy of it."""

    def __init__(self, maze: Maze, held: str) -> None:
        rows, columns = maze.walls.shape
        height = 0.9 * rows + 0.4
        figure = Figure(figsize=(0.9 * columns, height), dpi=100)
        figure.set_layout_engine("none")
        self.canvas = FigureCanvasAgg(figure)
        self.axes = figure.add_axes((0, 0, 1, 0.9 * rows / height))
        draw_maze(self.axes, maze, held)
        self.canvas.draw()
        self.empty = self.canvas.copy_from_bbox(figure.bbox)

    def picture(self, *artists: Artist) -> NDArray[np.uint8]:
        self.canvas.restore_region(self.empty)
        for artist in artists:
            self.axes.draw_artist(artist)
            artist.remove()
        return np.asarray(self.canvas.buffer_rgba())[:, :, :3].copy()


def _frame(
    maze: Maze, stages: dict[str, _Stage], move: Move, t: float, caption: str
) -> NDArray[np.uint8]:
    from_row, from_column, held_before = maze.locate(move.state)
    to_row, to_column, held_after = maze.locate(move.next_state)
    stage = stages[held_after if t > 0.75 else held_before]
    slipping = move.slipped and t > 0.2
    row, column = from_row + t * (to_row - from_row), from_column + t * (to_column - from_column)
    if (from_row, from_column) == (to_row, to_column):  # lean towards the wall and come back
        down, right = MOVES[CLOCKWISE[move.action] if move.slipped else move.action]
        lean = 0.25 * float(np.sin(np.pi * t))
        row, column = from_row + lean * down, from_column + lean * right
    words = caption + (" – slips!" if slipping else "")
    title = stage.axes.text(0.1, -0.12, words, weight="bold", va="bottom")
    disc = Circle((column + 0.5, row + 0.5), 0.24, fc=ORANGE if slipping else BLUE, ec=BLACK)
    down, right = MOVES[move.action]
    arrow = stage.axes.annotate(
        "",
        xy=(from_column + 0.5 + 0.62 * right, from_row + 0.5 + 0.62 * down),
        xytext=(from_column + 0.5, from_row + 0.5),
        arrowprops={
            "arrowstyle": "-|>,head_length=0.6,head_width=0.35",
            "lw": 2.5,
            "color": GREY if slipping else BLACK,
            "ls": ":" if slipping else "-",
        },
    )
    arrow.set_visible(t < 0.9)
    return stage.picture(title, stage.axes.add_patch(disc), arrow)
