"""Verdicts follow from intervals alone."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from report.claims import (
    COLUMNS,
    Claim,
    Criterion,
    Evidence,
    Reading,
    criteria,
    details,
    number,
    record,
    seeds_to_tell,
    sensitivity,
    verdicts,
    what_it_would_take,
)

FEW = Criterion("at most 10", at_most=10)
MANY = Criterion("at least 1", at_least=1)


def claim(*criteria, name="1a"):
    return Claim(name, "1.1", "Something is so.", criteria, "Figure 1")


@pytest.mark.parametrize(
    ("low", "high", "answer"),
    [(3, 10, "yes"), (11, 12, "no"), (9, 11, "open"), (10, 10, "yes"), (10.001, 11, "no")],
)
def test_a_criterion_looks_at_the_whole_interval(low, high, answer):
    assert FEW.answer(Evidence(low, low, high, seeds=30)) == answer


@pytest.mark.parametrize(
    ("first", "second", "verdict"),
    [
        ((5, 5), (5, 5), "holds"),
        ((11, 12), (0, 0.5), "does not hold"),
        ((5, 5), (0, 0.5), "holds in part"),
        ((5, 5), (0, 2), "holds in part"),
        ((9, 11), (0, 2), "cannot tell"),
        ((9, 11), (0, 0.5), "does not hold"),
    ],
)
def test_verdicts(first, second, verdict):
    evidence = [Evidence(low, low, high, seeds=30) for low, high in (first, second)]
    assert claim(FEW, MANY).judge(*evidence).verdict == verdict


@pytest.mark.parametrize(
    ("low", "high", "answer"),
    [
        (0.5, 0.7, "open"),
        (0.51, 0.7, "yes"),
        (0.3, 0.5, "open"),  # as from the other side: the bound itself settles nothing
        (0.3, 0.49, "no"),
        (0.5, 0.5, "no"),  # unless there is nothing else
        (0.4, 0.6, "open"),
    ],
)
def test_above_does_not_include_its_bound(low, high, answer):
    criterion = Criterion("above a half", above=0.5)
    assert criterion.answer(Evidence(low, low, high, seeds=30)) == answer


def test_a_criterion_is_one_sentence():
    with pytest.raises(ValueError, match=r"text must be without '; '.*got 'a; b'"):
        Criterion("a; b", at_least=0)


@pytest.mark.parametrize(
    ("bounds", "error", "message"),
    [
        ({}, ValueError, "at_least, at_most or above must be a finite number"),
        ({"at_most": math.inf}, ValueError, "at_least, at_most or above must be a finite number"),
        ({"at_least": math.nan}, ValueError, "at_least must be a finite number, got nan"),
        ({"above": "0.5"}, TypeError, "above must be a finite number, got '0.5'"),
        ({"at_least": 2, "at_most": 1}, ValueError, "at_most must be no less than at_least.*1.0"),
        ({"above": 1, "at_most": 1}, ValueError, "at_most must be .* more than above, got 1.0"),
    ],
)
def test_a_criterion_needs_a_bound(bounds, error, message):
    with pytest.raises(error, match=message):
        Criterion("anything", **bounds)


def test_every_criterion_needs_its_evidence():
    with pytest.raises(ValueError, match=r"evidence must be 2 pieces, .* claim 1a"):
        claim(FEW, MANY).judge(Evidence.exact(1))


def test_impossible_intervals_are_refused():
    with pytest.raises(ValueError, match=r"estimate must be from low to high, 2.0 to 3.0, got 1.0"):
        Evidence(1, 2, 3, seeds=30)
    for place in range(3):
        numbers = [2.0, 1.0, 3.0]
        numbers[place] = math.nan
        with pytest.raises(ValueError, match=r"(estimate|low|high) must be a .*number, got nan"):
            Evidence(*numbers, seeds=30)
    with pytest.raises(ValueError, match="seeds must be an integer from 0, got -1"):
        Evidence(1, 1, 1, seeds=-1)
    assert Evidence(np.float32(1), Fraction(1, 2), np.int8(2), seeds=np.uint8(9)) == Evidence(
        1.0, 0.5, 2.0, 9
    )


def test_the_table_gathers_the_chapters_in_order(tmp_path):
    second = claim(FEW, name="2a").judge(Evidence(4, 3, 5, seeds=30))
    first = claim(FEW, MANY).judge(Evidence.exact(7), Evidence.exact(2))
    record([second], tmp_path, chapter="2")
    record([first], tmp_path, chapter="1")
    rows = record([first], tmp_path, chapter="1")
    table = pd.read_csv(tmp_path / "claims.csv")
    assert list(table.columns) == list(COLUMNS)
    assert table["id"].tolist() == ["1a", "2a"]
    assert table["chapter"].tolist() == [1, 2]
    assert table.loc[0, "criterion"] == "at most 10; at least 1"
    assert table.loc[1, ["estimate", "low", "high", "seeds"]].tolist() == [4, 3, 5, 30]
    assert rows["verdict"].tolist() == ["holds"]
    assert details([first])["met"].tolist() == ["yes", "yes"]
    assert details([second])["measured"].tolist() == ["4 [3, 5]"]
    assert verdicts([first, second])["verdict"].tolist() == ["holds", "holds"]


@pytest.mark.parametrize(
    ("criterion", "evidence", "seeds"),
    [
        (FEW, Evidence(8, 6, 12, seeds=30), 250),
        (FEW, Evidence(10, 6, 12, seeds=4), math.inf),  # the estimate is the bound
        (FEW, Evidence(8, 6, math.inf, seeds=30), math.inf),
        (FEW, Evidence.none(), math.inf),
        (Criterion("above a half", above=0.5), Evidence(0.75, 0.5, 1, seeds=30), 70),
        (Criterion("75 to 125", 75, 125), Evidence(120, 110, 130, seeds=30), 250),
    ],
)
def test_seeds_that_it_would_take(criterion, evidence, seeds):
    assert criterion.answer(evidence) == "open"
    assert seeds_to_tell(criterion, evidence) == seeds


def test_only_what_is_open_is_said_to_need_more_seeds():
    finding = claim(FEW, MANY).judge(Evidence(10, 6, 12, seeds=4), Evidence(4, 3, 5, seeds=30))
    assert what_it_would_take([finding]) == ("1a, criterion 1: no number (excluded: below 6)")


def criterion_finding(criterion, *interval, seeds=30):
    claim = Claim("1a", "1.1", "Something is so.", (criterion,), "Figure 1")
    return claim.judge(Evidence(*interval, seeds=seeds))


@pytest.mark.parametrize(
    ("criterion", "interval", "answer"),
    [
        (Criterion("half", above=0.5), (0.625, 0.375, 0.875), "250 (excluded: above 0.875)"),
        (Criterion("an eighth", at_least=0.125), (0.25, 0, 0.3), "250 (excluded: above 0.3)"),
        (Criterion("at most", at_most=0.25), (0.125, 0.1, 0.375), "250 (excluded: below 0.1)"),
        # Not the bound that is nearest, but the one that the interval holds.
        (Criterion("both", 60, 100), (75, 70, 125), "250 (excluded: below 70 and above 125)"),
        (Criterion("the bound", above=0.5), (0.5, 0.4, 0.6), "no number (excluded: above 0.6)"),
        (Criterion("none", at_most=9), (math.inf, 5, math.inf), "no number (excluded: below 5)"),
        (Criterion("all", at_least=9), (5, 5, math.inf), "no number (excluded: nothing)"),
    ],
)
def test_what_it_would_take_by_hand(criterion, interval, answer):
    """30 seeds, a reach of twice the distance to the bound, 80% power: 30 times 4 times 2.04."""
    finding = criterion_finding(criterion, *interval)
    assert what_it_would_take([finding]) == f"1a, criterion 1: {answer}"


def test_seeds_for_a_power_of_eighty_percent():
    """A normal mean one unit from its bound, with the seeds that are said to tell."""
    now = Evidence(1.0, -0.96, 2.96, seeds=100)  # half a width of 1.96 at 100 seeds: spread 10
    needed = seeds_to_tell(Criterion("above nothing", above=0), now)
    tells = stats.norm.sf(1.96, loc=1 / (10 / np.sqrt(needed)))
    assert 0.8 < tells < 0.82


def test_what_is_settled_takes_nothing():
    assert what_it_would_take([criterion_finding(FEW, 7, 6, 8)]) == "none is open"


# --- the number that decides ------------------------------------------------------------------


def row_of(*pairs):
    """A claim's row, from pairs of a criterion and an interval over as many seeds as its place."""
    criteria, intervals = zip(*pairs, strict=True)
    pieces = [Evidence(*interval, seeds=i) for i, interval in enumerate(intervals, 1)]
    return claim(*criteria).judge(*pieces).row()


