"""What a bug report needs: `python -m rl_core`."""

import platform
import sys
from pathlib import Path

import joblib
import numba

import rl_core
from rl_core.experiments.provenance import platform_settings, processor, versions


def main() -> None:
    """Print versions, machine and folders, a line each.

    Examples
    --------
    >>> main()  # doctest: +ELLIPSIS
    rl_core       ...
    """
    results = Path("results")
    found = results.resolve() if results.exists() else "none below this folder"
    cache = numba.config.CACHE_DIR or "beside each module, in __pycache__"  # type: ignore[attr-defined]
    lines = {
        "rl_core": Path(rl_core.__file__).parent,
        "executable": sys.executable,
        "system": platform.platform(),
        "processor": f"{processor()}, {joblib.cpu_count()} cores for this process",
        "machine code": cache,
        "results": found,
        **versions(),
        **{f"numba {name}": value for name, value in platform_settings().items()},
    }
    for name, value in lines.items():
        print(f"{name:<13} {value}")


if __name__ == "__main__":
    main()
