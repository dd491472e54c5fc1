"""The measurements of the benchmarks that the book and the README show: complete, and the same."""

from pathlib import Path

import pandas as pd
import pytest

from bench.adopt import adopt
from bench.table import COLUMNS, TURNS, comparison, in_turns, markdown

ROOT = Path(__file__).parent.parent
MEASURED = pd.read_csv(ROOT / "book" / "data" / "bench.csv")


def rows(*words: str) -> pd.DataFrame:
    """The measurements whose names hold all these words."""
    names = MEASURED["benchmark"] + " against " + MEASURED["against"]
    return MEASURED[[all(word in name for word in words) for name in names]]


def test_it_was_measured_in_one_run_on_one_machine():
    assert [*MEASURED.columns] == [*COLUMNS, "machine", "date"]
    assert MEASURED[["machine", "date"]].drop_duplicates().shape[0] == 1


def test_every_ratio_has_its_interval_and_a_verdict_that_it_bears():
    limits = MEASURED["against"] == "the limit set"
    ratios = MEASURED[~limits]
    assert (ratios["turns"] >= TURNS).all()
    assert (ratios["low"] <= ratios["ratio"]).all()
    assert (ratios["ratio"] <= ratios["high"]).all()
    assert ((ratios["verdict"] == "faster") == (ratios["low"] > 1)).all()
    assert ((ratios["verdict"] == "slower") == (ratios["high"] < 1)).all()
    assert set(MEASURED.loc[limits, "verdict"]) == {"within"}


@pytest.mark.parametrize(
    ("ours", "verdict"),
    [([0.5] * 7, "faster"), ([2.0] * 7, "slower"), ([0.5] * 4 + [2.0] * 3, "cannot tell")],
)
def test_faster_is_what_is_faster_with_its_whole_interval(ours, verdict):
    assert comparison("a", "b", [1.0] * 7, ours, "s", "")["verdict"] == verdict


def test_neighbours_that_slow_both_down_do_not_change_a_ratio():
    slowed = [1.0, 9.0, 2.0, 1.0, 5.0, 3.0, 1.0]
    row = comparison("a", "b", [2 * slow for slow in slowed], slowed, "s", "")
    assert (row["low"], row["ratio"], row["high"]) == (2.0, 2.0, 2.0)


def test_the_ways_take_turns():
    said = []
    ways = {name: lambda turn, name=name: said.append((turn, name)) or turn for name in "ab"}
    assert in_turns(ways, "x", turns=2) == {"a": [0, 1], "b": [0, 1]}
    assert said == [(0, "a"), (0, "b"), (1, "a"), (1, "b")]


def test_growth_was_measured_with_what_the_page_draws():
    growth = pd.read_csv(ROOT / "book" / "data" / "growth.csv")
    assert set(growth["what"]) == {"seeds", "episodes", "states", "cores"}
    sizes = growth.groupby("what")["size"]
    assert sizes.nunique()["cores"] == 2
    assert (sizes.nunique().drop("cores") >= 5).all()
    assert sizes.max()["states"] >= 9_000_000
    assert (growth.groupby(["what", "size"]).size() >= 3).all()


@pytest.mark.parametrize(
    ("words", "at_least"),
    [
        (("value iteration", "10⁶ states"), 1),
        (("value iteration", "10⁶ states", "Storm"), 3),
        (("value iteration", "10⁵ states, 3 flags", "Storm"), 2),
        (("DQN", "rejax"), 2),
        (("DQN", "stacked"), 2),
        (("REINFORCE", "stacked"), 2),
        (("Q-learning on the Maze, compiled", "gym.make"), 200),
        (("REINFORCE", "Acrobot", "usual loop"), 60),
        (("REINFORCE", "Acrobot", "A2C"), 30),
        (("REINFORCE", "MountainCar-v0", "usual loop"), 40),
        (("REINFORCE", "MountainCarContinuous", "usual loop"), 40),
        (("DQN", "Acrobot"), 5),
        (("DQN", "MountainCar"), 5),
    ],
)
def test_the_speeds_aimed_at_are_among_it(words, at_least):
    found = rows(*words)
    assert len(found)
    assert (found["ratio"] >= at_least).all()


def test_the_readme_shows_it():
    assert markdown(MEASURED) in (ROOT / "README.md").read_text()


def test_what_was_measured_is_adopted(tmp_path):
    for folder in ("results", "book/data"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "README.md").write_text("# a\n\nMeasured on x.\n\n| b |\n\n## c\n\nd\n")
    MEASURED.to_csv(tmp_path / "results/bench.csv", index=False)
    assert adopt(tmp_path) == ["bench.csv"]
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / "book/data/bench.csv"), MEASURED)
    assert (tmp_path / "README.md").read_text() == f"# a\n\n{markdown(MEASURED)}\n\n## c\n\nd\n"
