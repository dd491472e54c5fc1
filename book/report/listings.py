"""Lines of code on the page, taken from its source when the book is built."""

import html
import importlib
import inspect
import re
import textwrap
from dataclasses import dataclass
from functools import reduce

from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonLexer

from rl_core.checks import require

LONGEST, WHOLE = 25, 40
"""Lines of a listing: what can be read beside its equation, and a module that is an example."""

_DOCSTRING = re.compile(r'^[ \t]+"""(?:.|\n)*?"""[ \t]*\n', re.MULTILINE)


@dataclass(frozen=True)
class Listing:
    """Some lines of a module, as a page and as text."""

    title: str
    module: str
    first_line: int
    code: str

    @property
    def file(self) -> str:
        """The file's path in the repository."""
        return f"{self.module.replace('.', '/')}.py"

    def _repr_html_(self) -> str:
        title = f"{html.escape(self.title)} " if self.title else ""
        place = f"<code>{self.file}</code>"
        if self.module.startswith("rl_core."):
            place = f'<a href="api.html#module-{self.module}">{place}</a>'
        code = highlight(self.code, PythonLexer(), HtmlFormatter(wrapcode=True))
        return (
            f'<div class="listing"><p>{title}{place}, from line {self.first_line}</p>{code}</div>'
        )

    def __repr__(self) -> str:
        return f"{self.title} {self.file}, from line {self.first_line}\n\n{self.code}".lstrip()


def listing(path: str, title: str = "", *, first: str = "", last: str = "") -> Listing:
    """Show what carries out an equation: a function, a method, or some lines of it.

    Parameters
    ----------
    path : str
        "module:function" or "module:Class.method", compiled functions as written; or "module".
    title : str
        What to say before the file's name.
    first, last : str
        Text in the first and in the last line to show; by default all of it, without its docstring.

    Raises
    ------
    ValueError
        If the lines are not there, or are more than 25, a module's more than 40.

    Examples
    --------
    >>> listing("rl_core.reinforce:TorchLearner.loss").file
    'rl_core/reinforce.py'
    """
    module, start, code = _lines(path, first, last)
    return Listing(title, module, start, code)


def lines_of(path: str, *, first: str = "", last: str = "") -> str:
    """The code that `listing` shows.

    Examples
    --------
    >>> print(lines_of("rl_core.reinforce:TorchLearner.loss", first="return"))
    return -(v * log_pi).mean()
    """
    return _lines(path, first, last)[2]


def _lines(path: str, first: str, last: str) -> tuple[str, int, str]:
    module, _, name = path.partition(":")
    try:
        found = importlib.import_module(module)
        found = reduce(getattr, name.split("."), found) if name else found
    except (ImportError, AttributeError, ValueError) as error:
        raise ValueError(f"path must name a function of a module, got {path!r}: {error}") from None
    found = getattr(found, "py_func", found)  # numba's compiled function holds what was written
    source, start = inspect.getsourcelines(inspect.unwrap(found))
    start = start if name else 1
    begin = _place("first", first, source, 0) if first else 0
    end = _place("last", last, source, begin) if last else len(source) - 1
    code = "".join(source[begin : end + 1])
    if not first and name:
        code = _DOCSTRING.sub("", code, count=1)
    code = textwrap.dedent(code).strip("\n")
    length, longest = code.count("\n") + 1, LONGEST if name else WHOLE
    require(length <= longest, "path", path, f"of at most {longest} lines (it has {length})")
    return module, start + begin, code


def _place(name: str, text: str, source: list[str], after: int) -> int:
    """The number of the first line, not before another one, that has a text in it."""
    for number, line in enumerate(source[after:], after):
        if text in line:
            return number
    raise ValueError(f"{name} must be in the lines shown, got {text!r}")
