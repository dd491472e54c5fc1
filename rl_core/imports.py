"""What a configuration names by import path: found, and with a digest of the code behind it."""

import hashlib
import importlib
from typing import Any

from rl_core import sources


def imported(name: str, path: object) -> Any:
    """Return what stands at the import path "module:attribute".

    Raises
    ------
    TypeError, ValueError
        With `name` for what is looked for: the path is no text, or nothing is there.

    Examples
    --------
    >>> imported("shaping", "math:floor")(2.5)
    2
    >>> imported("shaping", "math:flour")
    Traceback (most recent call last):
    ValueError: shaping must be an import path 'module:name', got 'math:flour' (module 'math' ...
    """
    allowed = f"{name} must be an import path 'module:name', got {path!r}"
    if not isinstance(path, str):
        raise TypeError(allowed)
    module, _, attribute = path.partition(":")
    if not (module and attribute):
        raise ValueError(allowed)
    if module == "__main__":
        raise ValueError(f"{allowed}; put it into a module of its own, where workers find it")
    try:
        found = importlib.import_module(module)
        for part in attribute.split("."):
            found = getattr(found, part)
    except Exception as error:  # importing runs a module's code, which may raise anything
        raise ValueError(f"{allowed} ({error})") from error
    return found


def code_behind(path: str) -> str:
    """Return the SHA-256 of the module at an import path and of what it imports.

    What is installed is named by its version instead.

    Examples
    --------
    >>> len(code_behind("rl_core.maze:Maze"))
    64
    """
    module = path.partition(":")[0]
    if module.split(".")[0] == "rl_core" or sources.is_project(module):
        found = repr(sorted(sources.code([module]).items()))
    else:
        top = importlib.import_module(module.partition(".")[0])
        found = f"{module} {getattr(top, '__version__', '')}"
    return hashlib.sha256(found.encode()).hexdigest()
