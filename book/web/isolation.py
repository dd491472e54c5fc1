"""Run a command as if its reader had no settings: `python isolation.py command argument ...`.

Matplotlib, IPython, Jupyter, Sphinx and Python itself listen to some hundred variables and to files
in the home folder: a backend, a style, a kernel of the same name, a start-up profile. Any of them
can change a page. So what a command gets is listed here, and everything else stays outside.
"""

import os
import sys
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).parents[2]
# Where things are, what the machine can do, and what the project itself reads:
KEPT = {
    *("PATH", "HOME", "USER", "LOGNAME", "SHELL", "TERM", "COLUMNS", "TMPDIR", "SYSTEMROOT"),
    *("LD_LIBRARY_PATH", "NUMBA_CACHE_DIR", "SEEDS", "CI", "CHROMIUM"),
    *("DISPLAY", "WAYLAND_DISPLAY", "XAUTHORITY", "XDG_RUNTIME_DIR", "BROWSER"),
}
OURS = ("RL_CORE_", "DASK_")
"""How the names begin that are the project's own, or of the workers a user chooses."""


def environment(given: Mapping[str, str], root: Path = ROOT) -> dict[str, str]:
    """Return the variables of a clean run: a few of the given ones, and fixed ones.

    Parameters
    ----------
    given : mapping of str to str
        The reader's variables.
    root : Path
        The checkout. Settings of matplotlib, IPython and Jupyter go to its `.venv/settings`.

    Examples
    --------
    >>> reader = {"PATH": "/bin", "MPLBACKEND": "Agg", "LC_ALL": "C", "PYTHONPATH": "/mine"}
    >>> clean = environment(reader, Path("/book"))
    >>> clean["PATH"], "MPLBACKEND" in clean, clean["LC_ALL"], clean["PYTHONPATH"]
    ('/book/.venv/bin:/bin', False, 'C.UTF-8', '/book')
    """
    settings = root / ".venv" / "settings"
    kept = {name: text for name, text in given.items() if name in KEPT or name.startswith(OURS)}
    return kept | {
        "PATH": os.pathsep.join([str(root / ".venv" / "bin"), given.get("PATH", os.defpath)]),
        "PYTHONPATH": str(root),  # this checkout, whatever else is installed
        "PYTHONHASHSEED": "0",
        "PYTHONNOUSERSITE": "1",
        "PYTHONUTF8": "1",
        "PYDEVD_DISABLE_FILE_VALIDATION": "1",
        "LC_ALL": "C.UTF-8",
        "TZ": "UTC",
        "MPLCONFIGDIR": str(settings / "matplotlib"),
        "IPYTHONDIR": str(settings / "ipython"),
        "JUPYTER_CONFIG_DIR": str(settings / "jupyter"),
        "JUPYTER_DATA_DIR": str(settings / "jupyter"),
        "JUPYTER_PREFER_ENV_PATH": "1",
        "SDL_VIDEODRIVER": "dummy",
        # One thread a process: the parallelism is over seeds, and results must not depend on cores.
        "OMP_NUM_THREADS": "1",
        "MKL_NUM_THREADS": "1",
    }


if __name__ == "__main__":
    # IPython looks whether the folder above its own can be written.
    (ROOT / ".venv" / "settings").mkdir(parents=True, exist_ok=True)
    os.execvpe(sys.argv[1], sys.argv[1:], environment(os.environ))
