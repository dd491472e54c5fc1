"""One place decides how hot loops are compiled, so that every kernel is compiled the same way."""

from collections.abc import Callable
from functools import cache
from typing import Any, ParamSpec, TypeVar, cast

import numba
from numba.core.caching import InTreeCacheLocator

from rl_core.sources import code

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


@cache
def _code(module: str) -> list[tuple[str, str]]:
    return sorted(code([module]).items())


class ImportsCacheLocator(InTreeCacheLocator):
    """Where numba keeps the machine code of a kernel, and until when it holds.

    A kernel contains the kernels it calls. Numba itself looks at the kernel's own file only, and
    would go on using machine code after an edit to a module it imports.
    """

    def __init__(self, py_func: Callable[..., object], py_file: str) -> None:
        super().__init__(py_func, py_file)  # type: ignore[no-untyped-call]
        self._module = py_func.__module__

    def get_source_stamp(self) -> object:
        """Return a stamp that changes with the code of the module or of one it imports."""
        own_file = super().get_source_stamp()  # type: ignore[no-untyped-call]
        return own_file, _code(self._module)


def compiled(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Compile `function` with numba, keeping its type signature for readers and type checkers.

    The machine code is cached beside the module. Floating point is strict (no `fastmath`), because
    a run has to give the same bits every time; the interpreter lock is released.
    """
    config: Any = numba.config
    before = config.CACHE_LOCATOR_CLASSES
    config.CACHE_LOCATOR_CLASSES = f"{__name__}.ImportsCacheLocator,UserWideCacheLocator"
    try:
        kernel = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    finally:
        config.CACHE_LOCATOR_CLASSES = before
    return cast(Callable[_Arguments, _Result], kernel)
