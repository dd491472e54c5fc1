"""Chapter 5: learning curves, fates of seeds, the trade-off around sigma, the mean action."""

from collections.abc import Mapping, Sequence

import gymnasium as gym
import numpy as np
import pandas as pd
from interactive import Widget, knob, seed_curves, snapshots
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drawings.look import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    LINES,
    ORANGE,
    SKY_BLUE,
    VERMILLION,
    label,
    median_band,
)
from drawings.reinforce import films
from report.figure_data import tidy
from report.seeds import SEEDS
from rl_core.evaluation import Weights, as_learned
from rl_core.experiments import Results
from rl_core.reinforce import ReinforceConfig
from rl_core.statistics import bootstrap_interval
from rl_core.training import weights_of
from studies import continuous as study
from studies import continuous_fates as fates
from studies.continuous import (
    CONVERGED,
    EARLY,
    ENV,
    EPISODES,
    LEARNED,
    SIGMAS,
    SWEEPS,
    Curves,
)
from studies.continuous_fates import FATES
from studies.policy_maps import mean_actions, state_grid
from studies.shared import shown_agents

EVERY = 10  # episodes between drawn points, after the first
POINTS = (1, *range(EVERY, EPISODES + 1, EVERY))


def curve_data(curves: Curves, arms: Sequence[str]) -> pd.DataFrame:
    """What the curves are drawn from: each seed's median of the last 100 episodes.

    Of the points the first and every tenth.
    """
    tables = []
    for arm in arms:
        good = dict(zip(SEEDS, curves.learned(arm), strict=True))
        smooth = pd.DataFrame(curves.smooth[arm].T, columns=list(SEEDS))
        smooth.insert(0, "episode", np.arange(1, EPISODES + 1))
        drawn = smooth[smooth["episode"].isin(POINTS)]
        long = drawn.melt("episode", var_name="seed", value_name="steps").dropna()
        tables.append(long.assign(arm=arm, learned=long["seed"].map(good)))
    return pd.concat(tables, ignore_index=True)


def learning_curves(curves: Curves, arms: Mapping[str, str], original: pd.DataFrame) -> Figure:
    """A panel an arm: steps an episode of every seed, where each stopped, and the curve of 2018.

    Parameters
    ----------
    curves : Curves
    arms : mapping of str to str
        Arms and the titles of their panels.
    original : pandas.DataFrame
        `episode, low, high` of the published curve.
    """
    figure, panels = plt.subplots(
        *(len(arms), 1), figsize=(6.4, 4.2 * len(arms)), sharex=True, sharey=True, squeeze=False
    )
    for axes, (arm, title) in zip(panels[:, 0], arms.items(), strict=True):
        drawn = (original["episode"], original["low"], original["high"])
        name = "2018 original, one run"
        axes.fill_between(*drawn, color="#c9b458", alpha=0.75, lw=0, label=name)
        _every_seed(axes, curves, arm)
        axes.axhline(200, color=GREY, lw=0.8, ls="--")
        axes.text(EPISODES, 195, "200, the report's number", ha="right", va="top", fontsize=8)
        axes.set_yscale("log")
        label(axes, x="episode", y="steps to the goal (log scale)", title=title)
        axes.legend(fontsize=8, loc="upper right")
    plt.close(figure)
    return figure


def every_seed(
    curves: Curves, results: Results, arm: str, title: str, original: pd.DataFrame
) -> Widget:
    """An arm's panel as a figure that answers; with films of single seeds, if as reported."""
    smooth = curves.smooth[arm]
    x = np.array(POINTS)
    arrays, config = results.arrays(arm), study.config(arm)
    agents = shown_agents(
        fates.shown_seeds(curves, arm),
        lambda place, moment: as_learned(config, weights_of(arrays, place, moment)),
    )
    return seed_curves(
        tidy(x, {arm: smooth[:, x - 1]}, value="steps"),
        *(fates.of_each_seed(curves, results, arm), original),
        still=learning_curves(curves, {arm: title}, original),
        films=films(ENV, agents) if arm == "as reported" else {},
        label=f"Learning curves of the seeds over the published curve, {title}.",
        title=title,
        median="learned",
    )


