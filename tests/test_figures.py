"""The shared pieces of the drawings."""

import subprocess

import imageio_ffmpeg
import numpy as np
import pandas as pd
import pytest

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
        ([], 1, "frames is empty"),
        ([np.zeros((32, 32, 3), np.uint8)], 0, "frames_per_second must be positive, not 0"),
        ([np.zeros((32, 32, 3))], 1, "frame 0 must be uint8"),
        ([np.zeros((32, 32, 4), np.uint8)], 1, "frame 0 must be uint8"),
        (
            [np.zeros((32, 32, 3), np.uint8), np.zeros((32, 34, 3), np.uint8)],
            1,
            "frame 1 has shape",
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
