"""Numbers for the prose: `{glue:text}` shows them there by their names."""

from collections.abc import Mapping
from typing import Any

from myst_nb import glue


def paste(numbers: Mapping[str, Any]) -> None:
    """Give numbers, or texts, to the prose under their names; nothing is shown here.

    Examples
    --------
    >>> paste({"seeds": 30})
    """
    for name, value in numbers.items():
        glue(name, value, display=False)
