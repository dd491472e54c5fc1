"""What is rewritten in a built page."""

import base64
import re
import struct
from pathlib import Path

import pydata_sphinx_theme
import pytest
import styles
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
    assert f'<img loading="lazy" width="640" height="480" alt="x" src="{source}" />' in text


@pytest.mark.parametrize("tag", ['<img width="3" src="chart.png">', '<img src="lost.png">'])
def test_a_picture_that_has_a_size_or_is_not_there_stays(page, tag):
    waiting = tag.replace("<img", '<img loading="lazy"')
    assert website.lightened(HEAD + tag, page).endswith(waiting)


def test_no_script_is_asked_for_before_the_page_is_painted(page):
    (page.parent / "documentation_options.js").write_text("const SETTINGS = 1;")
    text = website.lightened(HEAD, page)
    assert "<script>const SETTINGS = 1;</script>" in text
    assert '<script type="text/late" src="a.js">' in text


@pytest.mark.parametrize(
    ("name", "mark"),
    [
        ("play/maze.js", '<div data-play="maze">'),
        ("copybutton.js", '<div class="highlight">'),
        ("togglebutton.js", '<div class="admonition tip dropdown">'),
    ],
)
def test_a_script_is_only_where_there_is_something_for_it(page, name, mark):
    head = f'<head><script src="_static/{name}?v=1"></script></head>'
    assert name not in website.lightened(f'{head}<div class="dropdown toggle-x">', page)
    assert f'<script type="text/late" src="_static/{name}?v=1">' in website.lightened(
        head + mark, page
    )


def test_night_falls_before_the_first_picture(page):
    """Not when the theme's script comes, after a flash of light."""
    text = website.lightened(HEAD.replace("</head>", f"<script>{website.THEME}</script>"
        "</head>"), page)  # fmt: skip
    assert "prefers-color-scheme: dark" in text
    assert website.THEME not in text


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


def test_what_stands_inside_a_page_becomes_a_file_beside_it(page, tmp_path):
    data = base64.b64encode(PNG).decode()
    still = f'<div class="play-still"><img src="data:image/png;base64,{data}"></div>'
    film = f'<video preload="auto" src="data:video/mp4;base64,{data}"></video>'
    below = tmp_path / "book" / "page.html"
    text = website.set_apart(still + still + film, below, tmp_path / "_images")
    picture, again, movie = re.findall(r'src="\.\./_images/(\w+\.\w+)"', text)
    assert picture == again != movie
    assert (tmp_path / "_images" / movie).read_bytes() == PNG
    assert 'preload="none"' in text


def test_cells_have_no_address_that_nobody_asks_for():
    cells = ['<td id="T_table-1-1_row0_col0" class="x">', '<td id="T_table-1-1_row1_col0">']
    text = f"<style>#T_table-1-1_row1_col0 {{ }}</style><table id='T_table-1-1'>{''.join(cells)}"
    assert website.unnamed(text) == text.replace(cells[0], '<td class="x">')


def test_the_theme_measures_one_piece_of_code_at_a_time():
    folder = Path(pydata_sphinx_theme.__file__).parent / "theme/pydata_sphinx_theme/static/scripts"
    script = (folder / "pydata-sphinx-theme.js").read_text(encoding="utf-8")
    assert "setTimeout((()=>{e.tabIndex=" in website.unhurried(script)


def test_words_of_code_are_not_marked_one_by_one(page):
    code = '<code class="code"><span class="pre">a</span> <span class="pre">b</span></code>'
    assert website.lightened(HEAD + code, page).endswith('<code class="code">a b</code>')


def test_formulas_are_left_for_later(page):
    script = '<script defer="defer" src="../_static/mathjax/tex-chtml.js"></script>'
    text = website.lightened(HEAD.replace("</head>", f"{script}</head>"), page)
    assert script not in text
    assert '<meta name="mathjax" content="../_static/mathjax/startup.js" />' in text


def test_of_the_styles_only_what_can_be_used_stays():
    known = styles.words(['<p class="a b-c" id="here">', "element.classList.add('open')"])
    css = """
        p:not(.nowhere) > .a, .nowhere { top: 0 }
        #there { top: 1px }
        @media print { .nowhere { top: 2px } .open { top: 3px } }
        @supports (top: 0) { #there { top: 4px } }
        @font-face { font-family: x }
        .b-c:is(.nowhere, .a), .w-1\\/2 { content: ".nowhere { }" }
        """
    left = styles.pruned(css, known)
    assert [number in left for number in ("0", "1px", "2px", "3px", "4px")] == [1, 0, 0, 1, 0]
    assert left.startswith("p:not(.nowhere) > .a{")
    assert "@font-face { font-family: x }" in left
    assert '.b-c:is(.nowhere, .a),.w-1\\/2{ content: ".nowhere { }" }' in left


def test_all_styles_are_in_one_sheet(tmp_path):
    static = tmp_path / "_static"
    static.mkdir()
    (static / "a.css").write_text('@charset "UTF-8";@import "b.css"; .a  { top: 0 } /* of a */')
    (static / "b.css").write_text(".b { content: '/*  */' }")
    (static / "c.css").write_text(".c { top: 1px }")
    sheets = [f'<link href="../_static/{name}.css?v=1" rel="stylesheet" />' for name in "ac"]
    page = tmp_path / "book" / "page.html"
    page.parent.mkdir()
    page.write_text(f"<head><title>x</title>{''.join(sheets)}</head>")
    styles.join(tmp_path, [page])
    (sheet,) = static.iterdir()
    assert sheet.read_text() == ".b { content: '/*  */' } .a { top: 0 }  .c { top: 1px }"
    link = rf'<head><title>x</title><link rel="stylesheet" href="../_static/{sheet.name}\?v=\w+" />'
    assert re.fullmatch(link + "</head>", page.read_text())


def test_a_link_to_a_caption_leads_to_what_stands_above_it():
    output = nodes.container(classes=["cell_output"])
    cell = nodes.container("", output, classes=["cell"])
    caption = nodes.container(classes=["caption"], ids=["figure-s1-1"])
    other = nodes.container(classes=["caption"], ids=["figure-s1-2"])
    page = nodes.section("", cell, caption, nodes.paragraph(), other)
    website.land_on_pictures(None, page, "")
    assert output["ids"] == ["figure-s1-1"]
    assert caption["ids"] == []
    assert other["ids"] == ["figure-s1-2"]
