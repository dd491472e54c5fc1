"""What is up to date is decided by content."""

import os
import sys

import pytest
import stamp


@pytest.fixture
def make(tmp_path, monkeypatch):
    """Make a target that counts how often it was made; return the count."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.py").write_text("1")
    count = "from pathlib import Path; p = Path('n'); p.write_text(p.read_text() + 'x')"
    (tmp_path / "n").write_text("")

    def run(also="", code=count):
        options = ["done/stamp", "--in", "in", "--also", also, "--", sys.executable, "-c", code]
        return stamp.main(options), len((tmp_path / "n").read_text())

    assert run() == (0, 1)
    return run


def test_nothing_is_done_when_only_times_change(make, tmp_path):
    for moment in (0, 2e9):
        os.utime(tmp_path / "in" / "a.py", (moment, moment))
        assert make() == (0, 1)


@pytest.mark.parametrize(
    "change",
    [
        lambda folder: (folder / "a.py").write_text("2"),
        lambda folder: (folder / "a.py").unlink(),
        lambda folder: (folder / "a.py").rename(folder / "b.py"),
        lambda folder: (folder / "a b: c.py").write_text(""),
        lambda folder: os.utime((folder / "a.py").rename(folder / "ä.py"), (0, 0)),
    ],
    ids=["edited", "deleted", "renamed", "odd name", "older and renamed"],
)
def test_a_change_of_the_inputs_is_noticed_once(make, tmp_path, change):
    change(tmp_path / "in")
    assert [make(), make()] == [(0, 2), (0, 2)]


def test_an_older_file_with_other_content_is_noticed(make, tmp_path):
    (tmp_path / "in" / "a.py").write_text("0")
    os.utime(tmp_path / "in" / "a.py", (0, 0))
    assert make() == (0, 2)


def test_a_setting_counts_as_an_input(make):
    assert make(also="3 seeds") == (0, 2)


def test_caches_do_not_count(make, tmp_path):
    (tmp_path / "in" / "__pycache__").mkdir()
    (tmp_path / "in" / "__pycache__" / "a.pyc").write_text("")
    assert make() == (0, 1)


def test_a_failure_leaves_no_stamp(make):
    assert make(also="other", code="raise SystemExit(3)") == (3, 1)
    assert make() == (0, 2)


def test_an_edit_during_the_run_counts_for_the_next(make):
    edit = "from pathlib import Path; Path('in/a.py').write_text('during')"
    assert make(also="other", code=edit) == (0, 1)
    assert make(also="other") == (0, 2)
