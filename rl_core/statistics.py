"""Statistics over seeds: intervals, success fractions, convergence.

A seed is one independent run of an arm, and the only thing that is resampled here. Measures are
counts of steps or episodes, so lower is better throughout; negate returns. A seed that never gets
there counts as infinity rather than being dropped: medians, interquartile means and the probability
of improvement take infinities as they are, of either sign. What would have to average both signs is
no number, and refused. Values may be integers, truth values, fractions or floats of any width.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy import stats

from rl_core import checks
from rl_core.kernels.arrays import F64, I64, Bools
from rl_core.kernels.compiled import compiled

Statistic = Callable[..., Any]
POINTS_AT_ONCE = 64  # bounds the memory of a bootstrap to 5 MB for 10,000 resamples


class Interval(NamedTuple):
    """An estimate between its confidence limits: never outside, not even by rounding.

    Attributes
    ----------
    estimate, low, high : float or numpy.ndarray
        Numbers, or arrays of shape (points,).
    """

    estimate: Any
    low: Any
    high: Any


def iqm(values: ArrayLike, axis: int = 0) -> Any:
    """Return the interquartile mean along `axis`: the mean of the middle half.

    Of n values, floor(n / 4) are left out at either end (Agarwal et al. 2021, "Deep reinforcement
    learning at the edge of the statistical precipice"). NaN among the values gives NaN; infinities
    of both signs in the middle half are a ValueError.

    >>> from rl_core.statistics import iqm
    >>> float(iqm([100.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, -7.0]))
    3.5
    """
    values = _array("values", values, 1, 2)
    axis = checks.integer("axis", axis, -values.ndim, values.ndim - 1)
    return _averaged(values, stats.trim_mean, 0.25, axis=axis)


def bootstrap_interval(
    values: ArrayLike,
    statistic: Statistic = np.median,
    *,
    rng: np.random.Generator,
    level: float = 0.95,
    resamples: int = 10_000,
) -> Interval:
    """Return a statistic over seeds with its percentile bootstrap interval.

    The seeds are drawn with replacement, as many as there are, `resamples` times; the limits are
    the (1 - level) / 2 and (1 + level) / 2 quantiles of the statistic over the draws, rounded
    outwards to a value that occurred (Efron and Tibshirani 1993, "An introduction to the
    bootstrap", chapter 13). A curve's points see the same draws. Mean, interquartile mean and
    median of the ordered values x_(1) <= ... <= x_(n) are one formula with different trim g:

        T = 1 / (n - 2 g) sum_{k = g + 1}^{n - g} x_(k),   g = 0, floor(n / 4), floor((n - 1) / 2)

    Parameters
    ----------
    values : array, shape (seeds,) or (seeds, points)
        At least one seed. Infinities are values like others; a draw that would average both signs
        reaches as far as either. A curve's point that has a NaN, a seed that stopped, gets NaN
        throughout: no seed is left out silently. A single number must not be NaN.
    statistic : {np.median, np.mean, iqm}
        What is estimated.
    rng : numpy.random.Generator
        Draws the seeds.
    level : float
        Confidence, between 0 and 1.
    resamples : int
        Number of draws, at least 1.

    Returns
    -------
    Interval
        Floats, or arrays of shape (points,).

    Raises
    ------
    TypeError, ValueError
        An argument is not as described.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.statistics import bootstrap_interval
    >>> estimate, low, high = bootstrap_interval(
    ...     [93.0, 101.0, 88.0, 120.0, 97.0], rng=np.random.default_rng(0)
    ... )
    >>> estimate, low, high
    (97.0, 88.0, 120.0)
    """
    level, resamples = _checked_draws(rng, level, resamples)
    values = _array("values", values, 1, 2)
    points = values.reshape(len(values), -1).T.copy()
    unknown = values.ndim == 1 and np.isnan(values).any()
    checks.require(not unknown, "values", values, "without NaN")
    n = len(values)
    trims = (np.mean, 0), (iqm, n // 4), (np.median, (n - 1) // 2)
    trim = [g for known, g in trims if statistic is known]
    checks.require(trim, "statistic", statistic, "np.median, np.mean or iqm")
    counts = _seed_counts(n, resamples, rng)
    low, high = np.empty(len(points)), np.empty(len(points))
    for start in range(0, len(points), POINTS_AT_ONCE):
        part = slice(start, start + POINTS_AT_ONCE)
        order = np.argsort(points[part], axis=1)
        ordered = np.take_along_axis(points[part], order, axis=1)
        low[part], high[part] = _limits(_trimmed_means(ordered, order, counts, trim[0]), level)
    estimate = _averaged(points, statistic, axis=1)
    low[np.isnan(estimate)] = high[np.isnan(estimate)] = np.nan
    if values.ndim == 1:
        return _interval(float(estimate[0]), float(low[0]), float(high[0]))
    return _interval(estimate, low, high)


def probability_of_improvement(
    a: ArrayLike,
    b: ArrayLike,
    *,
    rng: np.random.Generator,
    level: float = 0.95,
    resamples: int = 10_000,
) -> Interval:
    """Return how likely a random seed of arm `a` does better (lower) than one of arm `b`.

        P = 1 / (n m) sum_i sum_j ([a_i < b_j] + [a_i = b_j] / 2)

    with a percentile bootstrap interval that draws the seeds of each arm independently (Agarwal et
    al. 2021, section 4.3). Half means that neither is better.

    If all values of both arms are infinite, no seed of either got there. That says nothing of which
    is better, so the interval is [0, 1]; draws of equal seeds alone would make it [0.5, 0.5].

    Parameters
    ----------
    a, b : array, shape (seeds,)
        The arms; infinities are allowed, NaN is not.
    rng, level, resamples
        As in `bootstrap_interval`.

    Raises
    ------
    TypeError, ValueError
        An argument is not as described.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.statistics import probability_of_improvement
    >>> rng = np.random.default_rng(0)
    >>> probability_of_improvement([1.0, 2.0], [2.0, np.inf], rng=rng).estimate
    0.875
    >>> tuple(probability_of_improvement([np.inf], [np.inf], rng=rng))
    (0.5, 0.0, 1.0)
    """
    a, b = _array("a", a, 1), _array("b", b, 1)
    for name, arm in (("a", a), ("b", b)):
        checks.require(not np.isnan(arm).any(), name, arm, "without NaN")
    level, resamples = _checked_draws(rng, level, resamples)
    if np.isposinf(a).all() and np.isposinf(b).all():
        return Interval(0.5, 0.0, 1.0)
    # Counted in halves, whole numbers: rounding cannot push the limits past the estimate.
    halves = 2.0 * (a[:, None] < b) + (a[:, None] == b)
    drawn_a, drawn_b = (_seed_counts(len(arm), resamples, rng) for arm in (a, b))
    all_pairs = 2.0 * len(a) * len(b)
    limits = _limits(np.sum((drawn_a @ halves) * drawn_b, axis=1) / all_pairs, level)
    return _interval(float(halves.sum() / all_pairs), *map(float, limits))


def proportion_interval(successes: int, trials: int, *, level: float = 0.95) -> Interval:
    """Return the fraction `successes / trials` with its Wilson score interval.

    The limits are the p at which a test of p with normal approximation just does not reject (Wilson
    1927); they stay within [0, 1], and are sensible for fractions of 0 and 1 too.

    Raises
    ------
    TypeError, ValueError
        Not integers with 0 <= successes <= trials, no trials, or `level` not between 0 and 1.

    Examples
    --------
    >>> from rl_core.statistics import proportion_interval
    >>> estimate, low, high = proportion_interval(27, 30)
    >>> f"{estimate:.2f} [{low:.2f}, {high:.2f}]"
    '0.90 [0.74, 0.97]'
    """
    level = checks.number("level", level, above=0, below=1)
    trials = checks.integer("trials", trials, 1)
    successes = checks.integer("successes", successes, 0, trials)
    limits = stats.binomtest(successes, trials).proportion_ci(level, method="wilson")
    return _interval(successes / trials, float(limits.low), float(limits.high))


def learned(curves: ArrayLike, threshold: float, *, window: int) -> Bools:
    """Return which seeds learn: the median over the last `window` episodes is at most `threshold`.

    Parameters
    ----------
    curves : array, shape (seeds, episodes)
        Not smoothed. To judge at a milestone, pass the curves up to there.
    threshold : float
        In the units of the curves.
    window : int
        1 to the number of episodes.

    Returns
    -------
    numpy.ndarray, shape (seeds,), bool
        False where the window has a NaN: a seed that stopped has not learned. False too where
        its median lies between minus and plus infinity, and is no number.

    Raises
    ------
    TypeError, ValueError
        `curves` has another shape, `window` does not fit into it, or `threshold` is NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.statistics import learned
    >>> curves = [[500.0, 90.0, 95.0], [500.0, 500.0, 90.0], [90.0, 90.0, np.nan]]
    >>> learned(curves, 100, window=2)
    array([ True, False, False])
    """
    curves = _array("curves", curves, 2)
    window = checks.integer("window", window, 1, curves.shape[1])
    threshold = checks.floats("threshold", [threshold], (1,), finite=False)[0]
    with np.errstate(invalid="ignore"):
        return np.asarray(np.median(curves[:, -window:], axis=1) <= threshold)


@compiled
def _trimmed_means(ordered: F64, order: I64, counts: I64, trim: int) -> F64:
    """Return the trimmed mean of each draw at each point, shape (points, resamples).

    Row p of `ordered` has the values of point p in order, and of `order` the seeds they belong to.
    counts[r, s] is how often draw r has seed s. Walking along the order, the draw's values come
    sorted without sorting each draw: value i fills the places from `placed` on, counts times.
    """
    n_points, n_seeds = ordered.shape
    end = n_seeds - trim
    means = np.empty((n_points, len(counts)))
    for p in range(n_points):
        for r in range(len(counts)):
            placed, total = 0, 0.0
            for i in range(n_seeds):
                first = max(placed, trim)
                placed += counts[r, order[p, i]]
                if placed > first:  # also keeps infinities that are trimmed away out of the sum
                    total += (min(placed, end) - first) * ordered[p, i]
                    if placed >= end:
                        break
            means[p, r] = total / (end - trim)
    return means


def _seed_counts(n_seeds: int, resamples: int, rng: np.random.Generator) -> I64:
    """Return how often each seed is drawn: n draws with replacement, shape (resamples, seeds)."""
    return rng.multinomial(n_seeds, np.full(n_seeds, 1 / n_seeds), size=resamples)


def _limits(drawn: F64, level: float) -> tuple[Any, Any]:
    """Return the percentile limits over the last axis, as values that occur.

    No interpolation, because between two infinities there is no number. A draw that is none, since
    it averages both, counts as the one for the lower limit and as the other for the upper.
    """
    lowest, highest = (np.where(np.isnan(drawn), end, drawn) for end in (-np.inf, np.inf))
    low = np.quantile(lowest, (1 - level) / 2, axis=-1, method="lower")
    high = np.quantile(highest, (1 + level) / 2, axis=-1, method="higher")
    return low, high


def _interval(estimate: Any, low: Any, high: Any) -> Interval:
    """Limits that hold their estimate; sums in another order can miss it by a rounding error."""
    if isinstance(estimate, float):
        return Interval(estimate, min(low, estimate), max(high, estimate))
    return Interval(estimate, np.minimum(low, estimate), np.maximum(high, estimate))


def _averaged(values: F64, statistic: Statistic, *trim: float, axis: int) -> Any:
    """Return a statistic of values, NaN where they have one; refuse infinities of both signs."""
    with np.errstate(invalid="ignore"):
        middle = np.asarray(statistic(values, *trim, axis=axis))
    unknown = np.isnan(values).any(axis=axis)
    allowed = "without infinities of both signs in the middle"
    checks.require(not np.isnan(middle[~unknown]).any(), "values", values, allowed)
    return np.where(unknown, np.nan, middle)


def _array(name: str, values: ArrayLike, *dimensions: int) -> F64:
    """Return numbers as float64, not empty; NaN stands for what is missing."""
    try:
        given = np.asarray(values)
    except (RuntimeError, TypeError, ValueError):  # ragged nesting, or what its own code raises
        given = np.empty((0, 0, 0))
    shape = (None,) * (given.ndim if given.ndim in dimensions else dimensions[-1])
    missing = pd.isna(given) if given.dtype.kind in "fO" else np.zeros(given.shape, bool)
    if missing.any() or given.dtype.kind == "b":
        given = np.where(missing, 0.0, given)
    array = checks.floats(name, given, shape, finite=False)
    checks.require(array.size, name, array, "not empty")
    array[missing] = np.nan
    return array


def _checked_draws(rng: object, level: float, resamples: int) -> tuple[float, int]:
    checks.generator("rng", rng)
    level = checks.number("level", level, above=0, below=1)
    return level, checks.integer("resamples", resamples, 1)
