"""A Sphinx extension: what all pages of the site have, or have not, beyond the settings.

Pages are light: what a page says is painted before any script or picture is asked for. One style
sheet, with what is used of the theme's styles and icons; scripts and mathematics only where there
is something for them to do, and afterwards (`_static/late.js`); every picture a file of its own
with its size, so that nothing moves when it comes.
"""

import base64
import hashlib
import html
import os
import re
import shutil
import struct
from pathlib import Path
from typing import Any

import sphinx_thebe
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.config import Config

from report.seeds import FULL, PREVIEW, SEEDS
from web import icons, styles

BANNER = (
    f"<strong>Preview with {len(SEEDS)} seeds.</strong> Numbers, intervals and verdicts are not "
    f"those of the book, which has {FULL} seeds, and the text may not fit them. "
    "<code>make book</code> makes the book."
)


def announce(_app: Sphinx, config: Config) -> None:
    """Put the banner on top of every page if this is a preview."""
    if PREVIEW:
        config.html_theme_options = {**config.html_theme_options, "announcement": BANNER}


def without_thebe(app: Sphinx) -> None:
    """Leave out the scripts of Thebe, which Jupyter Book puts on every page, used or not.

    It runs cells on a server, which this book has not, and its script ends with an error.
    """
    for listener in list(app.events.listeners["env-before-read-docs"]):
        if listener.handler is sphinx_thebe.init_thebe_core:
            app.disconnect(listener.id)


def describe(
    app: Sphinx, page: str, _template: str, context: dict[str, Any], doctree: nodes.document | None
) -> None:
    """Give a page a description for search engines, and mathematics only if it has any.

    Sphinx counts the formulas of all pages that a page lists among its own. The front page is not
    named twice in its title.
    """
    if doctree is not None and not any(doctree.findall(is_formula)):
        others = [it for it in context["script_files"] if "mathjax" not in str(it.filename)]
        context["script_files"] = [it for it in others if "MathJax" not in str(it.attributes)]
    if page == app.config.root_doc:
        context["docstitle"] = ""
    text = first_sentences(doctree) if doctree is not None else ""
    if text:
        tag = f'<meta name="description" content="{html.escape(text)}" />'
        context["metatags"] = context.get("metatags", "") + tag


def land_on_pictures(_app: Sphinx, doctree: nodes.document, _page: str) -> None:
    """Let the address of a caption be that of what stands above it: a link shows both."""
    for caption in list(doctree.findall(nodes.container)):
        above = caption.previous_sibling()
        if "caption" in caption["classes"] and isinstance(above, nodes.container):
            outputs = [
                it for it in above.findall(nodes.container) if "cell_output" in it["classes"]
            ]
            if outputs:
                outputs[0]["ids"] += caption["ids"]
                caption["ids"] = []


def is_formula(node: nodes.Node) -> bool:
    """Whether it is one in a line or on a line of its own."""
    return isinstance(node, nodes.math | nodes.math_block)


def first_sentences(doctree: nodes.document, length: int = 160) -> str:
    """Return the first paragraph of some length, up to the end of a sentence if there is one."""
    paragraphs = (node.astext().replace("\n", " ") for node in doctree.findall(nodes.paragraph))
    text = next((paragraph for paragraph in paragraphs if len(paragraph) > length / 2), "")
    cut = text[:length]
    return (
        cut if len(text) <= length else cut[: cut.rfind(". ") + 1] or cut.rpartition(" ")[0] + " …"
    )


def size(picture: bytes) -> tuple[int, int]:
    """Return width and height of a PNG in pixels, from its beginning.

    Examples
    --------
    >>> size(bytes(16) + bytes([0, 0, 0, 7, 0, 0, 1, 0]))
    (7, 256)
    """
    width, height = struct.unpack(">II", picture[16:24])
    return width, height


def sized(tag: re.Match[str], page: Path) -> str:
    """Give a picture its width and height."""
    source = re.search(r'src="(data:image/png;base64,)?([^":]+)"', tag[0])
    if source is None or " width=" in tag[0]:
        return tag[0]
    if source[1]:
        picture = base64.b64decode(source[2][:32])
    elif source[2].endswith(".png") and (page.parent / source[2]).exists():
        picture = (page.parent / source[2]).read_bytes()
    else:
        return tag[0]
    width, height = size(picture)
    return f'<img width="{width}" height="{height}"{tag[1]}'


def set_apart(text: str, page: Path, images: Path) -> str:
    """Make pictures and films that stand inside a page files of their own: the text comes first.

    Parameters
    ----------
    text : str
        The page's HTML.
    page, images : Path
        Where it is, and the folder of the files.
    """

    def moved(source: re.Match[str]) -> str:
        data = base64.b64decode(source[2])
        name = f"{hashlib.sha256(data).hexdigest()[:32]}.{source[1].rpartition('/')[2]}"
        images.mkdir(exist_ok=True)
        (images / name).write_bytes(data)
        return f'src="{os.path.relpath(images, page.parent)}/{name}"'

    text = text.replace('preload="auto"', 'preload="none"')
    return re.sub(r'src="data:(image/png|video/mp4);base64,([^"]+)"', moved, text)


# What must be on a page so that a script has something to do there.
NEEDED_BY = {
    "/play/": "data-play=",
    "/sort.js": "sortable",
    "/design-tabs.js": "sd-tab-set",
    "/togglebutton.js": r'class="[^"]*(?<![-\w])(toggle|admonition[^"]* dropdown)(?![-\w])',
    "/copybutton.js": 'class="highlight"',
    "/clipboard.min.js": 'class="highlight"',
}
THEME = 'localStorage.getItem("theme") || "auto"'


