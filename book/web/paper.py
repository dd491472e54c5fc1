"""Print the book, built as a single page, to a PDF: `python paper.py page.html book.pdf`."""

import sys
from pathlib import Path

from web.chromium import NoBrowserError, open_browser

STYLE = """
    .sidebar-toggle, .header-article, .bd-header-article, .bd-sidebar-secondary, .prev-next-footer,
    button, .admonition-title::after { display: none !important; }
    .bd-article, .bd-main, .bd-content, .bd-article-container
      { max-width: 100% !important; padding: 0 !important; }
    html { font-size: 13px !important; }
    span[id^="document-"] + section { break-before: page; }
    details.hide { display: none; }
    .cell_output img, figure img { max-height: 85mm; width: auto !important; margin: auto; }
    .sd-row > * { flex: 0 0 50% !important; width: 50% !important; }
    .sd-row img { max-height: 60mm; }
    h1, h2, h3, h4 { break-after: avoid; }
    figure, img, table, .math { break-inside: avoid; }
    pre { white-space: pre-wrap !important; overflow-wrap: anywhere; }
    div.cell_output, table { overflow: visible !important; }
    td, th { overflow-wrap: break-word; white-space: normal !important; }
    """

# A film becomes the picture in its middle, with a word on where it moves.
STILLS = """
    async () => {
      for (const film of document.querySelectorAll('video')) {
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


def print_page(page: Path, pdf: Path) -> None:
    """Print a page of HTML to a PDF in A4, with page numbers.

    Raises
    ------
    web.chromium.NoBrowserError
        If no browser is installed.
    """
    with open_browser() as browser, browser.new_context(color_scheme="light") as context:
        window = context.new_page()
        window.goto(page.resolve().as_uri(), wait_until="load")
        window.evaluate(STILLS)
        window.add_style_tag(content=STYLE)
        window.pdf(
            path=pdf,
            format="A4",
            margin=dict.fromkeys(("top", "bottom", "left", "right"), "18mm"),
            display_header_footer=True,
            header_template="<span></span>",
            footer_template=NUMBER,
            outline=True,
            tagged=True,
        )


if __name__ == "__main__":
    try:
        print_page(*map(Path, sys.argv[1:]))
    except NoBrowserError as error:
        sys.exit(str(error))
