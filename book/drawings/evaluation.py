"""Chapter 6: what bins bring and cost, steps against returns, and all agents side by side."""

import numpy as np
import pandas as pd
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drawings.look import BLACK, BLUE, COLOURS, GREEN, GREY, VERMILLION, label
from rl_core.statistics import bootstrap_interval
from studies.evaluation import CAP, ENV, KEY, LEARNED, LIMIT, steps_of

MARKS = {"random": "x", "REINFORCE": "o", "DQN": "s", "table": "^"}
INKS = dict(zip(MARKS, (BLACK, BLUE, VERMILLION, GREEN), strict=True))


def _kind(agent: str) -> str:
    return agent.partition(",")[0]


def _interval(values: np.ndarray) -> tuple[float, float, float]:
    rng = np.random.default_rng(np.random.SeedSequence(2024))
    return bootstrap_interval(values, rng=rng)


def bins(
    costs: dict[str, pd.DataFrame],
    policies: pd.DataFrame,
    fewest: dict[str, float],
    network_costs: dict[str, np.ndarray],
) -> Figure:
    """Steps that the greedy table needs, and steps its training took, against the bins."""
    figure, grid = plt.subplots(2, len(costs), figsize=(7.2, 6.4), sharex=True, sharey="row")
    for (name, table), (top, bottom) in zip(costs.items(), grid.T, strict=True):
        _against_bins(top, table, "steps", BLUE)
        network = steps_of(policies, name, "REINFORCE", "as learned")
        good = network[network <= LEARNED]
        if len(good):
            middle, low, high = _interval(good)
            text = f"REINFORCE, {len(good)} of {len(network)}\nseeds that learned"
            top.axhspan(low, high, color=VERMILLION, alpha=0.2, lw=0)
            top.axhline(middle, color=VERMILLION, ls="--", label=text)
        top.axhline(fewest[name], color=BLACK, ls=":", label="fastest possible")
        top.axhline(CAP, color=GREY, lw=0.8, ls="-")
        top.set_yscale("log")
        label(top, x="", y="steps to the goal (log scale)", title=name)
        top.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, 0.93))
        _against_bins(bottom, table, "training_steps", BLUE)
        bottom.axhline(np.median(network_costs[name]), color=VERMILLION, ls="--")
        bottom.set_yscale("log")
        label(bottom, x="bins a dimension", y="steps of training (log scale)")
        bottom.set_xscale("log", base=2)
        numbers = sorted(set(table["bins"]))
        bottom.set_xticks(numbers, [str(n) for n in numbers])
        bottom.minorticks_off()
    grid[0, 0].text(5, CAP, "stopped", fontsize=8, va="bottom", ha="center")
    for axes in grid[:, 1]:
        axes.set_ylabel("")
    plt.close(figure)
    return figure


def _against_bins(axes: Axes, table: pd.DataFrame, column: str, colour: str) -> None:
    """Every seed, a little apart, and the median with its interval."""
    groups = [(n, rows[column].to_numpy(float)) for n, rows in table.groupby("bins")]
    for n, values in groups:
        aside = n * np.geomspace(0.9, 1.11, len(values))
        axes.plot(aside, values, ".", color=GREY, ms=3.5, ls="")
    middle, low, high = np.array([_interval(values) for _, values in groups]).T
    numbers = [n for n, _ in groups]
    axes.fill_between(numbers, low, high, color=colour, alpha=0.25, lw=0)
    axes.plot(numbers, middle, "o-", color=colour, ms=5, label="table, median of all seeds")


