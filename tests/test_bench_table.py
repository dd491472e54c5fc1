"""The measurements of the benchmarks that the book and the README show: complete, and the same."""

from pathlib import Path

import pandas as pd
import pytest

from bench.table import COLUMNS, markdown

ROOT = Path(__file__).parent.parent
MEASURED = pd.read_csv(ROOT / "book" / "data" / "bench.csv")


def rows(*words: str) -> pd.DataFrame:
    """The measurements whose names hold all these words."""
    names = MEASURED["benchmark"] + " against " + MEASURED["against"]
    return MEASURED[[all(word in name for word in words) for name in names]]


def test_it_was_measured_in_one_run_on_one_machine():
    assert [*MEASURED.columns] == [*COLUMNS, "machine", "date"]
    assert MEASURED[["machine", "date"]].drop_duplicates().shape[0] == 1


@pytest.mark.parametrize(
    ("words", "at_least"),
    [
        (("value iteration", "10⁶ states"), 1),
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
