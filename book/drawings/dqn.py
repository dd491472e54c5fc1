"""Chapter 4: learning curves over those of 2018, causes side by side, and a value function."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from interactive import Widget, seed_curves
from matplotlib import pyplot as plt
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from drawings.look import (
    BLACK,
    BLUE,
    COLOURS,
    GREY,
    LINES,
    ORANGE,
    SKY_BLUE,
    VERMILLION,
    label,
    median_band,
)
from drawings.reinforce import films
from rl_core.evaluation import Rollout, Weights
from rl_core.experiments import Results
from rl_core.training import weights_of
from studies import dqn as study
from studies.dqn import BUDGET, ENV, EPISODES, LEARNED, PARTS, Curves
from studies.policy_maps import action_values
from studies.shared import of_values, shown_agents

PUSHES = ("left", "none", "right")
_PUSH_COLOURS = ListedColormap([SKY_BLUE, "#eeeeee", ORANGE])


def learning_curve(curves: Curves, name: str, original: pd.DataFrame) -> Figure:
    """Steps an episode of every seed, their median with its interval, and the curve of 2018."""
    arm = f"{name}, as reported"
    figure, axes = plt.subplots(figsize=(6.4, 4.6))
    axes.fill_between(
        *(original["episode"], original["low"], original["high"]),
        color="#c9b458",
        alpha=0.75,
        lw=1.0,
        label="2018 original, one run",
    )
    x = np.arange(1, EPISODES + 1)
    seeds = curves.raw[arm]
    for steps in seeds:
        axes.plot(x, steps, color=GREY, ls="-", lw=0.4, alpha=0.6)
    axes.plot([], [], color=GREY, ls="-", lw=0.8, label=f"each of {len(seeds)} seeds")
    rows = curves.table[arm]
    stopped = rows[~rows["terminated"]]
    if len(stopped):
        text = f"stopped before the goal ({len(stopped)} episodes)"
        axes.plot(stopped["episode"], stopped["steps"], "x", color=BLACK, ms=5, label=text)
    text = f"median of all {len(seeds)} seeds, 95% interval"
    median_band(axes, x, seeds, colour=BLUE, line="-", text=text)
    axes.set_yscale("log")
    label(axes, x="episode", y="steps to the goal (log scale)")
    figure.legend(loc="outside lower center", ncols=2, fontsize=9)
    plt.close(figure)
    return figure


def every_seed(curves: Curves, results: Results, name: str, original: pd.DataFrame) -> Widget:
    """The learning curve as a figure that answers, with films of single seeds below it.

    The films' agents act as at the end of their training, one action in ten at random, and before
    learning as at its beginning, nine in ten.
    """
    arm, rows = f"{name}, as reported", curves.table[f"{name}, as reported"]
    arrays = results.arrays(arm)
    agents = shown_agents(
        study.shown_seeds(curves, arm),
        lambda place, moment: of_values(weights_of(arrays, place, moment), 0.9 if moment else 0.1),
    )
    return seed_curves(
        *(rows.assign(stopped=~rows["terminated"]), study.fates(curves, arm), original),
        still=learning_curve(curves, name, original),
        films=films(ENV[name], agents),
        label=f"Learning curves of all seeds on {name} with DQN over the published curve.",
    )


def shares(curves: Curves, variants: Sequence[str]) -> Figure:
    """Share of seeds that learned after each change, with its interval, on both environments."""
    figure, axes = plt.subplots(figsize=(6.4, 5.6))
    y = np.arange(len(variants))[::-1]
    marks = zip(ENV, ("o", "s"), (BLUE, VERMILLION), (0.14, -0.14), strict=True)
    for name, marker, colour, offset in marks:
        found = np.array([curves.share(f"{name}, {variant}") for variant in variants])
        errors = np.abs(found[:, 1:].T - found[:, 0])
        axes.errorbar(
            *(found[:, 0], y + offset),
            xerr=errors,
            fmt=marker,
            color=colour,
            ls="",
            ms=6,
            elinewidth=1.2,
            label=name,
        )
    axes.set_yticks(y, [variant.replace("original, ", "+ ") for variant in variants])
    axes.set_xlim(-0.02, 1.02)
    label(axes, x=f"share of seeds that learn (at most {LEARNED} steps a goal)", y="")
    figure.legend(loc="outside lower center", ncols=2)
    plt.close(figure)
    return figure


def over_the_budget(curves: Curves, names: dict[str, str]) -> Figure:
    """Steps a goal in each tenth of the budget: median over seeds and its interval."""
    figure, both = plt.subplots(2, 1, figsize=(6.4, 7.0))
    for axes, name in zip(both, ENV, strict=True):
        tenth = BUDGET[name] / PARTS
        middles = (np.arange(PARTS) + 0.5) * tenth / 1000
        for i, (variant, text) in enumerate(names.items()):
            steps = curves.parts(f"{name}, {variant}")
            shown = text if name == "Acrobot" else None
            style = {"colour": COLOURS[i], "line": LINES[i], "marker": "o"}
            median_band(axes, middles, steps, text=shown, top=tenth, **style)
        axes.set_yscale("log")
        axes.set_xlim(0, BUDGET[name] / 1000)
        label(axes, x="environment steps (thousands)", y="steps a goal (log scale)", title=name)
    figure.legend(loc="outside lower center", ncols=2, fontsize=9)
    plt.close(figure)
    return figure


def profiles(
    of_arm: Mapping[str, Mapping[str, np.ndarray]], marks: Mapping[str, float] | None = None
) -> Figure:
    """Share of seeds that need at most so many steps a goal, on each environment.

    Parameters
    ----------
    of_arm : mapping of str to mapping of str to ndarray of shape (seeds,)
        Steps a goal of each seed by environment and arm.
    marks : mapping of str to float, optional
        By environment, what a goal costs at random: a vertical line.
    """
    figure, both = plt.subplots(1, len(of_arm), figsize=(7.2, 3.9), sharey=True)
    for axes, (name, arms) in zip(np.atleast_1d(both), of_arm.items(), strict=True):
        for i, (text, steps) in enumerate(arms.items()):
            x = np.sort(steps[np.isfinite(steps)])
            y = np.arange(1, len(x) + 1) / len(steps)
            x, y = np.r_[80, x, BUDGET[name]], np.r_[0, y, y[-1:]] if len(y) else np.zeros(2)
            axes.step(x, y, where="post", color=COLOURS[i], ls=LINES[i], lw=1.6, label=text)
        axes.axvline(LEARNED, color=GREY, ls="-", lw=0.8)
        if marks:
            axes.axvline(marks[name], color=BLACK, ls=":", lw=1.2, label="random, kept for 10")
        axes.set_xscale("log")
        axes.set_xlim(80, 5_000)
        axes.set_ylim(-0.02, 1.02)
        label(axes, x="steps a goal (log scale)", y="", title=name)
    np.atleast_1d(both)[0].set_ylabel("share of seeds at most there")
    handles, texts = np.atleast_1d(both)[0].get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside lower center", ncols=2, fontsize=9)
    plt.close(figure)
    return figure


def over_the_reported(curves: Curves, arm: str, others: Mapping[str, np.ndarray]) -> Figure:
    """Steps an episode of some runs over all seeds of a reported arm.

    Parameters
    ----------
    arm : str
        The reported arm: its seeds are drawn thin, their median strong.
    others : mapping of str to ndarray of shape (runs, episodes)
    """
    figure, axes = plt.subplots(figsize=(6.4, 4.2))
    seeds = curves.raw[arm]
    x = np.arange(1, seeds.shape[1] + 1)
    axes.plot(x, seeds.T, color=GREY, ls="-", lw=0.4, alpha=0.5)
    axes.plot([], [], color=GREY, ls="-", lw=0.8, label=f"each of {len(seeds)} seeds, as reported")
    axes.plot(x, np.median(seeds, axis=0), color=BLUE, ls="-", label="their median")
    for i, (text, runs) in enumerate(others.items(), 1):
        for k, steps in enumerate(runs):
            shown = text if k == 0 else None
            at = np.arange(1, len(steps) + 1)
            axes.plot(at, steps, color=COLOURS[i], ls=LINES[i], lw=1.3, label=shown)
    axes.set_yscale("log")
    label(axes, x="episode", y="steps to the goal (log scale)")
    figure.legend(loc="outside lower center", ncols=2, fontsize=9)
    plt.close(figure)
    return figure


def plane_table(policies: dict[str, tuple[Weights, Rollout]]) -> pd.DataFrame:
    """The values behind `state_plane`: `policy, position, velocity` and one value a push."""
    tables = []
    for title, (weights, _) in policies.items():
        grid = _plane()[2]
        table = pd.DataFrame(grid, columns=["position", "velocity"]).round(5)
        table[[f"q_{push}" for push in PUSHES]] = action_values(weights, grid)
        table.insert(0, "policy", title)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _plane() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, velocities, and all their pairs, of shape (pairs, 2)."""
    position, velocity = np.linspace(-1.2, 0.6, 91), np.linspace(-0.07, 0.07, 71)
    grid = np.stack(np.meshgrid(position, velocity), axis=-1).reshape(-1, 2)
    return position, velocity, grid


