"""Chapter 2: the drawings that belong to it alone."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
from interactive import Widget, knob
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

from drawings.look import BLACK, BLUE, GREEN, GREY, ORANGE, SKY_BLUE, VERMILLION, label
from drawings.maze import VALUES, WALL
from rl_core.maze import MOVES
from rl_core.statistics import bootstrap_interval
from studies.q_learning import EPISODES
from studies.q_learning_world import World

STUCK = 10  # % of the optimum: a greedy policy that loses more is stuck
WIDTH = 5.6  # inches: small, so that the letters stay large on a phone


def band(axes: Axes, x: np.ndarray, curves: np.ndarray, *, colour: str, ls="-", name="") -> None:
    """Every seed faintly, the median strongly, and its 95% interval as a band."""
    # A line a pixel says no more than a line every few episodes.
    axes.plot(x, curves.T, color=colour, ls="-", lw=0.4, alpha=0.16, zorder=1)
    middle, low, high = bootstrap_interval(curves, rng=np.random.default_rng(2018))
    axes.fill_between(x, low, high, color=colour, alpha=0.3, lw=0, zorder=2)
    axes.plot(x, middle, color=colour, ls=ls, lw=1.8, zorder=3, label=name)


def figure_9(world: World, norms: np.ndarray, original: pd.DataFrame, level: float) -> Figure:
    """The report's figure 9, every seed over the curve of 2018; below, its lower end enlarged."""
    figure, (top, bottom) = plt.subplots(2, figsize=(WIDTH, 6.2), height_ratios=(3, 2))
    every = np.arange(0, EPISODES, 10)
    for axes in (top, bottom):
        axes.fill_between(
            *(original["episode"], original["low"], original["high"]),
            color=ORANGE,
            lw=2.5,
            zorder=0,
            label="2018 original",
        )
        name = f"median of {len(norms)} seeds, 95% band"
        band(axes, every + 1, norms[:, every], colour=BLUE, name=name)
        axes.axhline(
            world.plateau,
            color=BLACK,
            ls="--",
            lw=1.4,
            label=f"plateau from the model: {world.plateau:.3f}",
        )
        axes.set_xlim(0, EPISODES)
    bottom.axhline(
        level,
        color=VERMILLION,
        ls=":",
        lw=2,
        zorder=4,
        label=f"plateau and noise, predicted: {level:.3f}",
    )
    top.set_ylim(0, 27)
    bottom.set_ylim(7.93, 8.13)
    label(top, x="", y="‖Q − Q*‖ (reward units)", title="whole run")
    label(bottom, x="episode", y="‖Q − Q*‖", title="the same, its lower end enlarged")
    handles, names = bottom.get_legend_handles_labels()
    top.legend(handles, names, loc="upper right")
    plt.close(figure)
    return figure


def over_reported(norms: np.ndarray, table: pd.DataFrame, text: str) -> Figure:
    """The error of a few seeds with changed settings over that of all seeds as reported."""
    figure, axes = plt.subplots(figsize=(WIDTH, 3.4))
    every = np.arange(0, EPISODES, 10)
    band(axes, every + 1, norms[:, every], colour=GREY, name="as reported")
    wide = table.pivot(index="episode", columns="seed", values="error_norm")
    drawn = wide[wide.index % 10 == 1]
    lines = axes.plot(drawn.index, drawn, color=VERMILLION, ls="-", lw=0.8)
    lines[0].set_label(text)
    axes.set(xlim=(0, EPISODES), ylim=(0, None))
    label(axes, x="episode", y="‖Q − Q*‖ (reward units)")
    axes.legend(loc="upper right")
    plt.close(figure)
    return figure


def error_split(episodes: Sequence[int], parts: Mapping[str, np.ndarray]) -> Figure:
    """The squared error over the episodes, stacked by how often an entry was visited."""
    figure, axes = plt.subplots(figsize=(WIDTH, 4.0))
    looks = {
        "cannot be visited": (GREY, "", "cannot be visited"),
        "never visited": (ORANGE, "//", "never visited yet"),
        "rarely visited": (SKY_BLUE, "..", "visited rarely"),
        "often visited: noise": (VERMILLION, "", "visited often"),
    }
    below, seeds = np.zeros(len(episodes)), len(parts["cannot be visited"])
    for name, (colour, hatch, words) in looks.items():
        height = parts[name].mean(axis=0)
        axes.fill_between(
            *(episodes, below, below + height),
            fc=colour,
            ec="white",
            hatch=hatch,
            lw=0.4,
            label=words,
        )
        below = below + height
    axes.set(xscale="log", xlim=(1, EPISODES), ylim=(0, None))
    _ticks(axes.xaxis, [1, 10, 100, 1000, EPISODES])
    label(axes, x="episode (logarithmic)", y=f"‖Q − Q*‖², mean of {seeds} seeds")
    axes.legend(loc="upper right", reverse=True, frameon=True, framealpha=0.9)
    plt.close(figure)
    return figure