def sigma_knob(curves: Curves, table: pd.DataFrame) -> Widget:
    """The arms of sigma, one at a time: their curves, and what came of them.

    Parameters
    ----------
    curves : Curves
    table : pandas.DataFrame
        Of `studies.continuous.tradeoff`.
    """
    x, by_value = np.arange(EVERY, EPISODES + 1, EVERY), {}
    arms = dict(zip(SIGMAS, SWEEPS["two observations"], strict=True))
    rng = np.random.default_rng(np.random.SeedSequence(2020))
    for sigma, arm in arms.items():
        steps = curves.smooth[arm][curves.learned(arm)][:, x - 1]
        empty = np.full(len(x), np.nan)
        found = bootstrap_interval(steps, rng=rng, resamples=2_000) if len(steps) else [empty] * 3
        columns = dict(zip(("median", "low", "high"), found, strict=True))
        by_value[sigma] = pd.DataFrame({"episode": x, **columns})
    wide = table.pivot(index="arm", columns="measure", values="estimate").loc[list(arms.values())]
    names = {it: PANELS[it][0].replace("\n", " ") for it in ("learned", "steps", "return", "early")}
    return knob(
        "σ",
        list(arms),
        by_value,
        wide[list(names)].rename(columns=names),
        still=variants(curves, {arm: f"σ = {sigma}" for sigma, arm in arms.items()}),
        label="Learning curves for three widths of the noise, and what they trade.",
        y_label="steps to the goal",
    )


def _every_seed(axes: Axes, curves: Curves, arm: str) -> None:
    """A line a seed with a cross where its budget was used up, and the median of the good ones."""
    x = np.arange(EVERY, EPISODES + 1, EVERY)
    good, smooth = curves.learned(arm), curves.smooth[arm]
    for steps, learned in zip(smooth, good, strict=True):
        style = {"color": GREY, "ls": "-"} if learned else {"color": BLACK, "ls": ":"}
        axes.plot(x, steps[x - 1], lw=0.6, **style)
        last = np.flatnonzero(np.isfinite(steps))[-1]
        if last + 1 < EPISODES:
            axes.plot(last + 1, steps[last], "x", color=VERMILLION, ms=6, clip_on=False)
    axes.plot([], [], color=GREY, ls="-", lw=0.8, label=f"{good.sum()} seeds that learned")
    axes.plot([], [], color=BLACK, ls=":", lw=0.8, label=f"{(~good).sum()} that did not")
    axes.plot([], [], "x", color=VERMILLION, ms=6, label="budget used up")
    if good.any():
        text = "median of those that learned, 95% interval"
        median_band(axes, x, smooth[good][:, x - 1], colour=BLUE, line="-", text=text)


def variants(curves: Curves, names: Mapping[str, str]) -> Figure:
    """Median and interval of those seeds of each arm that learned."""
    figure, axes = plt.subplots(figsize=(6.4, 4.8))
    x = np.arange(EVERY, EPISODES + 1, EVERY)
    for (arm, text), colour, line in zip(names.items(), COLOURS, LINES, strict=False):
        good = curves.learned(arm)
        text = f"{text} ({good.sum()} of {len(SEEDS)} learned)"
        if good.any():
            steps = curves.smooth[arm][good][:, x - 1]
            median_band(axes, x, steps, colour=colour, line=line, text=text)
        else:
            axes.plot([], [], color=colour, ls=line, label=text)
    axes.set_yscale("log")
    label(axes, x="episode", y="steps to the goal (log scale)")
    figure.legend(loc="outside lower center", ncols=2, fontsize=9)
    plt.close(figure)
    return figure