@pytest.mark.parametrize(
    ("pairs", "place", "verdict"),
    [
        # the first that failed
        ([(FEW, (5, 4, 6)), (FEW, (20, 15, 30)), (FEW, (50, 40, 60))], 2, "holds in part"),
        ([(FEW, (9, 8, 11)), (FEW, (20, 15, 30))], 2, "does not hold"),
        # none failed: what is open decides, and of that the tightest
        ([(FEW, (5, 4, 6)), (FEW, (7, 5, 11)), (FEW, (9, 7, 11))], 3, "holds in part"),
        ([(FEW, (9, 8, 11)), (FEW, (9.9, 8, 11))], 2, "cannot tell"),
        # all hold: the tightest, in halves of its interval's width, not in its own units
        ([(FEW, (9, 8.9, 9.1)), (FEW, (5, 1, 9))], 2, "holds"),
        ([(FEW, (9, 9, 9)), (FEW, (5, 4, 6))], 2, "holds"),  # what is exact is never tight,
        ([(FEW, (5, 4, 6)), (FEW, (10, 10, 10))], 2, "holds"),  # unless it is the bound
        ([(FEW, (5, 4, 6)), (FEW, (math.inf, -math.inf, math.inf))], 2, "holds in part"),
    ],
)
def test_the_number_that_decides_is_shown(pairs, place, verdict):
    row = row_of(*pairs)
    estimate, low, high = pairs[place - 1][1]
    assert row["verdict"] == verdict
    assert row["deciding_seeds"] == place
    assert (row["deciding_estimate"], row["deciding_low"], row["deciding_high"]) == (
        *(estimate, low, high),
    )
    assert (row["deciding_bound"], row["distance"]) == (10, 10 - estimate)
    # The first of them stands where it always stood.
    assert (row["estimate"], row["low"], row["high"]) == pairs[0][1]
    assert row["seeds"] == 1


