"""Of the theme's styles (450 kB, which hold up the first picture) only what some page can use.

In one file: a page waits for one answer, not for seventeen.
"""

import hashlib
import os
import re
from collections.abc import Iterable
from pathlib import Path

import tinycss2
from tinycss2.ast import Node

NESTED = ("media", "supports", "layer", "container")
LINK = r'\s*<link (?=[^>]*rel="stylesheet")[^>]*href="([^"?]+)[^>]*>'
NAME = re.compile(r"[.#](-?[_a-zA-Z][\w-]*)")


def words(texts: Iterable[str]) -> set[str]:
    """Return all that could be the name of a class or an address in pages and scripts."""
    return {word for text in texts for word in re.findall(r"[\w-]+", text)}


def pruned(css: str, known: set[str]) -> str:
    """Leave out selectors with a class or an address that is not known, and rules without any.

    Parameters
    ----------
    css : str
        A style sheet.
    known : set of str
        What `words` finds.

    Examples
    --------
    >>> pruned(".a, .b .c { top: 0 } @media print { #x { top: 1px } } p { top: 2px }", {"a", "b"})
    '.a{ top: 0 }p{ top: 2px }'
    """
    return _rules(tinycss2.parse_stylesheet(css, skip_comments=True, skip_whitespace=True), known)


def _rules(rules: Iterable[Node], known: set[str]) -> str:
    return "".join(_rule(rule, known) for rule in rules if rule.type.endswith("rule"))


def _rule(rule: Node, known: set[str]) -> str:
    if rule.type == "at-rule":
        if rule.content is None or rule.at_keyword not in NESTED:
            return rule.serialize()
        inner = _rules(tinycss2.parse_rule_list(rule.content), known)
        return f"@{rule.at_keyword}{tinycss2.serialize(rule.prelude)}{{{inner}}}" * bool(inner)
    kept = [one for one in _selectors(rule.prelude) if _used(one, known)]
    return f"{','.join(kept)}{{{tinycss2.serialize(rule.content)}}}" * bool(kept)


def _selectors(prelude: list[Node]) -> list[str]:
    """Return the selectors of a rule; a comma within brackets parts none."""
    parts: list[list[Node]] = [[]]
    for token in prelude:
        if token == ",":
            parts.append([])
        else:
            parts[-1].append(token)
    return [tinycss2.serialize(part).strip() for part in parts]


def _used(selector: str, known: set[str]) -> bool:
    """Whether all names are known, but for those in brackets, which may be negated or optional."""
    outside = re.sub(r"\([^()]*\)|\[[^]]*\]", "", re.sub(r"\([^()]*\)", "", selector))
    return "\\" in selector or set(NAME.findall(outside)) <= known


def prune(site: Path) -> None:
    """Prune the styles of a built site, all but those of MathJax."""
    sheets = [file for file in site.glob("_static/**/*.css") if "mathjax" not in file.parts]
    pages = [file for kind in ("*.html", "_static/**/*.js") for file in site.rglob(kind)]
    known = words(file.read_text(encoding="utf-8") for file in pages if "mathjax" not in file.parts)
    for sheet in sheets:
        sheet.write_text(pruned(sheet.read_text(encoding="utf-8"), known), encoding="utf-8")


def packed(css: str) -> str:
    """Leave out comments and the spaces that only people need.

    Examples
    --------
    >>> packed("a  { /* of links */ content: ' /* */ ' }")
    "a {  content: ' /* */ ' }"
    """
    parts = r"""("[^"]*"|'[^']*')|/\*.*?\*/|\s+"""
    return re.sub(parts, lambda it: it[1] or " " * it[0].isspace(), css, flags=re.DOTALL)


def _whole(sheet: Path) -> str:
    """Return a style sheet with those that it imports in their place."""
    text = sheet.read_text(encoding="utf-8").removeprefix('@charset "UTF-8";')
    return re.sub(r'@import "([^"]+)";', lambda name: _whole(sheet.parent / name[1]), text)


def join(site: Path, pages: Iterable[Path]) -> None:
    """Put all style sheets of a built site into one, in their order, and let each page name it."""
    texts = {page: page.read_text(encoding="utf-8") for page in pages}
    sheets = dict.fromkeys(
        (page.parent / name).resolve()
        for page, text in texts.items()
        for name in re.findall(LINK, text)
    )
    whole = packed("\n".join(map(_whole, sheets)))
    for sheet in site.glob("_static/**/*.css"):
        if "mathjax" not in sheet.parts:
            sheet.unlink()
    (site / "_static/book.css").write_text(whole, encoding="utf-8")
    version = hashlib.sha256(whole.encode()).hexdigest()[:8]
    for page, text in texts.items():
        address = os.path.relpath(site / "_static/book.css", page.parent)
        link = f'<link rel="stylesheet" href="{address}?v={version}" />'
        page.write_text(re.sub(LINK, "", text).replace("</title>", f"</title>{link}", 1), "utf-8")
