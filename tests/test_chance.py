"""What is said of chance and of amendments, on made-up tables of claims."""

import numpy as np
import pandas as pd

from report.amendments import AMENDMENTS, told
from report.chance import chance
from report.claims import Claim, Criterion, Evidence, criteria

FAST = Criterion("fast", above=0.5)


def found(*intervals):
    claim = Claim("9a", "9", "Fast.", (FAST,) * len(intervals), "Figure 9")
    pieces = [Evidence(*interval, seeds=30) for interval in intervals]
    return chance(criteria([claim.judge(*pieces)]))


def test_chance_is_counted_over_all_criteria():
    missed = (0.4, 0.3, 0.49), (0.3, 0.1, 0.4)
    counted = found((0.7, 0.55, 0.9), (0.7, 0.51, 0.9), *missed, (0.9, 0.8, 0.95))
    assert (counted.criteria, counted.random, counted.failed) == (5, 5, 2)
    assert counted.by_chance == 5 / 20
    assert counted.near["criterion"].tolist() == ["9a, criterion 2: fast", "9a, criterion 3: fast"]
    assert counted.near["measured"].tolist() == ["0.7 [0.51, 0.9]", "0.4 [0.3, 0.49]"]
    assert counted.near["met"].tolist() == ["yes", "no"]


def test_what_is_not_random_and_what_has_no_end_is_not_near():
    counted = found((0.5, 0.5, 0.5), (0.7, 0.5, np.inf))
    assert (counted.criteria, counted.random, len(counted.near)) == (2, 1, 0)


def test_amendments_are_of_claims_of_the_report():
    known = set(pd.read_csv("book/data/claims.csv", dtype=str)["id"])
    known |= {"all", "sentences of chapter 3", "sentences of chapter 4"}
    for row in told(AMENDMENTS):
        first, *last = row["claim"].replace(", ", " to ").split(" to ")
        assert {first, *last} <= known
        assert row["data known"] in ("yes", "no")
        assert all(row.values())
