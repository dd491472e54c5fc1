"""Appendix B: the ratios beside others, and how the cost grows."""

import numpy as np
import pandas as pd
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from drawings.look import BLACK, BLUE, GREY, ORANGE, label
from studies.performance import Amdahl

MARKS = {"faster": (BLUE, "o"), "cannot tell": (GREY, "s"), "slower": (ORANGE, "v")}


def ratios(bench: pd.DataFrame) -> Figure:
    """How many times as long the rival takes, with its interval, one line a comparison."""
    figure, axes = plt.subplots(figsize=(8.4, 0.46 * len(bench) + 0.9))
    places = np.arange(len(bench))[::-1]
    for place, row in zip(places, bench.itertuples(), strict=True):
        colour, mark = MARKS[row.verdict]
        axes.plot([row.low, row.high], [place, place], color=colour, ls="-", lw=4, alpha=0.5)
        axes.plot(row.ratio, place, mark, color=colour, ms=6)
        axes.text(row.high * 1.12, place, f"{row.ratio:g}×", va="center", fontsize=9, color=BLACK)
    axes.axvline(1, color=BLACK, lw=1)
    axes.set_yticks(places, bench["benchmark"] + "\nagainst " + bench["against"], fontsize=8)
    axes.set_xscale("log")
    axes.set_xlim(min(0.5, bench["low"].min() / 1.3), bench["high"].max() * 3)
    axes.grid(axis="y", visible=False)
    label(axes, x="cost of the rival ÷ cost of ours (log scale)", y="")
    plt.close(figure)
    return figure


def growth(turns: pd.DataFrame, name: str) -> Figure:
    """Seconds against size on logarithmic axes: every turn, the median, and proportional growth."""
    figure, axes = _panel(name, "processor time (s, log scale)")
    median = turns.groupby("size")["seconds"].median()
    last = median.index[-1]
    proportional = median.iloc[-1] * median.index / last
    axes.plot(median.index, proportional, color=GREY, ls="--", lw=1, label="in proportion")
    axes.plot(turns["size"], turns["seconds"], "o", color=BLUE, alpha=0.35, ms=5, label="a turn")
    axes.plot(median.index, median, "-", color=BLUE, label="median")
    if last < 1000:  # else powers of ten do
        axes.set_xticks(median.index, median.index)
    axes.legend(loc="upper left")
    plt.close(figure)
    return figure


def cores(turns: pd.DataFrame, law: Amdahl) -> Figure:
    """Seconds of an experiment against cores: measured at a few, beyond them by Amdahl's law."""
    figure, axes = _panel("cores", "time by the clock (s, log scale)")
    counts = np.array([1, 2, 4, 8, 16, 32, 64])
    alone = turns.loc[turns["size"] == 1, "seconds"].median()
    axes.plot(counts, alone / counts, color=GREY, ls="--", lw=1, label="in proportion")
    low, high = (alone / law.speed_up(counts, share) for share in (law.low, law.high))
    axes.fill_between(counts, low, high, color=BLUE, alpha=0.2, lw=0)
    computed = alone / law.speed_up(counts)
    axes.plot(counts, computed, ":", color=BLUE, label="computed, Amdahl's law")
    axes.plot(turns["size"], turns["seconds"], "o", color=BLUE, alpha=0.5, label="measured, a turn")
    axes.set_xticks(counts, counts)
    axes.legend(loc="lower left")
    plt.close(figure)
    return figure


def _panel(x: str, y: str) -> tuple[Figure, plt.Axes]:
    figure, axes = plt.subplots()
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())
    label(axes, x=f"{x} (log scale)", y=y)
    return figure, axes
