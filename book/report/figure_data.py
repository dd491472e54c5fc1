"""The numbers behind the figures, for download beside each."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from report.names import file_name
from report.seeds import SEEDS
from rl_core.checks import require

FOLDER = Path("../results/figures")


def offer(name: str, table: pd.DataFrame, *, folder: Path = FOLDER) -> None:
    """Write what a figure shows as `name`.csv, to six digits: more than can be drawn."""
    name = file_name("name", name)
    folder.mkdir(parents=True, exist_ok=True)
    table.to_csv(folder / f"{name}.csv", index=False, float_format="%.6g")


def tidy(
    x: np.ndarray, arms: Mapping[str, np.ndarray], *, value: str, seeds: range = SEEDS
) -> pd.DataFrame:
    """Curves as rows `arm, seed, episode, value`.

    Parameters
    ----------
    x : ndarray of shape (points,)
        The episodes.
    arms : mapping of str to ndarray of shape (seeds, points)
        A curve a seed, for each arm.
    value : str
        The name of the column that holds them.
    seeds : range
        The seeds, in the order of the curves.

    Raises
    ------
    ValueError
        If an arm's curves are not of the shape (seeds, points).

    Examples
    --------
    >>> tidy(np.array([10, 20]), {"a": np.array([[1.0, 2.0]])}, value="steps", seeds=range(1))
      arm  seed  episode  steps
    0   a     0       10    1.0
    1   a     0       20    2.0
    """
    for arm, curves in arms.items():
        fits = np.shape(curves) == (len(seeds), len(x))
        require(fits, f"arms[{arm!r}]", np.shape(curves), f"of the shape {len(seeds), len(x)}")
    index = pd.MultiIndex.from_product([arms, seeds, x], names=["arm", "seed", "episode"])
    return pd.DataFrame({value: np.stack(list(arms.values())).ravel()}, index).reset_index()
