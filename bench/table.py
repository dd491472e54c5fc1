"""The table of the measurements: how it is measured, its rows, and how it is shown."""

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from statistics import median

import numpy as np
import pandas as pd
from tqdm import tqdm

from rl_core.statistics import bootstrap_interval

COLUMNS = (
    *("benchmark", "against", "rival", "ours", "ratio", "low", "high", "verdict"),
    *("unit", "turns", "note"),
)
TURNS = 7


def processor_seconds(work: Callable[[], object]) -> float:
    """Processor time of a call, all its threads together: what neighbours take is not counted."""
    start = time.process_time()
    work()
    return time.process_time() - start


def in_turns(
    ways: Mapping[str, Callable[[int], float]], name: str, turns: int = TURNS
) -> dict[str, list[float]]:
    """Let the ways take turns, each with the number of the turn; return what each one measured."""
    costs: dict[str, list[float]] = {way: [] for way in ways}
    for turn in tqdm(range(turns), desc=f"  {name}", unit=" turns", file=sys.stderr):
        for way, measure in ways.items():
            costs[way].append(measure(turn))
    return costs


def comparison(
    benchmark: str,
    against: str,
    rival: Sequence[float],
    ours: Sequence[float],
    unit: str,
    note: str,
) -> dict[str, object]:
    """Return a row: what was compared, against whom, the cost of each, and their ratio.

    Parameters
    ----------
    rival, ours : sequence of float
        The costs of each turn. Shown are the medians, and of the ratios within a turn the median
        with its bootstrap interval of 95%. Ours is faster only if that lies above 1 as a whole.

    Examples
    --------
    >>> row = comparison("a walk", "a run", [1.0, 1.1, 1.0], [3.0, 3.0, 3.2], "s", "uphill")
    >>> row["ratio"], row["low"], row["high"], row["verdict"]
    (0.333, 0.312, 0.367, 'slower')
    """
    ratios = np.divide(rival, ours)
    interval = bootstrap_interval(ratios, rng=np.random.default_rng(2020))
    _, low, high = shown = [float(f"{value:.3g}") for value in interval]
    verdict = "faster" if low > 1 else "slower" if high < 1 else "cannot tell"
    costs = (float(f"{median(cost):.4g}") for cost in (rival, ours))
    values = (benchmark, against, *costs, *shown, verdict, unit, len(ratios), note)
    return dict(zip(COLUMNS, values, strict=True))


def limit(
    benchmark: str, against: str, allowed: float, used: float, unit: str, note: str
) -> dict[str, object]:
    """Return a row that holds ours against a limit: measured once, so without an interval.

    Examples
    --------
    >>> limit("luggage", "the airline", allowed=23.0, used=20.0, unit="kg", note="")["verdict"]
    'within'
    """
    shown = (float(f"{value:.4g}") for value in (allowed, used))
    verdict = "within" if used <= allowed else "beyond"
    ratio = float(f"{allowed / used:.3g}")
    values = (benchmark, against, *shown, ratio, np.nan, np.nan, verdict, unit, 1, note)
    return dict(zip(COLUMNS, values, strict=True))


def markdown(measured: pd.DataFrame) -> str:
    """Name the machine and the day, and set a row a comparison, in Markdown.

    Parameters
    ----------
    measured : pandas.DataFrame
        `results/bench.csv`: the columns of `COLUMNS`, and `machine` and `date`.

    Examples
    --------
    >>> row = comparison("a walk", "a run", [6.0], [2.0], unit="s", note="")
    >>> where = {"machine": "a desk", "date": "2026-11-24"}
    >>> print(markdown(pd.DataFrame([row | where])))
    Measured on 2026-11-24, a desk.
    <BLANKLINE>
    | benchmark | against | rival | ours | ratio | low | high | verdict | unit | turns | note |
    | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
    | a walk | a run | 6 | 2 | 3 | 3 | 3 | faster | s | 1 |  |
    """
    where = measured.iloc[0]
    lines = [list(COLUMNS), ["---"] * len(COLUMNS)]
    for row in measured[list(COLUMNS)].astype(object).itertuples(index=False):
        cells = ("" if pd.isna(cell) else cell for cell in row)
        lines.append([f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in cells])
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return f"Measured on {where['date']}, {where['machine']}.\n\n{table}"
