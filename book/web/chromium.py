"""An installed Chromium or Chrome, for the test of the pages and for the printed book."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager

from playwright.sync_api import Browser, sync_playwright

PROGRAMS = ("chromium", "google-chrome", "google-chrome-stable", "chromium-browser", "chrome")


class NoBrowserError(RuntimeError):
    """There is no browser on this machine."""


@contextmanager
def open_browser() -> Iterator[Browser]:
    """Start the browser without a window: the one named by `CHROMIUM`, or one that is found.

    Raises
    ------
    NoBrowserError
        If none is found.
    """
    named = os.environ.get("CHROMIUM")
    program = named or next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        raise NoBrowserError(f"no browser found: install one of {', '.join(PROGRAMS)}")
    with sync_playwright() as playwright:
        arguments = ["--disable-dev-shm-usage"]  # containers have little shared memory
        browser = playwright.chromium.launch(executable_path=program, args=arguments)
        try:
            yield browser
        finally:
            browser.close()
