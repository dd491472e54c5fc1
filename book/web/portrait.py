"""Take the README's picture, the report's figures beside ours, from the built front page.

`python portrait.py index.html picture.png`, or `make picture`.
"""

import sys
from pathlib import Path

from chromium import NoBrowserError, open_browser

WINDOW = {"width": 1300, "height": 1200}  # all of it in sight at once
# Four in a row, over the full width and with nothing in front.
ALONE = """
    .thumbnails { position: fixed; inset: 0 auto auto 0; z-index: 9999; width: 1300px;
                  padding: 1rem; grid-template-columns: repeat(4, 1fr);
                  background: white; box-shadow: 0 0 0 100vmax white; }
"""


def take(page: Path, picture: Path) -> None:
    """Save what the front page shows of the figures.

    Raises
    ------
    web.chromium.NoBrowserError
        If no browser is installed.
    """
    with open_browser() as browser:
        context = browser.new_context(viewport=WINDOW, color_scheme="light")
        window = context.new_page()
        window.goto(page.resolve().as_uri(), wait_until="load")
        window.add_style_tag(content=ALONE)
        window.locator(".thumbnails").screenshot(path=picture)


if __name__ == "__main__":
    try:
        take(*map(Path, sys.argv[1:]))
    except NoBrowserError as error:
        sys.exit(str(error))