def state_plane(policies: dict[str, tuple[Weights, Rollout]]) -> Figure:
    """MountainCar's values and greedy pushes over position and velocity, with one trajectory.

    Parameters
    ----------
    policies : dict of str to (weights, episode)
        One row of panels each, by its title.
    """
    figure, panels = plt.subplots(len(policies), 2, figsize=(7.2, 3.3 * len(policies)))
    position, velocity, grid = _plane()
    shape = (len(velocity), len(position))
    for row, (title, (weights, episode)) in zip(
        np.atleast_2d(panels), policies.items(), strict=True
    ):
        q = action_values(weights, grid)
        values = row[0].pcolormesh(
            *(position, velocity, q.max(axis=1).reshape(shape)), cmap="cividis", rasterized=True
        )
        figure.colorbar(values, ax=row[0], label="max Q(s, a)")
        row[1].pcolormesh(
            *(position, velocity, q.argmax(axis=1).reshape(shape)),
            cmap=_PUSH_COLOURS,
            vmin=-0.5,
            vmax=2.5,
            rasterized=True,
        )
        for axes, ink in zip(row, ("white", BLACK), strict=True):
            axes.plot(*episode.observations.T, color=ink, ls="-", lw=1.2)
            axes.plot(*episode.observations[0], "o", color=ink, ms=5)
            axes.axvline(0.5, color=ink, ls=":", lw=1)
            axes.grid(visible=False)
            label(axes, x="position", y="velocity (a step)")
        row[0].set_title(f"{title}: value", fontsize=10)
        row[1].set_title("greedy push", fontsize=10)
    handles = [
        Line2D([], [], marker="s", ls="", ms=9, mec=GREY, color=_PUSH_COLOURS(i), label=push)
        for i, push in enumerate(PUSHES)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, title="push")
    plt.close(figure)
    return figure
