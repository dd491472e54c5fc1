"""The seeds of the book: 0 to 29, or only the first few for a first look (`SEEDS=3`)."""

import os

FULL = 30
"""Seeds an arm in what is published."""


def chosen(text: str) -> range:
    """Return the seeds that a setting asks for: the first so many.

    Raises
    ------
    ValueError
        If `text` is not a whole number from 2 to 30: an interval needs two.

    Examples
    --------
    >>> chosen("3")
    range(0, 3)
    """
    if not text.isdecimal() or not 2 <= int(text) <= FULL:
        raise ValueError(f"SEEDS must be a whole number from 2 to {FULL}, got {text!r}")
    return range(int(text))


SEEDS = chosen(os.environ.get("SEEDS") or str(FULL))
PREVIEW = len(SEEDS) < FULL
