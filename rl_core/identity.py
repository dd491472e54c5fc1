"""What tells one value from another: its one description in JSON, and the digest of that.

Results are kept under a digest of everything that decides their bits. A configuration, or what an
environment is registered with, comes into it through `describe`; what a configuration names by
import path, through `code_behind`.
"""

import dataclasses
import hashlib
import importlib
import json
import math
import pkgutil
import sys
from collections.abc import Mapping
from functools import reduce
from typing import Any

import numpy as np

from rl_core import sources


def canonical_json(value: object) -> str:
    """Return the one way `value` is written as JSON: sorted keys, no spaces, no NaN.

    Examples
    --------
    >>> from rl_core.identity import canonical_json
    >>> canonical_json({"b": 1.0, "a": [True, None]})
    '{"a":[true,null],"b":1.0}'
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def digest(value: object) -> str:
    """Return the SHA-256 of the canonical JSON of `value`, in hexadecimal.

    Examples
    --------
    >>> from rl_core.identity import digest
    >>> digest({"seed": 1})[:8] != digest({"seed": 2})[:8]
    True
    """
    return hashlib.sha256(canonical_json(value).encode()).hexdigest()


def import_path(name: str, thing: object, allowed: str = "a class or function") -> str:
    """Return where `thing` is found by import, as "module:attribute".

    Raises
    ------
    TypeError
        It is not found there: it was made in `__main__`, within a function, or by a lambda.

    Examples
    --------
    >>> from rl_core.identity import canonical_json
    >>> from rl_core.identity import import_path
    >>> import_path("rule", canonical_json)
    'rl_core.identity:canonical_json'
    """
    module = getattr(thing, "__module__", None)
    path = getattr(thing, "__qualname__", "")
    try:
        found: object = reduce(getattr, path.split("."), sys.modules[str(module)])
    except (KeyError, AttributeError):
        found = None
    if found is not thing or module == "__main__" or not callable(thing):
        raise TypeError(
            f"{name} must be {allowed} at the top of a module that can be imported (put it "
            f"into a file of its own), got {thing!r}"
        )
    return f"{module}:{path}"


def describe(value: object, name: str = "config", modules: set[str] | None = None) -> Any:
    """Return `value`, a configuration, in terms of JSON, with the classes of its dataclasses.

    Parameters
    ----------
    value : object
        Dataclasses, lists, tuples, dicts with string keys, classes and functions that can be
        imported, str, int, float, bool and None, nested at will; numpy's scalars count as Python's.
        Infinities and NaN are written as text.
    name : str
        What an error calls `value`.
    modules : set of str, optional
        Takes the modules of all classes and functions met.

    Raises
    ------
    TypeError
        Any other type: the digest could not tell two of its values apart.

    Examples
    --------
    >>> from rl_core.identity import describe
    >>> from rl_core.training import Failure
    >>> describe(Failure(seed=3, episode=1, reason="NaN"))["class"]
    'rl_core.training:Failure'
    """
    if isinstance(value, np.generic):
        value = value.item()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {
            field.name: describe(getattr(value, field.name), f"{name}.{field.name}", modules)
            for field in dataclasses.fields(value)
        }
        return {"class": _place(name, type(value), modules), **fields}  # no field's name
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: describe(item, f"{name}[{key!r}]", modules) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [describe(item, f"{name}[{i}]", modules) for i, item in enumerate(value)]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else {"float": repr(float(value))}
    if value is None or isinstance(value, bool | int | str):
        return value
    if callable(value) and hasattr(value, "__qualname__"):
        return {"import": _place(name, value, modules)}
    raise TypeError(
        f"{name} must be made of dataclasses, lists, tuples, dicts with string keys, classes, "
        f"functions, str, int, float, bool and None, got {value!r} of type {type(value).__name__}"
    )


def _place(name: str, thing: object, modules: set[str] | None) -> str:
    path = import_path(name, thing)
    if modules is not None:
        modules.add(path.partition(":")[0])
    return path


def restored(described: Any) -> Any:
    """Return the value that `describe` described; lists come back as tuples.

    Raises
    ------
    TypeError, ValueError
        A class or function is not found there, or does not take the values.

    Examples
    --------
    >>> from rl_core.identity import describe, restored
    >>> from rl_core.training import Failure
    >>> restored(describe(Failure(seed=3, episode=1, reason="NaN")))
    Failure(seed=3, episode=1, reason='NaN')
    """
    if isinstance(described, list):
        return tuple(restored(item) for item in described)
    if not isinstance(described, dict):
        return described
    if "class" in described:
        kind = imported("config", described["class"])
        if not (isinstance(kind, type) and dataclasses.is_dataclass(kind)):
            raise TypeError(f"config must be described by dataclasses, got {kind!r}")
        given = [field.name for field in dataclasses.fields(kind) if field.init]
        return kind(**{name: restored(described[name]) for name in given})
    if "import" in described:
        return imported("config", described["import"])
    if "float" in described:
        return float(described["float"])
    return {name: restored(item) for name, item in described.items()}


def imported(name: str, path: object) -> Any:
    """Return what stands at the import path "module:attribute".

    Raises
    ------
    TypeError, ValueError
        With `name` for what is looked for: the path is no text, or nothing is there.

    Examples
    --------
    >>> from rl_core.identity import imported
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
        return pkgutil.resolve_name(path)
    except Exception as error:  # importing runs a module's code, which may raise anything
        raise ValueError(f"{allowed} ({error})") from error


def code_behind(path: str) -> str:
    """Return the SHA-256 of the module at an import path and of what it imports.

    What is installed is named by its version instead.

    Examples
    --------
    >>> from rl_core.identity import code_behind
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
