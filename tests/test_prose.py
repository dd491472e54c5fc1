"""No number in the prose of the book is a result typed by hand: results are glued from the run.

A number in the text may be a setting: it then stands in the code that the chapter runs, or in the
report's own claims. It may be one of the world's constants, or a small number that counts what is
on the page. Anything else has to come from `{glue:text}`.
"""

import ast
import re
from pathlib import Path

import jupytext
import pandas as pd
import pytest

ROOT = Path(__file__).parent.parent
BOOK = ROOT / "book"
CHAPTERS = sorted(BOOK.glob("[0-9]*.ipynb"))
OTHERS = [BOOK / "intro.ipynb", *sorted(BOOK.glob("a[0-9]*.ipynb"))]
README = ROOT / "README.md"
SMALL = 12  # what is counted by looking at the page or at the method
CONSTANTS = {  # numbers of the worlds and of the sources, which no run changes
    "01_value_iteration": {14, 112},  # free cells, states
    "02_q_learning": {112, 92, 368},  # states, those that can be visited alive, their entries
    "05_continuous_reinforce": {0.07, 90, 10_000, 30},  # top speed, return that counts as solved,
    # an episode's length in an example, the number of seeds in the question
    "intro": {650},  # the report's course
    # versions, SHA-256, sizes of the batches of 2018
    "a1_reproduce": {3.11, 3.12, 3.13, 256, 1.5, 512, 32, 1_000},
}
EVERYWHERE = {2018, 95, 29}  # the year of the report, the intervals, the last seed
NUMBER = re.compile(r"(?<![\w.])\d+(?:,\d{3})*(?:\.\d+)?(?![\w]|\.\d)")


def prose(path):
    """The text a reader reads: without code, formulas, addresses and numbers of figures."""
    cells = jupytext.read(path).cells
    described = [cell.metadata.get("mystnb", {}).get("image", {}).get("alt", "") for cell in cells]
    text = "\n\n".join([cell.source for cell in cells if cell.cell_type == "markdown"] + described)
    for hidden in (
        r"^```\w*\n.*?^```$",
        r"^```[^\n]*$",
        r"\$\$.*?\$\$",
        r"\$[^$\n]*(\n[^$\n]+)?\$",
        r"\{[\w:]+\}`[^`]*`",
        r"`[^`]*`",
        r"\]\([^)]*\)",
        r"^:(name|gutter|class):[^\n]*$",
        r"^:+\{[^\n]*$",
        r"(figures?|tables?|films?|sections?|chapters?|situations?|seeds?) S?\d[\d.]*"
        r"(( ?[,–-] ?| and | to )S?\d[\d.]*)*",
    ):
        text = re.sub(hidden, " ", text, flags=re.IGNORECASE | re.DOTALL | re.MULTILINE)
    return text


def test_the_reading_of_prose():
    """The test itself sees typed numbers, and those alone."""
    path = CHAPTERS[0]
    text = prose(path)
    assert "state" in text
    assert not re.search(r"glue:text|\\gamma", text)
    assert NUMBER.findall("after 1,234.5 steps, 12% of 30 (S1.2, v2)") == ["1,234.5", "12", "30"]


def settings(path):
    """Every number in the code of a chapter and its study, and the defaults of its algorithms."""
    code = [cell.source for cell in jupytext.read(path).cells if cell.cell_type == "code"]
    names = re.findall(r"^from studies import (\w+) as study$", "\n".join(code), re.MULTILINE)
    own = [BOOK / "studies" / f"{name}.py" for name in names]
    if path.stem == "a2_performance":
        own += [BOOK / "drawings/performance.py", ROOT / "bench/growth.py"]
    code += [file.read_text() for file in own]
    places = [ROOT / "rl_core" / name.replace(".", "/") for name in imported("\n".join(code))]
    core = [
        place / "__init__.py" if place.is_dir() else place.with_suffix(".py") for place in places
    ]
    assert path in OTHERS or (own and core)
    trees = [ast.parse(source) for source in code]
    for file in core:
        classes = [n for n in ast.parse(file.read_text()).body if isinstance(n, ast.ClassDef)]
        trees += [n for c in classes for n in c.body if isinstance(n, ast.AnnAssign)]
    nodes = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Constant)]
    return {float(node.value) for node in nodes if type(node.value) in (int, float)}


def imported(code):
    """The names of the modules of `rl_core` that code imports from."""
    return re.findall(r"^(?:import|from) rl_core\.([\w.]+)", code, re.MULTILINE)


def reported():
    """Every number in the report's claims."""
    claims = pd.read_csv(BOOK / "data/claims.csv", dtype=str)
    found = NUMBER.findall(" ".join(claims["claim"]))
    return {float(number.replace(",", "")) for number in found}


@pytest.mark.parametrize("path", CHAPTERS + OTHERS, ids=lambda path: path.stem)
def test_no_number_is_typed(path):
    known = settings(path) | reported() | set(range(SMALL + 1))
    known |= EVERYWHERE | CONSTANTS.get(path.stem, set())
    typed = [
        number
        for number in NUMBER.findall(prose(path))
        if float(number.replace(",", "")) not in known
    ]
    assert typed == []


@pytest.mark.parametrize("path", [*CHAPTERS, *OTHERS, README], ids=lambda path: path.stem)
def test_no_verdict_is_typed(path):
    """What a claim came to stands in the table that the run makes, not in a sentence."""
    ids = "|".join(pd.read_csv(BOOK / "data/claims.csv", dtype=str)["id"].drop(34))
    typed = re.findall(
        rf"\b(?:{ids})\b[^.]*\b(?:holds|does not hold|cannot tell|is refuted|is confirmed)\b",
        prose(path),
    )
    assert typed == []
