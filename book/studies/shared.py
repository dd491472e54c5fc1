"""What the studies of several chapters share: evidence, the seed in the middle, texts, times."""

import numpy as np
import pandas as pd

from report.claims import Evidence
from rl_core.experiments import Results
from rl_core.statistics import bootstrap_interval, probability_of_improvement


def median_evidence(values: np.ndarray, rng: np.random.Generator) -> Evidence:
    """Median over seeds with its interval; of no seeds at all nothing is known.

    Examples
    --------
    >>> median_evidence(np.array([]), np.random.default_rng(0)).seeds
    0
    """
    if len(values) == 0:
        return Evidence.none()
    return Evidence(*bootstrap_interval(values, rng=rng), seeds=len(values))


def lower_evidence(one: np.ndarray, other: np.ndarray, rng: np.random.Generator) -> Evidence:
    """Probability that a seed of `one` has the lower value; without seeds, anything."""
    seeds = min(len(one), len(other))
    if seeds == 0:
        return Evidence(0.5, 0.0, 1.0, seeds=0)
    return Evidence(*probability_of_improvement(one, other, rng=rng), seeds=seeds)


def middle(steps: np.ndarray) -> int:
    """The place of the seed in the middle when all are ordered by their steps: not a pick.

    A place counts from 0 among the seeds of an arm; it is no seed. Of two in the middle it is the
    lower one.

    Parameters
    ----------
    steps : ndarray of shape (seeds,)
        In the order of the seeds; infinite where one does not get there.

    Examples
    --------
    >>> middle(np.array([9.0, 5.0, 7.0, np.inf]))
    2
    """
    order = np.argsort(steps, kind="stable")
    return int(order[(len(order) - 1) // 2])


def interval_text(interval: tuple[float, float, float]) -> str:
    """An estimate with its interval, in whole numbers.

    Examples
    --------
    >>> interval_text((-1234.4, -np.inf, 0.2))
    '−1,234 [−∞, 0]'
    """
    texts = (f"{x:,.0f}".replace("inf", "∞").replace("-", "−") for x in interval)
    return "{} [{}, {}]".format(*texts)


def seconds(results: Results, arms: dict[str, tuple[str, float]]) -> pd.DataFrame:
    """Seconds that one seed took: here those of the processor, in the report by the clock.

    Parameters
    ----------
    results : Results
        With the arms.
    arms : dict of str to (str, float)
        For each arm what to call it, and the report's seconds.
    """
    rows = []
    for arm, (name, reported) in arms.items():
        made = results.provenance[results.provenance["arm"] == arm]
        taken = made["processor_seconds"]
        rows.append((name, reported, taken.mean(), taken.sum(), made["processor"].iloc[0]))
    columns = ["experiment", "2018 (s)", "now (s, mean)", "now, all seeds (s)", "processor"]
    return pd.DataFrame(rows, columns=columns)
