"""What fixed sentences around measured numbers take for granted, checked against the data."""

from seeds import PREVIEW


def premise(holds: bool, sentence: str) -> None:
    """Stop the chapter if its data no longer bear out a sentence of its text.

    A preview has too few seeds to bear out anything; there nothing is checked.

    Raises
    ------
    AssertionError
        If it does not hold, with the sentence.

    Examples
    --------
    >>> premise(2 > 1, "Two are more than one.")
    """
    if not (holds or PREVIEW):
        raise AssertionError(f"the data do not bear out this sentence of the text: {sentence}")
