"""A Sphinx extension: what all pages of the site have, or have not, beyond the settings."""

from typing import Any

import sphinx_thebe
from sphinx.application import Sphinx
from sphinx.config import Config

from report.seeds import FULL, PREVIEW, SEEDS

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


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.connect("config-inited", announce)
    app.connect("builder-inited", without_thebe)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
