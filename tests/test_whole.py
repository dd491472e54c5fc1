"""The timing of the whole: a clean clone, steps that are not repeated, and what fails is told."""

import csv
import subprocess

import pytest

from bench import whole
from bench.whole import Step

MAKEFILE = """
book:
\t@test -e built && echo again || echo anew
\t@touch built
fail:
\t@echo this went wrong; test -e ../allowed
"""
STEPS = (
    Step("book", "make book", "from nothing", ("built", "kernels")),
    Step("book, unchanged", "make book", "touched", touched=True),
    Step("fail", "make fail", "it may fail"),
)


def git(folder, *arguments):
    who = ["-c", "user.name=a", "-c", "user.email=a@b"]
    subprocess.run(["git", *who, *arguments], cwd=folder, check=True, capture_output=True)


@pytest.fixture
def root(tmp_path, monkeypatch):
    """A checkout with a Makefile and a commit."""
    (tmp_path / "Makefile").write_text(MAKEFILE)
    (tmp_path / ".gitignore").write_text("results/\n")
    git(tmp_path, "init", "--quiet")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "--quiet", "-m", "all")
    monkeypatch.setattr(whole, "ROOT", tmp_path)
    monkeypatch.setattr(whole, "FOLDER", tmp_path / "results/timing")
    return tmp_path


def rows(path):
    return {row["what"]: row for row in csv.DictReader(path.read_text().splitlines())}


def test_every_step_has_its_row(root):
    assert whole.main(STEPS[:2]) == 0
    table = rows(root / "results/timing.csv")
    assert [*table] == ["book", "book, unchanged"]
    assert table["book"]["how"] == "make book: from nothing"
    assert float(table["book"]["seconds"]) >= 0
    assert int(table["book"]["cores"]) >= 1
    assert not (root / "results/timing").exists()


def test_what_is_done_is_not_done_again(root, capsys):
    assert whole.main(STEPS) == 1
    said = capsys.readouterr().out
    assert "this went wrong" in said
    assert not (root / "results/timing.csv").exists()
    first = rows(root / "results/timing/timing.csv")
    (root / "results/timing/allowed").touch()
    assert whole.main(STEPS) == 0
    said = capsys.readouterr().out
    assert said.count("done before") == 2
    assert rows(root / "results/timing.csv")["book"] == first["book"]


def test_a_step_says_what_it_did(root):
    whole.main(STEPS)
    logs = root / "results/timing"
    assert "anew" in (logs / "book.log").read_text()
    assert "again" in (logs / "book-unchanged.log").read_text()


def test_another_commit_is_another_clone(root, capsys):
    whole.main(STEPS)
    (root / "Makefile").write_text(MAKEFILE.replace("anew", "quite anew"))
    whole.main(STEPS)
    assert "without the changes" in capsys.readouterr().out
    git(root, "commit", "--quiet", "-am", "more")
    whole.main(STEPS)
    assert "done before" not in capsys.readouterr().out
    assert "quite anew" in (root / "results/timing/book.log").read_text()


def test_a_long_step_gives_a_sign_of_life(root, monkeypatch, capsys):
    (root / "Makefile").write_text("slow:\n\t@echo begun; sleep 0.5\n")
    git(root, "commit", "--quiet", "-am", "slow")
    monkeypatch.setattr(whole, "MINUTE", 0.1)
    assert whole.main((Step("slow", "make slow", "it sleeps"),)) == 0
    assert "after 0 min: begun" in capsys.readouterr().out


def test_what_is_announced_is_timed():
    """`make book` announces the time of the book and of the preview."""
    assert {"book", "preview"} <= {step.what for step in whole.STEPS}
