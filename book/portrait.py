"""Take the README's picture, the report's figures beside ours, from the built front page.

`python portrait.py index.html picture.png`, or `make picture`.
"""

import sys
from pathlib import Path

from chromium import NoBrowserError, open_browser

WIDE = {"width": 1400, "height": 900}  # three pictures in a row beside the contents


def take(page: Path, picture: Path) -> None:
    """Save what the front page shows of the figures.

    Raises
    ------
    chromium.NoBrowserError
        If no browser is installed.
    """
    with open_browser() as browser:
        context = browser.new_context(viewport=WIDE, color_scheme="light")
        window = context.new_page()
        window.goto(page.resolve().as_uri(), wait_until="load")
        window.locator(".thumbnails").screenshot(path=picture)


if __name__ == "__main__":
    try:
        take(*map(Path, sys.argv[1:]))
    except NoBrowserError as error:
        sys.exit(str(error))
