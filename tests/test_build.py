"""What is copied for a preview and for a chapter alone."""

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
    times = [build.expected(what, cores) for cores in (1, 2, 4, 16)]
    assert times == sorted(times, reverse=True)
    assert times[-1] >= 1


def test_what_comes_is_said_first(capsys):
    build.announce(30)
    said = capsys.readouterr().out
    assert "minutes" in said
    assert "make book SEEDS=3" in said