def test_the_distance_is_negative_where_a_bound_is_missed():
    both = Criterion("75 to 125", 75, 125)
    assert [both.margin(value) for value in (60, 80, 120, 140)] == [
        *((-15, 75), (5, 75), (5, 125), (-15, 125)),
    ]
    assert Criterion("above", above=0.5).margin(0.75) == (0.25, 0.5)
    assert Criterion("at most", at_most=9).margin(math.inf) == (-math.inf, 9)


@given(
    st.lists(st.tuples(st.floats(-9, 9), st.floats(0, 9), st.floats(0, 9)), min_size=1, max_size=4)
)
def test_verdicts_and_the_criteria_that_make_them(triples):
    criteria = [Criterion(str(i), above=-1, at_most=3) for i in range(len(triples))]
    pieces = [Evidence(x, x - below, x + over, seeds=30) for x, below, over in triples]
    finding = claim(*criteria).judge(*pieces)
    decides = finding.answers[finding.deciding]
    assert {
        "holds": decides == "yes",
        "cannot tell": decides == "open",
        "does not hold": decides == "no",
        "holds in part": decides != "yes",
    }[finding.verdict]


# --- readings ---------------------------------------------------------------------------------

IN_ROUNDS = Claim(
    *("1c", "1.1", "Fewer.", (Criterion("a round at most 1", at_most=1),), "Figure 1"),
    reading="iteration as round",
    readings=(Reading("iteration as sweep", (Criterion("a sweep at most 1", at_most=1),)),),
    amended="the second reading: seeds 100 to 129",
)


def test_a_verdict_that_readings_do_not_share_depends_on_the_reading():
    finding = IN_ROUNDS.judge(Evidence.exact(8.15), readings=[[Evidence(0.25, 0.2, 0.3, seeds=9)]])
    row = finding.row()
    assert finding.verdict == "depends on the reading"
    assert row["readings"] == (
        "iteration as round: does not hold, 8.15; iteration as sweep: holds, 0.25 [0.2, 0.3]"
    )
    assert row["deciding_estimate"] == 8.15
    assert row["amended"] == "the second reading: seeds 100 to 129"
    assert details([finding])["criterion"].tolist() == [
        "iteration as round: a round at most 1",
        "iteration as sweep: a sweep at most 1",
    ]


def test_a_verdict_that_readings_share_stands():
    finding = IN_ROUNDS.judge(Evidence.exact(8), readings=[[Evidence.exact(2)]])
    assert finding.verdict == "does not hold"
    assert "iteration as sweep: does not hold, 2" in finding.row()["readings"]
    assert claim(FEW).judge(Evidence.exact(1)).row()["readings"] == ""


def test_every_reading_needs_its_name_and_its_evidence():
    with pytest.raises(ValueError, match="readings must be 1 sequences, one for each other"):
        IN_ROUNDS.judge(Evidence.exact(8))
    with pytest.raises(ValueError, match="reading must be a name"):
        replace(IN_ROUNDS, reading="")
    with pytest.raises(ValueError, match="criteria must be one criterion or more"):
        claim()


# --- many criteria, and what "about" means ------------------------------------------------------


