"""What tests of several files share: a browser, and docstrings' examples run as after pasting."""

import os
from collections.abc import Iterator

import pytest
from chromium import NoBrowserError, open_browser
from playwright.sync_api import Browser


def pytest_collection_modifyitems(items):
    """Examples of the package have none of their module's names but those they import."""
    for item in items:
        if isinstance(item, pytest.DoctestItem) and item.dtest.name.startswith("rl_core."):
            item.dtest.globs = {"__name__": "pasted"}


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A browser without a window; on a machine without any there is nothing to see with."""
    try:
        with open_browser() as browser:
            yield browser
    except NoBrowserError as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(str(error))