def noise_law(left: pd.DataFrame, predicted: Mapping[float, float]) -> Figure:
    """What a constant step size leaves of the error, against the prediction from the model."""
    figure, axes = plt.subplots(figsize=(WIDTH, 3.6))
    axes.plot(left["step_size"], left["measured"], ".", color=BLUE, ms=4, alpha=0.25, ls="none")
    medians = left.groupby("step_size")["measured"].median()
    axes.plot(medians.index, medians, "o", color=BLUE, ms=7, ls="none")
    axes.plot([], [], "o", color=BLUE, ls="none", label="measured: every seed, and the median")
    fine = sorted(predicted)
    axes.plot(
        fine, [predicted[x] for x in fine], color=VERMILLION, ls="-", label="predicted, model alone"
    )
    axes.set(xscale="log", yscale="log")
    _ticks(axes.xaxis, list(medians.index))
    _ticks(axes.yaxis, [0.2, 0.5, 1, 2, 5])
    axes.text(0.0225, 2.6, "smaller steps:\nnot there yet after\n5,000 episodes", va="top")
    label(axes, x="step size α (logarithmic)", y="‖Q − Q*‖, visitable entries")
    axes.legend(loc="upper right")
    plt.close(figure)
    return figure


def wrong_decisions(contested: pd.DataFrame, *, seeds: int) -> Figure:
    """How often a state is decided wrongly, against how much is at stake there."""
    figure, axes = plt.subplots(figsize=(WIDTH, 3.6))
    axes.plot(contested["lead"], contested["wrong"], "o", color=BLUE, ms=6, alpha=0.6, ls="none")
    axes.set(xscale="log", ylim=(-3, 103))
    _ticks(axes.xaxis, [0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5])
    label(
        axes,
        x="lead of the best action over the second best in Q* (logarithmic)",
        y=f"wrong after 5,000 episodes\n(% of {seeds} seeds)",
    )
    plt.close(figure)
    return figure


def courses(x: np.ndarray, panels: Mapping[tuple[str, str], Mapping[str, np.ndarray]]) -> Figure:
    """Curves of a few arms over the episodes; panels by (title, unit), curves by the arm's name."""
    figure, rows = plt.subplots(
        len(panels), figsize=(WIDTH, 0.6 + 2.9 * len(panels)), squeeze=False
    )
    for axes, ((title, unit), curves) in zip(rows[:, 0], panels.items(), strict=True):
        for (name, values), colour, ls in zip(
            curves.items(), (BLUE, VERMILLION, GREEN), ("-", "--", "-."), strict=True
        ):
            band(axes, x, values, colour=colour, ls=ls, name=name)
        axes.set_xlim(0, EPISODES)
        if unit.startswith("RMSE"):
            axes.set_yscale("log")
            _ticks(axes.yaxis, [0.02, 0.05, 0.1, 0.2, 0.5, 1])
        else:
            axes.set_ylim(0, None)
        label(axes, x="episode", y=unit, title=title)
    handles, names = rows[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=3, columnspacing=1.2)
    plt.close(figure)
    return figure


MEASURES = {
    "error": ("error of Q at the end", "RMSE, visitable entries"),
    "unvisited": ("entries never visited", "% of visitable entries"),
    "earned": ("earned while learning", "% of the optimum"),
    "lost": ("lost by the greedy policy", "% of the optimum"),
}


