"""What the studies share, by hand."""

import numpy as np
import pandas as pd
import pytest

from studies import shared


def generator():
    return np.random.default_rng(0)


def test_of_no_seeds_nothing_is_known():
    nothing = np.array([])
    known = shared.median_evidence(nothing, generator())
    assert (known.low, known.high, known.seeds) == (-np.inf, np.inf, 0)
    known = shared.lower_evidence(np.ones(3), nothing, generator())
    assert (known.low, known.high, known.seeds) == (0, 1, 0)


def test_a_comparison_has_the_seeds_of_the_smaller_group():
    known = shared.lower_evidence(np.zeros(3), np.ones(5), generator())
    assert (known.estimate, known.seeds) == (1, 3)
    assert shared.median_evidence(np.arange(5.0), generator()).estimate == 2


@pytest.mark.parametrize(
    ("steps", "place"), [([9, 5, 7], 2), ([9, 5, 7, np.inf], 2), ([1, 1, 1], 1), ([np.inf], 0)]
)
def test_the_place_in_the_middle(steps, place):
    assert shared.middle(np.array(steps)) == place


def test_the_processor_s_time_counts_of_the_named_arms():
    made = pd.DataFrame({"arm": ["a", "a", "b"], "processor": "p", "seconds": 99.0})
    made["processor_seconds"] = [1.0, 3.0, 9.0]
    results = type("Results", (), {"provenance": made})
    table = shared.seconds(results, {"a": ("one seed of a", 60.0)})
    assert table.to_numpy().tolist() == [["one seed of a", 60.0, 2.0, 4.0, "p"]]


@pytest.mark.parametrize(
    ("interval", "text"),
    [((-3.0, -np.inf, 4.0), "−3 [−∞, 4]"), ((1234.5, 0.4, np.inf), "1,234 [0, ∞]")],
)
def test_intervals_have_signs(interval, text):
    assert shared.interval_text(interval) == text
