"""What all interactive figures are made of: data as JSON, a still picture, and a name."""

import base64
import html
import io
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from rl_core.checks import require

LARGEST = 250_000
"""The most characters of data a figure may add to its page."""

STATIC = Path(__file__).parent.parent / "_static"


def scripts() -> list[str]:
    """Return the scripts as Sphinx's `html_js_files` wants them, in the order of loading.

    Examples
    --------
    >>> scripts()[:2]
    ['play/core.js', 'play/maze.js']
    """
    names = sorted(path.name for path in (STATIC / "play").glob("*.js"))
    first = ["core.js", "maze.js"]  # the others use what these define
    return [f"play/{name}" for name in [*first, *(name for name in names if name not in first)]]


@dataclass(frozen=True)
class Widget:
    """An interactive figure, as a notebook shows it.

    Attributes
    ----------
    kind : str
        The name under which a script has registered how to build it.
    data : mapping
        What the script gets, made of dicts, lists, strings and numbers; NaN becomes null.
    label : str
        What the figure shows, in words: the picture's alternative text.
    still : matplotlib.figure.Figure or str or object with _repr_html_
        The picture, or its HTML, that stands where there are no scripts.
    below : str
        HTML that stands below both, with or without scripts.

    Raises
    ------
    ValueError
        If the data takes more than `LARGEST` characters.

    Examples
    --------
    >>> "data-play" in Widget("knob", {"x": 1}, "A knob.", "<p>As it stood.</p>")._repr_html_()
    True
    """

    kind: str
    data: Mapping[str, Any]
    label: str
    still: Any
    below: str = ""

    def __post_init__(self) -> None:
        size = len(self.json)
        require(size <= LARGEST, "data", f"{size:,}", f"at most {LARGEST:,} characters of JSON")

    @property
    def json(self) -> str:
        """The data as JSON that can stand in a page: no `<`, which might end the script."""
        text = json.dumps(_plain(self.data), separators=(",", ":"), allow_nan=False)
        return text.replace("<", "\\u003c")

    def _repr_html_(self) -> str:
        label = html.escape(self.label, quote=True)
        return (
            f'<div class="play" data-play="{self.kind}" role="group" aria-label="{label}">'
            f'<div class="play-still">{as_html(self.still, self.label)}</div>'
            f'<script type="application/json">{self.json}</script></div>{self.below}'
        )


def as_html(shown: Any, label: str) -> str:
    """Return a figure as an image, or what already is HTML, or can show itself as such, as HTML."""
    if isinstance(shown, Figure):
        file = io.BytesIO()
        shown.savefig(file, format="png", dpi=110)
        data = base64.b64encode(file.getvalue()).decode()
        alt = html.escape(label, quote=True)
        return f'<img alt="{alt}" src="data:image/png;base64,{data}">'
    return shown if isinstance(shown, str) else shown._repr_html_()


def doubles(values: ArrayLike) -> str:
    """Return numbers as base64 of their float64, little-endian: not a bit is lost.

    Examples
    --------
    >>> doubles([1.0])
    'AAAAAAAA8D8='
    """
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f8").tobytes()).decode()


def _plain(data: Any) -> Any:
    """Return data as JSON knows it: numpy's kinds as Python's, what is not finite as null."""
    if isinstance(data, Mapping):
        return {str(key): _plain(value) for key, value in data.items()}
    if isinstance(data, np.ndarray):
        data = data.tolist()
    if isinstance(data, list | tuple):
        return [_plain(value) for value in data]
    if isinstance(data, np.generic):
        data = data.item()
    if isinstance(data, float):
        if not math.isfinite(data):
            return None
        return int(data) if data.is_integer() else data
    return data


def significant(values: ArrayLike, digits: int = 4) -> list[float | None]:
    """Round to so many significant digits: a curve on a screen needs no more.

    Examples
    --------
    >>> significant([1234.56, 0.00123456, float("nan")])
    [1235.0, 0.001235, None]
    """
    numbers = np.asarray(values, dtype=float).tolist()
    return [float(f"{x:.{digits}g}") if math.isfinite(x) else None for x in numbers]
