"""Learning curves of an arm, and what the chapters read off them, one number a seed."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from rl_core.statistics import Interval, bootstrap_interval


def learning_curves(
    table: pd.DataFrame,
    column: str = "steps",
    *,
    seeds: Sequence[int],
    episodes: int,
    window: int = 1,
) -> np.ndarray:
    """Return a column of one arm's table as one curve a seed: medians over the last episodes.

    Parameters
    ----------
    table : pandas.DataFrame
        With the columns `seed`, `episode` (from 1) and `column`; one row a seed and episode.
    column : str
        What is drawn; finite.
    seeds : sequence of int
        The rows of the result: all seeds that were run, so that none that failed goes missing.
    episodes : int
        The length of the result.
    window : int
        The trailing window, at least 1: point t is the median over episodes t - window + 1 to t,
        fewer at the start.

    Returns
    -------
    numpy.ndarray, shape (seeds, episodes), float64
        NaN where a seed has no such episode: after it stopped.

    Raises
    ------
    ValueError
        The table has several rows for a seed and episode (several arms), seeds or episodes other
        than those asked for, or numbers that are not finite.

    Examples
    --------
    >>> import pandas as pd
    >>> from studies.curves import learning_curves
    >>> table = pd.DataFrame({"seed": [0, 0, 1], "episode": [1, 2, 1], "steps": [90, 70, 80]})
    >>> learning_curves(table, seeds=[0, 1, 2], episodes=2, window=2)
    array([[90., 80.],
           [80., nan],
           [nan, nan]])
    """
    wide = table.pivot(index="episode", columns="seed", values=column).astype(np.float64)
    others = set(wide.columns) - set(seeds), set(wide.index) - set(range(1, episodes + 1))
    if any(others):
        raise ValueError(f"seeds and episodes must be all that the table has, got not {others}")
    if not np.isfinite(table[column]).all():
        raise ValueError(f"table must be of finite {column}")
    wide = wide.reindex(index=range(1, episodes + 1), columns=list(seeds))
    return wide.rolling(window, min_periods=1).median().where(wide.notna()).to_numpy().T.copy()


def episodes_to_threshold(curves: np.ndarray, threshold: float) -> np.ndarray:
    """Return the first episode in which each seed is at or below a threshold.

    Parameters
    ----------
    curves : array, shape (seeds, episodes)
        Usually smoothed.
    threshold : float
        In the units of the curves.

    Returns
    -------
    numpy.ndarray, shape (seeds,), float64
        Episodes counted from 1; infinity for seeds that never get there (they might, later).

    Examples
    --------
    >>> import numpy as np
    >>> from studies.curves import episodes_to_threshold
    >>> episodes_to_threshold(np.array([[9.0, 3.0, 9.0], [9.0, 9.0, np.nan]]), 3)
    array([ 2., inf])
    """
    below = curves <= threshold
    return np.where(below.any(axis=1), below.argmax(axis=1) + 1.0, np.inf)


def paired_difference_interval(
    a: np.ndarray, b: np.ndarray, *, rng: np.random.Generator
) -> Interval:
    """Return the median of a - b, seed by seed, with its bootstrap interval.

    Parameters
    ----------
    a, b : array, shape (seeds,)
        Two arms with the same seeds in the same order. Infinite where a seed never gets there: so
        is its difference, and 0 where it does in neither arm. A median that could be any number,
        between minus and plus infinity, is 0: no difference.
    rng : numpy.random.Generator
        Draws the seeds.

    Examples
    --------
    >>> import numpy as np
    >>> from studies.curves import paired_difference_interval
    >>> a, b = np.array([np.inf, 7.0, np.inf]), np.array([4.0, 5.0, np.inf])
    >>> paired_difference_interval(a, b, rng=np.random.default_rng(0)).estimate
    2.0
    """
    with np.errstate(invalid="ignore"):
        differences = np.where(np.isinf(a) & (a == b), 0.0, a - b)
        if np.isnan(np.median(differences)):
            return Interval(0.0, -np.inf, np.inf)
    return bootstrap_interval(differences, rng=rng)
