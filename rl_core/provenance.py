"""What made a result: the digest that names it, and the machine that made it.

The store (`rl_core.store`) keeps results under a digest of everything that decides their bits: the
algorithm and its configuration, the environment, episodes, seed, the source of the modules involved
and the versions of the libraries underneath. What does not decide the bits is left out: names of
arms, number of workers, plotting code, comments.
"""

import dataclasses
import hashlib
import importlib
import importlib.metadata
import json
import math
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.envs.registration import registry

LIBRARIES = ("gymnasium", "numba", "numpy", "pandas", "torch")


def canonical_json(value: object) -> str:
    """Return the one way `value` is written as JSON: sorted keys, no spaces, no NaN.

    >>> canonical_json({"b": 1.0, "a": [True, None]})
    '{"a":[true,null],"b":1.0}'
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def digest(value: object) -> str:
    """Return the SHA-256 of the canonical JSON of `value`, in hexadecimal.

    >>> digest({"seed": 1})[:8] != digest({"seed": 2})[:8]
    True
    """
    return hashlib.sha256(canonical_json(value).encode()).hexdigest()


def describe(value: object, name: str = "config") -> Any:
    """Return `value`, a configuration, in terms of JSON, with the classes of its dataclasses.

    Parameters
    ----------
    value : object
        Dataclasses, lists, tuples, dicts with string keys, str, int, float, bool and None, nested
        at will; numpy's scalars count as Python's. Infinities and NaN are written as text.
    name : str
        What an error calls `value`.

    Raises
    ------
    TypeError
        Any other type: the digest could not tell two of its values apart.

    Examples
    --------
    >>> @dataclasses.dataclass(frozen=True)
    ... class Greedy:
    ...     epsilon: float = 0.1
    >>> describe(Greedy())
    {'class': 'Greedy', 'epsilon': 0.1}
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {
            field.name: describe(getattr(value, field.name), f"{name}.{field.name}")
            for field in dataclasses.fields(value)
        }
        return {"class": type(value).__qualname__, **fields}
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: describe(item, f"{name}[{key!r}]") for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [describe(item, f"{name}[{i}]") for i, item in enumerate(value)]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else {"float": repr(float(value))}
    if value is None or isinstance(value, bool | int | str):
        return value
    raise TypeError(
        f"{name} is {value!r} of type {type(value).__name__}; allowed are dataclasses, lists, "
        "tuples, dicts with string keys, str, int, float, bool and None"
    )


def versions() -> dict[str, str]:
    """Return the versions of Python and of the libraries that decide a result's bits."""
    found = {name: importlib.metadata.version(name) for name in LIBRARIES}
    return {"python": platform.python_version(), **found}


def processor() -> str:
    """Return the name of this machine's processor."""
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def environment_modules(env: str) -> list[str]:
    """Return the modules that define a registered environment; none if Gymnasium itself does.

    Gymnasium's own are named by its version. In Gymnasium, the id "module:Name-v0" means: import
    the module, which registers the environment.

    Raises
    ------
    ValueError
        If that module cannot be imported.

    Examples
    --------
    >>> environment_modules("CartPole-v1"), environment_modules("rl_core/Maze-v0")
    ([], ['rl_core.maze'])
    """
    module, _, name = env.rpartition(":")
    if module:
        try:
            importlib.import_module(module)
        except ImportError as error:
            allowed = "an id whose module can be imported"
            raise ValueError(f"env must be {allowed}, got {env!r}") from error
    entry = registry[name].entry_point if name in registry else None
    maker = entry.partition(":")[0] if isinstance(entry, str) else getattr(entry, "__module__", "")
    return [found for found in (module, maker) if found and found.split(".")[0] != "gymnasium"]
