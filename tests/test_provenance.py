"""What stands beside a result tells of what ran."""

import importlib.metadata
import platform
import sys

import gymnasium
import llvmlite
import numba
import numpy
import pandas
import torch

from rl_core.experiments.provenance import platform_settings, processor, versions


def test_versions_are_those_that_run():
    assert versions() == {
        "python": ".".join(map(str, sys.version_info[:3])),
        "gymnasium": gymnasium.__version__,
        "llvmlite": llvmlite.__version__,
        "numba": numba.__version__,
        "numpy": numpy.__version__,
        "pandas": pandas.__version__,
        "torch": importlib.metadata.version("torch"),
    }
    assert torch.__version__.startswith(versions()["torch"])  # it may add what it was built for


def test_the_switches_of_numba_and_the_machine_count(monkeypatch):
    before = platform_settings()
    monkeypatch.setattr(numba.config, "BOUNDSCHECK", 1)
    assert platform_settings() != before
    monkeypatch.undo()
    assert platform_settings() == before
    monkeypatch.setattr(platform, "machine", lambda: "sparc")
    assert platform_settings() != before


def test_the_processor_has_a_name():
    assert processor().strip()