def test_every_criterion_has_its_row_and_says_whether_it_is_near_its_bound():
    near = claim(FEW, MANY, name="3a").judge(
        Evidence(8, 7, 9.8, seeds=30),  # 0.2 from 10, width 2.8: near
        Evidence(5, 4, 6, seeds=30),
    )
    exact = IN_ROUNDS.judge(Evidence.exact(1), readings=[[Evidence(1.5, 1.1, 3.1, seeds=9)]])
    missed = claim(FEW, name="3b").judge(Evidence(14, 10.5, 13.5 + 2, seeds=30))  # a tenth: near
    found = criteria([near, exact, missed])
    assert found["near"].tolist() == [True, False, False, True, True]
    assert found["answer"].tolist() == ["yes", "yes", "yes", "no", "no"]
    assert found["label"].iloc[3] == "1c (iteration as sweep), criterion 1"
    assert found["bound"].tolist() == [10, 1, 1, 1, 10]


def test_no_end_is_not_near_and_what_readings_share_is_one_criterion():
    assert not criteria([claim(FEW).judge(Evidence.none())])["near"].any()
    shared = replace(IN_ROUNDS, readings=(Reading("iteration as sweep", IN_ROUNDS.criteria),))
    same, other = Evidence.exact(1), Evidence.exact(2)
    assert len(criteria([shared.judge(same, readings=[[same]])])) == 1
    assert len(criteria([shared.judge(same, readings=[[other]])])) == 2
    spread = Evidence(1, 0, 3, seeds=30)
    assert what_it_would_take([shared.judge(spread, readings=[[spread]])]).count("criterion") == 1


ABOUT = claim(Criterion("75 to 125", 75, 125), Criterion("the same of some", 75, 125), name="3a")


def test_what_about_means():
    finding = ABOUT.judge(Evidence(115, 80, 120, seeds=5), Evidence(115, 114, 116, seeds=4))
    table = sensitivity(finding, 100, [80, 85, 115, 125, math.inf])
    assert table["share"].tolist() == [0.4, 0.8, 0.8]
    assert table["verdict"].tolist() == ["cannot tell", "holds", "holds"]
    assert table["claim"].tolist() == ["3a"] * 3
    assert table[["low", "high"]].to_numpy().tolist() == [[85, 115], [75, 125], [65, 135]]
    assert table["verdict"].iloc[1] == finding.verdict
    assert sensitivity(finding, -100, [-90])["share"].tolist() == [1, 1, 1]
    with pytest.raises(ValueError, match="values must be without NaN"):
        sensitivity(finding, 100, [math.nan])
    with pytest.raises(ValueError, match="about must be"):
        sensitivity(finding, math.nan, [1])


def test_the_table_says_what_becomes_of_a_verdict_where_about_means_more(tmp_path):
    finding = ABOUT.judge(Evidence(115, 80, 120, seeds=5), Evidence(115, 114, 116, seeds=4))
    other = claim(FEW, name="3b").judge(Evidence.exact(7))
    record([finding, other], tmp_path, chapter="3", about=sensitivity(finding, 100, [80, 85]))
    record([claim(FEW, name="4a").judge(Evidence.exact(7))], tmp_path, chapter="4")
    table = pd.read_csv(tmp_path / "claims.csv", keep_default_na=False)
    assert table["about"].tolist() == ["15%: cannot tell; 25%: holds; 35%: holds", "", ""]
    assert len(pd.read_csv(tmp_path / "about.csv")) == 3
    assert pd.read_csv(tmp_path / "criteria.csv")["label"].tolist() == [
        *("3a, criterion 1", "3a, criterion 2", "3b, criterion 1", "4a, criterion 1"),
    ]


@pytest.mark.parametrize("name", ["../evil", "a/b", "", ".", "..", "/tmp/evil", "a\\b", "1\n"])
def test_names_are_never_paths(tmp_path, name):
    folder = tmp_path / "results"
    with pytest.raises(ValueError, match="chapter must be a name of letters, digits"):
        record([claim(FEW).judge(Evidence.exact(1))], folder, chapter=name)
    assert list(tmp_path.iterdir()) == []


def test_numbers_are_written_with_three_digits():
    assert [number(x) for x in (999.4, 999.5, -0.0, 0.0514)] == ["999", "1,000", "0", "0.0514"]


def test_large_numbers_are_written_out():
    finding = claim(MANY).judge(Evidence(1234, -math.inf, math.inf, seeds=30))
    assert details([finding])["measured"].tolist() == ["1,234 [−∞, ∞]"]


def test_no_claim_is_judged_twice(tmp_path):
    finding = claim(FEW).judge(Evidence.exact(7))
    record([finding], tmp_path, chapter="1")
    with pytest.raises(ValueError, match=r"findings must be .* only once, got '1a'"):
        record([finding], tmp_path, chapter="2")
    assert len(pd.read_csv(tmp_path / "claims.csv")) == 1
