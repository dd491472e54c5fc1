"""Print the built book to a PDF: `python paper.py _build/html book.pdf`.

The pages are put one behind the other as they were built, nothing is executed again. Reference and
index stay with the site. Where a heading lands is known only once it is printed, so the book is
printed twice: the second time its contents have page numbers.
"""

import base64
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote, urldefrag

import yaml
from bs4 import BeautifulSoup, Tag
from chromium import NoBrowserError, open_browser
from playwright.sync_api import Browser

ROOT = Path(__file__).parents[2]
LEFT_OUT = ("api",)
STYLE = """
    html { font-size: 12px !important; }
    body { background: white; line-height: 1.42; }
    button:not(th button), .headerlink, details.hide, .sorts, .toctree-wrapper,
    .tableofcontents-wrapper, .admonition-title::after { display: none !important; }
    article { max-width: 100% !important; padding: 0 !important; }
    article { break-before: page; }
    article h1 { margin: 0 0 0.6rem; font-size: 2.2em; }
    article :is(h2, h3, h4) { margin: 1.2rem 0 0.5rem; line-height: 1.2; }
    article :is(p, ul, ol, dl, .admonition, div[class*="highlight-"]) { margin-bottom: 0.6rem; }
    article li > p { margin-bottom: 0.2rem; }
    .printed-contents ol { columns: 2; column-gap: 3em; list-style: none; padding: 0; }
    .printed-contents a { display: flex; gap: 0.3em; color: inherit; text-decoration: none; }
    .printed-contents a::before { content: ""; order: 1; flex: 1; margin: 0 0.5em;
      border-bottom: 1px dotted; }
    .printed-contents .page { order: 2; }
    .printed-contents .title { break-after: avoid; font-weight: bold; margin-top: 0.6em; }
    .printed-contents .section { margin-left: 1.5em; }
    .cell_output img, figure img { max-height: 62mm; max-width: 100%; width: auto !important;
      height: auto !important; margin: auto; display: block; }
    .cell_output img[alt^="A picture from the film"] { max-height: 45mm; }
    .thumbnails { grid-template-columns: 1fr 1fr 1fr !important; gap: 0.5rem !important; }
    .thumbnail img { max-height: 30mm; }
    .sd-row > * { flex: 0 0 50% !important; width: 50% !important; }
    .sd-row img { max-height: 52mm; }
    .bd-article .caption, figcaption { margin-bottom: 0.8rem !important; }
    h1, h2, h3, h4 { break-after: avoid; }
    p, li { orphans: 2; widows: 2; }
    figure, img, tr, .math, .thumbnail, .cell:has(img) { break-inside: avoid; }
    .cell:has(img, video), .listing > p, caption, thead, thead tr, tbody tr:first-child {
      break-after: avoid; }
    .cell:not(:has(> :not(details.hide))) { display: none; }
    .cell { margin: 0.4rem 0 !important; }
    .cell pre { margin: 0; padding: 0.4rem 0.6rem; }
    pre { line-height: 1.3; white-space: pre-wrap !important; overflow-wrap: anywhere; }
    div.cell_output, .output, table { overflow: visible !important; }
    .bd-article table { font-size: 0.78em !important; line-height: 1.25; margin: 0.3rem 0 0.7rem; }
    .bd-article table :is(td, th) { padding: 0.12em 0.5em !important; overflow-wrap: break-word;
      white-space: normal !important; }
    """

# A film becomes the picture in its middle, with a word on where it moves; those of single seeds are
# for the screen.
STILLS = """
    async () => {
      document.querySelectorAll('.play-films').forEach(it => it.remove());
      for (const film of document.querySelectorAll('video')) {
        await new Promise(done => {
          film.addEventListener('loadedmetadata', done, {once: true});
          film.preload = 'auto';
          film.load();
        });
        await new Promise(done => {
          film.addEventListener('seeked', done, {once: true});
          film.currentTime = film.duration / 2;
        });
        const canvas = document.createElement('canvas');
        [canvas.width, canvas.height] = [film.videoWidth, film.videoHeight];
        canvas.getContext('2d').drawImage(film, 0, 0);
        const still = document.createElement('img');
        still.src = canvas.toDataURL();
        still.alt = film.getAttribute('aria-label');
        still.style.maxWidth = '100%';
        const note = document.createElement('p');
        note.textContent = 'A picture from the film, which plays in the pages for the screen.';
        film.replaceWith(still, note);
        await still.decode();
      }
      await Promise.all([...document.images].map(image => {
        image.loading = 'eager';
        return image.decode();
      }));
      await MathJax.startup.promise;
    }
    """
NUMBER = (
    '<div style="width: 100%; text-align: center; font-size: 8px">'
    '<span class="pageNumber"></span></div>'
)


def pages(site: Path) -> list[Path]:
    """The built pages in the order of the book, but for those that are left out."""
    toc = yaml.safe_load((ROOT / "_toc.yml").read_text(encoding="utf-8"))
    parts = [*toc.get("parts", []), {"chapters": toc.get("chapters", [])}]
    names = [toc["root"], *(page["file"] for part in parts for page in part["chapters"])]
    return [site / f"{name}.html" for name in names if Path(name).stem not in LEFT_OUT]


def name_of(page: Path, fragment: str) -> str:
    """The address of a place on a page, within the one document."""
    return f"p{page.stem}--{unquote(fragment)}"


def address_of(tag: Tag, file: Path) -> str:
    """Return a file's address; a film, of which a picture is taken, is put into the document."""
    if tag.name != "video":
        return file.as_uri()
    return f"data:video/mp4;base64,{base64.b64encode(file.read_bytes()).decode()}"


