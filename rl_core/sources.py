"""The source code behind a module: its own and that of the modules it imports.

Two questions are answered here. Which code does a module stand for, so that a result can be kept
under it? And does this process run that code, although files may change under it?

The second is answered by content, never by times: from the import of this module on, the source of
every other module is remembered as it is when Python loads that module. Modules that were loaded
before are remembered as they stand on disk at that moment.
"""

import ast
import hashlib
import importlib
import importlib.util
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any

_LOADED: dict[str, str] = {}  # module -> its source when it was loaded
_INSTALLED = {"site-packages", "dist-packages"}  # folders


def code(modules: Iterable[str], *, loaded: bool = False) -> dict[str, str]:
    """Return `modules` and what they import, each with the SHA-256 of its code.

    Imports are followed, transitively, into the modules' own packages, into `rl_core`, and into all
    that is not installed: neighbours in the folder, other projects. They are read off the source,
    so one that is computed at run time is not seen. Code is the parsed program: comments and
    formatting do not count. What is no Python source file is left out.

    Parameters
    ----------
    modules : iterable of str
    loaded : bool
        Take modules as this process loaded them, not as they stand on disk.

    Examples
    --------
    >>> from rl_core.sources import code
    >>> sorted(code(["rl_core.checks"]))
    ['rl_core', 'rl_core.checks']
    """
    waiting = list(modules)
    own = {_top(module) for module in waiting} | {"rl_core"}
    found: dict[str, str] = {}
    while waiting:
        name = waiting.pop()
        followed = name not in found and (_top(name) in own or is_project(name))
        spec = _spec(name) if followed else None
        if spec is None:
            continue
        source = _LOADED.get(name) if loaded else None
        found[name], imported = _analysed(source or _source(spec), spec.parent or "")
        waiting.extend(imported | {name.rpartition(".")[0]})
    return found


@cache  # emptied whenever a module is loaded
def loaded_code(module: str) -> tuple[tuple[str, str], ...]:
    """Return `code` of one module as this process loaded it, sorted."""
    return tuple(sorted(code([module], loaded=True).items()))


def check_loaded(expected: Mapping[str, str]) -> None:
    """Check that this process runs the code that `expected` (from `code`) tells of.

    Raises
    ------
    RuntimeError
        A module on disk is not the expected one, or this process loaded another.
    """
    for name, fingerprint in expected.items():
        importlib.import_module(name)
        spec = _spec(name)
        if spec is None or _analysed(_source(spec), spec.parent or "")[0] != fingerprint:
            raise RuntimeError(f"the source of {name} was changed while the experiment ran")
        source = _LOADED.get(name)
        if source is not None and _analysed(source, spec.parent or "")[0] != fingerprint:
            raise RuntimeError(
                f"the source of {name} was changed after this process loaded it: restart the "
                "process (the notebook's kernel, Dask's workers) so that it runs what is on disk"
            )


class _Witness:
    """An import hook that finds nothing itself and remembers what the others find."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> None:
        """Remember the source of the module that is about to be loaded."""
        for finder in sys.meta_path:
            if finder is not self:
                spec = finder.find_spec(name, path, target)
                if spec is not None:
                    _remember(name, spec)
                    break


def _remember(name: str, spec: ModuleSpec | None) -> None:
    if spec is None or not _is_source(spec) or not (_top(name) == "rl_core" or _outside(spec)):
        return
    try:
        _LOADED[name] = _source(spec)
    except (OSError, SyntaxError, UnicodeDecodeError):  # Python itself will tell
        _LOADED.pop(name, None)
    loaded_code.cache_clear()


def is_project(module: str) -> bool:
    """Whether a module's package is neither Python's own nor installed: someone works on it."""
    try:
        spec = importlib.util.find_spec(_top(module))
    except ValueError:  # it has no spec
        return False
    return spec is not None and _outside(spec)


def _outside(spec: ModuleSpec) -> bool:
    """Whether a module lies in no folder of installed packages."""
    folders = spec.submodule_search_locations or ["site-packages"]  # of a module without a file
    folder = str(spec.origin) if spec.has_location else folders[0]
    return _top(spec.name) not in sys.stdlib_module_names and not _INSTALLED & {*Path(folder).parts}


def _top(module: str) -> str:
    return module.partition(".")[0]


def _is_source(spec: ModuleSpec) -> bool:
    return str(spec.origin).endswith(".py")


def _spec(module: str) -> ModuleSpec | None:
    """Return where `module` comes from, or None if it is not a Python source file."""
    try:
        spec = importlib.util.find_spec(module)
    except (ModuleNotFoundError, ValueError):  # no such module, or one without a spec
        return None
    return spec if spec is not None and _is_source(spec) else None


def _source(spec: ModuleSpec) -> str:
    return importlib.util.decode_source(Path(str(spec.origin)).read_bytes())


@cache
def _analysed(source: str, package: str) -> tuple[str, frozenset[str]]:
    """Return the SHA-256 of a module's code, and the modules it imports.

    Some of the latter may be names inside modules: `from package import name` does not tell.
    """
    tree = ast.parse(source)
    imported: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imported.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            imported.add(base)
            imported.update(f"{base}.{alias.name}" for alias in node.names)
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest(), frozenset(imported)


def _watch() -> None:
    """Remember what is loaded already, and see to the rest from now on."""
    for name, module in list(sys.modules.items()):
        _remember(name, getattr(module, "__spec__", None))
    sys.meta_path.insert(0, _Witness())


_watch()
