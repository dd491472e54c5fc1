"""Chapter 5's measures on made-up runs whose answers are known."""

import numpy as np
import pandas as pd
import pytest

from drawings import continuous as drawings
from rl_core.policies import MLP, Gaussian
from rl_core.reinforce import ReinforceConfig
from studies import continuous as study
from studies import continuous_causes as causes
from studies import continuous_fates as what_became
from studies.policy_maps import mean_actions

EPISODES = 600
SIGMA = 0.3


def seed_rows(arm, seed, steps, terminated, mean=0.0):
    """Rows of one seed whose every force costs 0.1 (mean^2 + sigma^2)."""
    steps, terminated = np.asarray(steps), np.asarray(terminated)
    rows = pd.DataFrame({"arm": arm, "seed": seed, "steps": steps, "terminated": terminated})
    rows["episode"] = np.arange(1, len(steps) + 1)
    rows["return"] = 100.0 * terminated - 0.1 * (mean**2 + SIGMA**2) * steps
    return rows


def made_up(arm, level=200):
    """Five seeds: good, slow, never out, out and idle, out and pressing."""
    capped = [True, False, False]
    return pd.concat(
        [
            seed_rows(arm, 0, np.full(EPISODES, level), np.full(EPISODES, True)),
            seed_rows(arm, 1, np.full(EPISODES, 900), np.full(EPISODES, True)),
            seed_rows(arm, 2, [500_000, 500_000], [False, False]),
            seed_rows(arm, 3, [7_000, 500_000, 500_000], capped, mean=0.1),
            seed_rows(arm, 4, [7_000, 500_000, 500_000], capped, mean=3.0),
        ]
    )


@pytest.fixture(autouse=True)
def short(monkeypatch):
    monkeypatch.setattr(study, "EPISODES", EPISODES)
    monkeypatch.setattr(drawings, "EPISODES", EPISODES)
    monkeypatch.setattr(study, "SNAPSHOTS", (100,))
    for module in (study, what_became, drawings):
        monkeypatch.setattr(module, "SEEDS", range(5))


def curves_of(*tables):
    return study.Curves(pd.concat(tables))


def test_fates_by_hand():
    curves = curves_of(made_up("as reported"))
    log_sigma = np.full((5, 1), np.log(SIGMA))
    assert tuple(what_became.fates(curves, "as reported", log_sigma)) == what_became.FATES


def test_the_force_of_pressing_seeds_by_hand():
    curves = curves_of(made_up("as reported"))
    log_sigma = np.full((5, 1), np.log(SIGMA))
    assert what_became.pressing_forces(curves, "as reported", log_sigma) == pytest.approx([3.0])


CUT = [*[True] * 400, False]


@pytest.mark.parametrize(
    ("steps", "terminated", "fate"),
    [
        ([*[200] * 400, 50], CUT, "well"),
        ([500_000, *[200] * 400, 50], [False, *CUT], "well"),  # it recovered
        ([*[900] * 400, 50], CUT, "slow or late"),
        ([500_000, *[900] * 400, 50], [False, *CUT], "slow or late"),
        ([*[200] * 400, 500_000, 50], [*CUT, False], "out, then idle"),  # stuck, then cut
        ([*[200] * 400, 300_000], CUT, "out, then idle"),  # stuck in the episode that is cut
    ],
)
def test_a_seed_cut_by_its_budget_has_not_learned(steps, terminated, fate):
    rows = made_up("as reported")
    first = seed_rows("as reported", 0, steps, terminated)
    curves = curves_of(first, rows[rows["seed"] > 0])
    found = what_became.fates(curves, "as reported", np.full((5, 1), np.log(SIGMA)))
    assert found[0] == ("slow or late" if fate == "well" else fate)
    assert not curves.learned("as reported").any()
    assert curves.cut("as reported").tolist() == [fate != "out, then idle", *[False] * 4]
    assert curves.stopped_well("as reported").tolist() == [fate == "well", *[False] * 4]
    assert np.isinf(curves.at("as reported")[0])
    assert np.isneginf(curves.final_return("as reported")[0])


