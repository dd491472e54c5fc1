"""The truths that the appendix counts intervals against."""

import numpy as np
import pytest

from studies import calibration as study

MANY = 200_000


def test_the_laws_have_the_truths_that_are_said_of_them():
    rng = np.random.default_rng(0)
    for failing in (0.0, 0.3):
        drawn = study.steps(rng, MANY, failing=failing)
        assert np.median(drawn) == pytest.approx(study.median_of_all(failing), rel=0.01)
        assert np.isinf(drawn).mean() == pytest.approx(failing, abs=0.005)
    fast = study.steps(rng, MANY, faster=0.5)
    lower = (fast < study.steps(rng, MANY)).mean()
    assert lower == pytest.approx(study.chance_to_be_lower(0.5), abs=0.005)


def test_what_is_held_is_counted():
    draws = iter([(0.0, 1.0), (2.0, 3.0), (0.5, 0.5), (0.6, 0.9)])
    assert study.held(0.5, lambda rng: next(draws), seed=0, repeats=4) == 0.5
    assert study.share_held(1, 0.5) == 1.0


def test_every_interval_has_its_row():
    table = study.coverage(repeats=2)
    assert len(table) == len(list(study.cases())) + 4
    assert table["held (%)"].between(0, 100).all()
