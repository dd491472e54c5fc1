"""What the drawings of all chapters share: one look, one set of colours, one way to show a film."""

import base64
import html
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import matplotlib as mpl
import numpy as np
from cycler import cycler
from IPython import get_ipython
from matplotlib.axes import Axes
from matplotlib_inline.backend_inline import set_matplotlib_formats
from numpy.typing import NDArray

from rl_core.checks import instance, number, require
from rl_core.statistics import bootstrap_interval

# Okabe & Ito (2008), "Color universal design": told apart with every common colour blindness.
BLACK = "#000000"
ORANGE = "#E69F00"
SKY_BLUE = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#767676"
COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY_BLUE, BLACK)
LINES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), (0, (1, 1)))


def use_style() -> None:
    """Set matplotlib up for the book: sizes that stay legible on a phone, few inks.

    Lines differ in colour and in dash pattern, so that a black-and-white print can be read too.
    What the reader's own settings say (matplotlibrc, MPLBACKEND, an IPython profile) is undone: in
    a notebook, figures are shown inside it as PNG, and everything else begins at its default.

    Examples
    --------
    >>> use_style()
    >>> mpl.rcParams["axes.spines.top"]
    False
    """
    shell = get_ipython()
    if hasattr(shell, "kernel"):
        shell.run_line_magic("matplotlib", "inline")
        set_matplotlib_formats("png")
    mpl.rcdefaults()
    mpl.rcParams.update(
        {
            "figure.figsize": (6.4, 3.8),
            "figure.dpi": 100,
            "savefig.dpi": 200,
            "savefig.bbox": "tight",
            "figure.constrained_layout.use": True,
            "figure.facecolor": "white",
            "font.family": "DejaVu Sans",  # ships with matplotlib: the same everywhere
            "font.size": 11,
            "axes.titlesize": 11,
            "axes.titleweight": "bold",
            "axes.titlelocation": "left",
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.grid": True,
            "axes.axisbelow": True,
            "grid.color": "#dddddd",
            "grid.linewidth": 0.6,
            "legend.frameon": False,
            "legend.fontsize": 10,
            "lines.linewidth": 1.8,
            "axes.prop_cycle": cycler(color=COLOURS) + cycler(linestyle=LINES),
        }
    )


def label(axes: Axes, *, x: str, y: str, title: str = "") -> None:
    """Name both axes (with units) and the panel."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title:
        axes.set_title(title)


def median_band(
    axes: Axes,
    x: NDArray[np.integer],
    seeds: NDArray[np.float64],
    *,
    colour: str,
    line: Any,
    text: str | None,
    top: float | None = None,
    marker: str = "",
) -> None:
    """Draw the median over seeds, and its 95% interval as a band.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    x : ndarray of shape (points,)
    seeds : ndarray of shape (seeds, points)
        A seed that stopped (NaN), or reached no goal, counts as needing for ever.
    colour, line, marker : str
        As in matplotlib; a line may be a dash pattern.
    text : str or None
        For the legend.
    top : float, optional
        To where the band goes if it has no end; by default the largest value of a seed.
    """
    values = np.where(np.isnan(seeds), np.inf, seeds)
    rng = np.random.default_rng(np.random.SeedSequence(2020))
    middle, low, high = bootstrap_interval(values, rng=rng, resamples=2_000)
    upper = np.where(np.isinf(high), np.nanmax(seeds) if top is None else top, high)
    axes.fill_between(
        *(x, low, upper), where=np.isfinite(low).tolist(), color=colour, alpha=0.22, lw=0
    )
    drawn = np.where(np.isinf(middle), np.nan, middle)
    axes.plot(x, drawn, color=colour, ls=line, marker=marker, ms=4, label=text)


class Film:
    """A silent film that a notebook shows as an HTML video, its data inside the page.

    H.264 in 4:2:0, which every browser plays. It starts when the reader asks for it: nothing moves
    on a page unasked. The description is read out by screen readers.

    Parameters
    ----------
    frames : iterable of ndarray of uint8, shape (height, width, 3)
        The pictures, all of one size; an odd last row or column is cut off (the format needs even
        sizes).
    frames_per_second : float
        Speed of play.
    description : str
        What the film shows, in words.

    Raises
    ------
    TypeError, ValueError
        If there is no frame, a frame is not an RGB picture of the first one's size, or
        `frames_per_second` is not positive.

    Examples
    --------
    >>> black = np.zeros((32, 32, 3), np.uint8)
    >>> film = Film([black, black + 255], frames_per_second=2, description="A flash.")
    >>> film.mp4[4:8]
    b'ftyp'
    """

    def __init__(
        self,
        frames: Iterable[NDArray[np.uint8]],
        *,
        frames_per_second: float,
        description: str,
    ) -> None:
        frames_per_second = number("frames_per_second", frames_per_second, above=0)
        instance("description", description, str, "a str")
        pictures = [np.asarray(frame) for frame in frames]
        require(pictures, "frames", pictures, "one frame or more")
        for place, picture in enumerate(pictures):
            fits = picture.dtype == np.uint8 and picture.ndim == 3 and picture.shape[2] == 3
            shown, name = f"{picture.dtype} {picture.shape}", f"frames[{place}]"
            require(fits, name, shown, "uint8 of shape (height, width, 3)")
            same = picture.shape == pictures[0].shape
            require(same, name, picture.shape, f"of the shape of the first, {pictures[0].shape}")
        self.description = description
        self.height, self.width = (side - side % 2 for side in pictures[0].shape[:2])
        self.mp4 = _encode(pictures, frames_per_second)

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.mp4).decode()
        text = html.escape(self.description, quote=True)
        return (
            f'<video controls loop muted playsinline preload="auto" aria-label="{text}" '
            f'width="{self.width}" height="{self.height}" title="{text}" '
            f'src="data:video/mp4;base64,{data}"></video>'
        )


def _encode(pictures: list[NDArray[np.uint8]], frames_per_second: float) -> bytes:
    height, width = (side - side % 2 for side in pictures[0].shape[:2])
    raw = b"".join(picture[:height, :width].tobytes() for picture in pictures)
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"]
    source += ["-r", f"{frames_per_second}", "-i", "-"]
    codec = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "23", "-preset", "slow"]
    with tempfile.TemporaryDirectory() as folder:
        film = Path(folder) / "film.mp4"
        command = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", *source, *codec]
        command += ["-movflags", "+faststart", str(film)]
        subprocess.run(command, input=raw, check=True)
        return film.read_bytes()
