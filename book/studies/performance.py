"""What appendix B reads from its measurements (`bench`): growth, the serial share, what is waited.

Seconds depend on the machine and its neighbours. How they grow does so much less.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from rl_core.statistics import bootstrap_interval


def power(turns: pd.DataFrame) -> float:
    """The power with which the seconds grow: the slope on logarithmic axes, by least squares.

    Parameters
    ----------
    turns : pandas.DataFrame
        Columns `size` and `seconds`, a row a turn. The slope is that of the medians.

    Examples
    --------
    >>> power(pd.DataFrame({"size": [1, 1, 1, 2, 2, 2], "seconds": [1, 1, 9, 4, 4, 4]}))
    2.0
    """
    median = turns.groupby("size")["seconds"].median()
    sizes = median.index.to_numpy(float)
    return round(float(np.polyfit(np.log(sizes), np.log(median.to_numpy()), 1)[0]), 6)


def each(turns: pd.DataFrame) -> pd.Series:
    """Median seconds of one (a seed, a state), by size.

    Examples
    --------
    >>> each(pd.DataFrame({"size": [1, 10], "seconds": [3.0, 20.0]})).tolist()
    [3.0, 2.0]
    """
    median = turns.groupby("size")["seconds"].median()
    return median / median.index


@dataclass(frozen=True)
class Amdahl:
    """The share of the work that only one core can do, with its interval of 95%.

    G. Amdahl 1967: on n cores what takes T on one takes T (s + (1 - s) / n).
    """

    share: float
    low: float
    high: float

    def speed_up(self, cores: Any, share: float | None = None) -> Any:
        """How many times as fast so many cores are as one.

        Examples
        --------
        >>> float(Amdahl(0.5, 0.5, 0.5).speed_up(2))
        1.3333333333333333
        """
        serial = self.share if share is None else share
        return 1 / (serial + (1 - serial) / np.asarray(cores))


def serial_share(turns: pd.DataFrame) -> Amdahl:
    """The serial share s = 2 T(2) / T(1) - 1 by the turns' times on one core and on two.

    Below 0 it stands for none at all: the two turns of a pair met other neighbours.

    Examples
    --------
    >>> rows = {"size": [1, 2], "turn": [0, 0], "seconds": [10.0, 6.0]}
    >>> serial_share(pd.DataFrame(rows)).share
    0.2
    """
    by_turn = turns.pivot(index="turn", columns="size", values="seconds")
    shares = (2 * by_turn[2] / by_turn[1] - 1).clip(0, 1).to_numpy()
    found = bootstrap_interval(shares, rng=np.random.default_rng(2020))
    return Amdahl(*(round(float(value), 6) for value in found))


def whole(timing: pd.DataFrame) -> pd.DataFrame:
    """What the book takes, in minutes, and the share of its cores' time that was waited.

    Examples
    --------
    >>> row = {"what": "book", "how": "make book", "cores": 2, "seconds": 60.0}
    >>> whole(pd.DataFrame([row | {"processor_seconds": 90.0}]))["waiting"].tolist()
    [0.25]
    """
    busy = timing["processor_seconds"] / (timing["cores"] * timing["seconds"])
    shown = {
        "what": timing["what"],
        "how": timing["how"],
        "cores": timing["cores"],
        "minutes": timing["seconds"] / 60,
        "processor minutes": timing["processor_seconds"] / 60,
        "waiting": 1 - busy,
    }
    return pd.DataFrame(shown)