def steps_and_returns(policies: pd.DataFrame, gentle: pd.DataFrame) -> Figure:
    """Each policy a dot: its steps and its return, as paid and shaped."""
    figure, grid = plt.subplots(3, 2, figsize=(7.2, 8.4))
    for row, name in enumerate(ENV):
        of_environment = policies[policies["environment"] == name]
        for column, by in enumerate(("return", "shaped_return")):
            axes = grid[row, column]
            if column == 1 and name == "MountainCarContinuous":
                axes.axis("off")
                continue
            for kind in MARKS:
                chosen = of_environment[of_environment["agent"].map(_kind) == kind]
                if column == 1 and chosen[by].isna().all():
                    continue
                open_marks = {} if kind == "random" else {"mfc": "none"}
                axes.plot(
                    *(chosen["steps"], chosen[by], MARKS[kind]),
                    **(open_marks | {"color": INKS[kind], "ls": "", "ms": 5, "label": kind}),
                )
            axes.set_xscale("log")
            ticks = (100, 300, 1_000, 3_000)
            axes.set_xticks(ticks, [f"{n:,}" for n in ticks])
            axes.minorticks_off()
            rewards = "return" if column == 0 else "shaped return"
            title = name if column == 0 else ""
            label(axes, x="mean steps (log scale)", y=rewards, title=title)
    by_hand = {"color": COLOURS[3], "marker": "D", "ls": ":", "ms": 4, "lw": 1}
    arrived = gentle[gentle["reached"] == 1]
    label_by_hand = "by hand, ever more gently"
    grid[2, 0].plot(arrived["steps"], arrived["return"], **by_hand, label=label_by_hand)
    handles = dict(zip(*grid[2, 0].get_legend_handles_labels()[::-1], strict=True))
    handles |= dict(zip(*grid[0, 0].get_legend_handles_labels()[::-1], strict=True))
    grid[2, 1].legend(handles.values(), handles.keys(), loc="center", fontsize=10)
    plt.close(figure)
    return figure


def all_agents(policies: pd.DataFrame, published: pd.DataFrame) -> Figure:
    """Return under Gymnasium's time limit of every agent: seeds, median, interval; published."""
    figure, panels = plt.subplots(
        *(3, 1),
        figsize=(6.4, 10),
        height_ratios=[_lines(policies, published, name) for name in ENV],
    )
    for axes, name in zip(panels, ENV, strict=True):
        rows = []
        of_environment = policies[policies["environment"] == name]
        for key, seeds in of_environment.groupby(KEY[1:], sort=False):
            rows.append((_described(*key), _kind(key[0]), seeds["limited_return"].to_numpy()))
        outside = published[published["environment"] == ENV[name]]
        for i, (_, kind, values) in enumerate(rows):
            middle, low, high = _interval(values)
            axes.plot(values, np.full(len(values), i), ".", color=GREY, ms=3.5, ls="")
            axes.plot([low, high], [i, i], color=INKS[kind], lw=3, ls="-", alpha=0.5)
            axes.plot(middle, i, MARKS[kind], color=INKS[kind], ms=6, ls="")
        for i, one in enumerate(outside.itertuples(), len(rows)):
            axes.plot(one[4], i, "D", color=COLOURS[4], ms=5, ls="")
        texts = [text for text, _, _ in rows]
        texts += [f"{one.algorithm}, {one.source}" for one in outside.itertuples()]
        axes.set_yticks(range(len(texts)), texts, fontsize=8)
        axes.set_ylim(len(texts) - 0.5, -0.5)
        axes.axhline(len(rows) - 0.5, color=GREY, lw=0.8, ls="-")
        label(axes, x=f"return within {LIMIT[name]} steps", y="", title=name)
    plt.close(figure)
    return figure


def _lines(policies: pd.DataFrame, published: pd.DataFrame, name: str) -> int:
    """Agents and published results of an environment."""
    agents = policies.loc[policies["environment"] == name, KEY[1:]].drop_duplicates()
    return len(agents) + int((published["environment"] == ENV[name]).sum())


def _described(agent: str, trained: str, acting: str) -> str:
    """One line for an agent."""
    parts = [agent]
    if trained == "time limit":
        parts.append("limit")
    if agent == "REINFORCE" and acting == "greedy":
        parts.append("greedy")
    return ", ".join(parts)
