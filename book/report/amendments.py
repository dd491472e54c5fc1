"""Every change of a criterion or of what it is judged on, one row each."""

from typing import NamedTuple


class Amendment(NamedTuple):
    """What was changed: when, in which chapter and claim, and what came of it.

    Attributes
    ----------
    when : str
        The day.
    claim : str
        Chapter and claim.
    changed : str
        What was changed.
    data_known : bool
        Whether data that bear on it had been seen.
    moved : str
        What it moved.
    judged_on : str
        The seeds that judge it since.
    """

    when: str
    claim: str
    changed: str
    data_known: bool
    moved: str
    judged_on: str


AMENDMENTS = (
    Amendment(
        "2026-11-28",
        "1c",
        "second reading, an iteration is a sweep of the evaluation",
        True,
        "the verdict, to 'depends on the reading'",
        "the Maze (exact) and the random mazes",
    ),
    Amendment(
        "2026-11-28",
        "2b",
        "second reading, means against an arm that is chosen on other seeds",
        True,
        "the evidence of the second reading only",
        "chosen on 1,000 to 1,029, judged on 100 to 159",
    ),
    Amendment(
        "2026-11-28",
        "2g",
        "first criterion on fresh seeds, and a second reading by means",
        True,
        "the first criterion, which was open on seeds 0 to 29",
        "100 to 279; the error of the second reading 100 to 159",
    ),
    Amendment(
        "2026-11-28",
        "2h",
        "the first criterion's lower bound, 0, struck out: nothing could fail it",
        True,
        "nothing",
        "0 to 29",
    ),
)
