"""Chapter 3: the arms of REINFORCE, what the report claims about them, and how it is measured.

The cap on Acrobot's episodes is that of 2018. The budgets of environment steps keep a seed that
never finds the goal from running for ever; they were chosen on seeds 1000 to 1029, of which
every one that learned with gamma 0.99 needed less. That leaves out a seed that got out late and was
out of budget while doing well: it counts as one that did not learn. `stopped_well` counts these.

Two kinds of seeds are fresh, which means that nobody had looked at them when the criteria stood.

- What is new, or was changed with data known, is judged on the first thirty seeds from 100 on.
- A verdict whose bound lies within half an interval's width of the interval's end is made on the
  hundred seeds from 100 on instead, once and alone. These have their own 95% interval. So a true
  statement is refuted with a chance of 5%, and of one in ten thousand more: that the first interval
  had missed it by more than its half. 3a is such a verdict.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pandas as pd

from report.claims import Claim, Criterion, Evidence, Finding, Reading, sensitivity
from report.figure_data import tidy
from report.seeds import FULL, SEEDS
from rl_core.experiments import Arm, Results, run
from rl_core.policies import MLP
from rl_core.reinforce import ReinforceConfig, reinforce
from rl_core.statistics import bootstrap_interval, learned, proportion_interval
from studies import shared
from studies.curves import episodes_to_threshold, learning_curves, paired_difference_interval
from studies.shared import interval_text, lower_evidence, median_evidence

EPISODES = 2_000
BUDGET = 4_000_000  # environment steps a seed
ACROBOT_CAP = 5_000  # steps an episode, as in 2018, when a capped episode was not learned from
WINDOW = 100  # episodes; "steps at episode k" is a seed's median over the last 100 up to k
LEARNED = 500  # steps; a seed that learned needs at most so many in the last 100 episodes
DRAWN = np.arange(10, EPISODES + 1, 10)  # the episodes of drawn points
MILESTONES = (1_000, 1_500, 2_000)
FRESH = range(100, 100 + len(SEEDS))
NEAR_A_BOUND = range(100, 100 + 100 * len(SEEDS) // FULL)
SHORT = 1_000_000  # environment steps, where that is enough to see what becomes of a seed
TORCH_EPISODES = 300
RUN_AWAY = 500_000  # steps: a seed with an episode longer than this has run away
UNITS = (10, 20, 30, 64, 128)  # of a single layer
PAIRED = "against as reported at 2,000, same seed"
REPORTED_MINUTES = {"Acrobot": 2, "MountainCar": 3}
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
TRIALS = {
    "MountainCar": {
        "as reported": {},
        **{f"one layer of {units}": {"network": MLP((units,))} for units in UNITS},
        "one epoch": {"epochs": 1},
        "returns centred": {"normalise": "centre"},
        "raw returns, one epoch": {"normalise": "none", "epochs": 1, "max_env_steps": SHORT},
        "raw returns, one update": {
            **{"normalise": "none", "epochs": 1, "max_env_steps": SHORT},
            "batch_size": SHORT,
        },
    },
}
"""What is run on fresh seeds only, beside Acrobot as reported."""


def arm(name: str, variant: str, **changes: object) -> Arm:
    """One environment, with the reported settings but for the changes."""
    env, caps = ENVIRONMENTS[name]
    config = ReinforceConfig(**{"max_env_steps": BUDGET, **caps, **changes})
    return Arm(f"{name}, {variant}", reinforce, env, config, EPISODES, snapshots=(EPISODES,))


def arms() -> list[Arm]:
    """Every variant on both environments."""
    return [arm(name, v, **changes) for name in ENVIRONMENTS for v, changes in VARIANTS.items()]


def trials() -> list[Arm]:
    """What is run on fresh seeds."""
    return [arm(name, v, **changes) for name in TRIALS for v, changes in TRIALS[name].items()]


def learn(store: Path) -> Results:
    """Run what the store does not have; the rest is read."""
    return run(arms(), seeds=SEEDS, store=store)


def learn_afresh(store: Path) -> tuple[Results, Results]:
    """Run the fresh seeds: of the trials, and of Acrobot as reported, which takes more of them."""
    reported = [arm("Acrobot", "as reported")]
    return run(trials(), seeds=FRESH, store=store), run(reported, seeds=NEAR_A_BOUND, store=store)


AS_WELL = (
    Criterion(
        "probability that a seed with one layer needs at most 1.1 times as many steps at episode "
        "2,000 as one with two, at least 0.5",
        at_least=0.5,
    ),
    Criterion(
        "probability that a seed with two layers takes more episodes to get to 500 steps than one "
        "with one, at least a tenth",
        at_least=0.1,
    ),
)

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
        amended="near its bound, so judged on seeds 100 to 199 instead",
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
        AS_WELL,
        "Figure S3.2",
        reading="one layer of 10 units",
        readings=(Reading("one layer of 128 units", AS_WELL),),
        amended="a second reading, and both of random pairs of seeds: judged on seeds 100 to 129",
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

QUESTIONS = (
    Criterion(
        "raw returns, one epoch of batches of 512: share of seeds that run away, at least a half",
        at_least=0.5,
    ),
    Criterion(
        "raw returns, one epoch, one update an episode: share of seeds that run away, at most a "
        "quarter",
        at_most=0.25,
    ),
    Criterion(
        "returns centred, not scaled: share of seeds that run away, at most a quarter",
        at_most=0.25,
    ),
    Criterion(
        "returns normalised: probability that a seed with three epochs gets to 500 steps in fewer "
        "episodes than one with one epoch, above 0.5",
        above=0.5,
    ),
)
"""What the trials are to tell beside 3d: a run away is an episode of more than 500,000 steps."""


class Curves:
    """Steps per episode of each arm, one row a seed; NaN after a seed's budget is used up."""

    def __init__(self, table: pd.DataFrame, seeds: range = SEEDS) -> None:
        self.seeds = seeds

        def curves(window: int) -> dict[str, np.ndarray]:
            return {
                str(arm): learning_curves(rows, seeds=seeds, episodes=EPISODES, window=window)
                for arm, rows in table.groupby("arm", sort=False)
            }

        self.raw, self.smooth = curves(1), curves(WINDOW)

    def at(self, arm: str, episode: int) -> np.ndarray:
        """Steps of each seed at an episode; infinite where the seed had stopped before."""
        steps = self.smooth[arm][:, episode - 1]
        return np.where(np.isnan(steps), np.inf, steps)

    def rows(self, arms: Sequence[str]) -> pd.DataFrame:
        """The curves of `arms` as drawn, a row an arm, seed and episode; empty where stopped."""
        smooth = {arm: self.smooth[arm][:, DRAWN - 1] for arm in arms}
        return tidy(DRAWN, smooth, value="steps", seeds=self.seeds)

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


