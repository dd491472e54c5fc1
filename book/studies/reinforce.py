"""Chapter 3: the arms of REINFORCE, what the report claims about them, and how it is measured.

The cap on Acrobot's episodes is that of 2018. The budgets of environment steps keep a seed that
never finds the goal from running for ever; they were chosen on seeds 1000 to 1029, of which
every one that learned with gamma 0.99 needed less. That leaves out a seed that got out late and was
out of budget while doing well: it counts as one that did not learn. `stopped_well` counts these.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from report.claims import Claim, Criterion, Evidence, Finding
from report.figure_data import tidy
from report.seeds import SEEDS
from rl_core.experiments import Arm, Results, run
from rl_core.policies import MLP
from rl_core.reinforce import ReinforceConfig, reinforce
from rl_core.statistics import (
    bootstrap_interval,
    episodes_to_threshold,
    learned,
    learning_curves,
    paired_difference_interval,
    proportion_interval,
)
from studies import shared
from studies.shared import interval_text, lower_evidence, median_evidence

EPISODES = 2_000
BUDGET = 4_000_000  # environment steps a seed
ACROBOT_CAP = 5_000  # steps an episode, as in 2018, when a capped episode was not learned from
WINDOW = 100  # episodes; "steps at episode k" is a seed's median over the last 100 up to k
LEARNED = 500  # steps; a seed that learned needs at most so many in the last 100 episodes
DRAWN = np.arange(10, EPISODES + 1, 10)  # the episodes of drawn points
MILESTONES = (1_000, 1_500, 2_000)
PAIRED = "against as reported at 2,000, same seed"
REPORTED_AT = {"Acrobot": 1_000, "MountainCar": 1_500}  # the episodes of the report's numbers

ENVIRONMENTS = {
    "Acrobot": ("Acrobot-v1", {"max_episode_steps": ACROBOT_CAP, "learn_from_capped": False}),
    "MountainCar": ("MountainCar-v0", {}),
}
VARIANTS = {
    "as reported": {},
    "gamma 0.9": {"gamma": 0.9},
    "one hidden layer": {"network": MLP((10,))},
    "raw returns": {"normalise": "none"},
}


def arms() -> list[Arm]:
    """Every variant on both environments."""
    return [
        Arm(
            f"{name}, {variant}",
            reinforce,
            env,
            ReinforceConfig(max_env_steps=BUDGET, **caps, **changes),
            EPISODES,
            snapshots=(EPISODES,),
        )
        for name, (env, caps) in ENVIRONMENTS.items()
        for variant, changes in VARIANTS.items()
    ]


def learn(store: Path) -> Results:
    """Run what the store does not have; the rest is read."""
    return run(arms(), seeds=SEEDS, store=store)


CLAIMS = (
    Claim(
        "3a",
        "3.1.2",
        "Acrobot, REINFORCE: about 100 steps an episode after 1,000 episodes.",
        (
            Criterion("steps at episode 1,000, median over all seeds, 75 to 125", 75, 125),
            Criterion("the same over the seeds that learned by then", 75, 125),
        ),
        "Figure 10",
    ),
    Claim(
        "3b",
        "3.1.2",
        "Acrobot, REINFORCE: gamma 0.99 converges faster and better than 0.9.",
        (
            Criterion(
                "better: probability that a seed with 0.99 needs fewer steps at episode 2,000 than "
                "one with 0.9, above 0.5",
                above=0.5,
            ),
            Criterion(
                "faster: probability that it gets to 200 steps in fewer episodes, above 0.5",
                above=0.5,
            ),
        ),
        "Figure S3.1",
    ),
    Claim(
        "3c",
        "3.1.3",
        "MountainCar, REINFORCE: about 180 steps after 1,500 episodes.",
        (
            Criterion("steps at episode 1,500, median over all seeds, 135 to 225", 135, 225),
            Criterion("the same over the seeds that learned by then", 135, 225),
        ),
        "Figure 11",
    ),
    Claim(
        "3d",
        "3.1.3-4",
        "MountainCar: one hidden layer does as well as two; two are sometimes slower.",
        (
            Criterion(
                "steps at episode 2,000, paired ratio of one layer to two over all seeds, median, "
                "at most 1.1 (a seed out of budget counts as infinite steps, two such as 1)",
                at_most=1.1,
            ),
            Criterion(
                "share of seeds in which two layers take more episodes to get to 500 steps, at "
                "least a tenth",
                at_least=0.1,
            ),
        ),
        "Figure S3.2",
    ),
    Claim(
        "3e",
        "3.1.4",
        "Acrobot: two hidden layers do better than one.",
        (
            Criterion(
                "probability that a seed with two layers needs fewer steps at episode 2,000 than "
                "one with one layer, above 0.5",
                above=0.5,
            ),
        ),
        "Figure S3.1",
    ),
)


class Curves:
    """Steps per episode of each arm, one row a seed; NaN after a seed's budget is used up."""

    def __init__(self, table: pd.DataFrame) -> None:
        self.raw = {
            str(arm): learning_curves(rows, seeds=SEEDS, episodes=EPISODES)
            for arm, rows in table.groupby("arm", sort=False)
        }
        self.smooth = {
            str(arm): learning_curves(rows, seeds=SEEDS, episodes=EPISODES, window=WINDOW)
            for arm, rows in table.groupby("arm", sort=False)
        }

    def at(self, arm: str, episode: int) -> np.ndarray:
        """Steps of each seed at an episode; infinite where the seed had stopped before."""
        steps = self.smooth[arm][:, episode - 1]
        return np.where(np.isnan(steps), np.inf, steps)

    def rows(self, arms: Sequence[str]) -> pd.DataFrame:
        """The curves of `arms` as drawn, a row an arm, seed and episode; empty where stopped."""
        smooth = {arm: self.smooth[arm][:, DRAWN - 1] for arm in arms}
        return tidy(DRAWN, smooth, value="steps")

    def learned(self, arm: str, episode: int = EPISODES) -> np.ndarray:
        """Which seeds had learned by an episode."""
        return learned(self.raw[arm][:, :episode], LEARNED, window=WINDOW)

    def stopped_well(self, arm: str) -> np.ndarray:
        """Which seeds were out of budget while they needed no more steps than one that learned."""
        smooth = self.smooth[arm]
        last = np.array([curve[np.isfinite(curve)][-1] for curve in smooth])
        return np.isnan(smooth[:, -1]) & (last <= LEARNED)

    def lost(self, arm: str) -> np.ndarray:
        """Which seeds once needed no more steps than one that learned, and did not stay there."""
        return np.isfinite(self.episodes_to(arm, LEARNED)) & ~self.learned(arm)

    def episodes_to(self, arm: str, steps: float) -> np.ndarray:
        """Episodes until each seed first needs no more than `steps`; infinite if it never does."""
        curves = np.where(np.isnan(self.smooth[arm]), np.inf, self.smooth[arm])
        return episodes_to_threshold(curves, steps)


