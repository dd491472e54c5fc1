"""Appendix B: the ratios beside others, and how the cost grows."""

import numpy as np
import pandas as pd
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from drawings.look import BLACK, BLUE, GREY, ORANGE, label
from studies.performance import Amdahl

MARKS = {"faster": (BLUE, "o"), "cannot tell": (GREY, "s"), "slower": (ORANGE, "v")}
LABELS = 175  # points that the names of the rivals take


def ratios(bench: pd.DataFrame) -> Figure:
    """How many times as long the rivals take, with intervals, under what they were measured at."""
    bench = bench.iloc[pd.factorize(bench["benchmark"])[0].argsort(kind="stable")]
    starts = bench["benchmark"].ne(bench["benchmark"].shift())
    places = -(np.arange(len(bench)) + 1.2 * starts.cumsum()).to_numpy()
    figure, axes = plt.subplots(figsize=(5.6, 0.22 * -places[-1] + 0.7))
    for place, row, first in zip(places, bench.itertuples(), starts, strict=True):
        colour, mark = MARKS[row.verdict]
        axes.plot([row.low, row.high], [place, place], color=colour, ls="-", lw=4, alpha=0.5)
        axes.plot(row.ratio, place, mark, color=colour, ms=6)
        axes.text(row.high * 1.15, place, f"{row.ratio:g}×", va="center", fontsize=9, color=BLACK)
        if first:
            axes.annotate(
                row.benchmark,
                (0, place + 1),
                (-LABELS, 0),
                xycoords=axes.get_yaxis_transform(),
                textcoords="offset points",
                va="center",
                fontsize=9,
                fontweight="bold",
                backgroundcolor="white",
            )
    axes.axvline(1, color=BLACK, lw=1)
    axes.set_yticks(places, bench["against"], fontsize=9, ha="left")
    axes.tick_params(axis="y", pad=LABELS, length=0)
    axes.spines["left"].set_visible(False)
    axes.set_ylim(places[-1] - 0.8, 0)
    axes.set_xscale("log")
    axes.set_xlim(min(0.5, bench["low"].min() / 1.3), bench["high"].max() * 3.5)
    axes.grid(axis="y", visible=False)
    label(axes, x="cost of the rival ÷ cost of ours (log scale)", y="")
    plt.close(figure)
    return figure


def in_words(bench: pd.DataFrame) -> pd.DataFrame:
    """The same as a table: costs, and the ratio with its interval where it has one."""
    shown = bench[["benchmark", "against", "rival", "ours", "ratio", "verdict"]].copy()
    interval = bench["low"].map("{:g}".format) + ", " + bench["high"].map("{:g}".format)
    between = (" [" + interval + "]").where(bench["low"].notna(), "")
    shown["ratio"] = bench["ratio"].map("{:g}".format) + between
    return shown.rename(columns={"ratio": "ratio [95%]"})


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
