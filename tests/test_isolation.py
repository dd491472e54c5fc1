"""Commands run apart from the reader's settings."""

import subprocess
import sys

import isolation
import pytest

HOSTILE = {
    "MPLBACKEND": "Agg",
    "MATPLOTLIBRC": "/tmp/matplotlibrc",
    "IPYTHONDIR": "/home/reader/.ipython",
    "JUPYTER_PATH": "/opt/jupyter",
    "JUPYTER_CONFIG_DIR": "/home/reader/.jupyter",
    "JUPYTER_PREFER_ENV_PATH": "0",
    "PYTHONPATH": "/home/reader/lib",
    "PYTHONSTARTUP": "/home/reader/start.py",
    "LC_ALL": "C",
    "LANG": "de_DE",
    "TZ": "Pacific/Auckland",
    "SPHINXOPTS": "-q",
    "NUMBA_DISABLE_JIT": "1",
}


def test_what_a_reader_sets_changes_nothing():
    reader = {"PATH": "/bin", "HOME": "/home/reader"}
    assert isolation.environment(reader | HOSTILE) == isolation.environment(reader)


@pytest.mark.parametrize(
    "name", ["HOME", "SEEDS", "CI", "CHROMIUM", "NUMBA_CACHE_DIR", "RL_CORE_WORKERS", "DASK_CONFIG"]
)
def test_what_the_project_reads_is_passed_on(name):
    assert isolation.environment({name: "x"})[name] == "x"


def test_a_command_runs_in_that_environment(monkeypatch):
    for name, text in HOSTILE.items():
        monkeypatch.setenv(name, text)
    code = "import os; print(os.environ.get('MPLBACKEND'), os.environ['TZ'], os.environ['LC_ALL'])"
    command = [sys.executable, isolation.__file__, sys.executable, "-c", code]
    assert subprocess.check_output(command, text=True).split() == ["None", "UTC", "C.UTF-8"]