def sweep(swept: pd.DataFrame, *, x: str, ticks: Sequence[float], log: bool) -> Figure:
    """What a parameter does to the error, to coverage, to what is earned and to what is learned.

    The parameter is the first column of `swept`.
    """
    figure, panels = plt.subplots(2, 2, figsize=(6.0, 5.8))
    for axes, (measure, (title, unit)) in zip(panels.flat, MEASURES.items(), strict=True):
        of_seeds = swept.pivot(index="seed", columns=swept.columns[0], values=measure)
        values, seeds = of_seeds.columns.to_numpy(), of_seeds.to_numpy()
        axes.plot(values, seeds.T, ".", color=BLUE, ls="none", ms=4, alpha=0.2, zorder=1)
        middle, low, high = bootstrap_interval(seeds, rng=np.random.default_rng(2018))
        axes.fill_between(values, low, high, color=BLUE, alpha=0.25, lw=0)
        axes.plot(values, middle, color=BLUE, ls="-", marker="o", ms=5)
        if log:
            axes.set_xscale("log")
        if measure == "error":
            axes.set_yscale("log")
            _ticks(axes.yaxis, [0.02, 0.05, 0.1, 0.2, 0.5, 1])
        else:
            top = max(5, 1.08 * seeds.max())
            axes.set_ylim(-0.04 * top, top)
        _ticks(axes.xaxis, ticks)
        label(axes, x=x, y=unit, title=title)
    plt.close(figure)
    return figure


def turning(
    swept: pd.DataFrame, errors: Mapping[float, np.ndarray], *, x: str, ticks, log: bool
) -> Widget:
    """`sweep` as a figure that answers, with the error over the episodes for each value.

    Parameters
    ----------
    swept : pandas.DataFrame
        As for `sweep`; so are `x`, `ticks` and `log`.
    errors : mapping of float to ndarray, shape (seeds, EPISODES)
        For each value of the parameter.
    """
    wide = {
        f"{title} ({unit})": swept.pivot(index=swept.columns[0], columns="seed", values=measure)
        for measure, (title, unit) in MEASURES.items()
    }
    lost = swept.pivot(index=swept.columns[0], columns="seed", values="lost")
    table = pd.DataFrame({name: seeds.median(axis=1) for name, seeds in wide.items()})
    table[f"share of seeds that lose at most {STUCK}%"] = (lost <= STUCK).mean(axis=1)
    at = np.unique(np.geomspace(1, EPISODES, 90).round().astype(int))
    rng, curves = np.random.default_rng(2018), {}
    for value, seeds in errors.items():
        found = bootstrap_interval(seeds[:, at - 1], rng=rng, resamples=2_000)
        columns = dict(zip(("median", "low", "high"), found, strict=True))
        curves[value] = pd.DataFrame({"episode": at, **columns})
    return knob(
        *(x.partition(" (")[0], list(table.index), curves, table),
        still=sweep(swept, x=x, ticks=ticks, log=log),
        seeds={name: seeds.to_numpy() for name, seeds in wide.items()},
        label=f"What the {x} does to the error, to coverage, to what is earned and to what is lost",
        y_label="error of Q (RMSE, visitable entries)",
    )


def _ticks(axis: Axis, values: Sequence[float]) -> None:
    """Put plain numbers at these places and nothing between them."""
    axis.set_major_locator(FixedLocator(list(values)))
    axis.set_major_formatter(FixedFormatter([f"{x:g}" for x in values]))
    axis.set_minor_locator(NullLocator())


def learning_frames(
    world: World, episodes: Sequence[int], Q: np.ndarray, visits: np.ndarray
) -> Iterator[np.ndarray]:
    """Frames of a film: in all eight situations, the greedy action and the visits of each cell.

    Q and visits have shape (frames, S, A).
    """
    stage = _Stage(world)
    for episode, values, counts in zip(episodes, Q, visits, strict=True):
        yield stage.picture(episode, values, counts)


