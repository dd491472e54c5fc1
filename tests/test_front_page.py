"""The front page: every claim exactly once, what failed first, links that lead to the figures."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from report import front_page

EXPECTED = pd.DataFrame({"id": ["1a", "2b", "3c"]})
FOUND = pd.DataFrame(
    {
        "id": ["3c", "1a", "2b"],
        "section": ["3.1", "1.1", "2.1"],
        "claim": ["c <third>", "a", "b"],
        "criterion": ["steps at most 225; the same again", "share is 1", "ratio"],
        "estimate": [314.0, 1.0, 0.5],
        "low": [250.0, 1.0, 0.25],
        "high": [np.inf, 1.0, 0.75],
        "seeds": [30, 0, 30],
        "verdict": ["does not hold", "holds", "cannot tell"],
        "figure": ["Figure 11, S3.2", "Figures 1 to 8, Table 1.1", "Figure S2.6"],
        "deciding_criterion": ["the same again", "share is 1", "ratio"],
        "deciding_estimate": [299.5, 1.0, 0.5],
        "deciding_low": [-np.inf, 1.0, 0.25],
        "deciding_high": [np.inf, 1.0, 0.75],
        "deciding_seeds": [26, 0, 30],
        "deciding_bound": [225.0, 1.0, 0.5],
        "distance": [-74.5, 0.0, 0.0],
        "readings": [np.nan] * 3,  # as an empty text is read from a file
        "amended": ["on seeds 100 to 129", np.nan, np.nan],
        "about": ["15%: does not hold; 25%: does not hold; 35%: does not hold", np.nan, np.nan],
        "chapter": [3, 1, 2],
    }
)


def test_the_claims_come_in_the_order_of_the_report(tmp_path):
    FOUND.to_csv(tmp_path / "claims.csv", index=False)
    table = front_page.claims(tmp_path, EXPECTED)
    assert table["id"].tolist() == ["1a", "2b", "3c"]
    assert table["high"].tolist() == [1.0, 0.75, np.inf]


@pytest.mark.parametrize(
    ("found", "message"),
    [
        (FOUND[:2], "missing: 2b"),
        (pd.concat([FOUND, FOUND[:1]]), "more than once: 3c"),
        (FOUND.assign(id=["3c", "1a", "9z"]), "missing: 2b; unknown: 9z"),
    ],
)
def test_a_table_that_is_not_whole_is_refused(tmp_path, found, message):
    found.to_csv(tmp_path / "claims.csv", index=False)
    with pytest.raises(front_page.IncompleteError, match=message):
        front_page.claims(tmp_path, EXPECTED)


def test_no_table_at_all_is_refused(tmp_path):
    with pytest.raises(front_page.IncompleteError, match=r"missing: 1a, 2b, 3c.*run all"):
        front_page.claims(tmp_path, EXPECTED)


def test_what_failed_stands_first():
    page = front_page.claims_table(FOUND)
    assert re.findall(r'">([123][abc])</a>', page) == ["3c", "2b", "1a"]
    assert front_page.counts(FOUND) == {
        "does not hold": 1,
        "holds in part": 0,
        "depends on the reading": 0,
        "cannot tell": 1,
        "holds": 1,
    }


def test_a_row_shows_the_number_that_decides():
    """And not the first, which is that of another criterion."""
    page = front_page.claims_table(FOUND)
    assert "<b>300</b> <small>[−∞, ∞]</small>" in page
    assert "314" not in page
    assert "<b>1</b></td>" in page  # exact: no interval
    assert "the same again: 300 [−∞, ∞] (26 seeds), bound 225, missed by 74.5." in page
    assert "share is 1: 1 (exact), bound 1, kept by 0." in page
    assert "<p>Criteria: steps at most 225; the same again.</p>" in page
    assert page.count("Criteria:") == 1  # where there is only one it is the one that decides
    assert "<p>Amended: on seeds 100 to 129.</p>" in page
    assert "nan" not in page.lower()
    assert '<span class="sorts"> A click on a heading sorts.</span>' in page


def test_both_numbers_are_shown_where_the_verdict_depends_on_the_reading():
    text = "as round: does not hold, 8.15; as sweep: holds, 0.25"
    row = FOUND[1:2].assign(verdict="depends on the reading", readings=text)
    page = front_page.claims_table(row)
    assert f'<div class="readings">{text}</div>' in page
    assert '<span class="verdict depends-on-the-reading">depends on the reading</span>' in page
    assert "<b>1</b> depends on the reading" in front_page.verdict_bar(row)


def test_a_verdict_that_hangs_on_the_meaning_of_about_is_marked():
    words = "15%: does not hold; 25%: cannot tell; 35%: holds"
    page = front_page.claims_table(FOUND.assign(about=[words, np.nan, np.nan]))
    assert page.count(f'<div class="readings">“About” within {words}</div>') == 1
    page = front_page.claims_table(FOUND)  # where all three agree it stands behind the click only
    assert page.count("<p>“About” within: 15%: does not hold;") == 1
    assert '<div class="readings">' not in page


def test_what_a_table_says_is_text():
    assert "c &lt;third&gt;" in front_page.claims_table(FOUND)
    hostile = '"><script>alert(1)</script>'
    texts = ["id", "section", "claim", "criterion", "verdict", "deciding_criterion", "readings"]
    table = FOUND.assign(**dict.fromkeys([*texts, "amended", "about"], hostile))
    table["figure"] = f"Figure 11, {hostile}"
    for page in (front_page.claims_table(table), front_page.verdict_bar(table)):
        assert "<script" not in page


@pytest.mark.parametrize(
    ("text", "targets"),
    [
        ("Figure 10", ["03_reinforce#figure-10"]),
        ("Figures 1 to 8", ["01_value_iteration#figure-1", "01_value_iteration#figure-8"]),
        ("Table 1.2, S1.2", ["01_value_iteration#T_table-1-2", "01_value_iteration#figure-s1-2"]),
        ("Figures 12, 13", ["04_dqn#figure-12", "04_dqn#figure-13"]),
    ],
)
def test_figures_are_linked(text, targets):
    links = re.findall('href="([^"]*)"', front_page.linked(text))
    assert [link.replace(".html", "") for link in links] == targets


def test_a_thumbnail_shows_the_first_arm_of_a_figure_with_several(tmp_path):
    rows = pd.DataFrame({"episode": [1, 2, 1], "seed": [0, 0, 1], "steps": [9.0, 8.0, 7.0]})
    table = pd.concat([rows.assign(arm="as reported"), rows.assign(arm="other", steps=1.0)])
    table.to_csv(tmp_path / "figure.csv", index=False)
    found = front_page.curves(tmp_path / "figure.csv", seeds=range(3))
    never = np.inf  # the third seed has no row: it is not left out
    np.testing.assert_array_equal(found, [[9.0, 7.0, never], [8.0, never, never]])


def test_every_chapter_has_its_page():
    book = Path(front_page.__file__).parent.parent
    notebooks = {path.stem for path in book.glob("[0-9]*.ipynb")}
    own = "07_take_it_from_here"  # no claim of the report stands there
    assert notebooks == {*front_page.PAGES.values(), own}