def fate_bars(table: pd.DataFrame) -> Figure:
    """Seeds of every arm by what became of them."""
    figure, axes = plt.subplots(figsize=(6.4, 4.8))
    looks = (
        (BLUE, ""),
        (SKY_BLUE, "//"),
        ("#bbbbbb", ""),
        (ORANGE, "\\\\"),
        (VERMILLION, "xx"),
    )
    left = np.zeros(len(table))
    for fate, (colour, hatch) in zip(FATES, looks, strict=True):
        counts = table[fate].to_numpy()
        bars = axes.barh(
            *(table["arm"], counts),
            left=left,
            color=colour,
            hatch=hatch,
            edgecolor="white",
            label=fate,
        )
        axes.bar_label(
            bars,
            [str(n) if n else "" for n in counts],
            label_type="center",
            fontsize=9,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85},
        )
        left += counts
    axes.invert_yaxis()
    axes.grid(visible=False)
    label(axes, x="seeds", y="")
    figure.legend(loc="outside lower center", ncols=3, fontsize=9)
    plt.close(figure)
    return figure


PANELS = {
    "early": (f"length of the first {EARLY} episodes\n(mean steps, all seeds)", "log"),
    "learned": (f"share of seeds that learn\n(at most {LEARNED} steps at the end)", "linear"),
    "episodes": (f"episodes until {CONVERGED} steps\n(seeds that learned)", "linear"),
    "steps": ("steps at episode 5,000\n(seeds that learned)", "linear"),
    "spread": ("interquartile range of steps,\nlast 500 (seeds that learned)", "linear"),
    "return": ("return at episode 5,000\n(seeds that learned)", "linear"),
}


def tradeoff(table: pd.DataFrame) -> Figure:
    """Six measures against sigma, with intervals."""
    figure, panels = plt.subplots(3, 2, figsize=(6.4, 8.4))
    places = np.arange(len(SIGMAS))
    series = [
        ("two observations", SWEEPS["two observations"], places, BLUE, "o-"),
        ("two observations and a constant", SWEEPS["and a constant"], places, VERMILLION, "s--"),
        ("σ learned, from 0.5 on", ("sigma learned",), places[-1:] + 1, GREEN, "D"),
    ]
    for axes, (measure, (text, scale)) in zip(panels.flat, PANELS.items(), strict=True):
        rows = table[table["measure"] == measure].set_index("arm")
        axes.set_yscale(scale)
        finite = rows[["estimate", "low", "high"]].replace([np.inf, -np.inf], np.nan)
        top, bottom = finite.max(axis=None), finite.min(axis=None)
        top = top * 2 if scale == "log" else top + 0.12 * (top - bottom)
        for shift, (name, arms, x, colour, mark) in zip((-0.08, 0.08, 0), series, strict=True):
            estimate, low, high = (rows.loc[list(arms), c].to_numpy() for c in rows.columns[1:])
            middle = np.where(np.isinf(estimate), np.nan, estimate)
            axes.plot(x + shift, middle, mark, color=colour, ms=5, label=name)
            ends = (np.where(np.isinf(low), np.nan, low), np.where(np.isinf(high), top, high))
            axes.vlines(x + shift, *ends, color=colour, lw=1.4)
            beyond = np.isinf(high)
            axes.plot(x[beyond] + shift, np.full(beyond.sum(), top), "^", color=colour, ms=6)
        axes.set_xticks([*places, len(places)], [*map(str, SIGMAS), "learned"])
        axes.set_xlim(-0.4, len(places) + 0.4)
        axes.set_title(text, fontsize=9)
        axes.set_xlabel("σ")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    plt.close(figure)
    return figure


def escapes(steps: Mapping[float, np.ndarray], max_steps: int) -> Figure:
    """How likely noise alone is out of the valley within so many steps."""
    figure, axes = plt.subplots()
    for (sigma, taken), colour, line in zip(steps.items(), COLOURS, LINES, strict=False):
        x = np.append(np.sort(taken[np.isfinite(taken)]), max_steps)
        y = np.append(np.arange(1, len(x)), len(x) - 1) / len(taken)
        axes.step(np.append(100, x), np.append(0, y), where="post", color=colour, ls=line)
        axes.plot([], [], color=colour, ls=line, label=f"σ = {sigma}")
        spent = 1_000 / sigma**2  # steps after which 0.1 sigma^2 a step has eaten the 100
        axes.plot(spent, 0, "v", color=colour, ms=9, clip_on=False, zorder=5)
    axes.set_xscale("log")
    axes.set_ylim(0, 1)
    label(axes, x="steps (log scale)", y="share of episodes that are out")
    axes.plot([], [], "v", color=GREY, label="the noise has cost 100")
    axes.legend(loc="upper left")
    plt.close(figure)
    return figure


