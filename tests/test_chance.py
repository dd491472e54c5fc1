"""What is said of chance and of amendments, on made-up tables of claims."""

import numpy as np
import pandas as pd

from report.amendments import AMENDMENTS, told
from report.chance import chance


def claims(*rows):
    names = ("criterion", "estimate", "low", "high", "bound")
    found = [dict(zip(names, row, strict=True)) for row in rows]
    return pd.DataFrame(
        {
            "id": f"9{i}",
            "criterion": row["criterion"],
            "deciding_criterion": row["criterion"].split("; ")[-1],
            **{f"deciding_{name}": row[name] for name in names[1:]},
        }
        for i, row in enumerate(found)
    )


def test_the_near_are_those_whose_interval_ends_within_a_tenth_of_its_width():
    """Ends at 1 and 2: a tenth of the width is 0.1, on either side of either end."""
    bounds = (0.95, 1.05, 1.5, 1.95, 2.05, 0.85, 2.15)
    found = chance(claims(*(("few; fast", 1.4, 1.0, 2.0, bound) for bound in bounds)))
    assert found.near["claim"].tolist() == ["90", "91", "93", "94"]
    assert (found.criteria, found.claims, found.random) == (14, 7, 7)
    assert found.by_chance == 7 / 20


def test_what_is_not_random_and_what_has_no_end_is_not_near():
    found = chance(claims(("few", 1, 1, 1, 1), ("slow", 5, 4, np.inf, 4)))
    assert (found.criteria, found.random, len(found.near)) == (2, 1, 0)


def test_amendments_are_of_claims_of_the_report():
    known = set(pd.read_csv("book/data/claims.csv", dtype=str)["id"])
    known |= {"all", "sentences of chapter 4"}
    for row in told(AMENDMENTS):
        first, *last = row["claim"].replace(", ", " to ").split(" to ")
        assert {first, *last} <= known
        assert row["data known"] in ("yes", "no")
        assert all(row.values())
