"""One place decides how hot loops are compiled, so that every kernel is compiled the same way."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def compiled(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Compile `function` with numba, keeping its type signature for readers and type checkers.

    The machine code is cached beside the module. Floating point is strict (no `fastmath`), because
    a run has to give the same bits every time; the interpreter lock is released.
    """
    return cast(
        Callable[_Arguments, _Result],
        numba.njit(cache=True, nogil=True, error_model="numpy")(function),
    )
