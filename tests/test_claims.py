"""Verdicts follow from intervals alone."""

import math

import pandas as pd
import pytest

from report.claims import (
    COLUMNS,
    Claim,
    Criterion,
    Evidence,
    details,
    record,
    seeds_to_tell,
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
        (0.3, 0.5, "no"),
        (0.5, 0.5, "no"),
        (0.4, 0.6, "open"),
    ],
)
def test_above_does_not_include_its_bound(low, high, answer):
    criterion = Criterion("above a half", above=0.5)
    assert criterion.answer(Evidence(low, low, high, seeds=30)) == answer


def test_a_criterion_is_one_sentence():
    with pytest.raises(ValueError, match=r"text must be without '; '.*got 'a; b'"):
        Criterion("a; b")


def test_every_criterion_needs_its_evidence():
    with pytest.raises(ValueError, match="claim 1a has 2 criteria, not 1"):
        claim(FEW, MANY).judge(Evidence.exact(1))


def test_impossible_intervals_are_refused():
    with pytest.raises(ValueError, match="low <= estimate <= high, not 2, 1, 3"):
        Evidence(1, 2, 3, seeds=30)
    with pytest.raises(ValueError, match="low <= estimate"):
        Evidence(float("nan"), 2, 3, seeds=30)


def test_the_table_gathers_the_chapters_in_order(tmp_path):
    second = claim(FEW, name="2a").judge(Evidence(4, 3, 5, seeds=30))
    first = claim(FEW, MANY).judge(Evidence.exact(7), Evidence.exact(2))
    record([second], tmp_path, chapter="2")
    record([first], tmp_path, chapter="1")
    rows = record([first], tmp_path, chapter="1")
    table = pd.read_csv(tmp_path / "claims.csv")
    assert list(table.columns) == list(COLUMNS)
    assert table["id"].tolist() == ["1a", "2a"]
    assert table.loc[0, "criterion"] == "at most 10; at least 1"
    assert table.loc[1, ["estimate", "low", "high", "seeds"]].tolist() == [4, 3, 5, 30]
    assert rows["verdict"].tolist() == ["holds"]
    assert details([first])["met"].tolist() == ["yes", "yes"]
    assert details([second])["measured"].tolist() == ["4 [3, 5]"]
    assert verdicts([first, second])["verdict"].tolist() == ["holds", "holds"]


@pytest.mark.parametrize(
    ("criterion", "evidence", "seeds"),
    [
        (FEW, Evidence(8, 6, 12, seeds=30), 70),
        (FEW, Evidence(10, 6, 12, seeds=4), math.inf),  # the estimate is the bound
        (FEW, Evidence(8, 6, math.inf, seeds=30), math.inf),
        (FEW, Evidence.none(), math.inf),
        (Criterion("above a half", above=0.5), Evidence(0.75, 0.5, 1, seeds=30), 30),
        (Criterion("75 to 125", 75, 125), Evidence(120, 110, 130, seeds=30), 120),
    ],
)
def test_seeds_that_it_would_take(criterion, evidence, seeds):
    assert criterion.answer(evidence) == "open"
    assert seeds_to_tell(criterion, evidence) == seeds


def test_only_what_is_open_is_said_to_need_more_seeds():
    finding = claim(FEW, MANY).judge(Evidence(10, 6, 12, seeds=4), Evidence(4, 3, 5, seeds=30))
    assert what_it_would_take([finding]) == "1a, criterion 1: no number"


def criterion_finding(criterion, *interval, seeds=30):
    claim = Claim("1a", "1.1", "Something is so.", (criterion,), "Figure 1")
    return claim.judge(Evidence(*interval, seeds=seeds))


@pytest.mark.parametrize(
    ("criterion", "interval", "answer"),
    [
        (Criterion("above a half", above=0.5), (0.625, 0.375, 0.875), "1a, criterion 1: 120"),
        (Criterion("an eighth", at_least=0.125), (0.25, 0.0, 0.5), "1a, criterion 1: 120"),
        (Criterion("at most", at_most=0.25), (0.125, 0.0, 0.5), "1a, criterion 1: 120"),
        (Criterion("both", 60, 100), (75, 50, 110), "1a, criterion 1: 120"),  # not the 50 of 100
        (Criterion("the bound", above=0.5), (0.5, 0.4, 0.6), "1a, criterion 1: no number"),
        (Criterion("no end", at_most=9), (math.inf, 5, math.inf), "1a, criterion 1: no number"),
        (Criterion("settled", above=0.5), (0.7, 0.6, 0.8), "none is open"),
    ],
)
def test_what_it_would_take_by_hand(criterion, interval, answer):
    """30 seeds, and a half width twice the distance to the bound: 30 times 2 squared."""
    assert what_it_would_take([criterion_finding(criterion, *interval)]) == answer


def test_no_seeds_give_no_number():
    nothing = criterion_finding(Criterion("above a half", above=0.5), 0.5, 0.0, 1.0, seeds=0)
    assert what_it_would_take([nothing]) == "1a, criterion 1: no number"


def test_large_numbers_are_written_out():
    finding = claim(MANY).judge(Evidence(1234, -math.inf, math.inf, seeds=30))
    assert details([finding])["measured"].tolist() == ["1,234 [−∞, ∞]"]


def test_no_claim_is_judged_twice(tmp_path):
    finding = claim(FEW).judge(Evidence.exact(7))
    record([finding], tmp_path, chapter="1")
    with pytest.raises(ValueError, match="judged more than once: 1a"):
        record([finding], tmp_path, chapter="2")
    assert len(pd.read_csv(tmp_path / "claims.csv")) == 1