def mean_action_maps(
    config: ReinforceConfig, agents: Mapping[str, Weights], points: int = 121
) -> tuple[Figure, pd.DataFrame]:
    """The mean action over position and velocity, a panel an agent, and the data drawn."""
    space = gym.make(ENV).observation_space
    grid = state_grid(space, points)
    extent = (space.low[0], space.high[0], space.low[1], space.high[1])
    edges = np.linspace(*extent[:2], points), np.linspace(*extent[2:], points)
    n_rows = -(-len(agents) // 2)
    figure, panels = plt.subplots(
        *(n_rows, 2), figsize=(6.4, 2.6 * n_rows), sharex=True, sharey=True, squeeze=False
    )
    table = pd.DataFrame(grid, columns=["position", "velocity"])
    for axes, (agent, weights) in zip(panels.flat, agents.items(), strict=False):
        means = mean_actions(config, weights, grid)[:, 0]
        plane = means.reshape(points, points).T
        picture = axes.imshow(
            plane, origin="lower", aspect="auto", extent=extent, cmap="PuOr", vmin=-1, vmax=1
        )
        if plane.min() < 0 < plane.max():
            axes.contour(*edges, plane, levels=[0], colors=BLACK, linewidths=0.8)
        axes.axvline(-np.pi / 6, color=BLACK, lw=0.7, ls=":")
        axes.grid(visible=False)
        axes.set_title(agent, fontsize=9)
        table[f"mean action, {agent}"] = means.round(4)
    for axes in panels[-1]:
        axes.set_xlabel("position")
    for axes in panels[:, 0]:
        axes.set_ylabel("velocity (a step)")
    figure.colorbar(
        picture, ax=panels, label="mean action (force)", extend="both", shrink=0.5, aspect=30
    )
    plt.close(figure)
    return figure, table


def mean_action_snapshots(
    config: ReinforceConfig, agents: Mapping[str, Weights], still: Figure, points: int = 41
) -> Widget:
    """The same, one agent at a time, coarser."""
    space = gym.make(ENV).observation_space
    grid = state_grid(space, points)
    planes = {
        agent: mean_actions(config, weights, grid)[:, 0].reshape(points, points).T
        for agent, weights in agents.items()
    }
    x, y = (np.linspace(low, high, points) for low, high in zip(space.low, space.high, strict=True))
    return snapshots(
        planes,
        **{"x": x, "y": y, "still": still, "limit": 1.0, "mark": -np.pi / 6},
        **{"x_label": "position", "y_label": "velocity (a step)", "value_label": "mean action"},
        label="The mean action over position and velocity, as it was learned.",
    )


def profiles(table: pd.DataFrame) -> Figure:
    """Share of seeds that need at most so many steps at the end, a line an arm."""
    figure, axes = plt.subplots(figsize=(6.4, 4.4))
    for (arm, rows), colour, line in zip(
        table.groupby("arm", sort=False), COLOURS, LINES, strict=False
    ):
        axes.step(rows["steps"], rows["share"], where="post", color=colour, ls=line, label=arm)
    axes.axvline(LEARNED, color=GREY, lw=0.8, ls=":")
    axes.text(LEARNED, 0.12, " counts as learned", fontsize=8, color=GREY)
    axes.set_ylim(0, 1)
    label(axes, x="steps at episode 5,000, at most", y="share of seeds")
    figure.legend(loc="outside lower center", ncols=2, fontsize=9)
    plt.close(figure)
    return figure


def engines(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """One seed's steps an episode, as each engine has learned it."""
    figure, axes = plt.subplots(figsize=(6.4, 3.8))
    looks = zip(tables.items(), ((BLUE, 2.6, "-"), (ORANGE, 1.0, "--")), strict=True)
    for (text, rows), (colour, width, line) in looks:
        axes.plot(rows["episode"], rows["steps"], color=colour, lw=width, ls=line, label=text)
    axes.set_yscale("log")
    label(axes, x="episode", y="steps to the goal (log scale)")
    axes.legend(loc="upper right")
    plt.close(figure)
    return figure
