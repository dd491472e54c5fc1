"""What is copied for a build, how the notebooks are executed, and what is said of it."""

import shutil
import subprocess
import sys
from pathlib import Path

import announce
import build
import nbformat
import pytest
import yaml

CONFIG = Path(__file__).parent.parent / "_config.yml"


@pytest.fixture
def root(tmp_path, monkeypatch):
    """A checkout with sources and results."""
    (tmp_path / "book").mkdir()
    (tmp_path / "book/a.py").write_text("a")
    (tmp_path / "_config.yml").write_text("title: x")
    (tmp_path / "_toc.yml").write_text("root: book/intro")
    monkeypatch.setattr(build, "ROOT", tmp_path)
    return tmp_path


def test_a_preview_shares_the_store_but_not_the_tables(root):
    copy = build.copied(root / "_build/source", preview=True, only=[])
    (copy / "results/store/run").write_text("")
    (copy / "results/claims.csv").write_text("")
    assert (root / "results/store/run").exists()
    assert not (root / "results/claims.csv").exists()
    assert (copy / "_toc.yml").read_text() == "root: book/intro"


def test_a_chapter_alone_has_the_results_of_the_book(root):
    copy = build.copied(root / "_build/source", preview=False, only=["03_x", "04_y"])
    (copy / "results/claims.csv").write_text("")
    assert (root / "results/claims.csv").exists()
    toc = yaml.safe_load((copy / "_toc.yml").read_text())
    assert toc["root"] == "book/03_x"
    assert toc["chapters"] == [{"file": "book/04_y"}]


@pytest.mark.parametrize("what", ["book", "preview"])
def test_more_cores_do_not_take_longer(what):
    times = [announce.expected(what, cores) for cores in (1, 2, 4, 16)]
    assert times == sorted(times, reverse=True)
    assert times[-1] >= 1


def test_what_comes_is_said_first(capsys):
    announce.announce(30)
    said = capsys.readouterr().out
    assert "minutes" in said
    assert "make book SEEDS=3" in said


def test_it_is_said_by_any_python_before_there_is_an_environment():
    command = [sys.executable, "-S", "-I", announce.__file__]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert "make book SEEDS=3" in said


@pytest.fixture
def write(tmp_path):
    """Write a notebook of one cell."""

    def write(name, source):
        cells = [nbformat.v4.new_code_cell(source)]
        path = tmp_path / name
        nbformat.write(nbformat.v4.new_notebook(cells=cells), path)
        return path

    return write


def test_notebooks_are_executed_where_they_lie(write, capfd):
    save = "from pathlib import Path; Path('x').write_text('1'); print('from', 'a chapter')"
    read = "print(Path('x').read_text() + '2')"
    paths = [write("intro.ipynb", f"from pathlib import Path; {read}"), write("01.ipynb", save)]
    assert build.execute_all(paths) == 0
    shown = [nbformat.read(path, 4).cells[0].outputs[0].text for path in paths]
    assert shown == ["12\n", "from a chapter\n"]
    said = capfd.readouterr().out
    assert "01.ipynb, 1 of 2" in said
    assert "intro.ipynb, 2 of 2" in said


def test_a_notebook_that_fails_is_named_and_ends_the_build(write, capfd):
    paths = [write("01.ipynb", "raise ValueError('by intent')"), write("intro.ipynb", "1")]
    assert build.execute_all(paths) == 1
    said = capfd.readouterr()
    assert "01.ipynb" in said.err
    assert "by intent" in said.err
    assert not nbformat.read(paths[1], 4).cells[0].outputs


def test_what_was_executed_is_not_executed_again(root):
    shutil.copy(CONFIG, root)
    copy = build.copied(root / "_build/source", preview=True, only=[])
    assert (
        yaml.safe_load((copy / "_config.yml").read_text())["execute"]["execute_notebooks"] == "off"
    )


@pytest.fixture
def steps(root, monkeypatch):
    """What a build runs, without running it."""
    done = []
    monkeypatch.setattr(build, "run", lambda command, _folder=None: done.append(command[2]) or 0)
    monkeypatch.setattr(build, "execute_all", lambda paths: done.append(len(paths)) or 0)
    monkeypatch.setattr(build.pictures, "missing", lambda *_: [])
    for name in ("01_x", "intro"):
        (root / f"book/{name}.ipynb").write_text("{}")
    return done


def test_the_book_is_trained_then_executed_then_set(root, steps):
    assert build.build(30, []) == 0
    assert steps == ["studies.everything", 2, str(root / "_build/source")]


def test_a_chapter_alone_trains_itself(root, steps):
    assert build.build(30, ["01_x"]) == 0
    assert steps == [1, str(root / "_build/chapter/_build/source")]


@pytest.mark.parametrize(("seeds", "only", "offered"), [("30", [], True), ("3", [], False)])
def test_an_interrupted_build_offers_the_preview(monkeypatch, capsys, seeds, only, offered):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(build, "build", interrupted)
    monkeypatch.setattr(sys, "argv", ["build.py"])
    monkeypatch.setenv("SEEDS", seeds)
    assert build.main() == 130
    assert ("make book SEEDS=3" in capsys.readouterr().out) == offered
