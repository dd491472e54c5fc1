"""What was changed in the claims and their criteria after the first of them were fixed."""

from typing import NamedTuple


class Amendment(NamedTuple):
    """One change: when, of what, what it was, whether its data were known, what it moved."""

    when: str
    claim: str
    what: str
    data_known: bool
    moved: str
    judged_on: str


AMENDMENTS = [
    Amendment(
        "first edition",
        "4a to 4f",
        '"above" excludes its bound, and a claim of which no criterion is met and one is missed '
        "does not hold; it was open",
        True,
        "no verdict of chapter 5",
        "seeds 0 to 29",
    ),
    Amendment(
        "first edition",
        "4a to 4f",
        "seeds that the budget ended while they still got out are judged by what they finished; "
        "they had counted as not having learned",
        True,
        "shares that learn; no verdict",
        "seeds 0 to 29",
    ),
    Amendment(
        "second edition",
        "4c",
        "second reading, noise in shares of the level",
        True,
        "see chapter 5",
        "seeds 100 to 129",
    ),
    Amendment(
        "second edition",
        "4e, 4f",
        "second reading, by return instead of steps",
        True,
        "see chapter 5",
        "seeds 100 to 129",
    ),
]
"""In the order in which they were made."""
