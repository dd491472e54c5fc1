"""What is rewritten in a built page."""

import base64
import struct

import pytest
import website
from docutils import nodes

HEAD = '<head><script src="documentation_options.js"></script><script src="a.js"></script></head>'
PNG = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + struct.pack(">II", 640, 480) + bytes(20)


@pytest.fixture
def page(tmp_path):
    (tmp_path / "chart.png").write_bytes(PNG)
    return tmp_path / "page.html"


@pytest.mark.parametrize(
    "source", ["chart.png", f"data:image/png;base64,{base64.b64encode(PNG).decode()}"]
)
def test_a_picture_gets_its_size(page, source):
    text = website.lightened(f'{HEAD}<img alt="x" src="{source}" />', page)
    assert f'<img width="640" height="480" alt="x" src="{source}" />' in text


@pytest.mark.parametrize("tag", ['<img width="3" src="chart.png">', '<img src="lost.png">'])
def test_a_picture_that_has_a_size_or_is_not_there_stays(page, tag):
    assert website.lightened(HEAD + tag, page).endswith(tag)


def test_scripts_wait_but_for_the_first(page):
    text = website.lightened(HEAD, page)
    assert '<script src="documentation_options.js">' in text
    assert '<script defer src="a.js">' in text


def test_the_icon_scripts_are_gone(page):
    script = '<script src="_static/vendor/fontawesome/6/js/all.min.js?digest=1"></script>'
    assert "fontawesome" not in website.lightened(HEAD.replace("</head>", f"{script}</head>"), page)


def test_an_empty_heading_is_none(page):
    assert website.lightened(f'{HEAD}<th class="x">&nbsp;</th><th>id</th>', page).endswith(
        "<td></td><th>id</th>"
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Short. " + "word " * 20, "Short. " + "word " * 20),
        ("A sentence of some words. " + "word " * 40, "A sentence of some words."),
        ("word " * 40, "word " * 31 + "word …"),
    ],
)
def test_a_description_ends_with_a_sentence_or_a_word(text, expected):
    page = nodes.section("", nodes.paragraph("", "no"), nodes.paragraph("", text))
    assert website.first_sentences(page) == expected
