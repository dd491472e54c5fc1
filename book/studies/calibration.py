"""Appendix: how often the book's 95% intervals hold what they are about, where that is known.

Steps of a seed are drawn from a law whose median, and whose chance to be lower than another, have a
formula: steps = 200 exp(spread Z) with a normal Z, and for ever with the chance of a failure. Then
intervals are made as in the chapters, and it is counted how many hold the truth. A share's interval
needs no draws: its coverage is a sum over the binomial law.
"""

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd
from scipy import stats

from rl_core.statistics import (
    bootstrap_interval,
    probability_of_improvement,
    proportion_interval,
)

SPREAD = 0.5  # standard deviation of the logarithm of steps
REPEATS = 500
RESAMPLES = 500  # in the chapters 10,000; here it is the intervals that have to be many
Draw = Callable[[np.random.Generator], tuple[float, float]]


def steps(
    rng: np.random.Generator, n: int, *, failing: float = 0.0, faster: float = 0.0
) -> np.ndarray:
    """Steps of n seeds: lognormal, infinite where one fails; `faster` is by how many spreads."""
    drawn = 200 * np.exp(SPREAD * (rng.normal(size=n) - faster))
    return np.where(rng.random(n) < failing, np.inf, drawn)


def median_of_all(failing: float) -> float:
    """The median of the law with failures.

    Examples
    --------
    >>> float(median_of_all(0.0))
    200.0
    """
    return 200 * np.exp(SPREAD * stats.norm.ppf(0.5 / (1 - failing)))


def chance_to_be_lower(faster: float) -> float:
    """How likely a seed that is so many spreads faster takes fewer steps than another.

    Examples
    --------
    >>> float(chance_to_be_lower(0.0))
    0.5
    """
    return stats.norm.cdf(faster / np.sqrt(2))


def share_held(n: int, share: float) -> float:
    """Chance that the interval of a share, over n seeds, holds it.

    Examples
    --------
    >>> round(share_held(30, 0.9), 3)
    0.974
    """
    counts = np.arange(n + 1)
    limits = np.array([proportion_interval(int(count), n)[1:] for count in counts])
    holds = (limits[:, 0] <= share) & (share <= limits[:, 1])
    return float(stats.binom.pmf(counts, n, share)[holds].sum())


def held(truth: float, draw: Draw, seed: int, repeats: int = REPEATS) -> float:
    """Share of intervals that hold the truth."""
    rng = np.random.default_rng(np.random.SeedSequence([2029, seed]))
    limits = np.array([draw(rng) for _ in range(repeats)])
    return float(((limits[:, 0] <= truth) & (truth <= limits[:, 1])).mean())


def cases() -> Iterator[tuple[str, str, float, Draw]]:
    """What is drawn: the interval, the seeds in words, the truth, and how to make one interval."""
    for n in (10, 30, 100):
        for failing in (0.0, 0.3):

            def median(rng, n=n, failing=failing):
                return bootstrap_interval(
                    steps(rng, n, failing=failing), rng=rng, resamples=RESAMPLES
                )[1:]

            text = f"{n}, of which {failing:.0%} fail" if failing else f"{n}"
            yield "median", text, median_of_all(failing), median
    for n, others, faster in ((30, 30, 0.5), (11, 25, 0.5), (100, 100, 0.5), (10, 10, 2.5)):

        def lower(rng, n=n, others=others, faster=faster):
            pair = steps(rng, n, faster=faster), steps(rng, others)
            return probability_of_improvement(*pair, rng=rng, resamples=RESAMPLES)[1:]

        truth = chance_to_be_lower(faster)
        yield f"probability of fewer steps, {truth:.2f}", f"{n} and {others}", truth, lower


def coverage(repeats: int = REPEATS) -> pd.DataFrame:
    """One row an interval and number of seeds: how many of the intervals hold the truth."""
    rows = [
        (name, seeds, held(truth, draw, place, repeats))
        for place, (name, seeds, truth, draw) in enumerate(cases())
    ]
    rows += [
        (f"share of seeds, {share:g}", f"{n}", share_held(n, share))
        for share in (0.5, 0.9)
        for n in (30, 100)
    ]
    table = pd.DataFrame(rows, columns=["interval", "seeds", "held"])
    return table.assign(held=100 * table["held"]).rename(columns={"held": "held (%)"})
