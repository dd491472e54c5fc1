"""Statistics over seeds: intervals, success fractions, convergence.

A seed is one independent run of an arm, and the only thing that is resampled here. Measures are
counts of steps or episodes, so lower is better throughout; negate returns. A seed that never gets
there counts as infinity rather than being dropped: medians, interquartile means and the probability
of improvement take infinities as they are, of either sign. What would have to average both signs is
no number, and refused. Values may be integers, truth values, fractions or floats of any width.
"""

from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

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
    return _averaged("values", values, stats.trim_mean, 0.25, axis=axis)


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
    return _bootstrap("values", _array("values", values, 1, 2), statistic, rng, level, resamples)


def _bootstrap(
    name: str,
    values: F64,
    statistic: Statistic,
    rng: np.random.Generator,
    level: float,
    resamples: int,
    anything: float | None = None,
) -> Interval:
    level, resamples = _checked_draws(rng, level, resamples)
    unknown = np.isnan(values.T).any(axis=-1)
    checks.require(values.ndim == 2 or not unknown, name, values, "without NaN")
    n_seeds = len(values)
    points = values.reshape(n_seeds, -1).T.copy()
    trim = _trim(statistic, n_seeds)
    counts = _seed_counts(n_seeds, resamples, rng)
    low, high = np.empty(len(points)), np.empty(len(points))
    for start in range(0, len(points), POINTS_AT_ONCE):
        part = slice(start, start + POINTS_AT_ONCE)
        order = np.argsort(points[part], axis=1)
        ordered = np.take_along_axis(points[part], order, axis=1)
        low[part], high[part] = _limits(_trimmed_means(ordered, order, counts, trim), level)
    estimate = _averaged(name, points, statistic, axis=1, anything=anything)
    low[np.isnan(estimate)] = high[np.isnan(estimate)] = np.nan
    if values.ndim == 1:
        return _interval(float(estimate[0]), float(low[0]), float(high[0]))
    return _interval(estimate, low, high)


def paired_difference_interval(
    a: ArrayLike,
    b: ArrayLike,
    statistic: Statistic = np.median,
    *,
    rng: np.random.Generator,
    level: float = 0.95,
    resamples: int = 10_000,
) -> Interval:
    """Return the bootstrap interval of a statistic of a - b, seed by seed.

    Parameters
    ----------
    a, b : array, shape (seeds,) or (seeds, points)
        Two arms with the same seeds in the same order. Infinite where a seed never gets there: so
        is its difference, and 0 where it does in neither arm. Of these only a median can be taken;
        where any number would be one, between minus and plus infinity, it is 0: no difference.
    statistic, rng, level, resamples
        As in `bootstrap_interval`.

    Raises
    ------
    TypeError, ValueError
        An argument is not as described.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.statistics import paired_difference_interval
    >>> rng = np.random.default_rng(0)
    >>> paired_difference_interval([5.0, 7.0, 9.0], [4.0, 5.0, 6.0], np.mean, rng=rng).estimate
    2.0
    >>> paired_difference_interval([np.inf, 7.0, np.inf], [4.0, 5.0, np.inf], rng=rng).estimate
    2.0
    """
    a, b = _array("a", a, 1, 2), _array("b", b, 1, 2)
    checks.require(a.shape == b.shape, "b", b.shape, f"of the shape of a, {a.shape}")
    if np.isinf(a).any() or np.isinf(b).any():
        allowed = "np.median where a or b is infinite for some seed"
        checks.require(statistic is np.median, "statistic", statistic, allowed)
    with np.errstate(invalid="ignore", over="ignore"):
        differences = np.where(np.isinf(a) & (a == b), 0.0, a - b)
    return _bootstrap("a - b", differences, statistic, rng, level, resamples, anything=0.0)


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
    a, b = (
        checks.floats("a", a, (None,), finite=False),
        checks.floats("b", b, (None,), finite=False),
    )
    checks.require(len(a), "a", a, "not empty")
    checks.require(len(b), "b", b, "not empty")
    level, resamples = _checked_draws(rng, level, resamples)
    if np.isposinf(a).all() and np.isposinf(b).all():
        return Interval(0.5, 0.0, 1.0)
    # Counted in halves, whole numbers: rounding cannot push the limits past the estimate.
    halves = 2.0 * (a[:, None] < b) + (a[:, None] == b)
    drawn_a, drawn_b = (_seed_counts(len(arm), resamples, rng) for arm in (a, b))
    all_pairs = 2.0 * len(a) * len(b)
    low, high = _limits(np.sum((drawn_a @ halves) * drawn_b, axis=1) / all_pairs, level)
    return _interval(float(halves.sum() / all_pairs), float(low), float(high))


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


