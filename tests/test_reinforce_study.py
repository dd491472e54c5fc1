"""Chapter 3's measures, on made-up curves with known answers: no failure is left out."""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from studies import reinforce as study


def table(steps, arms=study.arms, seeds=study.SEEDS):
    """Episodes of every arm, each seed with the same steps in every episode; 0: stops half-way."""
    episodes = study.EPISODES
    rows = []
    for arm in arms():
        for seed in seeds:
            constant = steps(arm.name, seed)
            length = episodes if constant else episodes // 2
            rows.append(
                pd.DataFrame(
                    {
                        "arm": arm.name,
                        "seed": seed,
                        "episode": np.arange(1, length + 1),
                        "steps": constant or 300,
                        "terminated": True,
                    }
                )
            )
    made = pd.concat(rows, ignore_index=True)
    made["env_steps"] = made.groupby(["arm", "seed"])["steps"].cumsum()
    return made


def fresh_table(steps):
    return table(steps, study.trials, study.FRESH)


def near_table(steps):
    return table(steps, lambda: [study.arm("Acrobot", "as reported")], study.NEAR_A_BOUND)


def judge(first, fresh, near):
    """The findings of constant curves by claim."""
    findings = study.findings(
        study.Curves(table(first)),
        study.Curves(fresh_table(fresh), study.FRESH),
        study.Curves(near_table(near), study.NEAR_A_BOUND),
    )
    return {finding.claim.id: finding for finding in findings}


def test_no_seed_is_left_out_and_fresh_claims_see_fresh_seeds():
    """Where half of the wide layers' seeds never get there, half of the pairs cannot be as good."""
    wide, narrow = (f"MountainCar, one layer of {units}" for units in (128, 10))
    failing = len(study.FRESH) // 2

    def fresh(arm, seed):
        if arm == wide and seed < study.FRESH[0] + failing:
            return 0
        return 111 if arm == narrow else 100

    found = judge(lambda arm, seed: 4_000, fresh, lambda arm, seed: 100)
    assert found["3d"].answers[0] == "no"  # a tenth more is as well as two, eleven hundredths not
    other = found["3d"].others[0]
    assert other.claim.reading == "one layer of 128 units"
    assert other.evidence[0].estimate == 1 - failing / len(study.FRESH)
    assert other.evidence[0].seeds == len(study.FRESH)
    assert found["3a"].verdict == "holds"
    assert {piece.seeds for piece in found["3a"].evidence} == {len(study.NEAR_A_BOUND)}
    assert min(study.NEAR_A_BOUND) == min(study.FRESH) == 100
    assert found["3c"].evidence[1].seeds == 0
    assert found["3c"].answers == ("no", "open")
    curves = study.Curves(fresh_table(fresh), study.FRESH)
    assert curves.stopped_well(wide).sum() == failing
    assert curves.lost(wide).sum() == failing
    assert not curves.stopped_well(narrow).any()
    assert not curves.lost(narrow).any()


def test_the_questions_are_answered_by_what_the_arms_did():
    """One arm runs away at once, one never gets to 500 steps."""

    def fresh(arm, seed):
        steps = {"raw returns, one epoch": 600_000, "one epoch": 900}
        return steps.get(arm.removeprefix("MountainCar, "), 100)

    found = study.answers(study.Curves(fresh_table(fresh), study.FRESH))
    assert [piece.estimate for piece in found] == [1, 0, 0, 1]
    assert len(study.QUESTIONS) == len(found)


def test_seeds_are_compared_with_themselves():
    episodes = table(lambda arm, seed: 100 + seed + 20 * ("gamma" in arm))
    shown = study.milestones(episodes, study.Curves(episodes))
    column = shown.set_index("arm")[study.PAIRED]
    assert column["Acrobot, as reported"] == ""
    assert column["Acrobot, gamma 0.9"] == "20 [20, 20]"
    assert column["MountainCar, raw returns"] == "0 [0, 0]"


def test_what_is_seen_of_the_cars_is_all_there_is():
    assert study.sees_all("MountainCar-v0", steps=200) < 1e-6


def test_engines_part_where_their_steps_first_differ():
    def parting(*steps):
        rows = [
            pd.DataFrame({"arm": arm, "episode": np.arange(1, 4), "steps": of})
            for arm, of in zip(("compiled", "torch"), steps, strict=True)
        ]
        return study.parting(SimpleNamespace(table=pd.concat(rows)))

    assert parting([5, 6, 7], [5, 8, 7]) == 2
    assert parting([5, 6, 7], [5, 6, 7]) == 3


def ending(*steps):
    """Curves that end at given steps."""
    ends = np.array(steps)
    return SimpleNamespace(at=lambda arm, episode: ends, learned=lambda arm: ends <= study.LEARNED)


def test_seeds_to_show_are_chosen_by_rule():
    shown = study.shown_seeds(ending(300, np.inf, 100, 200, np.inf), "")
    assert shown == {"best": 2, "middle": 0, "worst that learned": 0, "failed": 1}
    assert study.shown_seeds(ending(9, 5), "") == {
        "best": 1,
        "middle": 1,
        "worst that learned": 0,
    }
    assert study.shown_seeds(ending(np.inf, np.inf), "")["failed"] == 0


def test_every_seed_has_one_fate_and_its_budget():
    arm, steps = "Acrobot, as reported", np.array([100.0, 900.0, np.nan, np.nan])
    curves = SimpleNamespace(
        seeds=range(4),
        smooth={arm: steps[:, None]},
        learned=lambda arm: steps <= study.LEARNED,
        stopped_well=lambda arm: np.array([False, False, True, False]),
        at=lambda arm, episode: np.where(np.isnan(steps), np.inf, steps),
    )
    rows = pd.DataFrame({"arm": arm, "seed": [0, 0, 1, 2, 3], "env_steps": [5, 9, 8, 7, 6]})
    other = rows.assign(arm="another", env_steps=99)
    found = study.fates(curves, pd.concat([rows, other]), arm)
    out = ["out of budget while doing well", "out of budget"]
    assert found["fate"].tolist() == ["learned", "not learned", *out]
    assert found["env_steps"].tolist() == [9, 8, 7, 6]
    assert found["steps_at_end"].isna().tolist() == [False, False, True, True]
