"""The printed book: addresses within one document, and on which pages they are."""

from pathlib import Path

import paper
from bs4 import BeautifulSoup

# As Chromium writes it: pages in a tree, addresses with the page that they are on.
PDF = b"""%PDF
1 0 obj
<</Type /Catalog /Pages 2 0 R /Dests 9 0 R>>
endobj
2 0 obj
<</Type /Pages /Kids [3 0 R 6 0 R]>>
endobj
3 0 obj
<</Type /Pages /Kids [5 0 R 4 0 R]>>
endobj
4 0 obj
<</Type /Page>>
endobj
5 0 obj
<</Type /Page>>
endobj
6 0 obj
<</Type /Page>>
endobj
9 0 obj
<</pone--figure-1 [4 0 R /XYZ 0 1 0]
/ptwo--a#20b [6 0 R /XYZ 0 1 0]>>
endobj
"""


def test_an_address_is_on_the_page_that_it_is_counted_to():
    assert paper.places(PDF) == {"pone--figure-1": 2, "ptwo--a b": 3}


def test_pages_become_one_document(tmp_path):
    one, two = tmp_path / "one.html", tmp_path / "two.html"
    two.write_text("")
    one.write_text(
        "<article><section id='x'><style>#T_1 .c {}</style><img src='a.png'>"
        "<a href='#x'>1</a><a href='two.html#y'>2</a><a href='data.csv'>3</a>"
        "<a href='https://example.org'>4</a></section></article>"
    )
    text = paper.article(one, {one, two})
    links = [link.get("href") for link in text.find_all("a")]
    assert links == ["#pone--x", "#ptwo--y", None, "https://example.org"]
    assert text.section["id"] == "pone--x"
    assert text.style.string == "#pone--T_1 .c {}"
    assert text.img["src"] == (tmp_path / "a.png").as_uri()


def test_contents_list_chapters_and_sections_with_their_pages():
    html = "<article><section id='a'><h1>A</h1><section id='b'><h2>B</h2></section></section>"
    text = BeautifulSoup(html, "html.parser").article
    lines = list(paper.contents([text], {"a": 7, "b": 8}))
    assert ["A" in line and ">7<" in line for line in lines] == [True, False]
    assert 'href="#b"' in lines[1]
    assert ">8<" in lines[1]


def test_the_reference_is_left_to_the_site():
    names = [page.stem for page in paper.pages(Path("site"))]
    assert names[0] == "intro"
    assert "01_value_iteration" in names
    assert "api" not in names
