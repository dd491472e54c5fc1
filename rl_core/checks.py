"""One way to check arguments: at the boundary, before work starts, in one wording.

Every check takes the argument's name and value, and returns the value as compiled code and the
store take it: Python's own int, float or bool, or an array of one type. What is not allowed raises

    <name> must be <what is allowed>, got <value>

as a TypeError if the value is of another kind altogether, else as a ValueError.
"""

import math
import os
from collections.abc import Callable, Collection, Iterable
from numbers import Integral, Real
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

LARGEST_INTEGER = 2**63 - 1
"""The largest integer that tables, compiled code and the store can hold."""


def require(condition: object, name: str, value: object, allowed: str) -> None:
    """Raise a ValueError unless the condition is true.

    Examples
    --------
    >>> from rl_core.checks import require
    >>> require(False, "gamma", 2, "a number from 0 to 1")
    Traceback (most recent call last):
    ValueError: gamma must be a number from 0 to 1, got 2
    """
    if not condition:
        _refuse(ValueError, name, value, allowed)


def instance(name: str, value: object, kinds: Any, allowed: str) -> Any:
    """Return the value if it is an instance of one of the kinds, else raise a TypeError.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.checks import instance
    >>> instance("rng", 7, np.random.Generator, "a numpy.random.Generator")
    Traceback (most recent call last):
    TypeError: rng must be a numpy.random.Generator, got 7
    """
    if not isinstance(value, kinds):
        _refuse(TypeError, name, value, allowed)
    return value


def integer(name: str, value: object, least: int = 0, most: int = LARGEST_INTEGER) -> int:
    """Return an integer from `least` to `most`, Python's or numpy's, but no bool.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.checks import integer
    >>> integer("episodes", np.uint8(200), least=1)
    200
    >>> integer("episodes", 0, least=1)
    Traceback (most recent call last):
    ValueError: episodes must be an integer from 1, got 0
    """
    allowed = f"an integer from {least}"
    if most != LARGEST_INTEGER:
        allowed += f" to {most}"
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral | np.integer):
        _refuse(TypeError, name, value, allowed)
    if int(value) > most and most == LARGEST_INTEGER:
        allowed += " below 2**63"
    require(least <= int(value) <= most, name, value, allowed)
    return int(value)


def number(
    name: str,
    value: object,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    above: float = -math.inf,
    below: float = math.inf,
) -> float:
    """Return a finite real number from `low` to `high`, more than `above` and less than `below`.

    Python's, numpy's and fractions count; a bool and NaN do not.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.checks import number
    >>> number("gamma", np.float32(0.5), 0, 1)
    0.5
    >>> number("learning_rate", 0, above=0)
    Traceback (most recent call last):
    ValueError: learning_rate must be a finite number above 0, got 0
    """
    allowed = _range(low, high, above, below)
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        _refuse(TypeError, name, value, allowed)
    try:
        converted = float(value)
    except OverflowError:
        converted = math.inf
    inside = math.isfinite(converted) and low <= converted <= high and above < converted < below
    require(inside, name, value, allowed)
    return converted


def _range(low: float, high: float, above: float, below: float) -> str:
    """Say in words which numbers are meant."""
    upto = "to" if math.isfinite(low) else "up to"
    bounds = {"from": low, "above": above, upto: high, "below": below}
    parts = [f"{word} {bound:g}" for word, bound in bounds.items() if math.isfinite(bound)]
    bounded = math.isfinite(max(low, above)) and math.isfinite(min(high, below))
    return " ".join(["a number" if bounded else "a finite number", *parts])


def positive(name: str, value: object) -> float:
    """Return a finite number above 0; see `number`."""
    return number(name, value, above=0)


def truth(name: str, value: object) -> bool:
    """Return a truth value, Python's or numpy's.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.checks import truth
    >>> truth("biases", np.True_)
    True
    """
    return bool(instance(name, value, bool | np.bool_, "a bool"))


def one_of(name: str, value: object, words: Collection[str]) -> str:
    """Return the value if it is one of some words.

    Examples
    --------
    >>> from rl_core.checks import one_of
    >>> one_of("engine", "jax", ("compiled", "torch"))
    Traceback (most recent call last):
    ValueError: engine must be one of 'compiled', 'torch', got 'jax'
    """
    allowed = f"one of {', '.join(map(repr, words))}"
    word: str = instance(name, value, str, allowed)
    require(word in words, name, value, allowed)
    return str(word)


def optional(name: str, value: object, check: Callable[..., Any], *bounds: Any) -> Any:
    """Return None, or what another check makes of the value.

    Examples
    --------
    >>> from rl_core.checks import integer, optional
    >>> optional("limit", None, integer, 1), optional("limit", 5, integer, 1)
    (None, 5)
    """
    if value is None:
        return None
    try:
        return check(name, value, *bounds)
    except (TypeError, ValueError) as error:
        kind = TypeError if isinstance(error, TypeError) else ValueError
        raise kind(str(error).replace(", got ", " or None, got ", 1)) from None


