"""A Sphinx extension: the reference, from docstrings that are written to be read as plain text.

In them a bar is an absolute value and a star is a star, an indented block is a formula or
pseudo-code, types are words. reStructuredText would take all of these for markup.
"""

import re
from itertools import groupby
from operator import itemgetter
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.ext import napoleon

# Sections as lists of names and words: their types are not links, since most of them are prose.
SECTIONS = [(name, "params_style") for name in ("Attributes", "Raises", "Warns")]
NUMPY = napoleon.Config(
    napoleon_use_param=False, napoleon_use_rtype=False, napoleon_custom_sections=SECTIONS
)


def as_words(text: str) -> str:
    r"""Escape what would be markup, except `code` in backticks and *stressed* words.

    Examples
    --------
    >>> print(as_words("**The** *error* |Q - Q*| of `x * y` and w_"))
    **The** *error* \|Q - Q\*\| of `x * y` and w\_
    """
    parts = re.split(r"(`[^`]*`|(?<!\S)\*\w[^*]*\*(?!\w)|(?<!\S)\*\*\w[^*]*\*\*)", text)
    parts[::2] = [re.sub(r"([\\*|`]|_(?!\w))", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)


def as_text(lines: list[str]) -> list[str]:
    """Mark the indented blocks before the first section as such, and escape all that is no code."""
    heading = next((i for i, line in enumerate(lines) if re.fullmatch(r"-{3,}", line)), len(lines))
    text: list[str] = []
    pieces: list[tuple[bool, str]] = []  # (is code, line)
    example = block = False
    for number, line in enumerate(lines):
        example = line.lstrip().startswith(">>>") or (example and bool(line.strip()))
        if line.strip() and not line.startswith("    "):
            block = False
        elif line.strip() and not block and number < heading and not lines[number - 1].strip():
            pieces += [(True, "::"), (True, "")]
            block = True
        pieces.append((example or block, line))
    for is_code, group in groupby(pieces, key=itemgetter(0)):
        whole = "\n".join(line for _, line in group)
        text += (whole if is_code else as_words(whole)).split("\n")
    return text


def process(
    _app: Sphinx, what: str, _name: str, _obj: object, _options: object, lines: list[str]
) -> None:
    """Turn a docstring into reStructuredText, in place."""
    lines[:] = as_text(lines)
    if what not in ("attribute", "data"):
        lines[:] = str(napoleon.NumpyDocstring(lines, NUMPY, what=what)).splitlines()


def skip(
    _app: Sphinx, _what: str, _name: str, member: object, _skip: bool, _options: object
) -> bool | None:
    """Leave out what nobody wrote: the fields of named tuples say only which number they are."""
    return True if str(member.__doc__).startswith("Alias for field number") else None


def unwrap(_app: Sphinx, doctree: nodes.document) -> None:
    """Set free what Sphinx puts into a paragraph although it is one, or a list: invalid in HTML."""
    for paragraph in list(doctree.findall(nodes.paragraph)):
        if any(isinstance(child, nodes.paragraph | nodes.bullet_list) for child in paragraph):
            paragraph.replace_self(paragraph.children)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.setup_extension("sphinx.ext.autodoc")
    app.connect("autodoc-process-docstring", process)
    app.connect("autodoc-skip-member", skip)
    app.connect("doctree-read", unwrap)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