def learning_curves(
    table: pd.DataFrame,
    column: str = "steps",
    *,
    seeds: Sequence[int],
    episodes: int,
    window: int = 1,
    average: Literal["median", "mean"] = "median",
) -> F64:
    """Return a column of one arm's table as one curve a seed, smoothed over the last episodes.

    Parameters
    ----------
    table : pandas.DataFrame
        With the columns `seed`, `episode` (from 1) and `column`; one row a seed and episode.
        Infinities are averaged like other numbers; NaN is refused.
    column : str
        What is drawn.
    seeds : sequence of int
        The rows of the result: all seeds that were run, so that none that failed goes missing.
    episodes : int
        The length of the result.
    window : int
        The trailing window, at least 1: point t is the average over episodes t - window + 1 to t,
        fewer at the start.
    average : {"median", "mean"}
        The average.

    Returns
    -------
    numpy.ndarray, shape (seeds, episodes), float64
        NaN where a seed has no such episode: after it stopped.

    Raises
    ------
    TypeError, ValueError
        The table has several rows for a seed and episode (several arms), no such column, other
        seeds or episodes than those asked for, or a window that averages infinities of both signs.

    Examples
    --------
    >>> import pandas as pd
    >>> from rl_core.statistics import learning_curves
    >>> table = pd.DataFrame({"seed": [0, 0, 1], "episode": [1, 2, 1], "steps": [90, 70, 80]})
    >>> learning_curves(table, seeds=[0, 1, 2], episodes=2, window=2)
    array([[90., 80.],
           [80., nan],
           [nan, nan]])
    """
    seeds, episodes = checks.distinct_seeds(seeds), checks.integer("episodes", episodes, 1)
    window = checks.integer("window", window, 1)
    checks.one_of("average", average, ("median", "mean"))
    checks.instance("table", table, pd.DataFrame, "a pandas.DataFrame")
    checks.instance("column", column, str, "the name of a column")
    missing = {"seed", "episode", column} - set(table.columns)
    allowed = f"with the columns {sorted(missing)} too, where column is {column!r}"
    checks.require(not missing, "table", list(table.columns), allowed)
    checks.floats(column, table[column], (None,), finite=False)
    twice = table.duplicated(["seed", "episode"]).any()
    checks.require(not twice, "table", "several rows for a seed and episode", "of a single arm")
    wide = table.pivot(index="episode", columns="seed", values=column)
    others = sorted(set(wide.columns) - set(seeds))
    checks.require(not others, "seeds", seeds, f"all that the table has, {others} too")
    fits = wide.index.isin(range(1, episodes + 1)).all()
    longest = f"{wide.index.min()} to {wide.index.max()}"
    checks.require(fits, "episodes", episodes, f"1 to the last of the table, which has {longest}")
    wide = wide.astype(np.float64).reindex(index=range(1, episodes + 1), columns=list(seeds))
    trailing = wide.rolling(window, min_periods=1)
    smooth = trailing.median() if average == "median" else trailing.mean()
    curves = smooth.where(wide.notna()).to_numpy().T.copy()
    # pandas leaves infinities out: windows that have one are averaged here.
    infinite = wide.isin([np.inf, -np.inf]).astype(float)
    windows = infinite.rolling(window, min_periods=1).max() > 0
    statistic = np.median if average == "median" else np.mean
    for t, i in np.argwhere((windows & wide.notna()).to_numpy()):
        seen = wide.iloc[max(0, t + 1 - window) : t + 1, i].dropna().to_numpy()
        curves[i, t] = _averaged(column, seen, statistic, axis=0)
    return curves


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