def article(page: Path, printed: set[Path]) -> Tag:
    """Return what a page says, its links and addresses made fit for the one document."""
    text = BeautifulSoup(page.read_text(encoding="utf-8"), "html.parser").find("article")
    assert isinstance(text, Tag), f"{page} has no article"
    text["id"] = ""
    for tag in text.find_all(id=True):
        tag["id"] = name_of(page, tag["id"])
    for style in text.find_all("style"):  # of tables, by their addresses
        style.string = style.get_text().replace("#T_", f"#{name_of(page, 'T_')}")
    for tag in text.find_all(src=True):
        if "://" not in tag["src"] and not tag["src"].startswith("data:"):
            tag["src"] = address_of(tag, (page.parent / unquote(tag["src"])).resolve())
    for link in text.find_all("a", href=True):
        address, fragment = urldefrag(link["href"])
        if "://" in address or address.startswith("mailto:"):
            continue
        target = (page.parent / unquote(address)).resolve() if address else page
        if target in printed:
            link["href"] = f"#{name_of(target, fragment)}"
        else:
            del link["href"]  # a download, or what only the site has
    return text


def contents(articles: list[Tag], numbers: dict[str, int]) -> Iterator[str]:
    """The lines of the list of contents: chapters, sections, and where they begin."""
    for text in articles:
        for heading in text.find_all(["h1", "h2"]):
            section = heading.find_parent("section")
            if section is None or heading.find_parent(class_="onlyprint"):
                continue
            for link in heading.find_all(class_="headerlink"):
                link.decompose()
            kind = "title" if heading.name == "h1" else "section"
            number = numbers.get(section["id"], "")
            title = f"{heading.decode_contents()} <span class='page'>{number}</span>"
            yield f'<li class="{kind}"><a href="#{section["id"]}">{title}</a></li>'


def document(site: Path, numbers: dict[str, int]) -> str:
    """Return the book as one page of HTML."""
    files = pages(site)
    first = BeautifulSoup(files[0].read_text(encoding="utf-8"), "html.parser")
    addresses = [link["href"].split("?")[0] for link in first.find_all("link", rel="stylesheet")]
    sheets = [(files[0].parent / address).resolve().as_uri() for address in addresses]
    styles = [f'<link rel="stylesheet" href="{sheet}">' for sheet in sheets]
    articles = [article(page, set(files)) for page in files]
    mathjax = (site / "_static/mathjax/tex-chtml.js").as_uri()
    front, *others = articles
    lines = "\n".join(contents(articles, numbers))
    return f"""<!doctype html><html lang="en" data-theme="light"><head><meta charset="utf-8">
        <title>{first.title.get_text()}</title>{"".join(styles)}<style>{STYLE}</style>
        <script>window.MathJax = {{options: {{processHtmlClass: "math"}}}}</script>
        <script src="{mathjax}" defer></script></head><body>
        <nav class="printed-contents"><h1>Contents</h1><ol>{lines}</ol></nav>
        {front}{"".join(map(str, others))}</body></html>"""


def places(pdf: bytes) -> dict[str, int]:
    """Return on which page each address of a PDF is that Chromium wrote, counted from 1."""
    objects = dict(re.findall(rb"\n(\d+) 0 obj\n(.*?)\nendobj", pdf, re.DOTALL))

    def below(number: bytes) -> Iterator[bytes]:
        kids = re.search(rb"/Kids \[(.*?)\]", objects[number], re.DOTALL)
        if kids is None:
            yield number
        else:
            for kid in re.findall(rb"(\d+) 0 R", kids[1]):
                yield from below(kid)

    catalog = next(text for text in objects.values() if b"/Type /Catalog" in text)
    order = list(below(re.search(rb"/Pages (\d+) 0 R", catalog)[1]))
    named = objects[re.search(rb"/Dests (\d+) 0 R", catalog)[1]]
    found = re.findall(rb"/(\S+) \[(\d+) 0 R", named)
    return {
        re.sub(r"#(..)", lambda code: chr(int(code[1], 16)), name.decode()): order.index(page) + 1
        for name, page in found
    }


def print_page(browser: Browser, page: Path) -> bytes:
    """Print a page of HTML in A4, with page numbers."""
    with browser.new_context(color_scheme="light") as context:
        window = context.new_page()
        window.set_default_timeout(240_000)  # milliseconds: for a machine that is busy
        window.goto(page.resolve().as_uri(), wait_until="load")
        window.evaluate(STILLS)
        return window.pdf(
            format="A4",
            margin=dict.fromkeys(("top", "bottom", "left", "right"), "14mm"),
            display_header_footer=True,
            header_template="<span></span>",
            footer_template=NUMBER,
            print_background=True,
            outline=True,
            tagged=True,
        )


def print_book(site: Path, pdf: Path) -> None:
    """Print a built book.

    Raises
    ------
    chromium.NoBrowserError
        If no browser is installed.
    """
    whole = pdf.with_suffix(".html")
    numbers: dict[str, int] = {}
    with open_browser() as browser:
        for _ in range(2):
            whole.write_text(document(site.resolve(), numbers), encoding="utf-8")
            printed = print_page(browser, whole)
            numbers = places(printed)
    pdf.write_bytes(printed)
    whole.unlink()


if __name__ == "__main__":
    try:
        print_book(*map(Path, sys.argv[1:]))
    except NoBrowserError as error:
        sys.exit(str(error))
