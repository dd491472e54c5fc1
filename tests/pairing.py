"""Every notebook of the book is paired with a .py twin, and committed without outputs."""

from pathlib import Path

import jupytext
import pytest
from jupytext.compare import compare_notebooks

BOOK = Path(__file__).parent.parent / "book"
NOTEBOOKS = sorted(BOOK.glob("*.ipynb"))
TWINS = sorted(path for path in BOOK.glob("*.py") if path.read_text().startswith("# ---\n"))


def test_every_notebook_has_a_twin_and_every_twin_a_notebook():
    assert NOTEBOOKS
    assert [path.stem for path in NOTEBOOKS] == [path.stem for path in TWINS]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_twins_say_the_same(path):
    compare_notebooks(
        jupytext.read(path),
        jupytext.read(path.with_suffix(".py")),
        fmt="py:percent",
        compare_ids=False,
    )


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_notebook_is_committed_without_outputs(path):
    for cell in jupytext.read(path).cells:
        if cell.cell_type == "code":
            assert not cell.outputs
            assert cell.execution_count is None
