"""The findings of the front page take their numbers from the results, or stop the book."""

import numpy as np
import pandas as pd
import pytest

from report import findings, front_page


def test_what_is_left_of_the_error():
    split = pd.DataFrame(
        {
            "episode": [1, 2, 2],
            "seed": [0, 0, 1],
            "cannot be visited": [9.0, 9.0, 9.0],
            "noise": [99.0, 0.5, 1.5],
        }
    )
    told = findings.unreachable(split).sentence
    assert "gap of <b>3.00</b>" in told
    assert "make up <b>90.0%</b>" in told
    with pytest.raises(AssertionError, match="cannot be visited"):
        findings.unreachable(split.assign(noise=10.0))


def claims(acrobot, mountaincar):
    text = "{}, REINFORCE: about {} steps an episode after 1,000 episodes."
    words = [text.format("Acrobot", 100), text.format("MountainCar", "1,180")]
    table = {"id": ["3a", "3c"], "claim": words, "estimate": [acrobot, mountaincar]}
    return pd.DataFrame(table)


@pytest.fixture
def originals(tmp_path):
    for figure, low in ((10, 90.0), (11, 1_100.0)):
        curve = pd.DataFrame({"episode": [10, 990, 1_010], "low": [7.0, low, low + 4]})
        name = "acrobot" if figure == 10 else "mountaincar"
        curve.assign(high=3 * low).to_csv(tmp_path / f"figure_{figure}_{name}_reinforce.csv")
    return tmp_path


def test_the_reports_numbers_against_its_curves(originals):
    told = findings.edges(claims(150, 1_500), originals).sentence
    assert "about 100 steps on Acrobot, whose curve runs from 92 to 270 there (we: <b>150" in told
    assert "about 1,180 steps on MountainCar, whose curve runs from 1,102 to 3,300" in told
    with pytest.raises(AssertionError, match="Acrobot: the text is at the lower edge"):
        findings.edges(claims(105, 1_500), originals)
    with pytest.raises(AssertionError, match="MountainCar: our median lies within"):
        findings.edges(claims(150, 9_000), originals)


def test_the_discount():
    arms = {"arm": ["MountainCar, as reported", "MountainCar, gamma 0.9"]}
    milestones = pd.DataFrame(arms | {"learned": ["7 of 9", "1 of 9"]})
    goals = pd.DataFrame(
        [
            ("MountainCar", variant, seed, tenth, steps * (1 + 9 * (tenth == 0)))
            for variant, steps in (("shaped", 400.0), ("shaped, gamma 0.9", 200.0))
            for seed in range(3)
            for tenth in (0, 9)
        ],
        columns=["environment", "variant", "seed", "tenth", "steps_a_goal"],
    )
    told = findings.discount(milestones, goals).sentence
    assert "in <b>7 of 9</b> seeds with 0.99 and in <b>1 of 9</b> with 0.9" in told
    assert "<b>200</b> steps a goal at the end, against 400" in told
    with pytest.raises(AssertionError, match="more seeds learn"):
        findings.discount(milestones.assign(learned=["1 of 9", "1 of 9"]), goals)
    with pytest.raises(AssertionError, match="DQN does better"):
        findings.discount(milestones, goals.assign(steps_a_goal=np.inf))


def test_the_causes():
    shares = {
        "shaped": 1.0,
        "original": 0.1,
        "original, biases": 0.2,
        "original, long memory": 0.05,
        "original, all but biases": 0.9,
        "original, no replay": 0.95,
        "original, all four": 0.8,
    }
    table = pd.DataFrame({"variant": shares.keys(), "share": shares.values()})
    table = pd.concat([table.assign(environment="MountainCar"), table.assign(environment="other")])
    told = findings.causes(table).sentence
    assert "<b>80%</b> of the seeds learn, 10% without, and with one of them at most <b>20%" in told
    with pytest.raises(AssertionError, match="more than any one"):
        findings.causes(table.assign(share=0.5))


def test_noise():
    numbers = {"as reported": (0.4, 91.0), "sigma 1": (0.9, 63.0), "other": (0.1, 1.0)}
    table = pd.DataFrame(
        [
            (arm, measure, value)
            for arm, pair in numbers.items()
            for measure, value in zip(("learned", "return"), pair, strict=True)
        ],
        columns=["arm", "measure", "estimate"],
    )
    told = findings.noise(table).sentence
    assert "<b>90%</b> of the seeds instead of 40%" in told
    assert "return: <b>63</b> instead of 91" in told
    with pytest.raises(AssertionError, match="teaches more"):
        findings.noise(table.assign(estimate=1.0))


def test_a_finding_leads_to_its_figure():
    page = front_page.findings_list([findings.Told("So it is.", "Figure S2.1")])
    assert page == (
        '<ol class="findings"><li>So it is. '
        '<a href="02_q_learning.html#figure-s2-1">Figure S2.1</a></li></ol>'
    )
