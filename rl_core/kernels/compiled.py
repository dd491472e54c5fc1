"""One place decides how hot loops are compiled and where their machine code is kept."""

import contextlib
import hashlib
import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba
from numba.core import caching
from numba.extending import overload

from rl_core import sources

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")

# Without these, numba is not typed.
_settings: Any = numba.config
_FunctionCache: Any = caching.FunctionCache
_CacheFiles: Any = caching.IndexDataCacheFile

SWITCHES = (
    "BOUNDSCHECK", "CPU_FEATURES", "CPU_NAME", "DISABLE_INTEL_SVML", "DISABLE_JIT", "ENABLE_AVX",
    "LOOP_VECTORIZE", "OPT", "SLP_VECTORIZE",
)  # fmt: skip
"""The settings of numba (`NUMBA_...`) that may change what a kernel returns."""


def compiled(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Compile `function` with numba, keeping its type signature for readers and type checkers.

    Floating point is strict (no `fastmath`), because a run has to give the same bits every time;
    the interpreter lock is released.

    The machine code is cached where numba would keep it: in the folder that `NUMBA_CACHE_DIR`
    names, else beside the module, else in the user's cache. Where none of them can be written, and
    for functions of `__main__` (a notebook's cells), every process compiles anew.

    Parameters
    ----------
    function : callable
        In the part of Python that numba compiles.

    Examples
    --------
    >>> from rl_core.kernels.compiled import compiled
    >>> @compiled
    ... def add(a: int, b: int) -> int:
    ...     return a + b
    >>> add(1, 2)
    3
    """
    return _compiled(function, inline="never")


def uncounted(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Compile like `compiled`, without counting references to arrays.

    For loops that only borrow what they are given: they make no array, return none, and from Python
    are given no generator. Numba counts at every slice, which takes longer than a small network.

    Examples
    --------
    >>> from rl_core.kernels.compiled import uncounted
    >>> @uncounted
    ... def add(a: int, b: int) -> int:
    ...     return a + b
    >>> add(1, 2)
    3
    """
    return _compiled(function, inline="never", _nrt=False)


def inlined(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Compile like `compiled`, but put the text of `function` into what calls it.

    For what is called at every step with tuples of arrays: at a call numba counts references to
    each of them, which takes longer than a small network.

    Examples
    --------
    >>> from rl_core.kernels.compiled import inlined
    >>> @inlined
    ... def add(a: int, b: int) -> int:
    ...     return a + b
    >>> add(1, 2)
    3
    """
    return _compiled(function, inline="always")


def _compiled(
    function: Callable[_Arguments, _Result], *, inline: str, _nrt: bool = True
) -> Callable[_Arguments, _Result]:
    options: Any = {"nogil": True, "error_model": "numpy", "inline": inline, "_nrt": _nrt}
    kernel: Any = numba.njit(**options)(function)
    code = sources.loaded_code(function.__module__)
    if code and not _settings.DISABLE_JIT:
        # RuntimeError: no folder can be written. ValueError: its name cannot be encoded.
        with contextlib.suppress(RuntimeError, ValueError, OSError):
            kernel._cache = _KernelCache(function, code)
    return cast(Callable[_Arguments, _Result], kernel)


def compiled_as(function: Callable[..., Any], kernel: Callable[..., Any]) -> None:
    """Let compiled code that calls `function` call `kernel`, with the same arguments.

    Examples
    --------
    >>> from rl_core.kernels.compiled import compiled, compiled_as
    >>> def name(x):
    ...     return f"plain {x}"
    >>> compiled_as(name, compiled(lambda x: x + 1))
    >>> compiled(lambda x: name(x))(1), name(1)
    (2, 'plain 1')
    """
    overload(function, strict=False)(lambda *arguments: lambda *arguments: kernel(*arguments))


def switches() -> dict[str, str]:
    """Return the settings of numba that may change what a kernel returns.

    Examples
    --------
    >>> from rl_core.kernels.compiled import SWITCHES
    >>> from rl_core.kernels.compiled import switches
    >>> sorted(switches()) == sorted(SWITCHES)
    True
    """
    return {name: str(getattr(_settings, name, None)) for name in SWITCHES}


class _KernelCache(_FunctionCache):  # type: ignore[misc]
    """numba's cache of a function, with a stamp of all that its machine code was made from.

    A kernel contains the kernels it calls. numba itself looks at the kernel's own file only, and
    would go on using machine code after an edit to a module it imports.
    """

    def __init__(self, function: Callable[..., object], code: object) -> None:
        super().__init__(function)
        stamp = hashlib.sha256(repr((code, switches())).encode()).hexdigest()
        self._cache_file = _CheckedFiles(self._cache_path, self._impl.filename_base, stamp)

    def save_overload(self, sig: object, data: object) -> None:
        """Keep the machine code, unless the disk is full or no longer to be written."""
        with contextlib.suppress(OSError):
            super().save_overload(sig, data)


class _CheckedFiles(_CacheFiles):  # type: ignore[misc]
    """numba's files, each followed by a checksum of its content and the stamp.

    What is damaged, or left by a process that was killed between two files, counts as absent.
    """

    @contextlib.contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[io.BytesIO]:
        content = io.BytesIO()
        with super()._open_for_write(filepath) as file:
            yield content
            file.write(content.getvalue() + self._checksum(content.getvalue()))

    def _load_index(self) -> dict[object, str]:
        found: dict[object, str] = super()._load_index() if self._intact(self._index_path) else {}
        return found

    def _load_data(self, name: str) -> object:
        return super()._load_data(name) if self._intact(self._data_path(name)) else None

    def _intact(self, path: str) -> bool:
        try:
            data = Path(path).read_bytes()
        except OSError:
            return False
        return self._checksum(data[:-32]) == data[-32:]

    def _checksum(self, content: bytes) -> bytes:
        return hashlib.sha256(self._source_stamp.encode() + content).digest()
