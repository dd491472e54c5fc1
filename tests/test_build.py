"""What is copied for a preview and for a chapter alone."""

import subprocess
import sys

import announce
import build
import pytest
import yaml


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


def test_the_whole_book_has_a_progress(capfd):
    lines = "x.ipynb: Executing notebook using local CWD [mystnb]", "something else"
    code = f"print({lines[0]!r}); print({lines[1]!r}); print({lines[0]!r}); raise SystemExit(3)"
    assert build.run([sys.executable, "-c", code], 11) == 3
    said = capfd.readouterr().out
    assert "something else" in said
    assert "notebook 1 of 11" in said
    assert "notebook 2 of 11" in said


@pytest.mark.parametrize(("seeds", "only", "offered"), [("30", [], True), ("3", [], False)])
def test_an_interrupted_build_offers_the_preview(monkeypatch, capsys, seeds, only, offered):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(build, "build", interrupted)
    monkeypatch.setattr(sys, "argv", ["build.py"])
    monkeypatch.setenv("SEEDS", seeds)
    assert build.main() == 130
    assert ("make book SEEDS=3" in capsys.readouterr().out) == offered
