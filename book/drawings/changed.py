"""One thing changed: a few seeds of other arms over every seed as reported."""

from collections.abc import Mapping

import pandas as pd
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from drawings.look import COLOURS, GREY, LINES, label

WINDOW = 100  # episodes, of the running median


def over_reported(reported: pd.DataFrame, others: Mapping[str, pd.DataFrame]) -> Figure:
    """Steps an episode of each seed, as far as the other arms go.

    Parameters
    ----------
    reported : pandas.DataFrame
        With the columns `seed`, `episode` and `steps`.
    others : mapping of str to pandas.DataFrame
        Such tables, by what is said of them.
    """
    figure, axes = plt.subplots()
    last = max(table["episode"].max() for table in others.values())
    looks = [("as reported, every seed", reported[reported["episode"] <= last], GREY, "-", 0.5)]
    for (text, table), colour, line in zip(others.items(), COLOURS[1:], LINES, strict=False):
        looks.append((text, table, colour, line, 1.4))
    for text, table, colour, line, width in looks:
        for _, rows in table.groupby("seed"):
            steps = rows["steps"].rolling(WINDOW, min_periods=1).median()
            axes.plot(rows["episode"], steps, color=colour, ls=line, lw=width)
        axes.plot([], [], color=colour, ls=line, lw=1.4, label=text)
    axes.set_yscale("log")
    label(axes, x="episode", y="steps to the goal (log scale)")
    axes.legend(fontsize=9)
    plt.close(figure)
    return figure
