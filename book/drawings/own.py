"""Chapter 7: days in a room, what was earned while learning, and in the end."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from drawings.look import BLACK, BLUE, COLOURS, GREEN, GREY, LINES, VERMILLION, label, median_band
from examples.room import COMFORT, SLEEPS, WAKES


def days(by_name: Mapping[str, pd.DataFrame]) -> Figure:
    """Temperature by the hour, and below it when there was heating."""
    figure, (top, bottom) = plt.subplots(
        2, 1, figsize=(6.4, 4.2), sharex=True, height_ratios=[4, 1.2]
    )
    top.axvspan(WAKES / 4, SLEEPS / 4, color=GREY, alpha=0.15, lw=0)
    top.axhline(COMFORT, color=GREY, lw=0.8, ls="-")
    for at, (name, day) in enumerate(by_name.items()):
        top.plot(day["hour"], day["temperature"], color=COLOURS[at], ls=LINES[at], label=name)
        on = day["hour"][day["heating"] == 1]
        bottom.plot(on, np.full(len(on), -at), "|", color=COLOURS[at], ms=9)
    label(top, x="", y="temperature (°C)")
    label(bottom, x="hour of the day", y="heating")
    bottom.set_yticks([])
    bottom.set_ylim(-len(by_name) + 0.4, 0.6)
    top.legend(loc="lower right")
    plt.close(figure)
    return figure


def learning(table: pd.DataFrame, arms: Mapping[str, str], rule: float) -> Figure:
    """Return of a day, a thin line a seed, against the days of learning."""
    figure, axes = plt.subplots()
    for at, (arm, name) in enumerate(arms.items()):
        rows = table[table["arm"] == arm].pivot(index="seed", columns="episode", values="return")
        smooth = rows.T.rolling(5, min_periods=1).mean()
        axes.plot(smooth.index, smooth, color=COLOURS[at], ls=LINES[at], lw=1.2)
        axes.plot([], [], color=COLOURS[at], ls=LINES[at], label=name)
    axes.axhline(rule, color=BLACK, ls=":", label="thermostat")
    label(axes, x="day of learning", y="return of a day (mean of 5)")
    axes.legend(loc="lower right")
    plt.close(figure)
    return figure


def medians(table: pd.DataFrame, arms: list[str], rule: float) -> Figure:
    """The median over seeds and its interval, for each arm."""
    figure, axes = plt.subplots()
    for arm, colour, line in zip(arms, (BLUE, VERMILLION), LINES, strict=False):
        rows = table[table["arm"] == arm].pivot(index="seed", columns="episode", values="return")
        smooth = rows.T.rolling(10, min_periods=1).mean().T
        days = smooth.columns.to_numpy()
        median_band(axes, days, smooth.to_numpy(), colour=colour, line=line, text=arm)
    axes.axhline(rule, color=BLACK, ls=":", label="thermostat")
    label(axes, x="day of learning", y="return of a day (mean of 10)")
    axes.legend(loc="lower right")
    plt.close(figure)
    return figure


def bars(speeds: pd.DataFrame) -> Figure:
    """Steps a second, on a logarithmic axis."""
    figure, axes = plt.subplots(figsize=(6.4, 1.9))
    axes.barh(speeds["loop"], speeds["steps a second"], color=[GREY, GREEN])
    axes.set_xscale("log")
    axes.invert_yaxis()
    label(axes, x="steps a second (logarithmic)", y="")
    plt.close(figure)
    return figure


def ends(by_arm: Mapping[str, np.ndarray], rule: float) -> Figure:
    """What each seed earns a day in the end, and the median with its interval."""
    figure, axes = plt.subplots(figsize=(6.4, 2.6))
    for at, values in enumerate(by_arm.values()):
        spread = np.linspace(-0.25, 0.25, len(values))
        axes.plot(np.sort(values), at + spread, "o", color=COLOURS[at], ms=4, alpha=0.6)
        axes.plot([np.median(values)], [at], "D", color=BLACK, ms=8)
    axes.axvline(rule, color=BLACK, ls=":", label="thermostat")
    axes.set_yticks(range(len(by_arm)), list(by_arm))
    axes.invert_yaxis()
    label(axes, x="mean return of a day, greedy", y="")
    axes.legend(loc="lower left")
    plt.close(figure)
    return figure
