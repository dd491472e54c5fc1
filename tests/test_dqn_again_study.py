"""Chapter 4's second round: its arms, its criteria, and the shaping by potentials."""

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest

from report.claims import Evidence
from studies import dqn as first
from studies import dqn_again as study
from studies.potential import GAMMA, potential


def test_the_potential_is_a_difference_but_for_the_wall():
    """What is added is gamma Phi(s') - Phi(s), Phi being 0 at the goal; at the wall it is near."""
    env = gym.make("MountainCar-v0").unwrapped
    rng = np.random.default_rng(0)
    before, _ = env.reset(seed=0)
    arrived, walls = False, 0
    while not arrived:  # with the velocity, and now and then anyhow
        action = int(rng.integers(3)) if rng.random() < 0.2 else 2 * int(before[1] > 0)
        after, reward, arrived, *_ = env.step(action)
        difference = GAMMA * (0.0 if arrived else abs(after[0] + 0.5)) - abs(before[0] + 0.5)
        hit = after[0] == np.float32(-1.2)
        walls += hit
        added = potential(after, reward) - reward
        assert added == pytest.approx(difference, abs=0.07 if hit else 1e-6)
        before = after
    assert walls > 0


def test_the_fresh_seeds_are_not_those_of_the_first_round():
    assert set(study.FRESH).isdisjoint(range(100))
    assert first.reported("MountainCar").gamma == GAMMA


def test_each_arm_of_the_second_round_differs_by_what_its_name_says():
    configs = {arm.name: vars(arm.config) for arm in study.arms()}
    all_four = vars(first.mended("MountainCar", first.RIVALS))
    biases = vars(first.mended("MountainCar", ("biases",)))
    for name, base, changed in (
        (study.LONG, biases, {"max_env_steps"}),
        (study.NO_PERSISTENCE, all_four, {"persistence"}),
        (study.NO_SCHEDULE, all_four, {"epsilon"}),
        (study.SHAPED_MENDED, all_four, {"shaping"}),
        (study.POTENTIAL_MENDED, all_four, {"shaping"}),
    ):
        assert {key for key in base if base[key] != configs[name][key]} == changed
    assert set(study.CRITERIA) < set(configs)


class Made:
    """Results of a second round in which every episode of an arm takes as long."""

    def __init__(self, steps):
        tables = []
        for arm in study.arms():
            count = arm.config.max_env_steps // steps
            rows = pd.DataFrame({"steps": [steps] * count}).assign(arm=arm.name, terminated=True)
            rows["env_steps"] = rows["steps"].cumsum()
            tables += [rows.assign(seed=seed) for seed in study.FRESH]
        self.table = pd.concat(tables)


@pytest.mark.parametrize(("steps", "arrived", "met"), [(300, True, "yes"), (600, False, "no")])
def test_a_criterion_is_met_by_the_share_of_seeds(monkeypatch, steps, arrived, met):
    monkeypatch.setattr(study, "FRESH", tuple(range(100, 130)))
    monkeypatch.setattr(study, "arrives", lambda results, arm: np.full(30, arrived))
    rows = study.judged(Made(steps)).set_index("arm")
    assert rows.loc[study.NO_SCHEDULE, "met"] == met
    assert rows.loc[study.POTENTIAL_MENDED, "met"] == met
    assert rows.loc[study.LONG, "met"] == {"yes": "no", "no": "yes"}[met]
    assert rows.loc[study.LONG, "share"] == float(arrived)


@pytest.mark.parametrize(
    ("arm", "share", "word"),
    [
        (study.LONG, 0.9, "time"),
        (study.NO_PERSISTENCE, 0.7, "Persistence"),
        (study.NO_SCHEDULE, 0.1, "Persistence"),
        (study.SHAPED_MENDED, 0.6, "flag"),
        (study.POTENTIAL_MENDED, 0.2, "Potentials"),
    ],
)
def test_each_sentence_on_the_second_round_falls_with_its_arm(arm, share, word):
    shares = dict(zip(study.CRITERIA, (0.1, 0.2, 1.0, 0.1, 0.8), strict=True))
    bearing = pd.DataFrame({"arm": list(shares), "share": shares.values(), "met": "yes"})
    assert all(study.premises(bearing).values())
    changed = bearing.set_index("arm")
    met = study.CRITERIA[arm].answer(Evidence(share, share, share, seeds=30))
    changed.loc[arm, ["share", "met"]] = share, met
    held = study.premises(changed.reset_index())
    assert [sentence for sentence, holds in held.items() if not holds] == [
        sentence for sentence in held if word in sentence
    ]
