"""Of the theme's icon font (1.9 MB with its scripts) only the icons that the site uses."""

import base64
import io
import logging
import re
from collections.abc import Iterable
from pathlib import Path

from fontTools.subset import Options, Subsetter
from fontTools.ttLib import TTFont

logging.getLogger("fontTools").setLevel(logging.WARNING)  # it tells all that it does

RULES = """\
@font-face {{ font-family: "Font Awesome 6 Free"; font-weight: 900; font-display: block;
  src: url(data:font/woff;base64,{font}) format("woff"); }}
:root {{ --fa-font-solid: normal 900 1em/1 "Font Awesome 6 Free"; }}
.fa, .fas, .fa-solid {{ display: inline-block; font-family: "Font Awesome 6 Free";
  font-style: normal; font-weight: 900; line-height: 1; text-rendering: auto; }}
.fa-lg {{ font-size: 1.25em; line-height: 0.05em; vertical-align: -0.075em; }}
"""


def codes(css: str) -> dict[str, int]:
    r"""Return the code point of each icon that a style sheet names.

    Examples
    --------
    >>> codes(r'.fa-bars:before,.fa-navicon:before{content:"\f0c9"}')
    {'bars': 61641, 'navicon': 61641}
    """
    found = {}
    for names, code in re.findall(r'([^{}]*)\{content:"\\([0-9a-f]+)"\}', css):
        found |= dict.fromkeys(re.findall(r"\.fa-([\w-]+):", names), int(code, 16))
    return found


def subset(font: Path, points: Iterable[int]) -> bytes:
    """Return a font with some of the characters of another, compressed."""
    whole = TTFont(font)
    subsetter = Subsetter(Options(notdef_outline=False))
    subsetter.populate(unicodes=list(points))
    subsetter.subset(whole)
    whole.flavor = "woff"
    data = io.BytesIO()
    whole.save(data)
    return data.getvalue()


def style(site: Path) -> str:
    """Return a style sheet, font inside, with the icons that pages, scripts and styles name."""
    (folder,) = (site / "_static/vendor/fontawesome").iterdir()
    known = codes((folder / "css/all.min.css").read_text(encoding="utf-8"))
    kinds = [site.rglob("*.html"), site.glob("_static/scripts/*.js"), site.glob("_static/**/*.css")]
    texts = [file.read_text(encoding="utf-8") for kind in kinds for file in kind
             if folder not in file.parents]  # fmt: skip
    names = {name for text in texts for name in re.findall(r"\bfa-([\w-]+)", text)} & set(known)
    direct = {int(code, 16) for text in texts for code in re.findall(r'"\\(f[0-9a-f]{3})"', text)}
    direct |= {ord(sign) for text in texts for sign in re.findall("[\ue000-\uf8ff]", text)}
    points = sorted(direct | {known[name] for name in names})
    font = base64.b64encode(subset(folder / "webfonts/fa-solid-900.ttf", points)).decode()
    rules = [f'.fa-{name}::before {{ content: "\\{known[name]:x}"; }}' for name in sorted(names)]
    return RULES.format(font=font) + "\n".join(rules) + "\n"
