"""The reference of the book: every module once, and everything public in it has a docstring."""

import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import pytest

import rl_core
from web import docstrings

PAGE = (Path(__file__).parent.parent / "book" / "api.md").read_text()
LISTED = re.findall(r"^\.\. automodule:: (\S+)$", PAGE, re.MULTILINE)
MODULES = [
    module.name
    for module in pkgutil.walk_packages(rl_core.__path__, "rl_core.")
    if not module.name.endswith("__main__")
]


def test_every_module_is_listed_once():
    assert sorted(LISTED) == sorted(MODULES)


def test_each_stands_under_its_name():
    assert re.findall(r"^### (\S+)$", PAGE, re.MULTILINE) == LISTED


@pytest.mark.parametrize("name", MODULES)
def test_every_public_function_and_class_has_a_docstring(name):
    module = importlib.import_module(name)
    bare = [
        key
        for key, value in vars(module).items()
        if not key.startswith("_")
        and callable(value)
        and getattr(value, "__module__", "") == name
        and not inspect.getdoc(value)
    ]
    assert bare == []


def test_formulas_before_the_first_section_stay_as_they_are():
    text = ["Return.", "", "    Q(s, a) <- |r|", "", "Done.", "", "Notes", "-----", "    |x|"]
    expected = ["Return.", "", "::", "", "    Q(s, a) <- |r|", "", "Done.", ""]
    assert docstrings.as_text(text) == [*expected, "Notes", "-----", r"    \|x\|"]


def test_examples_stay_as_they_are():
    text = ["Examples", "--------", ">>> 2 * 3", "6", "", "A star: *."]
    assert docstrings.as_text(text) == [*text[:5], r"A star: \*."]


def test_code_may_go_over_two_lines():
    assert docstrings.as_text(["Exactly `a *", "b` and c * d."]) == [
        "Exactly `a *",
        r"b` and c \* d.",
    ]