def test_curves_of_other_seeds():
    rows = made_up("as reported")
    fresh = study.Curves(rows.assign(seed=rows["seed"] + 100), range(100, 105))
    own = study.Curves(rows)
    for measure in ("learned", "at", "early", "spread"):
        np.testing.assert_array_equal(
            getattr(fresh, measure)("as reported"), getattr(own, measure)("as reported")
        )


def test_a_range_of_steps_relative_to_their_median():
    steps = np.tile([100, 200, 300, 400], EPISODES // 4)
    first = seed_rows("as reported", 0, steps, np.full(EPISODES, True))
    curves = curves_of(first, made_up("as reported").query("seed > 0"))
    low, middle, high = np.quantile(steps[-500:], [0.25, 0.5, 0.75])
    found = curves.relative_spread("as reported")
    assert found[0] == pytest.approx((high - low) / middle)
    assert np.isinf(found[2:]).all()


@pytest.mark.parametrize(
    ("steps", "terminated", "gone"),
    [
        ([200] * 5, [True] * 5, False),
        ([500_000, 200], [False, True], False),  # slow to begin, and never after
        ([200, 150_000], [True, True], True),
        ([200, 200, 150_000], [True, True, False], True),
        ([200, 50_000], [True, False], False),  # cut by the budget
        ([500_000], [False], False),  # never out
    ],
)
def test_who_is_lost(monkeypatch, steps, terminated, gone):
    monkeypatch.setattr(causes, "FRESH", range(1))
    assert causes.lost(seed_rows("a", 0, steps, terminated)).tolist() == [gone]


def test_one_update_that_loses_no_seed_is_found():
    def arm(name, gone):
        steps = [200, 150_000 if gone else 200]
        return [seed_rows(name, seed, steps, [True, True]) for seed in causes.FRESH]

    class Results:
        table = pd.concat(
            [rows for one in causes.arms() for rows in arm(one.name, "512" in one.name)]
        )

    table = causes.judge(Results)
    assert table["met"].tolist() == ["yes"] * 4
    assert table["lost, batches of 512"].tolist() == [len(causes.FRESH)] * 4
    assert (table["lost, the other"] == 0).all()


def test_a_driver_without_noise_to_speak_of_earns_what_the_flag_pays_less_its_force(monkeypatch):
    monkeypatch.setattr(causes, "SIGMAS", (1e-3,))
    monkeypatch.setattr(causes, "FORCES", (1.0,))
    monkeypatch.setattr(causes, "TRIES", 3)
    earned = causes.drivers()["return"].item()
    assert 85 < earned < 92  # some hundred steps at a tenth each


def test_profiles_and_parting_by_hand():
    curves = curves_of(made_up("as reported"))
    table = causes.profiles(curves, ("as reported",), np.array([100, 200, 1_000]))
    assert table["share"].tolist() == [0, 1 / 5, 2 / 5]
    one, other = pd.DataFrame({"steps": [3, 4, 5]}), pd.DataFrame({"steps": [3, 5]})
    assert causes.parting({"a": one, "b": other}) == 2
    assert causes.parting({"a": one, "b": one}) == 0


def test_measures_by_hand():
    curves = curves_of(made_up("as reported"))
    np.testing.assert_array_equal(curves.learned("as reported"), [True, *[False] * 4])
    at_the_end = [200, 900, np.inf, np.inf, np.inf]
    np.testing.assert_array_equal(curves.at("as reported", EPISODES), at_the_end)
    np.testing.assert_array_equal(curves.early("as reported"), [2000, 9000, *[np.inf] * 3])
    longest = [200, 900, 500_000, 500_000, 500_000]
    np.testing.assert_array_equal(curves.longest_early("as reported"), longest)
    np.testing.assert_array_equal(curves.episodes_to("as reported"), [1, *[np.inf] * 4])
    np.testing.assert_array_equal(curves.spread("as reported"), [0, 0, *[np.inf] * 3])
    assert curves.final_return("as reported")[0] == pytest.approx(100 - 0.1 * SIGMA**2 * 200)
    assert np.isneginf(curves.final_return("as reported")[2:]).all()
    assert study.middle(curves, "as reported") == 0


def all_arms(level):
    return study.Curves(pd.concat([made_up(arm, level(arm)) for arm in study.VARIANTS]))


def test_claims_are_judged_by_the_numbers(monkeypatch):
    monkeypatch.setattr(study, "MILESTONES", (EPISODES,))
    curves = all_arms(lambda arm: 400 if arm == "sigma 1" else 200)
    at = study.Curves.at
    monkeypatch.setattr(
        study.Curves, "at", lambda s, arm, k=None: at(s, arm, min(k or EPISODES, EPISODES))
    )
    found = {finding.claim.id: finding for finding in study.findings(curves, curves)}
    assert list(found) == ["4a", "4b", "4c", "4d", "4e", "4f"]
    assert found["4a"].answers[1] == "yes"
    assert found["4b"].answers == ("open",) * 4
    assert found["4c"].answers[1] == "yes"  # 0.5 converges, 1 does not
    assert found["4e"].answers[1:] == ("yes", "yes")
    assert found["4d"].evidence[2].estimate == 3 / 5
    assert found["4e"].others[0].answers == (found["4e"].answers[0], "yes")  # fewer steps paid for
    assert found["4f"].others[0].answers[1] == found["4f"].answers[1]
    assert found["4c"].others[0].evidence[:2] == found["4c"].evidence[:2]


def test_without_a_seed_that_learned_nothing_is_claimed():
    curves = all_arms(lambda arm: 700)
    nothing = study.lower_evidence(np.empty(0), np.ones(3), np.random.default_rng(0))
    assert (nothing.low, nothing.high, nothing.seeds) == (0.0, 1.0, 0)
    table = study.tradeoff(curves)
    none = table[(table["arm"] == "sigma 1") & (table["measure"] == "steps")].iloc[0]
    assert np.isinf([none["low"], none["high"]]).all()
    assert len(drawings.tradeoff(table).axes) == 6
    original = pd.DataFrame({"episode": [1, 2], "low": [9.0, 8.0], "high": [9.5, 8.5]})
    arms = {"as reported": "two", "three features": "three"}
    assert len(drawings.learning_curves(curves, arms, original).axes) == 2
    assert set(drawings.curve_data(curves, list(arms))["arm"]) == set(arms)


def test_arms_are_the_reports_with_one_thing_changed():
    arms = {arm.name: arm for arm in study.arms()}
    reported = arms["as reported"].config
    assert reported.policy == Gaussian(mean="weights", sigma=0.3)
    assert (reported.network, reported.learning_rate) == (MLP((10, 20), biases=False), 2e-3)
    assert (reported.batch_size, reported.epochs, reported.gamma) == (512, 1, 0.99)
    assert reported.normalise == "centre"
    assert len({repr(arm.config) for arm in arms.values()}) == len(arms)


def test_without_constant_and_biases_the_mean_grows_with_the_square_of_the_state():
    rng = np.random.default_rng(0)
    weights = {
        f"layer{i}.weight": rng.normal(size=shape).astype(np.float32)
        for i, shape in enumerate([(2, 10), (10, 20), (20, 2)])
    }
    weights["log_sigma"] = np.zeros(1, np.float32)
    config = ReinforceConfig(network=MLP(biases=False), policy=Gaussian(mean="weights"))
    states = rng.normal(size=(20, 2))
    small, large = (mean_actions(config, weights, c * states) for c in (1.0, 3.0))
    np.testing.assert_allclose(large, 9 * small, rtol=1e-4, atol=1e-5)
    assert np.abs(small).min() > 0


def test_more_noise_is_out_sooner():
    strong = what_became.noise_alone(1.0, episodes=10, max_steps=50_000)
    weak = what_became.noise_alone(0.3, episodes=5, max_steps=2_000)
    assert np.isfinite(strong).sum() >= 8
    assert np.isinf(weak).all()
