"""How many of the book's verdicts could be owed to chance, from the table of claims."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from report.claims import number


class Chance(NamedTuple):
    """What that many criteria come to by chance.

    Attributes
    ----------
    criteria : int
        Of all claims, in their first readings.
    claims : int
        As many as there are criteria that decide.
    random : int
        Deciding criteria whose evidence has an interval.
    by_chance : float
        How many of these 95% intervals can be expected to miss: a twentieth.
    near : pandas.DataFrame
        `claim, criterion, measured, bound`: those whose interval ends within a tenth of its width
        of the bound.
    """

    criteria: int
    claims: int
    random: int
    by_chance: float
    near: pd.DataFrame


def chance(claims: pd.DataFrame) -> Chance:
    """Count criteria and intervals, and name the deciding ones that are near their bound.

    Parameters
    ----------
    claims : pandas.DataFrame
        As `report.claims.record` writes it; the criteria of a claim have "; " between them.

    Examples
    --------
    >>> row = {"id": "9a", "criterion": "few; fast", "deciding_criterion": "fast"}
    >>> numbers = {"estimate": 0.7, "low": 0.51, "high": 0.9, "bound": 0.5}
    >>> row |= {f"deciding_{name}": value for name, value in numbers.items()}
    >>> found = chance(pd.DataFrame([row]))
    >>> found.criteria, found.random, found.near["measured"].tolist()
    (2, 1, ['0.7 [0.51, 0.9]'])
    """
    low, high, bound = (claims[f"deciding_{name}"] for name in ("low", "high", "bound"))
    width = (high - low).to_numpy(float)
    random = width > 0
    ends = np.minimum((low - bound).abs(), (high - bound).abs()).to_numpy(float)
    near = claims[random & np.isfinite(width) & (ends <= width / 10)]
    table = pd.DataFrame(
        {
            "claim": near["id"],
            "criterion": near["deciding_criterion"],
            "measured": [
                f"{number(row.deciding_estimate)} "
                f"[{number(row.deciding_low)}, {number(row.deciding_high)}]"
                for row in near.itertuples()
            ],
            "bound": [number(value) for value in near["deciding_bound"]],
        },
        columns=["claim", "criterion", "measured", "bound"],
    )
    criteria = int(claims["criterion"].str.split("; ").str.len().sum())
    return Chance(criteria, len(claims), int(random.sum()), random.sum() / 20, table)