def later(script: re.Match[str], text: str) -> str:
    """Let a script wait for `late.js`, or leave it out of a page that has no use for it."""
    needed = (mark for name, mark in NEEDED_BY.items() if name in script[0])
    if not all(re.search(mark, text) for mark in needed):
        return ""
    attributes = re.sub(r'\s(defer|async)(="\w*")?', "", script[1])
    return f'<script type="text/late"{attributes}></script>'


def settled(text: str, page: Path) -> str:
    """Settle before the first picture what the theme's scripts find out: settings, light or dark.

    The settings are a file of few bytes that holds up the page; they are put into it.
    """

    def inside(script: re.Match[str]) -> str:
        file = page.parent / script[1]
        return (
            f"<script>{file.read_text(encoding='utf-8')}</script>" if file.exists() else script[0]
        )

    dark = 'matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"'
    mode = f'{{light: "light", dark: "dark"}}[localStorage.getItem("mode")] || ({dark})'
    text = text.replace(THEME, mode)
    return re.sub(r'<script src="([^"?]*documentation_options\.js)[^"]*"></script>', inside, text)


def unnamed(text: str) -> str:
    """Take from the cells of tables the addresses that no style names: half of a table's bytes."""
    named = {name for style in re.findall("<style.*?</style>", text, re.DOTALL)
             for name in re.findall(r"#([\w-]+)", style)}  # fmt: skip
    cell = r'(<t[hd]) id="(T_[\w-]+_(?:row|level)\d[^"]*)"'
    return re.sub(cell, lambda it: it[0] if it[2] in named else it[1], text)


def lightened(text: str, page: Path) -> str:
    """Rewrite a built page: icons, scripts that wait, sizes of pictures, no empty headings.

    Parameters
    ----------
    text : str
        The page's HTML.
    page : Path
        Where it is: its pictures are found from there.
    """
    text = re.sub(r"\s*<(script|link)[^>]*/fontawesome/[^>]*>(</script>)?", "", text)
    text = re.sub(r'\s*<link rel="preload" as="script"[^>]*>', "", text)
    # Formulas are set when all else is there (`_static/late.js`), by the parts of MathJax that
    # `_config.yml` lists: two thirds of the file with everything in it.
    text = re.sub(
        r'<script defer="defer" src="([^"]*mathjax/)tex-chtml.js[^"]*"></script>',
        r'<meta name="mathjax" content="\1startup.js" />',
        text,
    )
    text = settled(text, page)
    scripts = r"<script((?![^>]*(?:/late\.js|documentation_options))[^>]*\ssrc=[^>]*)></script>"
    text = re.sub(scripts, lambda script: later(script, text), text)
    text = re.sub(r'<script (src="[^"]*/late\.js)', r"<script defer \1", text)
    # A mark around each word of code: a twelfth of all that the reference consists of.
    text = re.sub(r'<span class="pre">([^<]*)</span>', r"\1", unnamed(text))
    head, body = text.split("</head>", 1)
    body = re.sub(r"<img((?:\s[^>]*)?>)", lambda tag: sized(tag, page), body)
    body = re.sub(r"<img (?![^>]*\bloading=)", '<img loading="lazy" ', body)
    body = re.sub(r"<th(?:\s[^>]*)?>(?:\s|&nbsp;)*</th>", "<td></td>", body)
    # Read out is what can be read, not another name for it.
    body = re.sub(
        r'(<summary|<button[^>]*search-button-field[^>]*) aria-label="[^"]*"', r"\1", body
    )
    return head + "</head>" + body


def unhurried(script: str) -> str:
    """Let the theme measure one piece of code after the other, not 200 in one go.

    It asks of each whether it scrolls, so that the keyboard can reach it, and waits for a layout.
    """
    measure = "e.tabIndex=e.scrollWidth>e.clientWidth||e.scrollHeight>e.clientHeight?0:-1"
    return script.replace(measure, f"setTimeout((()=>{{{measure}}}))")


def lighten(app: Sphinx, error: Exception | None) -> None:
    """Rewrite all pages, write the icons that they use, and leave the styles that they use."""
    if error is not None or app.builder.name != "html":
        return
    site = Path(app.outdir)
    pages = [page for page in site.rglob("*.html") if "_static" not in page.parts]
    for page in pages:
        text = page.read_text(encoding="utf-8")
        if "</head>" in text:
            light = set_apart(lightened(text, page), page, site / "_images")
            page.write_text(light, encoding="utf-8")
    theme = site / "_static/scripts/pydata-sphinx-theme.js"
    theme.write_text(unhurried(theme.read_text(encoding="utf-8")), encoding="utf-8")
    (site / "_static/icons.css").write_text(icons.style(site), encoding="utf-8")
    shutil.rmtree(site / "_static/vendor/fontawesome")
    styles.prune(site)
    styles.join(site, pages)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.connect("config-inited", announce)
    app.connect("builder-inited", without_thebe)
    app.connect("builder-inited", lambda app: app.set_html_assets_policy("per_page"))
    app.connect("doctree-resolved", land_on_pictures)
    app.connect("html-page-context", describe, priority=900)
    app.connect("build-finished", lighten, priority=900)  # when all files are where they belong
    app.add_css_file("icons.css")
    return {"parallel_read_safe": True, "parallel_write_safe": True}
