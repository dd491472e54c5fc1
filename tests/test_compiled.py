"""Machine code is cached where it can be, and never other than the source it was made from."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import rl_core

PROJECT = Path(rl_core.__file__).parents[1]
CALLER = """
from callee import g
from rl_core.kernels.compiled import compiled

@compiled
def f(x):
    return g(x) * 10
"""
CALLEE = """
from rl_core.kernels.compiled import compiled

@compiled
def g(x):
    return x + 1
"""
PROGRAM = "import caller; print(caller.f(1), len(caller.f.stats.cache_hits))"


@pytest.fixture
def call(tmp_path):
    """Write two modules, one calling the other, and return what calls the caller anew."""
    folder = tmp_path / "modules"
    folder.mkdir()
    (folder / "caller.py").write_text(CALLER)
    (folder / "callee.py").write_text(CALLEE)
    cache = tmp_path / "cache"

    def call(program=PROGRAM, **environment):
        done = subprocess.run(
            [sys.executable, "-c", program],
            env={
                **os.environ,
                "PYTHONPATH": os.pathsep.join([str(folder), str(PROJECT)]),
                "NUMBA_CACHE_DIR": str(cache),
                **environment,
            },
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.split()

    call.folder, call.cache = folder, cache
    return call


def edit(path, old, new):
    """Change a file's content, but neither its size nor its time."""
    before = path.stat()
    path.write_text(path.read_text().replace(old, new))
    shutil.rmtree(path.parent / "__pycache__", ignore_errors=True)  # Python's own looks at times
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def test_an_edit_to_a_kernel_that_is_called_recompiles_the_caller(call):
    assert call() == ["20", "0"]
    assert call() == ["20", "1"]  # from the cache
    assert list(call.cache.glob("modules_*/caller.f*.nbc"))  # where the user wants it
    edit(call.folder / "callee.py", "x + 1", "x + 2")
    assert call() == ["30", "0"]
    edit(call.folder / "callee.py", "x + 2", "x + 1")
    call(NUMBA_OPT="0")  # other machine code under the same name
    assert call() == ["20", "0"]


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
def test_damaged_machine_code_is_compiled_again(call, suffix):
    call()
    for path in call.cache.glob(f"*/*{suffix}"):
        data = path.read_bytes()
        path.write_bytes(data[: len(data) // 2] if suffix == ".nbi" else b"garbage")
    assert call() == ["20", "0"]


def test_machine_code_of_a_killed_process_is_not_taken_for_the_new_source(call):
    """The index tells of the new source and the machine code is still the old."""
    call()
    old = {path: path.read_bytes() for path in call.cache.glob("*/*.nbc")}
    edit(call.folder / "callee.py", "x + 1", "x + 2")
    call()
    for path, data in old.items():
        path.write_bytes(data)
    assert call() == ["30", "0"]


def test_without_a_folder_to_write_to_nothing_is_cached(call, tmp_path):
    """Numba finds no place: each would lie below a file."""
    nowhere = str(tmp_path / "file")
    Path(nowhere).touch()
    (call.folder / "__pycache__").touch()
    arguments = {"NUMBA_CACHE_DIR": nowhere, "HOME": nowhere, "XDG_CACHE_HOME": nowhere}
    assert call(PYTHONDONTWRITEBYTECODE="1", **arguments) == ["20", "0"]


def test_a_module_edited_after_it_was_loaded_does_not_reach_the_cache(call):
    program = """
import callee, pathlib
path = pathlib.Path(callee.__file__)
path.write_text(path.read_text().replace("x + 1", "x + 5"))
import caller
print(caller.f(1))
"""
    assert call(program) == ["20"]
    shutil.rmtree(call.folder / "__pycache__", ignore_errors=True)  # Python's own looks at seconds
    assert call() == ["60", "0"]


def test_functions_of_the_main_program_are_not_cached(call):
    program = """
from callee import g
from rl_core.kernels.compiled import compiled
f = compiled(lambda x: g(x))
print(f(1), f._cache.cache_path)
"""
    assert call(program) == ["2", "None"]
