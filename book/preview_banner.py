"""A Sphinx extension: says on every page that a preview, made of fewer seeds, is not the book."""

from typing import Any

from seeds import FULL, PREVIEW, SEEDS
from sphinx.application import Sphinx
from sphinx.config import Config

BANNER = (
    f"<strong>Preview with {len(SEEDS)} seeds.</strong> Numbers, intervals and verdicts are not "
    f"those of the book, which has {FULL} seeds, and the text may not fit them. "
    "<code>make book</code> makes the book."
)


def announce(_app: Sphinx, config: Config) -> None:
    """Put the banner on top of every page if this is a preview."""
    if PREVIEW:
        config.html_theme_options = {**config.html_theme_options, "announcement": BANNER}


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.connect("config-inited", announce)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
