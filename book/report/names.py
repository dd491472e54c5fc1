"""Names of files, given by a caller: names, and never paths."""

import re

from rl_core.checks import instance, require


def file_name(argument: str, value: object) -> str:
    """Return the value if it names a file in a folder and cannot lead out of it.

    Raises
    ------
    TypeError, ValueError
        If it is anything but letters, digits, "_" and "-".

    Examples
    --------
    >>> file_name("chapter", "3")
    '3'
    >>> file_name("chapter", "../evil")
    Traceback (most recent call last):
    ValueError: chapter must be a name of letters, digits, '_' and '-', got '../evil'
    """
    allowed = "a name of letters, digits, '_' and '-'"
    name: str = instance(argument, value, str, allowed)
    require(re.fullmatch(r"[\w-]+", name), argument, name, allowed)
    return name
