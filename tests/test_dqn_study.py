"""Chapter 4's own measures, by hand."""

import dqn_study as study
import numpy as np
import pandas as pd
import pytest


def episodes(steps, terminated):
    table = pd.DataFrame({"steps": steps, "terminated": terminated})
    return table.assign(env_steps=table["steps"].cumsum())


def test_steps_a_goal_by_hand():
    """A budget of 25,000 steps: its last quarter begins at 18,750."""
    rows = episodes([5_000, 10_000, 5_000, 4_000, 1_000], [True, True, True, False, True])
    assert study.steps_a_goal(rows, "Acrobot") == 6_250 / 2
    assert study.steps_a_goal(rows, "Acrobot", 0.0, 0.5) == 12_500
    assert study.steps_a_goal(rows, "Acrobot", 0.0, 1.0) == 25_000 / 4
    nothing = episodes([25_000], [False])
    assert study.steps_a_goal(nothing, "Acrobot") == np.inf


def test_every_arm_on_a_cause_has_the_same_budget_batch_and_start():
    for name in study.ENV:
        of_env = [arm for arm in study.arms() if arm.name.startswith(name)]
        causes = [arm for arm in of_env if not arm.name.endswith("as reported")]
        assert {arm.config.max_env_steps for arm in causes} == {study.BUDGET[name]}
        assert {arm.config.batch_size for arm in causes} == {32}
        assert {arm.config.learning_starts for arm in causes} == {study.MEMORY[name]}
        original = [arm for arm in causes if "original" in arm.name]
        assert all(arm.config.shaping is None for arm in original)


def test_each_cause_is_one_change_and_all_four_are_all():
    base = vars(study.mended("MountainCar", ()))
    for rival in study.RIVALS:
        changed = vars(study.mended("MountainCar", (rival,)))
        different = {name for name in base if base[name] != changed[name]}
        allowed = {"exploration": {"epsilon", "persistence"}}
        assert different == allowed.get(rival, different)
        assert len(different) == len(allowed.get(rival, "1"))
    assert len(study.causes()) == 2 + 2 * len(study.RIVALS)


def test_the_criteria_cover_the_claims_of_section_3_2():
    assert [claim.id for claim in study.CLAIMS] == ["3f", "3g", "3h", "3i", "3j", "3k", "3l"]
    with pytest.raises(ValueError, match="criteria"):
        study.CLAIMS[0].judge()
