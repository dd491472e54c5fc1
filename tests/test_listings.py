"""Listings are the source's own lines, and cannot outlive them."""

import inspect
import sys

import pytest

from report.listings import LONGEST, lines_of, listing
from rl_core.reinforce import TorchLearner


@pytest.fixture
def module(tmp_path, monkeypatch):
    """A module with a function of 25 lines, one of 26, and one to be escaped."""
    body = "".join(f"    a{i} = {i}\n" for i in range(LONGEST - 1))
    (tmp_path / "listed.py").write_text(
        f"def short():\n{body}\n\ndef long():\n{body}    b = 0\n\n\n"
        'def marked(x):\n    """Two\n\n    lines."""\n    text = "<b>&"\n    return x < text\n'
    )
    monkeypatch.syspath_prepend(tmp_path)
    yield "listed"
    sys.modules.pop("listed", None)


def test_lines_are_those_of_the_source_without_the_docstring():
    source = inspect.getsource(TorchLearner.loss)
    for line in lines_of("rl_core.reinforce:TorchLearner.loss").splitlines():
        assert line in source
        assert '"""' not in line
    assert lines_of("rl_core.reinforce:discounted_returns").startswith("@compiled\ndef discounted")


def test_at_most_25_lines(module):
    assert len(lines_of(f"{module}:short").splitlines()) == LONGEST
    with pytest.raises(ValueError, match=r"path must be of at most 25 lines \(it has 26\)"):
        listing(f"{module}:long")
    assert lines_of(f"{module}:long", first="a3 =", last="a4 =") == "a3 = 3\na4 = 4"


@pytest.mark.parametrize(
    ("path", "lines", "message"),
    [
        ("rl_core.reinforce:gone", {}, "path must name a function .* no attribute 'gone'"),
        ("rl_core.gone:loss", {}, "path must name a function .* No module"),
        ("rl_core.reinforce", {}, "path must be of at most 40 lines"),
        ("rl_core.reinforce:TorchLearner.loss", {"first": "gone"}, "first must be in the lines"),
        ("rl_core.reinforce:TorchLearner.loss", {"last": "gone"}, "last must be in the lines"),
        (
            "rl_core.reinforce:TorchLearner.loss",
            {"first": "return", "last": "def loss"},
            "last must be in the lines",
        ),
    ],
)
def test_lines_that_are_gone_are_missed(path, lines, message):
    with pytest.raises(ValueError, match=message):
        listing(path, **lines)


def test_a_short_module_is_shown_whole():
    shown = listing("examples.room_task")
    assert shown.first_line == 1
    assert shown.code.startswith('"""The same room')
    assert shown.code.endswith("state[1] / DAY")
    assert "href" not in shown._repr_html_()  # it has no place in the reference


def test_the_page_names_the_file_and_links_to_its_reference(module):
    shown = listing("rl_core.reinforce:TorchLearner.loss", "The loss:")
    page = shown._repr_html_()
    assert 'href="api.html#module-rl_core.reinforce"' in page
    assert "rl_core/reinforce.py" in page
    assert "The loss:" in repr(shown)
    assert "log_pi" in repr(shown)
    start = inspect.getsourcelines(TorchLearner.loss)[1]
    assert shown.first_line == start
    marked = listing(f"{module}:marked", "a < b")._repr_html_()
    assert "<b>" not in marked
    assert "&lt;b&gt;&amp;" in marked
    assert "a &lt; b" in marked
