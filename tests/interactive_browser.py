"""The figures that answer, in a headless browser, from a file: what they show is what Python computes.

Run with the test of the book's pages; it needs a browser but not the book. Started as a program it
writes the page it looks at, `python tests/interactive_browser.py demo.html`, for people to look at.
"""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "book")]  # for the program; pytest has them already

from chromium import NoBrowserError, open_browser  # noqa: E402
from interactive import (  # noqa: E402
    learning_log,
    learning_widget,
    maze_sweeps,
    maze_widget,
    scripts,
)
from matplotlib.figure import Figure  # noqa: E402
from playwright.sync_api import Browser, Page  # noqa: E402

from rl_core.exploration import EpsilonGreedy  # noqa: E402
from rl_core.maze import Maze  # noqa: E402
from rl_core.maze_figures import situation_figure  # noqa: E402
from rl_core.planning import value_iteration  # noqa: E402
from rl_core.q_learning import QLearningConfig  # noqa: E402


def page_of(*sections: tuple[str, object]) -> str:
    """A page with headings and what stands below each, with scripts and styles in it."""
    static = ROOT / "book" / "_static"
    style = (static / "play.css").read_text()
    code = "".join(f"<script>{(static / name).read_text()}</script>" for name in scripts())
    body = "".join(f"<h2>{title}</h2>{shown._repr_html_()}" for title, shown in sections)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Demonstration</title>'
        '<meta name="viewport" content="width=device-width">'
        f"<style>body {{ font: 16px/1.5 sans-serif; margin: 1rem auto; max-width: 52rem; padding: 0 1rem }}"
        f'html[data-theme="dark"] body {{ background: #14181e; color: #e6e6e6 }}{style}</style>'
        f"{code}</head><body><script>document.documentElement.dataset.theme ="
        " matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light'</script>"
        f"<main>{body}</main></body></html>"
    )


MAZE = Maze()
SWEEPS = maze_sweeps(MAZE)
Q_STAR = value_iteration(MAZE.model(), gamma=0.9, tolerance=1e-10, progress=False).Q
CONFIG = QLearningConfig(step_size=0.2, exploration=EpsilonGreedy(0.9))
LOG = learning_log(MAZE, CONFIG, Q_STAR)


def demonstration() -> str:
    """Every kind of figure once, on what little can be computed while one waits."""
    still = situation_figure(MAZE, SWEEPS.V[-1][:, None].repeat(4, axis=1), "")
    return page_of(
        ("One sweep at a time", maze_widget(MAZE, SWEEPS, still=still)),
        ("One step at a time", learning_widget(MAZE, LOG, Q_STAR, still=still)),
    )


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(demonstration())
