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


def premise(sentence: str, holds: bool, *, preview: bool | None = None) -> None:
    """Stop the book if the data no longer bear out a sentence of it.

    Parameters
    ----------
    sentence : str
        The sentence, or the words that lean on the data.
    holds : bool
        Whether they do.
    preview : bool, optional
        Whether this is a first look with too few seeds to hold sentences to; by default as set.

    Raises
    ------
    TypeError
        If `sentence` is none: in the place of `holds` it would always count as true.
    AssertionError
        If they do not.

    Examples
    --------
    >>> premise("One and one is two.", 1 + 1 == 2)
    >>> premise("One and one is three.", 1 + 1 == 3, preview=False)
    Traceback (most recent call last):
    AssertionError: the data do not bear out: One and one is three.
    """
    if not isinstance(sentence, str):
        raise TypeError(f"sentence must be a str, got {sentence!r}")
    if not holds and not (PREVIEW if preview is None else preview):
        raise AssertionError(f"the data do not bear out: {sentence}")


SEEDS = chosen(os.environ.get("SEEDS") or str(FULL))
PREVIEW = len(SEEDS) < FULL
