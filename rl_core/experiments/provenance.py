"""The circumstances of a result: versions, settings and machine."""

import importlib.metadata
import platform
from pathlib import Path

from rl_core.kernels.compiled import switches

LIBRARIES = ("gymnasium", "llvmlite", "numba", "numpy", "pandas", "torch")


def versions() -> dict[str, str]:
    """Return the versions of Python and of the libraries that decide a result's bits."""
    found = {name: importlib.metadata.version(name) for name in LIBRARIES}
    return {"python": platform.python_version(), **found}


def platform_settings() -> dict[str, str]:
    """Return the machine's architecture and the settings of numba that decide a result's bits."""
    return {"machine": platform.machine(), **switches()}


def processor() -> str:
    """Return the name of this machine's processor."""
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text(errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
