"""A chapter built among hostile settings is the same chapter.

Not collected with the unit tests: it builds twice. Run by `make hostile`.
"""

import json
import os
import shutil
import subprocess
from pathlib import Path

import pictures
import pytest

ROOT = Path(__file__).parent.parent
KERNEL = {"argv": ["/bin/false"], "display_name": "not ours", "language": "python"}


def checkout(folder: Path) -> Path:
    """Copy what is under version control, beside a link to the environment."""
    listed = subprocess.check_output(["git", "ls-files", "-z"], cwd=ROOT, text=True)
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).exists():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    (folder / ".venv").symlink_to(ROOT / ".venv", target_is_directory=True)
    return folder


def reader(home: Path) -> dict[str, str]:
    """The variables of a reader who has set everything otherwise, with files to match."""
    rc = home / ".config/matplotlib/matplotlibrc"
    rc.parent.mkdir(parents=True)
    rc.write_text("text.usetex: True\nfigure.figsize: 1, 1\nbackend: Agg\n")
    startup = home / ".ipython/profile_default/startup/00.py"
    startup.parent.mkdir(parents=True)
    startup.write_text("raise SystemExit('the reader's profile')")
    for share in (".local/share/jupyter", "jupyter"):
        kernel = home / share / "kernels/python3/kernel.json"
        kernel.parent.mkdir(parents=True)
        kernel.write_text(json.dumps(KERNEL))
    library = home / "library/matplotlib/__init__.py"
    library.parent.mkdir(parents=True)
    library.write_text("raise ImportError('not this one')")
    return {
        "HOME": str(home),
        "MPLBACKEND": "Agg",
        "MATPLOTLIBRC": str(rc),
        "IPYTHONDIR": str(home / ".ipython"),
        "JUPYTER_PATH": str(home / "jupyter"),
        "JUPYTER_PREFER_ENV_PATH": "0",
        "PYTHONPATH": str(home / "library"),
        "LC_ALL": "C",
        "TZ": "Pacific/Auckland",
        "NUMBA_CACHE_DIR": str(ROOT / ".venv/settings/numba"),  # compiled once for both
    }


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The chapter as a clean reader builds it, and as one with settings does."""
    clean = checkout(tmp_path_factory.mktemp("clean"))
    hostile = checkout(tmp_path_factory.mktemp("x") / "Bücher und Räume")
    (hostile / "book/7 a draft: old.ipynb").write_text("no notebook")
    settings = reader(tmp_path_factory.mktemp("home"))
    quiet = {name: settings[name] for name in ("HOME", "NUMBA_CACHE_DIR")}
    base = {"PATH": os.environ["PATH"]}
    for folder, more in ((clean, quiet), (hostile, settings)):
        command = ["make", "chapter", "N=1", "PYTHON=.venv/bin/python"]
        run = subprocess.run(
            command, cwd=folder, env=base | more, capture_output=True, text=True, check=False
        )
        assert run.returncode == 0, run.stdout[-2000:] + run.stderr[-4000:]
    return clean, hostile


def test_the_claims_are_the_same(built):
    one, other = ((folder / "results/claims.csv").read_bytes() for folder in built)
    assert one == other


def test_pictures_films_and_tables_are_as_many(built):
    page = "_build/chapter/_build/html/book/01_value_iteration.html"
    one, other = (pictures.shown(folder / page) for folder in built)
    assert one == other
    assert min(one.values()) > 0


def test_the_pictures_are_the_same(built):
    pages = (folder / "_build/chapter/_build/html/_images" for folder in built)
    one, other = ({path.name: path.read_bytes() for path in page.iterdir()} for page in pages)
    assert one == other


def test_plain_sphinx_builds_the_same_sources(tmp_path):
    """The exit, should Jupyter Book 1.x go away; see CONTRIBUTING."""
    source = checkout(tmp_path / "book")
    (source / "_toc.yml").write_text("format: jb-book\nroot: book/references\n")
    clean = [source / ".venv/bin/python", "book/web/isolation.py", "jupyter-book"]
    subprocess.check_call([*clean, "config", "sphinx", "."], cwd=source)
    conf = source / "conf.py"
    without = conf.read_text().replace("'jupyter_book', ", "")
    own = "import sys; sys.path.insert(0, 'book')\n"
    conf.write_text(own + without.replace("'sphinx_jupyterbook_latex', ", ""))
    clean[2:] = ["python", "-m", "sphinx", "-q", "-b", "html"]
    subprocess.check_call([*clean, ".", "_build/html"], cwd=source)
    page = (source / "_build/html/book/references.html").read_text()
    assert "Sutton" in page
    assert "book.css" in page