def trial_table(fresh: Curves, near: Curves) -> pd.DataFrame:
    """One row an arm on fresh seeds: who learned, steps at the end, who ran away or stopped."""
    rng = np.random.default_rng(np.random.SeedSequence(2022))
    rows = []
    for curves in (fresh, near):
        for arm, raw in curves.raw.items():
            row = {"arm": arm, "seeds": len(raw), "learned": int(curves.learned(arm).sum())}
            ends = bootstrap_interval(curves.at(arm, EPISODES), rng=rng)
            row[f"steps at {EPISODES:,}"] = interval_text(ends)
            row["ran away"] = int(ran_away(curves, arm).sum())
            row["out of budget"] = int(np.isnan(raw[:, -1]).sum())
            rows.append(row)
    return pd.DataFrame(rows)


def question_table(evidence: Sequence[Evidence]) -> pd.DataFrame:
    """What the trials were to tell, and what they told."""
    return pd.DataFrame(
        [
            {"question": one.text, "measured": str(found), "met": one.answer(found)}
            for one, found in zip(QUESTIONS, evidence, strict=True)
        ]
    )


def about(findings: Sequence[Finding], curves: Curves, near: Curves) -> pd.DataFrame:
    """What becomes of 3a and 3c where "about" means more, or less, than a quarter."""
    found = {one.claim.id: one for one in findings}
    parts = []
    for claim, of, name, steps in (
        ("3a", near, "Acrobot", 100),
        ("3c", curves, "MountainCar", 180),
    ):
        reached = of.at(f"{name}, as reported", REPORTED_AT[name])
        parts.append(sensitivity(found[claim], steps, reached))
    return pd.concat(parts, ignore_index=True)


def ends(curves: Curves, arms: Sequence[str]) -> pd.DataFrame:
    """Steps at the end, a row an arm and seed; infinite where a seed had stopped."""
    return pd.concat(
        pd.DataFrame({"arm": arm, "seed": curves.seeds, "steps": curves.at(arm, EPISODES)})
        for arm in arms
    )


def same_seed(store: Path, seed: int) -> Results:
    """Train one seed on Acrobot twice: compiled, and in torch."""
    arms = [
        replace(arm("Acrobot", engine, engine=engine), episodes=TORCH_EPISODES, snapshots=())
        for engine in ("compiled", "torch")
    ]
    return run(arms, seeds=[seed], store=store)


def parting(results: Results) -> int:
    """The first episode in which two arms' steps differ; the last if none does."""
    one, other = (rows["steps"].to_numpy() for _, rows in results.table.groupby("arm"))
    length = min(len(one), len(other))
    return int(np.append(np.flatnonzero(one[:length] != other[:length]), length - 1)[0]) + 1


