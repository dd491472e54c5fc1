"""The source code behind a module: its own and that of the modules it imports.

Two questions are answered here. Which code does a module stand for, so that a result can be kept
under it? And does this process really run that code, although files may change under it?
"""

import ast
import hashlib
import importlib
import importlib.util
import time
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.machinery import ModuleSpec
from pathlib import Path

# This process may hold older code than a source file that was changed after this moment.
_LOADED_AT = time.time()


def code(modules: Iterable[str]) -> dict[str, str]:
    """Return `modules` and what they import, each with the SHA-256 of its code.

    Imports are followed, transitively, into the modules' own packages and into `rl_core`; a module
    that belongs to no package may also import its neighbours in the same folder. They are read off
    the source, so one that is computed at run time is not seen. Code is the parsed program:
    comments and formatting do not count. What is no Python source file is left out.

    Examples
    --------
    >>> sorted(code(["rl_core.run"]))
    ['rl_core', 'rl_core.run']
    """
    waiting = list(modules)
    own = {name for module in waiting for name in _own_names(module)} | {"rl_core"}
    found: dict[str, str] = {}
    while waiting:
        name = waiting.pop()
        spec = _spec(name) if name not in found else None
        if spec is None:
            continue
        found[name], imported = _analysed(_source(spec), spec.parent or "")
        imported |= {name.rpartition(".")[0]}
        waiting.extend(module for module in imported if _top(module) in own)
    return found


def check_loaded(expected: Mapping[str, str]) -> None:
    """Check that this process runs the code that `expected` (from `code`) tells of.

    Raises
    ------
    RuntimeError
        A module on disk is not the expected one, or was changed after this process loaded it.
    """
    for name, fingerprint in expected.items():
        importlib.import_module(name)
        spec = _spec(name)
        if spec is None or _analysed(_source(spec), spec.parent or "")[0] != fingerprint:
            raise RuntimeError(f"the source of {name} was changed while the experiment ran")
        status = _path(spec).stat()
        if max(status.st_mtime, status.st_ctime) > _LOADED_AT:
            raise RuntimeError(
                f"the source of {name} was changed after this process started: restart the "
                "process (the notebook's kernel, Dask's workers) so that it runs what is on disk"
            )


def _own_names(module: str) -> set[str]:
    """Return the top-level names whose source counts as part of `module`'s project."""
    spec = _spec(_top(module))
    if spec is None or spec.submodule_search_locations is not None:
        return {_top(module)}
    return {path.stem for path in _path(spec).parent.glob("*.py")}


def _top(module: str) -> str:
    return module.partition(".")[0]


def _spec(module: str) -> ModuleSpec | None:
    """Return where `module` comes from, or None if it is not a Python source file."""
    try:
        spec = importlib.util.find_spec(module)
    except (ModuleNotFoundError, ValueError):  # no such module, or one without a spec
        return None
    return spec if spec is not None and str(spec.origin).endswith(".py") else None


def _path(spec: ModuleSpec) -> Path:
    return Path(str(spec.origin))


def _source(spec: ModuleSpec) -> str:
    return importlib.util.decode_source(_path(spec).read_bytes())


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