def episodes_to_threshold(curves: ArrayLike, threshold: float, *, hold: int = 1) -> F64:
    """Return the episode from which each seed stays at or below `threshold` for `hold` episodes.

    Parameters
    ----------
    curves : array, shape (seeds, episodes)
        Usually smoothed.
    threshold : float
        In the units of the curves.
    hold : int
        Episodes in a row, 1 to their number.

    Returns
    -------
    numpy.ndarray, shape (seeds,), float64
        Episodes counted from 1; infinity for seeds that never do (censored: they might, later).

    Raises
    ------
    TypeError, ValueError
        `curves` has another shape, `hold` does not fit into it, or `threshold` is NaN.

    Examples
    --------
    >>> from rl_core.statistics import episodes_to_threshold
    >>> episodes_to_threshold([[9.0, 3.0, 9.0, 2.0, 1.0], [9.0, 9.0, 9.0, 9.0, 3.0]], 3, hold=2)
    array([ 4., inf])
    """
    curves = _array("curves", curves, 2)
    hold = checks.integer("hold", hold, 1, curves.shape[1])
    threshold = checks.floats("threshold", [threshold], (1,), finite=False)[0]
    windows = np.lib.stride_tricks.sliding_window_view(curves <= threshold, hold, axis=1)
    below = np.all(windows, axis=2)
    return np.where(below.any(axis=1), below.argmax(axis=1) + 1.0, np.inf)


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


def _trim(statistic: Statistic, n: int) -> int:
    """Return how many of n ordered values `statistic` leaves out at either end."""
    if statistic is np.mean:
        return 0
    if statistic is iqm:
        return n // 4
    if statistic is np.median:
        return (n - 1) // 2
    raise ValueError(f"statistic must be np.median, np.mean or iqm, got {statistic!r}")


def _seed_counts(n_seeds: int, resamples: int, rng: np.random.Generator) -> I64:
    """Return how often each seed is drawn: n draws with replacement, shape (resamples, seeds)."""
    return rng.multinomial(n_seeds, np.full(n_seeds, 1 / n_seeds), size=resamples)


def _limits(drawn: F64, level: float) -> tuple[Any, Any]:
    """Return the percentile limits over the last axis, as values that occur.

    No interpolation, because between two infinities there is no number. A draw that is none, since
    it averages both, counts as the one for the lower limit and as the other for the upper.
    """
    nothing = np.isnan(drawn)
    lowest, highest = np.where(nothing, -np.inf, drawn), np.where(nothing, np.inf, drawn)
    low = np.quantile(lowest, (1 - level) / 2, axis=-1, method="lower")
    high = np.quantile(highest, (1 + level) / 2, axis=-1, method="higher")
    return low, high


def _interval(estimate: Any, low: Any, high: Any) -> Interval:
    """Limits that hold their estimate; sums in another order can miss it by a rounding error."""
    if isinstance(estimate, float):
        return Interval(estimate, min(low, estimate), max(high, estimate))
    return Interval(estimate, np.minimum(low, estimate), np.maximum(high, estimate))


def _averaged(
    name: str,
    values: F64,
    statistic: Statistic,
    *trim: float,
    axis: int,
    anything: float | None = None,
) -> Any:
    """Return a statistic of values, NaN where they have one.

    Between infinities of both signs there is anything: refused, unless it is said what to take.
    """
    with np.errstate(invalid="ignore"):
        middle = np.asarray(statistic(values, *trim, axis=axis))
    unknown = np.isnan(values).any(axis=axis)
    between = np.isnan(middle) & ~unknown
    allowed = "without infinities of both signs in the middle"
    checks.require(anything is not None or not between.any(), name, values, allowed)
    middle[between] = anything
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
    return checks.number("level", level, above=0, below=1), checks.integer(
        "resamples", resamples, 1
    )
