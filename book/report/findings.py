"""What the book found, in five sentences whose numbers are read from the results.

Each sentence leans on a premise. If the results no longer bear it out, the book stops.
"""

import html
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from report.claims import number
from report.seeds import premise


class Told(NamedTuple):
    """A finding: its sentence, with the numbers that carry it set off, and where to look."""

    sentence: str
    figure: str


def told(results: Path, originals: Path, claims: pd.DataFrame) -> list[Told]:
    """The findings, in the order of the chapters.

    Parameters
    ----------
    results : Path
        Folder with what the chapters wrote.
    originals : Path
        Folder with the curves of 2018: `episode, low, high`.
    claims : pandas.DataFrame
        The table of claims, with what the report says and the first of our numbers.

    Raises
    ------
    AssertionError
        If the results do not bear a sentence out.
    """
    figures = results / "figures"
    return [
        unreachable(pd.read_csv(figures / "figure_s2_1.csv")),
        edges(claims, originals),
        discount(
            pd.read_csv(results / "reinforce_milestones.csv"),
            pd.read_csv(figures / "figure_s4_1.csv"),
        ),
        causes(pd.read_csv(figures / "figure_s4_2.csv")),
        noise(pd.read_csv(figures / "figure_s5_3.csv")),
    ]


def _strong(text: str) -> str:
    return f"<b>{html.escape(text)}</b>"


def unreachable(split: pd.DataFrame) -> Told:
    """Chapter 2: what is left of Q-learning's error is no slowness."""
    end = split[split["episode"] == split["episode"].max()]
    parts = end.drop(columns=["episode", "seed"]).mean()
    gap = parts["cannot be visited"]
    share = gap / parts.sum()
    premise("most of what is left of the error cannot be visited", share > 0.5)
    return Told(
        f"The gap of {_strong(f'{np.sqrt(gap):.2f}')} that Q-learning never closes is no slowness: "
        f"states that no episode can reach make up {_strong(f'{share:.1%}')} of the squared error "
        "that is left.",
        "Figure S2.1",
    )


def edges(claims: pd.DataFrame, originals: Path) -> Told:
    """Chapter 3: what the report says against what its own curves show."""
    by_id, parts = claims.set_index("id"), []
    for name, task, figure in (("3a", "Acrobot", 10), ("3c", "MountainCar", 11)):
        row = by_id.loc[name]
        said, episode = (
            float(text.replace(",", ""))
            for text in re.search(r"about ([\d,]+) steps.*?after ([\d,]+)", row["claim"]).groups()
        )
        curve = pd.read_csv(originals / f"figure_{figure}_{task.lower()}_reinforce.csv")
        around = curve[(curve["episode"] - episode).abs() < 50]
        low, high = around["low"].median(), around["high"].median()
        ours = row["estimate"]
        premise(f"{task}: the text is at the lower edge of its curve", said < (low + ours) / 2)
        premise(f"{task}: our median lies within the curve", low <= ours <= high)
        parts.append(
            f"about {number(said)} steps on {task}, whose curve runs from {number(low)} to "
            f"{number(high)} there (we: {_strong(number(ours))})"
        )
    text = " and ".join(parts)
    return Told(
        "The report's numbers for REINFORCE lie at the lower edge of its own curves, or below: "
        f"{text}.",
        "Figure 10",
    )


def discount(milestones: pd.DataFrame, goals: pd.DataFrame) -> Told:
    """Chapters 3 and 4: the discount decides, and not always for the larger one."""
    learned = milestones.set_index("arm")["learned"]
    far, near = (learned[f"MountainCar, {arm}"] for arm in ("as reported", "gamma 0.9"))
    premise(
        "with gamma 0.99 more seeds learn", int(far.partition(" ")[0]) > int(near.partition(" ")[0])
    )
    last = goals[(goals["environment"] == "MountainCar") & (goals["tenth"] == goals["tenth"].max())]
    steps = last.groupby("variant")["steps_a_goal"].median()
    with_far, with_near = steps["shaped"], steps["shaped, gamma 0.9"]
    premise("DQN does better with gamma 0.9", with_near < with_far)
    return Told(
        f"Gamma decides: REINFORCE learns MountainCar in {_strong(far)} seeds with 0.99 and in "
        f"{_strong(near)} with 0.9. For DQN with shaped rewards 0.9 is better: "
        f"{_strong(number(with_near))} steps a goal at the end, against {number(with_far)}.",
        "Figure S4.1",
    )


def causes(shares: pd.DataFrame) -> Told:
    """Chapter 4: why DQN failed on the original reward."""
    of = shares[shares["environment"] == "MountainCar"].set_index("variant")["share"]
    alone = of[[name for name in of.index if re.fullmatch(r"original, (?!all|no )[\w ]+", name)]]
    before, after, best = of["original"], of["original, all four"], alone.max()
    premise("mending all four causes helps more than any one", after > 2 * max(before, best))
    return Told(
        "DQN's failure on MountainCar's original reward was four other things: with them mended "
        f"and the reward kept {_strong(f'{after:.0%}')} of the seeds learn, {before:.0%} without, "
        f"and with one of them at most {_strong(f'{best:.0%}')}.",
        "Figure S4.2",
    )


def noise(measures: pd.DataFrame) -> Told:
    """Chapter 5: what a wider policy buys, and what it pays."""
    table = measures.pivot(index="measure", columns="arm", values="estimate")
    narrow, wide = table["as reported"], table["sigma 1"]
    premise("wide noise teaches more seeds", wide["learned"] > narrow["learned"])
    premise("wide noise costs return", wide["return"] < narrow["return"])
    wide_share, narrow_share = f"{wide['learned']:.0%}", f"{narrow['learned']:.0%}"
    return Told(
        f"Sigma 1 instead of 0.3 buys learning, {_strong(wide_share)} of the seeds instead of "
        f"{narrow_share}, and pays with return: {_strong(number(wide['return']))} instead of "
        f"{number(narrow['return'])} among those that learned.",
        "Figure S5.3",
    )
