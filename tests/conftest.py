"""Examples in the package's docstrings run as after pasting: without their module's names."""

import pytest


def pytest_collection_modifyitems(items):
    for item in items:
        if isinstance(item, pytest.DoctestItem) and item.dtest.name.startswith("rl_core."):
            item.dtest.globs = {"__name__": "pasted"}