def integers(
    name: str, values: object, least: int = 0, most: int = LARGEST_INTEGER
) -> tuple[int, ...]:
    """Return integers from `least` to `most`, from anything that can be gone through.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.checks import integers
    >>> integers("seeds", np.arange(3))
    (0, 1, 2)
    """
    scalar = isinstance(values, str | bytes) or getattr(values, "ndim", 1) == 0
    if scalar or not isinstance(values, Iterable):
        _refuse(TypeError, name, values, f"a sequence of integers from {least}")
    return tuple(integer(name, value, least, most) for value in values)


def distinct_seeds(seeds: object) -> tuple[int, ...]:
    """Return the seeds if they are distinct integers from 0, at least one.

    Examples
    --------
    >>> from rl_core.checks import distinct_seeds
    >>> distinct_seeds(range(3))
    (0, 1, 2)
    """
    found = integers("seeds", seeds)
    require(found and len(set(found)) == len(found), "seeds", found, "one or more, each once")
    return found


def generator(name: str, value: object) -> np.random.Generator:
    """Return the value if it is a numpy.random.Generator."""
    found: np.random.Generator = instance(
        name, value, np.random.Generator, "a numpy.random.Generator"
    )
    return found


def floats(
    name: str, values: ArrayLike, shape: tuple[int | None, ...], *, finite: bool = True
) -> NDArray[np.float64]:
    """Return an array of numbers as float64 (a copy), if it has the shape; None is any length.

    Infinities are let through if `finite` is false; NaN never is.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.checks import floats
    >>> floats("V", [1, 2], (2,))
    array([1., 2.])
    >>> floats("V", [1.0, np.nan], (None,))
    Traceback (most recent call last):
    ValueError: V must be finite, at (1,) it is nan
    """
    axes = ", ".join("any" if n is None else str(n) for n in shape)
    wanted = f"an array of numbers of shape ({axes})"
    try:
        given = np.asarray(values)
    except (RuntimeError, TypeError, ValueError):  # ragged nesting, or what its own code raises
        _refuse(ValueError, name, values, wanted)
    numbers = given.dtype != object or all(isinstance(x, Real) for x in given.ravel())
    if given.size and (given.dtype.kind not in "iufO" or not numbers):
        _refuse(TypeError, name, given.dtype, wanted)
    fits = given.ndim == len(shape) and all(
        n in (None, length) for n, length in zip(shape, given.shape, strict=True)
    )
    require(fits, name, given.shape, wanted)
    try:
        array = given.astype(np.float64)
    except OverflowError:  # an integer that no float holds
        _refuse(ValueError, name, given, wanted)
    except (TypeError, ValueError):
        _refuse(TypeError, name, given, wanted)
    wrong = ~np.isfinite(array) if finite else np.isnan(array)
    for index in np.argwhere(wrong)[:1].tolist():
        at, allowed = tuple(index), "finite" if finite else "without NaN"
        raise ValueError(f"{name} must be {allowed}, at {at} it is {array[at]}")
    return array


def in_memory(name: str, value: object, room: int) -> None:
    """Raise a ValueError if what a value asks for, in bytes, is more than the machine has.

    Examples
    --------
    >>> from rl_core.checks import in_memory
    >>> in_memory("bins", 10**6, 2**80)
    Traceback (most recent call last):
    ValueError: bins must be less: it would take 1,125,899,906,842,624.0 GiB of memory, and...
    """
    try:
        has = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):  # it does not tell
        return
    if room > has:
        asked, there = (f"{size / 2**30:,.1f}" for size in (room, has))
        allowed = f"less: it would take {asked} GiB of memory, and this machine has {there}"
        _refuse(ValueError, name, value, allowed)


def fields(config: object, **rules: tuple[Any, ...]) -> None:
    """Check the fields of a frozen dataclass and keep what the checks return.

    Parameters
    ----------
    config : dataclass
        In its `__post_init__`.
    **rules : tuple
        For each field a check and its further arguments.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.checks import fields, number
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Settings:
    ...     gamma: float = 0.9
    ...     def __post_init__(self):
    ...         fields(self, gamma=(number, 0, 1))
    >>> Settings(np.float64(1)).gamma
    1.0
    """
    for name, (check, *bounds) in rules.items():
        object.__setattr__(config, name, check(name, getattr(config, name), *bounds))


def _refuse(kind: type[Exception], name: str, value: object, allowed: str) -> NoReturn:
    shown = repr(value)
    shown = shown if len(shown) <= 200 else f"{shown[:200]}..."
    raise kind(f"{name} must be {allowed}, got {shown}")
