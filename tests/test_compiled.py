"""Machine code is cached, and never older than the source it was made from."""

import os
import subprocess
import sys
from pathlib import Path

import rl_core

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


def test_an_edit_to_a_kernel_that_is_called_recompiles_the_caller(tmp_path):
    (tmp_path / "caller.py").write_text(CALLER)
    (tmp_path / "callee.py").write_text(CALLEE)
    path = os.pathsep.join([str(tmp_path), str(Path(rl_core.__file__).parents[1])])

    def call():
        program = "import caller; print(caller.f(1), len(caller.f.stats.cache_hits))"
        environment = {**os.environ, "PYTHONPATH": path}
        command = [sys.executable, "-c", program]
        return subprocess.check_output(command, env=environment, text=True).split()

    assert call() == ["20", "0"]
    assert call() == ["20", "1"]  # from the cache
    (tmp_path / "callee.py").write_text(CALLEE.replace("x + 1", "x + 2"))
    assert call() == ["30", "0"]
