"""Chapter 3's measures, on made-up curves with known answers: no failure is left out."""

import numpy as np
import pandas as pd

from studies import reinforce as study


def table(steps):
    """Episodes of every arm, each seed with the same steps in every episode; 0: stops half-way."""
    seeds, episodes = len(study.SEEDS), study.EPISODES
    rows = []
    for arm in study.arms():
        for seed in range(seeds):
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
    return pd.concat(rows, ignore_index=True)


def test_a_seed_out_of_budget_counts_in_the_ratio_of_3d():
    one, two = "MountainCar, one hidden layer", "MountainCar, as reported"
    failing = len(study.SEEDS) // 2 + 1

    def steps(arm, seed):
        return 0 if arm == one and seed < failing else 100

    curves = study.Curves(table(steps))
    evidence = {finding.claim.id: finding.evidence for finding in study.findings(curves)}
    assert evidence["3d"][0].estimate == np.inf
    assert evidence["3d"][0].seeds == len(study.SEEDS)
    assert curves.stopped_well(one).sum() == failing
    assert curves.lost(one).sum() == failing
    assert not curves.stopped_well(two).any()
    assert not curves.lost(two).any()


def test_where_no_seed_learned_there_is_no_evidence():
    findings = study.findings(study.Curves(table(lambda arm, seed: 4_000)))
    three_a = findings[0]
    assert three_a.evidence[1].seeds == 0
    assert three_a.answers == ("no", "open")


def test_seeds_are_compared_with_themselves():
    episodes = table(lambda arm, seed: 100 + seed + 20 * ("gamma" in arm))
    shown = study.milestones(episodes, study.Curves(episodes))
    column = shown.set_index("arm")[study.PAIRED]
    assert column["Acrobot, as reported"] == ""
    assert column["Acrobot, gamma 0.9"] == "20 [20, 20]"
    assert column["MountainCar, raw returns"] == "0 [0, 0]"
