"""What tests of several files share: a browser, and docstrings' examples run as after pasting."""

import os
from collections.abc import Iterator
from typing import Any

import pytest


def pytest_collection_modifyitems(items):
    """Examples of the package have none of their module's names but those they import."""
    for item in items:
        if isinstance(item, pytest.DoctestItem) and item.dtest.name.startswith("rl_core."):
            item.dtest.globs = {"__name__": "pasted"}


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A browser without a window; on a machine without any there is nothing to see with."""
    from chromium import NoBrowserError, open_browser  # not loaded for the unit tests

    try:
        with open_browser() as browser:
            yield browser
    except NoBrowserError as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(str(error))
