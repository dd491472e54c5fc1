"""The shared pieces of the drawings."""

import os
import re
import subprocess
import sys

import imageio_ffmpeg
import nbformat
import numpy as np
import pandas as pd
import pytest
from nbclient import NotebookClient

from drawings.look import Film
from report.captions import captioned


def decode(film, path, shape):
    """Frames of the film, read back by the decoder."""
    path.write_bytes(film.mp4)
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-i", str(path)]
    raw = subprocess.run(
        [*command, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True, check=True
    ).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, *shape, 3)


def test_a_film_shows_its_frames_in_order(tmp_path):
    greys = [20, 120, 220]
    frames = [np.full((64, 48, 3), grey, np.uint8) for grey in greys]
    film = Film(frames, frames_per_second=5, description="three greys")
    shown = decode(film, tmp_path / "film.mp4", (64, 48))
    assert len(shown) == 3
    np.testing.assert_allclose([frame.mean() for frame in shown], greys, atol=4)


def test_odd_sizes_lose_their_last_row_and_column(tmp_path):
    film = Film([np.zeros((33, 47, 3), np.uint8)], frames_per_second=1, description="odd")
    assert len(decode(film, tmp_path / "film.mp4", (32, 46))) == 1


def test_a_film_describes_itself_and_does_not_start_by_itself():
    frame = np.zeros((32, 32, 3), np.uint8)
    page = Film([frame], frames_per_second=1, description='a "quoted" <tag>')._repr_html_()
    assert 'aria-label="a &quot;quoted&quot; &lt;tag&gt;"' in page
    assert "autoplay" not in page
    assert "controls" in page


@pytest.mark.parametrize(
    ("frames", "speed", "message"),
    [
        ([], 1, "frames must be one frame or more"),
        ([np.zeros((32, 32, 3), np.uint8)], 0, "frames_per_second must be .* above 0, got 0"),
        ([np.zeros((32, 32, 3), np.uint8)], np.nan, "frames_per_second must be .*, got nan"),
        ([np.zeros((32, 32, 3))], 1, r"frames\[0\] must be uint8"),
        ([np.zeros((32, 32, 4), np.uint8)], 1, r"frames\[0\] must be uint8"),
        (
            [np.zeros((32, 32, 3), np.uint8), np.zeros((32, 34, 3), np.uint8)],
            1,
            r"frames\[1\] must be of the shape of the first, \(32, 32, 3\), got \(32, 34, 3\)",
        ),
    ],
)
def test_bad_films_are_refused(frames, speed, message):
    with pytest.raises(ValueError, match=message):
        Film(frames, frames_per_second=speed, description="")


def test_the_largest_of_a_row_is_bold_and_ties_both_are():
    table = pd.DataFrame({"name": ["p", "q"], "a": [1.0, 2.0], "b": [3.0, 2.0]})
    styled = captioned(table, "Table 0.", boldest=["a", "b"])
    bold = {
        cell for cell, style in styled._compute().ctx.items() if ("font-weight", "bold") in style
    }
    assert bold == {(0, 2), (1, 1), (1, 2)}


def test_the_same_table_gives_the_same_page():
    table = pd.DataFrame({"a": [1.0]})
    assert captioned(table, "Table 0.").to_html() == captioned(table, "Table 0.").to_html()


def test_a_table_has_an_address():
    page = captioned(pd.DataFrame({"a": [1.0]}), "Table 3.1. Steps. All of them.").to_html()
    assert '<table id="T_table-3-1">' in page


def test_numbers_have_no_empty_digits():
    page = captioned(pd.DataFrame({"bound": [0.9, 100.0], "n": [1, 2]}), "Table 0.").to_html()
    assert all(f">{shown}</td>" in page for shown in ("0.9", "100", "1", "2"))


def test_words_have_room_and_names_of_arms_more():
    rows = pd.DataFrame({"met": ["yes"], "arm": ["a" * 60], "what": ["a " * 40], "n": [1]})
    page = captioned(rows, "Table 0.").to_html()
    for width in ("min(1.5em, 6em, 30vw)", "min(30em, 12em, 30vw)", "min(40em, 6em, 30vw)"):
        assert f"min-width: {width}" in page
    assert page.count("min-width") == 3


HOSTILE = '<script>alert("1")</script>&'


def test_what_a_user_names_is_text_in_a_table():
    table = pd.DataFrame({"arm": [HOSTILE], f"steps {HOSTILE}": [1.0]})
    page = captioned(table, f"Table {HOSTILE}. {HOSTILE}").to_html()
    assert "<script" not in page
    assert page.count("&lt;script&gt;") == 4  # twice in the caption
    assert re.findall(r'id="([^"]*)"', page)[0] == "T_table-script-alert-1-script"
    # and in a column that has a format of its own
    assert "<script" not in captioned(table, "Table 0.", formats={"arm": "{:>20}"}).to_html()


STYLE = """
import sys
sys.path[:0] = ["book", "."]
import matplotlib as mpl
from drawings.look import use_style
use_style()
print(mpl.rcParams["text.usetex"], mpl.rcParams["figure.dpi"], mpl.rcParams["xtick.labelsize"])
"""


def test_a_readers_own_settings_do_not_leak_in(tmp_path):
    own = tmp_path / "matplotlibrc"
    own.write_text("text.usetex: True\nxtick.labelsize: 40\nfigure.dpi: 30\n")
    environment = os.environ | {"MATPLOTLIBRC": str(own)}
    command = [sys.executable, "-c", STYLE]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "100.0", "medium"]


@pytest.mark.parametrize("backend", ["Agg", "svg", "module://nowhere"])
def test_a_notebook_shows_its_figures_whatever_the_backend(tmp_path, monkeypatch, backend):
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\n")
    monkeypatch.setenv("MATPLOTLIBRC", str(tmp_path / "matplotlibrc"))
    monkeypatch.setenv("MPLBACKEND", backend)
    draw = "from matplotlib import pyplot as plt\nplt.plot([1, 2])"
    cells = [nbformat.v4.new_code_cell(source) for source in (STYLE, draw)]
    notebook = nbformat.v4.new_notebook(cells=cells)
    NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    shown = [output.get("data", {}) for output in notebook.cells[1].outputs]
    assert sum("image/png" in data for data in shown) == 1
