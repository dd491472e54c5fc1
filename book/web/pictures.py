"""Does each page show what its source promises? `python pictures.py BOOK SITE` counts both.

A picture can get lost without an error: a backend that draws nothing leaves an empty cell, and
the build goes on. So figures, films and tables are counted in the notebooks and in the pages.
"""

import ast
import json
import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from bs4 import BeautifulSoup

CALLS = {
    "Film": "films",
    "film": "films",
    "captioned": "tables",
    "claims_table": "tables",
    "thumbnails": "pictures",
    **dict.fromkeys(("maze_widget", "learning_widget"), "pictures"),
    **dict.fromkeys(("turning", "sigma_knob", "mean_action_snapshots"), "pictures"),
}
DIRECTIVES = {"figure": "pictures", "image": "pictures", "table": "tables", "list-table": "tables"}
SHOWN = {"pictures": "img, svg[role=img]", "films": "video", "tables": "table"}


def calls(code: str) -> Iterator[str]:
    """The names of what a cell calls, but for the functions that it only defines."""
    pending: list[ast.AST] = list(ast.parse(code).body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Lambda):
            continue
        if isinstance(node, ast.Call):
            yield node.func.attr if isinstance(node.func, ast.Attribute) else ast.unparse(node.func)
        pending += ast.iter_child_nodes(node)


def promised(notebook: Path) -> Counter[str]:
    """Count what a notebook's source will show, at least."""
    count: Counter[str] = Counter()
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            named = re.findall(r"^[`:]{3,}\{(?:glue:)?([\w-]+)\}", source, re.MULTILINE)
            count.update(DIRECTIVES[name] for name in named if name in DIRECTIVES)
            count["tables"] += len(re.findall(r"^\|[ :|-]+\|$", source, re.MULTILINE))
        elif cell["cell_type"] == "code" and "remove-cell" not in cell["metadata"].get("tags", []):
            count["pictures"] += bool({"image", "figure"} & set(cell["metadata"].get("mystnb", {})))
            count.update(CALLS[name] for name in calls(source) if name in CALLS)
    return count


def shown(page: Path) -> Counter[str]:
    """Count what a built page shows."""
    article = BeautifulSoup(page.read_text(encoding="utf-8"), "html.parser").find("article")
    assert article is not None, f"{page} has no article"
    return Counter({kind: len(article.select(these)) for kind, these in SHOWN.items()})


def missing(book: Path, site: Path) -> list[str]:
    """Say what is not there, a line for each page and kind."""
    lost = []
    pages = {page.stem: page for page in sorted(site.glob("*.html"))}
    for notebook in sorted(book.glob("*.ipynb")):
        if notebook.stem in pages:
            there = shown(pages[notebook.stem])
            lost += [
                f"{notebook.stem} shows {there[kind]} {kind}, its source has {number}"
                for kind, number in promised(notebook).items()
                if there[kind] < number
            ]
    return lost if pages else [f"no pages in {site}"]


if __name__ == "__main__":
    sys.exit("\n".join(missing(*map(Path, sys.argv[1:]))) or None)
