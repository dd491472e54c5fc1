"""Chapter 1: the drawings that belong to it alone."""

from collections.abc import Mapping

import pandas as pd
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from drawings.look import BLUE, GREEN, GREY, VERMILLION, YELLOW, label

FLOOR = 1e-9  # errors below are rounding, and drawn here


def convergence(sweeps: pd.DataFrame, *, gamma: float, threshold: float) -> Figure:
    """Residual and norm of each sweep against the bound that the contraction promises."""
    figure, axes = plt.subplots()
    x = sweeps["sweep"]
    bound = sweeps["residual"].iloc[0] * gamma ** (x - 1)
    axes.semilogy(x, bound, color=GREY, ls="--", label="bound: $\\gamma^{k-1}$ × first residual")
    axes.semilogy(x, sweeps["norm"], color=BLUE, ls="-.", label="Frobenius norm of the change")
    axes.semilogy(x, sweeps["residual"], color=VERMILLION, ls="-", label="residual: largest change")
    axes.axhline(threshold, color=GREEN, ls=":", label=f"the report's threshold {threshold:g}")
    label(axes, x="sweep k", y="change of Q (reward units)")
    axes.legend()
    plt.close(figure)
    return figure


def over_reported(tables: Mapping[str, pd.DataFrame], threshold: float) -> Figure:
    """The residual of each sweep, of the reported settings first, then of others."""
    figure, axes = plt.subplots(figsize=(6.4, 3.4))
    looks = zip(
        tables.items(), (GREY, VERMILLION, BLUE, GREEN), ("-", "--", "-.", ":"), strict=False
    )
    for (text, sweeps), colour, line in looks:
        name = f"{text}: {len(sweeps)} sweeps"
        axes.semilogy(sweeps["sweep"], sweeps["residual"], color=colour, ls=line, label=name)
    axes.axhline(threshold, color=GREEN, ls=":", label=f"the report's threshold {threshold:g}")
    label(axes, x="sweep", y="largest change of Q (reward units)")
    axes.legend()
    plt.close(figure)
    return figure


def computation(progress: dict[str, pd.DataFrame]) -> Figure:
    """Error of the values against backups done, for value iteration and for policy iteration."""
    figure, axes = plt.subplots()
    for name, text, colour, marker in (
        ("value", "value iteration, a dot a sweep", BLUE, "."),
        ("policy", "policy iteration, a cross a round", VERMILLION, "x"),
    ):
        table = progress[name]
        error = table["error"].clip(lower=FLOOR)
        axes.semilogy(table["backups"], error, marker, color=colour, ls="-", lw=1, label=text)
    label(axes, x="backups (updates of one table entry)", y="largest error of the values")
    axes.legend()
    plt.close(figure)
    return figure


def coarse_values(course: pd.DataFrame, mazes: dict[int, pd.DataFrame]) -> Figure:
    """Share of states decided wrongly against how wrong the values still are, sweep by sweep."""
    figure, axes = plt.subplots()
    for path in mazes.values():
        axes.step(path["percent_off"], 100 * (1 - path["decided"]), color=GREY, ls="-", lw=0.6)
    axes.plot([], [], color=GREY, ls="-", lw=0.8, label=f"{len(mazes)} random mazes")
    wrong = 100 * (1 - course["decided"])
    axes.step(course["percent_off"], wrong, color=BLUE, ls="-", label="the report's Maze")
    axes.set(xscale="log", xlim=(110, 0.04), ylim=(-2, 102))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.axvspan(110, 1, color=YELLOW, alpha=0.18, lw=0)
    axes.text(1.15, 98, "values off by\nmore than 1%", ha="right", va="top", fontsize=9)
    label(
        axes,
        x="largest error of the values (% of the largest value), falling",
        y="states decided wrongly (%)",
    )
    axes.legend()
    plt.close(figure)
    return figure
