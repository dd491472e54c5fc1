"""How many of the book's answers could be owed to chance, from the table of criteria."""

from typing import NamedTuple

import pandas as pd

from report.claims import Evidence


class Chance(NamedTuple):
    """What that many criteria come to by chance.

    Attributes
    ----------
    criteria : int
        All of them, in all readings; one that two readings share counts once.
    random : int
        Those whose evidence has an interval.
    by_chance : float
        How many of these 95% intervals can be expected to miss: a twentieth.
    failed : int
        Those whose interval misses their bounds altogether.
    near : pandas.DataFrame
        `criterion, measured, bound, met`: those whose interval ends within a tenth of its width of
        a bound.
    """

    criteria: int
    random: int
    by_chance: float
    failed: int
    near: pd.DataFrame


def chance(criteria: pd.DataFrame) -> Chance:
    """Count criteria and intervals, and name those that are near their bound.

    Parameters
    ----------
    criteria : pandas.DataFrame
        As `report.claims.criteria` makes it.

    Examples
    --------
    >>> from report.claims import Claim, Criterion, criteria
    >>> claim = Claim("9a", "9", "Fast.", (Criterion("fast", above=0.5),), "Figure 9")
    >>> found = chance(criteria([claim.judge(Evidence(0.7, 0.51, 0.9, seeds=30))]))
    >>> found.criteria, found.random, found.near["measured"].tolist()
    (1, 1, ['0.7 [0.51, 0.9]'])
    """
    random = criteria["low"] < criteria["high"]
    near = criteria[criteria["near"].astype(bool)]
    measured = [
        str(Evidence(row.estimate, row.low, row.high, int(row.seeds))) for row in near.itertuples()
    ]
    table = pd.DataFrame(
        {
            "criterion": near["label"] + ": " + near["criterion"],
            "measured": measured,
            "bound": near["bound"],
            "met": near["answer"],
        }
    )
    return Chance(
        len(criteria),
        int(random.sum()),
        int(random.sum()) / 20,
        int((random & (criteria["answer"] == "no")).sum()),
        table,
    )
