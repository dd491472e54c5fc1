"""How the cost of the experiments grows: measured while the page is built, the best of some rounds.

Seconds depend on the machine and its neighbours. How they grow does not.
"""

import time
from collections.abc import Callable

import numpy as np
import pandas as pd
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from drawings.look import BLACK, BLUE, GREY, label
from report.seeds import PREVIEW
from rl_core.maze import Maze
from rl_core.planning import value_iteration
from rl_core.reinforce import ReinforceConfig, reinforce
from studies.random_mazes import random_maze

ROUNDS = 1 if PREVIEW else 3
SEED_COUNTS = (1, 2, 4, 8, 16)
EPISODES = (25, 50, 100, 200, 400)
SIDES = (12, 40, 125, 395)  # of random mazes with three flags: about 10³ to 10⁶ states


def _seconds(work: Callable[[], object]) -> float:
    """The quickest of some rounds: what the work takes when nothing gets in its way."""
    taken = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        work()
        taken.append(time.perf_counter() - start)
    return min(taken)


def _train(seeds: int, episodes: int) -> None:
    # Every episode stopped at 500 steps: the same work for each seed and episode.
    config = ReinforceConfig(max_episode_steps=500)
    reinforce("MountainCar-v0", config, episodes=episodes, seeds=range(1000, 1000 + seeds))


def by_seeds() -> pd.DataFrame:
    """Seconds of 50 episodes of REINFORCE against the number of seeds."""
    _train(1, 1)  # compiles
    rows = [(seeds, _seconds(lambda seeds=seeds: _train(seeds, 50))) for seeds in SEED_COUNTS]
    return pd.DataFrame(rows, columns=["seeds", "seconds"])


def by_episodes() -> pd.DataFrame:
    """Seconds of one seed of REINFORCE against the number of episodes."""
    rows = [(n, _seconds(lambda n=n: _train(1, n))) for n in EPISODES]
    return pd.DataFrame(rows, columns=["episodes", "seconds"])


def by_states() -> pd.DataFrame:
    """Seconds of value iteration on random mazes against the number of states."""
    value_iteration(Maze().model(), gamma=0.99, progress=False)  # compiles
    rows = []
    for side in SIDES:
        rng = np.random.default_rng(side)
        model = random_maze(side, side, 3, 0.2, rng).model()
        taken = _seconds(lambda model=model: value_iteration(model, gamma=0.99, progress=False))
        rows.append((model.n_states, taken))
    return pd.DataFrame(rows, columns=["states", "seconds"])


def growth(table: pd.DataFrame) -> float:
    """The power with which the seconds grow: the slope on logarithmic axes, by least squares."""
    x, y = (np.log(table.iloc[:, column].to_numpy(float)) for column in (0, 1))
    return float(np.polyfit(x, y, 1)[0])


def growth_figure(tables: list[pd.DataFrame]) -> Figure:
    """Seconds against seeds, episodes and states, each beside proportional growth."""
    figure, panels = plt.subplots(1, len(tables), figsize=(8.4, 3.2))
    for axes, table in zip(panels, tables, strict=True):
        x, y = table.iloc[:, 0], table.iloc[:, 1]
        axes.plot(x, y.iloc[-1] * x / x.iloc[-1], color=GREY, ls="--", lw=1)
        axes.plot(x, y, "o-", color=BLUE)
        axes.set_xscale("log")
        axes.set_yscale("log")
        if x.max() < 1000:  # else powers of ten do
            axes.set_xticks(x, x)
        axes.xaxis.set_minor_formatter(NullFormatter())
        label(axes, x=f"{table.columns[0]} (log scale)", y="seconds (log scale)")
    plt.close(figure)
    return figure


def bench_figure(bench: pd.DataFrame) -> Figure:
    """How many times as long the rival takes, one bar a comparison."""
    bench = bench[~bench["unit"].str.startswith("bytes")]
    figure, axes = plt.subplots(figsize=(8.4, 0.46 * len(bench) + 0.9))
    places = np.arange(len(bench))[::-1]
    axes.barh(places, bench["ratio"], color=BLUE, height=0.65)
    for place, ratio in zip(places, bench["ratio"], strict=True):
        axes.text(ratio * 1.06, place, f"{ratio:g}×", va="center", fontsize=9, color=BLACK)
    axes.axvline(1, color=BLACK, lw=1)
    axes.set_yticks(places, bench["benchmark"] + "\nagainst " + bench["against"], fontsize=8)
    axes.set_xscale("log")
    axes.set_xlim(0.5, bench["ratio"].max() * 3)
    axes.grid(axis="y", visible=False)
    label(axes, x="time of the rival ÷ time of ours (log scale)", y="")
    plt.close(figure)
    return figure
