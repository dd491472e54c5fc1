"""Chapter 6 on other seeds: the table on angles, and what decides 3n."""

import numpy as np
import pandas as pd

from rl_core.worlds.discretise import gridded
from rl_core.worlds.twins import TASKS
from studies import evaluation as first
from studies import evaluation_fresh as study
from studies.acrobot_angles import AcrobotAngles


def test_the_angles_are_those_of_the_acrobot_whose_sines_are_shown():
    angles, shown = AcrobotAngles.kernel(), TASKS["Acrobot-v1"].kernel()
    seen, six = np.zeros(4, np.float32), np.zeros(6, np.float32)
    rngs = [np.random.default_rng(0) for _ in range(2)]
    angles.start(rngs[0], angles.state, seen)
    shown.start(rngs[1], shown.state, six)
    for action in np.random.default_rng(1).integers(3, size=200).astype(np.float32):
        assert angles.step(angles.state, action[None]) == shown.step(shown.state, action[None])
        angles.observe(angles.state, seen)
        shown.observe(shown.state, six)
        both = np.ravel([np.cos(seen[:2]), np.sin(seen[:2])], order="F")
        np.testing.assert_allclose(six[:4], both, atol=1e-6)
        np.testing.assert_array_equal(seen[2:], six[4:])
    assert gridded(study.ANGLES, study.ANGLE_BINS).shape == (6**4, 3)


def made_up(of_cars, angles):
    """Networks of 100 steps, tables of 120, and fresh seeds as told."""
    names = [f"{name}, table, {first.BEST_BINS} bins" for name in study.CARS]
    fresh = dict(zip(names, of_cars, strict=True))
    fresh |= {"Acrobot, table of angles": angles, "Acrobot, as reported": np.full(30, 100.0)}
    rows = []
    for name in first.ENV:
        table = f"table, {first.chosen_bins(name)} bins"
        for agent, acting, steps in (("REINFORCE", "as learned", 100), (table, "greedy", 120)):
            key = dict(zip(first.KEY, (name, agent, "no limit", acting), strict=True))
            rows += [{**key, "seed": seed, "steps": steps, "return": -steps} for seed in range(3)]
    return pd.DataFrame(rows), fresh


def test_fresh_seeds_decide_where_the_first_were_near_the_bound(monkeypatch):
    monkeypatch.setattr(first, "judged_times", lambda times: None)
    monkeypatch.setattr(first, "agreement", lambda *_: first.Evidence.exact(1.0))
    shares = [np.repeat([100.0, 900.0], count) for count in ((95, 5), (50, 50))]
    policies, fresh = made_up(shares, np.full(30, 200.0))
    found = first.findings(policies, None, fresh)[1]
    assert found.answers == ("yes", "yes", "yes", "yes", "no")
    assert [piece.seeds for piece in found.evidence[3:]] == [100, 100]
    (other,) = found.others
    assert other.answers == ("yes", "yes", "no", "yes", "no")  # twice the network's steps
    assert other.evidence[2].estimate == 2


def test_the_seeds_are_fresh():
    assert min(study.NEAR_A_BOUND) == 100
    assert set(study.OF_ANGLES) < set(study.NEAR_A_BOUND) - set(range(100, 103))