def milestones(table: pd.DataFrame, curves: Curves) -> pd.DataFrame:
    """One row an arm: steps at the milestones with intervals, who learned, what was capped."""
    rng = np.random.default_rng(np.random.SeedSequence(2018))
    rows = []
    for arm, episodes in table.groupby("arm", sort=False):
        row = {"arm": arm}
        for episode in MILESTONES:
            steps = curves.at(arm, episode)
            row[f"steps at {episode:,}"] = interval_text(bootstrap_interval(steps, rng=rng))
        count = int(curves.learned(arm).sum())
        row[PAIRED] = _against_reported(curves, str(arm), rng)
        row["learned"] = f"{count} of {len(SEEDS)}"
        low, high = proportion_interval(count, len(SEEDS))[1:]
        row["share that learned, 95%"] = f"{low:.0%} to {high:.0%}"
        row["capped episodes"] = int((~episodes["terminated"]).sum())
        row["seeds out of budget"] = int((episodes.groupby("seed").size() < EPISODES).sum())
        rows.append(row)
    return pd.DataFrame(rows)


def _against_reported(curves: Curves, arm: str, rng: np.random.Generator) -> str:
    """How many steps more a seed needs at the end than the same seed as reported, median."""
    reported = f"{arm.partition(',')[0]}, as reported"
    if arm == reported:
        return ""
    ends = (curves.at(one, EPISODES) for one in (arm, reported))
    return interval_text(paired_difference_interval(*ends, rng=rng))


def wall_clock(results: Results, reported_minutes: dict[str, float]) -> pd.DataFrame:
    """Seconds one seed took, here and in the report."""
    arms = {
        f"{name}, as reported": (f"{name}, REINFORCE, one seed", 60 * minutes)
        for name, minutes in reported_minutes.items()
    }
    return shared.wall_clock(results, arms, "now, all seeds (s)")


def median_seed(curves: Curves, arm: str) -> int:
    """The seed in the middle when all are ordered by their steps at the end."""
    return shared.middle_seed(curves.at(arm, EPISODES))


def findings(curves: Curves) -> list[Finding]:
    """Hold the seeds against the criteria."""
    rng = np.random.default_rng(np.random.SeedSequence(2019))

    def about(arm: str, episode: int) -> tuple[Evidence, Evidence]:
        steps, good = curves.at(arm, episode), curves.learned(arm, episode)
        return median_evidence(steps, rng), median_evidence(steps[good], rng)

    def better(one: str, other: str, measure: Callable[[str], np.ndarray]) -> Evidence:
        return lower_evidence(measure(one), measure(other), rng)

    acrobot, slower, shallow = (
        f"Acrobot, {v}" for v in ("as reported", "gamma 0.9", "one hidden layer")
    )
    two, one = "MountainCar, as reported", "MountainCar, one hidden layer"
    ratio = steps_ratio(curves.at(one, EPISODES), curves.at(two, EPISODES))
    late = int((curves.episodes_to(two, LEARNED) > curves.episodes_to(one, LEARNED)).sum())

    def at_the_end(arm: str) -> np.ndarray:
        return curves.at(arm, EPISODES)

    def to_200(arm: str) -> np.ndarray:
        return curves.episodes_to(arm, 200)

    three_a, three_b, three_c, three_d, three_e = CLAIMS
    return [
        three_a.judge(*about(acrobot, 1_000)),
        three_b.judge(better(acrobot, slower, at_the_end), better(acrobot, slower, to_200)),
        three_c.judge(*about(two, 1_500)),
        three_d.judge(
            median_evidence(ratio, rng),
            Evidence(*proportion_interval(late, len(SEEDS)), seeds=len(SEEDS)),
        ),
        three_e.judge(better(acrobot, shallow, at_the_end)),
    ]


def steps_ratio(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Ratio of two arms' steps seed by seed; a seed that never gets there needs infinitely many.

    Examples
    --------
    >>> steps_ratio(np.array([3, np.inf, 2, np.inf]), np.array([2, 2, np.inf, np.inf]))
    array([1.5, inf, 0. , 1. ])
    """
    with np.errstate(invalid="ignore"):
        return np.where(np.isinf(one) & np.isinf(other), 1.0, one / other)