class _Stage:
    """The eight mazes, three in a row; the ninth place has the episode and the colour scale."""

    HIGHEST = 100_000

    def __init__(self, world: World) -> None:
        self.world, maze = world, world.maze
        rows, columns = maze.walls.shape
        self.step = (rows + 1.1, columns + 0.5)
        figure = Figure(figsize=(7.2, 7.3), dpi=100, layout="none")
        self.canvas = FigureCanvasAgg(figure)
        self.axes = figure.add_axes((0.01, 0.0, 0.98, 1.0))
        self.axes.set(
            xlim=(-0.1, 3 * self.step[1] - 0.4),
            ylim=(3 * self.step[0] - 0.1, -1.05),
            aspect="equal",
        )
        self.axes.axis("off")
        self.norm = LogNorm(1, self.HIGHEST)
        self.cells = []  # (state, x, y, patch)
        for number, flags in enumerate(maze.flag_sets):
            self._draw_maze(number, flags)
        x, y = self._corner(8)
        style = {"fontsize": 13, "va": "center"}
        self.caption = self.axes.text(x + 0.1, y - 0.1, "", weight="bold", **style)
        self.score = self.axes.text(x + 0.1, y + 0.65, "", **style)
        self._legend(figure, x, y)

    def _corner(self, number: int) -> tuple[float, float]:
        return (number % 3) * self.step[1], (number // 3) * self.step[0]

    def _draw_maze(self, number: int, flags: str) -> None:
        maze, (x, y) = self.world.maze, self._corner(number)
        title = f"holding {' '.join(flags)}" if flags else "no flag held"
        self.axes.text(x, y - 0.2, title, fontsize=13, weight="bold", va="bottom")
        for row, column in np.ndindex(maze.walls.shape):
            place = (x + column, y + row)
            patch = Rectangle(place, 1, 1, fc=WALL, ec="white", lw=1.2)
            self.axes.add_patch(patch)
            if maze.walls[row, column]:
                continue
            state = maze.state(row, column, flags)
            patch.set_facecolor("white")
            patch.set_edgecolor("#cccccc")
            if (row, column) in maze.goals:
                self._letter(place, "G", GREEN)
            elif not self.world.reachable[state]:
                patch.set(hatch="////", edgecolor="#bbbbbb")
            else:
                self.cells.append((state, *place, patch))
        for letter, (row, column) in maze.flag_cells.items():
            if letter not in flags:
                self._letter((x + column, y + row), letter, VERMILLION)

    def _letter(self, place: tuple[float, float], letter: str, colour: str) -> None:
        style = {"ha": "center", "va": "center", "weight": "bold", "fontsize": 14}
        self.axes.text(place[0] + 0.5, place[1] + 0.52, letter, color=colour, zorder=5, **style)

    def _legend(self, figure: Figure, x: float, y: float) -> None:
        for row, (colour, words) in enumerate(((BLACK, "optimal"), (VERMILLION, "not optimal"))):
            self._arrow(x + 0.5, y + 1.55 + 0.75 * row, 3, colour)
            self.axes.text(x + 1.15, y + 1.55 + 0.75 * row, words, fontsize=13, va="center")
        box = self.axes.transData.transform([(x + 0.1, y + 3.3), (x + 4.9, y + 2.95)])
        (left, bottom), (right, top) = figure.transFigure.inverted().transform(box)
        inset = figure.add_axes((left, bottom, right - left, top - bottom))
        bar = figure.colorbar(
            ScalarMappable(self.norm, VALUES), cax=inset, orientation="horizontal"
        )
        bar.set_ticks([1, 100, 10_000], labels=["1", "100", "10,000"], fontsize=11)
        bar.minorticks_off()
        bar.set_label("visits so far", fontsize=12)

    def _arrow(self, x: float, y: float, action: int, colour: str):
        down, right = MOVES[action]
        return self.axes.annotate(
            "",
            xy=(x + 0.42 * right, y + 0.42 * down),
            xytext=(x - 0.36 * right, y - 0.36 * down),
            arrowprops={
                "arrowstyle": "-|>,head_length=0.42,head_width=0.26",
                "lw": 2.2,
                "fc": colour if colour == BLACK else "white",
                "ec": colour,
                "ls": "-",
                "shrinkA": 0,
                "shrinkB": 0,
            },
            zorder=6,
        )

    def picture(self, episode: int, Q: np.ndarray, visits: np.ndarray) -> np.ndarray:
        """Draw the state of things after an episode."""
        right, arrows = 0, []
        for state, x, y, patch in self.cells:
            count = visits[state].sum()
            patch.set_facecolor(VALUES(self.norm(count)) if count else "white")
            best = np.flatnonzero(Q[state] == Q[state].max())
            if len(best) > 1:
                continue
            optimal = self.world.optimal[state, best[0]]
            right += optimal
            colour = BLACK if optimal else VERMILLION
            arrows.append(self._arrow(x + 0.5, y + 0.5, int(best[0]), colour))
        self.caption.set_text(f"after episode {episode:,}")
        self.score.set_text(f"{right} of {len(self.cells)} arrows optimal")
        self.canvas.draw()
        for arrow in arrows:
            arrow.remove()
        return np.asarray(self.canvas.buffer_rgba())[:, :, :3].copy()