def sees_all(env: str, steps: int = 1_000) -> float:
    """How far a world that starts from what is seen drifts from the world that is seen, at most.

    A second copy is set to the first one's observation before every step, and both take the same
    random action. If what is seen is all there is, the two differ by rounding only.
    """
    one, other = (gym.make(env, max_episode_steps=-1).unwrapped for _ in range(2))
    seen, _ = one.reset(seed=0)
    other.reset(seed=0)
    furthest = 0.0
    for action in np.random.default_rng(0).integers(3, size=steps):
        other.state = tuple(map(float, seen))
        seen, beside = (world.step(int(action))[0] for world in (one, other))
        furthest = max(furthest, float(np.abs(seen - beside).max()))
    return furthest


def seconds(results: Results) -> pd.DataFrame:
    """Seconds one seed took, here and in the report."""
    arms = {
        f"{name}, as reported": (f"{name}, REINFORCE, one seed", 60 * minutes)
        for name, minutes in REPORTED_MINUTES.items()
    }
    return shared.seconds(results, arms)


def shown_seeds(curves: Curves, arm: str) -> dict[str, int]:
    """Places of the seeds to show."""
    return shared.shown_seeds(curves.at(arm, EPISODES), curves.learned(arm))


def fates(curves: Curves, rows: pd.DataFrame, arm: str) -> pd.DataFrame:
    """What became of each seed of an arm, whose episodes are among the rows."""
    stopped, well = np.isnan(curves.smooth[arm][:, -1]), curves.stopped_well(arm)
    names = ["learned", "out of budget while doing well", "out of budget"]
    fate = np.select([curves.learned(arm), well, stopped], names, "not learned").tolist()
    ends = curves.at(arm, EPISODES)
    return shared.fate_table(rows[rows["arm"] == arm], curves.seeds, fate, ends)


def findings(curves: Curves, fresh: Curves, near: Curves) -> list[Finding]:
    """Hold the seeds against the criteria: the first thirty, and the fresh ones of 3d and of 3a."""
    rng = np.random.default_rng(np.random.SeedSequence(2019))

    def steps_at(curves: Curves, arm: str, episode: int) -> tuple[Evidence, Evidence]:
        steps, good = curves.at(arm, episode), curves.learned(arm, episode)
        return median_evidence(steps, rng), median_evidence(steps[good], rng)

    acrobot, slower, shallow = (
        f"Acrobot, {v}" for v in ("as reported", "gamma 0.9", "one hidden layer")
    )
    two = "MountainCar, as reported"

    def at_the_end(arm: str) -> np.ndarray:
        return curves.at(arm, EPISODES)

    def to_200(arm: str) -> np.ndarray:
        return curves.episodes_to(arm, 200)

    def as_well(units: int) -> tuple[Evidence, Evidence]:
        one = f"MountainCar, one layer of {units}"
        ends = fresh.at(one, EPISODES), 1.1 * fresh.at(two, EPISODES)
        episodes = fresh.episodes_to(one, LEARNED), fresh.episodes_to(two, LEARNED)
        return lower_evidence(*ends, rng), lower_evidence(*episodes, rng)

    three_a, three_b, three_c, three_d, three_e = CLAIMS
    return [
        three_a.judge(*steps_at(near, acrobot, 1_000)),
        three_b.judge(
            lower_evidence(at_the_end(acrobot), at_the_end(slower), rng),
            lower_evidence(to_200(acrobot), to_200(slower), rng),
        ),
        three_c.judge(*steps_at(curves, two, 1_500)),
        three_d.judge(*as_well(10), readings=[as_well(128)]),
        three_e.judge(lower_evidence(at_the_end(acrobot), at_the_end(shallow), rng)),
    ]


def ran_away(curves: Curves, arm: str) -> np.ndarray:
    """Which seeds had an episode of more than 500,000 steps."""
    return np.nanmax(curves.raw[arm], axis=1) > RUN_AWAY


def answers(fresh: Curves) -> list[Evidence]:
    """Evidence for each of the questions."""
    rng = np.random.default_rng(np.random.SeedSequence(2021))

    def share(variant: str) -> Evidence:
        away = ran_away(fresh, f"MountainCar, {variant}")
        return Evidence(*proportion_interval(int(away.sum()), len(away)), seeds=len(away))

    epochs = (fresh.episodes_to(f"MountainCar, {v}", LEARNED) for v in ("as reported", "one epoch"))
    return [
        *map(share, ("raw returns, one epoch", "raw returns, one update", "returns centred")),
        lower_evidence(*epochs, rng),
    ]
