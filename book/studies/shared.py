"""What the studies of several chapters share: evidence, the seed in the middle, texts."""

import numpy as np
import pandas as pd

from report.claims import Evidence
from report.seeds import SEEDS
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


def middle_seed(steps: np.ndarray) -> int:
    """The seed in the middle when all are ordered by their steps, the lower of two: not a pick.

    Parameters
    ----------
    steps : ndarray of shape (seeds,)
        In the order of the seeds; infinite where one does not get there.
    """
    order = np.argsort(steps, kind="stable")
    return int(SEEDS[order[(len(order) - 1) // 2]])


def interval_text(interval: tuple[float, float, float]) -> str:
    """An estimate with its interval, in whole numbers.

    Examples
    --------
    >>> interval_text((-1234.4, -np.inf, 0.2))
    '−1,234 [−∞, 0]'
    """
    texts = (f"{x:,.0f}".replace("inf", "∞").replace("-", "−") for x in interval)
    return "{} [{}, {}]".format(*texts)


def wall_clock(results: Results, arms: dict[str, tuple[str, float]], total: str) -> pd.DataFrame:
    """Seconds that one seed took, here and in the report.

    Parameters
    ----------
    results : Results
        With the arms.
    arms : dict of str to (str, float)
        For each arm what to call it, and the report's seconds.
    total : str
        The heading of the seconds of all seeds.
    """
    rows = []
    for arm, (name, seconds) in arms.items():
        made = results.provenance[results.provenance["arm"] == arm]
        rows.append((name, seconds, made["seconds"].mean(), made["seconds"].sum()))
        rows[-1] += (made["processor"].iloc[0],)
    columns = ["experiment", "2018 (s)", "now (s, mean)", total, "processor"]
    return pd.DataFrame(rows, columns=columns)
