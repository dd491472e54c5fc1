"""Pages that show less than their sources say are found."""

import json
import subprocess
import sys

import pictures
import pytest

IMAGE = {"mystnb": {"image": {"alt": "a line"}}}


def notebook(folder, *cells):
    """Write a notebook of (type, source, metadata)."""
    book = folder / "book"
    book.mkdir(exist_ok=True)
    names = ("cell_type", "source", "metadata")
    cells = [dict(zip(names, cell, strict=True)) for cell in cells]
    (book / "page.ipynb").write_text(json.dumps({"cells": cells}))
    return book / "page.ipynb"


def page(folder, body):
    """Write a built page."""
    site = folder / "site"
    site.mkdir(exist_ok=True)
    text = f"<img src='logo.png'><article>{body}</article><img src='icon.png'>"
    (site / "page.html").write_text(text)


PAGE = (
    ("code", "drawings.chart(curves)", IMAGE),
    ("markdown", "```{glue:figure} fig-1\n:name: figure-1\nText\n```", {}),
    ("markdown", "| a | b |\n|---|---|\n| 1 | 2 |", {}),
    ("code", ["def film(name):\n", "    return Film(name)\n", "film('x')\n"], {}),
    ("code", "figures.captioned(table, 'Table 1')\npremise('captioned(x)', True)", {}),
)
COMPLETE = "<img><figure><img></figure><video></video><table></table><table></table>"


def test_all_kinds_are_counted_in_the_source(tmp_path):
    assert pictures.promised(notebook(tmp_path, *PAGE)) == {"pictures": 2, "films": 1, "tables": 2}


def test_a_complete_page_is_complete(tmp_path):
    notebook(tmp_path, *PAGE)
    page(tmp_path, COMPLETE)
    assert pictures.missing(tmp_path / "book", tmp_path / "site") == []


@pytest.mark.parametrize(
    ("lost", "message"),
    [
        ("<img>", "page shows 1 pictures, its source has 2"),
        ("<video></video>", "page shows 0 films, its source has 1"),
        ("<table></table>", "page shows 1 tables, its source has 2"),
    ],
)
def test_what_is_lost_is_named(tmp_path, lost, message):
    notebook(tmp_path, *PAGE)
    page(tmp_path, COMPLETE.replace(lost, "", 1))
    command = [sys.executable, pictures.__file__, str(tmp_path / "book"), str(tmp_path / "site")]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr.strip()) == (1, message)


def test_a_site_without_pages_is_not_complete(tmp_path):
    notebook(tmp_path, *PAGE)
    assert pictures.missing(tmp_path / "book", tmp_path / "site") != []
