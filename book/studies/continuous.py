"""Chapter 5: the arms of continuous REINFORCE, what the report claims, and how it is measured.

The report counts three state features where MountainCarContinuous shows two numbers. Both readings
are arms: the two observations alone, and with a constant as the third. "as reported" takes the
first, because on seeds 1000 to 1029 more of its seeds learned (10 against 6 of 30).

The cap on an episode and the budget keep a seed that does not get out from running for ever. They
were chosen on the same seeds: from its first success on, no seed that learned needed more than
250,000 steps for an episode. The budget also ends seeds that drive well but took long to begin. As
in chapter 3 such a seed counts as one that did not learn; `stopped_well` counts them.

What was written with data known (the second readings of 4c, 4e and 4f) is judged on fresh seeds,
which nobody had looked at when their criteria stood.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from report.claims import Claim, Criterion, Evidence, Finding, Reading
from report.seeds import SEEDS
from rl_core.experiments import Arm, Results, run
from rl_core.policies import MLP, Gaussian
from rl_core.reinforce import ReinforceConfig, reinforce
from rl_core.statistics import (
    Interval,
    bootstrap_interval,
    learned,
    proportion_interval,
)
from studies import shared
from studies.curves import episodes_to_threshold, learning_curves
from studies.shared import interval_text, lower_evidence, median_evidence

ENV = "MountainCarContinuous-v0"
EPISODES = 5_000
BUDGET = 4_000_000  # environment steps a seed
CAP = 500_000  # steps an episode; a capped episode is not learned from
WINDOW = 100  # episodes; "at episode k" is a seed's median over the last 100 up to k
LEARNED = 500  # steps; a seed that learned needs at most so many in the last 100 episodes
CONVERGED = 300  # steps: half as many again as the report's 200
EARLY = 10  # episodes
EXTREME = 100_000  # steps: an episode that lasts "extremely long"
MILESTONES = (1_000, 3_000, 5_000)
SNAPSHOTS = (100, 1_000)
REPORTED_MINUTES = 3

VARIANTS = {
    "as reported": ({}, {}),
    "sigma 0.5": ({"sigma": 0.5}, {}),
    "sigma 1": ({"sigma": 1.0}, {}),
    "sigma learned": ({"sigma": 0.5, "learn_sigma": True}, {}),
    "gamma 0.9": ({}, {"gamma": 0.9}),
    "gamma 0.9, sigma 0.5": ({"sigma": 0.5}, {"gamma": 0.9}),
    "three features": ({"constant_feature": True}, {}),
    "three features, sigma 0.5": ({"constant_feature": True, "sigma": 0.5}, {}),
    "three features, sigma 1": ({"constant_feature": True, "sigma": 1.0}, {}),
    "mean direct, sigma 0.5": ({"mean": "direct", "sigma": 0.5}, {}),
    "returns scaled": ({}, {"normalise": "standard"}),
    "returns raw": ({}, {"normalise": "none"}),
}
SWEEPS = {
    "two observations": ("as reported", "sigma 0.5", "sigma 1"),
    "and a constant": tuple(f"three features{s}" for s in ("", ", sigma 0.5", ", sigma 1")),
}
SIGMAS = (0.3, 0.5, 1.0)
"""The standard deviations of a sweep's arms."""
FRESH = range(100, 100 + len(SEEDS))
ON_FRESH_SEEDS = ("sigma 0.5", "sigma 1", "sigma learned")


def config(variant: str) -> ReinforceConfig:
    """The settings of 2018 with the changes of a variant."""
    policy, changes = VARIANTS[variant]
    settings = {
        "gamma": 0.99,
        "network": MLP((10, 20), biases=False),
        "policy": Gaussian(**{"mean": "weights", "sigma": 0.3, **policy}),
        "learning_rate": 2e-3,
        "batch_size": 512,
        "epochs": 1,
        "normalise": "centre",
        "max_episode_steps": CAP,
        "max_env_steps": BUDGET,
        "learn_from_capped": False,
    }
    return ReinforceConfig(**{**settings, **changes})


def arms(variants: Sequence[str] = tuple(VARIANTS)) -> list[Arm]:
    """Variants, 5,000 episodes."""
    return [Arm(name, reinforce, ENV, config(name), EPISODES, SNAPSHOTS) for name in variants]


def learn(store: Path) -> Results:
    """Run what the store does not have; the rest is read."""
    return run(arms(), seeds=SEEDS, store=store)


def learn_fresh(store: Path) -> Results:
    """Run with fresh seeds what the second readings are judged on."""
    return run(arms(ON_FRESH_SEEDS), seeds=FRESH, store=store)


EASIER = Criterion(
    "easier: probability that a seed with sigma 1 needs fewer steps for its first 10 "
    "episodes than one with 0.5, above 0.5",
    above=0.5,
)
SLOWER = Criterion(
    "slower: probability, among seeds that learned, that sigma 1 gets to 300 steps "
    "in more episodes than 0.5, above 0.5",
    above=0.5,
)
AGAINST_NARROW = Criterion(
    "against 0.3: share of seeds that learn, paired difference, at least 0.05",
    at_least=0.05,
)
FINICKY = Criterion(
    "finicky: share of seeds that learn, sigma 0.5 minus learned sigma, paired, at least 0.05",
    at_least=0.05,
)


CLAIMS = (
    Claim(
        "4a",
        "4.1.2",
        "MountainCarContinuous, REINFORCE: about 200 steps an episode after 3,000 episodes.",
        (
            Criterion("steps at episode 3,000, median over all seeds, 150 to 250", 150, 250),
            Criterion("the same over the seeds that learned by then", 150, 250),
        ),
        "Figure 14",
    ),
    Claim(
        "4b",
        "4.1.2",
        "Gamma 0.99 converges faster and better than 0.9.",
        tuple(
            Criterion(
                f"sigma {sigma}: probability that a seed with 0.99 {what} than one with 0.9, "
                "above 0.5",
                above=0.5,
            )
            for sigma in (0.3, 0.5)
            for what in (
                "needs fewer steps at episode 5,000",
                "gets to 300 steps in fewer episodes",
            )
        ),
        "Figure S5.4",
    ),
    Claim(
        "4c",
        "4.1.3",
        "Sigma 1: easier to get out early, slower convergence, noisier steps.",
        (
            EASIER,
            SLOWER,
            Criterion(
                "noisier: the same for a wider interquartile range of the last 500 episodes' "
                "steps, above 0.5",
                above=0.5,
            ),
        ),
        "Figure S5.3",
        reading="range in steps",
        readings=(
            Reading(
                "range in shares of the median",
                (
                    EASIER,
                    SLOWER,
                    Criterion(
                        "noisier: the same for a wider interquartile range of the last 500 "
                        "episodes' steps, divided by their median, above 0.5 (fresh seeds)",
                        above=0.5,
                    ),
                ),
            ),
        ),
        amended="second reading, written with data known: judged on seeds 100 to 129",
    ),
    Claim(
        "4d",
        "4.1.3",
        "Sigma 0.3: faster convergence and fewer steps, but early episodes can last extremely "
        "long.",
        (
            Criterion(
                "faster: probability, among seeds that learned, that sigma 0.3 gets to 300 steps "
                "in fewer episodes than 0.5, above 0.5",
                above=0.5,
            ),
            Criterion("fewer: the same for fewer steps at episode 5,000, above 0.5", above=0.5),
            Criterion(
                "long: share of seeds with more than 100,000 steps in one of the first 10 "
                "episodes, at least a tenth",
                at_least=0.1,
            ),
        ),
        "Figure S5.3",
    ),
    Claim(
        "4e",
        "4.1.3",
        "Sigma 0.5 is a good compromise.",
        (
            AGAINST_NARROW,
            Criterion(
                "against 1: probability, among seeds that learned, of getting to 300 steps in "
                "fewer episodes, above 0.5",
                above=0.5,
            ),
            Criterion("against 1: the same for fewer steps at episode 5,000, above 0.5", above=0.5),
        ),
        "Figure S5.3",
        reading="by steps",
        readings=(
            Reading(
                "by return",
                (
                    AGAINST_NARROW,
                    Criterion(
                        "against 1: probability, among seeds that learned, of a higher return at "
                        "episode 5,000, above 0.5 (fresh seeds)",
                        above=0.5,
                    ),
                ),
            ),
        ),
        amended="second reading, written with data known: judged on seeds 100 to 129",
    ),
    Claim(
        "4f",
        "4.1.3",
        "Learning sigma too may do better but is more finicky.",
        (
            Criterion(
                "better: probability, among seeds that learned, that learning sigma (from 0.5 on) "
                "needs fewer steps at episode 5,000 than sigma 0.5, above 0.5",
                above=0.5,
            ),
            FINICKY,
        ),
        "Figure S5.3",
        reading="by steps",
        readings=(
            Reading(
                "by return",
                (
                    Criterion(
                        "better: probability, among seeds that learned, that learning sigma (from "
                        "0.5 on) has a higher return at episode 5,000 than sigma 0.5, above 0.5 "
                        "(fresh seeds)",
                        above=0.5,
                    ),
                    FINICKY,
                ),
            ),
        ),
        amended="second reading, written with data known: judged on seeds 100 to 129",
    ),
)


class Curves:
    """Steps and returns per episode of each arm, one row a seed; NaN after a seed's end."""

    def __init__(self, table: pd.DataFrame, seeds: range | None = None) -> None:
        self.seeds = SEEDS if seeds is None else seeds
        self.rows = {str(arm): rows for arm, rows in table.groupby("arm", sort=False)}
        self.raw, self.smooth, self.returns = {}, {}, {}
        for arm, rows in self.rows.items():
            shape = {"seeds": self.seeds, "episodes": EPISODES}
            self.raw[arm] = learning_curves(rows, **shape)
            self.smooth[arm] = learning_curves(rows, **shape, window=WINDOW)
            self.returns[arm] = learning_curves(rows, "return", **shape, window=WINDOW)

    def cut(self, arm: str) -> np.ndarray:
        """Which seeds the budget ended while they still got out."""
        rows = self.rows[arm]
        return _cut_by_the_budget(rows).groupby(rows["seed"]).any().reindex(self.seeds).to_numpy()

    def stopped_well(self, arm: str) -> np.ndarray:
        """Which of these needed no more steps than one that learned, in what they finished."""
        finished = self.rows[arm][~_cut_by_the_budget(self.rows[arm])]
        steps = finished.groupby("seed")["steps"].apply(lambda one: one.iloc[-WINDOW:].median())
        return self.cut(arm) & (steps.reindex(self.seeds) <= LEARNED).to_numpy()

    def at(self, arm: str, episode: int | None = None) -> np.ndarray:
        """Steps of each seed at an episode or the last; infinite where it had stopped before."""
        steps = self.smooth[arm][:, (episode or EPISODES) - 1]
        return np.where(np.isnan(steps), np.inf, steps)

    def final_return(self, arm: str) -> np.ndarray:
        """Return of each seed at the last episode; minus infinity where it had stopped before."""
        returns = self.returns[arm][:, -1]
        return np.where(np.isnan(returns), -np.inf, returns)

    def learned(self, arm: str, episode: int | None = None) -> np.ndarray:
        """Which seeds had learned by an episode, or by the last."""
        return learned(self.raw[arm][:, : episode or EPISODES], LEARNED, window=WINDOW)

    def episodes_to(self, arm: str, steps: float = CONVERGED) -> np.ndarray:
        """Episodes until each seed first needs no more than `steps`; infinite if it never does."""
        curves = np.where(np.isnan(self.smooth[arm]), np.inf, self.smooth[arm])
        return episodes_to_threshold(curves, steps)

    def early(self, arm: str) -> np.ndarray:
        """Steps of each seed's first 10 episodes; infinite if one of them was stopped."""
        first = self.rows[arm][self.rows[arm]["episode"] <= EARLY].groupby("seed")
        steps = first["steps"].sum().where(first["terminated"].all(), np.inf)
        return steps.reindex(self.seeds).to_numpy(float)

    def longest_early(self, arm: str) -> np.ndarray:
        """Steps of the longest of each seed's first 10 episodes, stopped ones included."""
        first = self.rows[arm][self.rows[arm]["episode"] <= EARLY]
        return first.groupby("seed")["steps"].max().reindex(self.seeds).to_numpy(float)

    def spread(self, arm: str) -> np.ndarray:
        """Interquartile range of each seed's steps in the last 500 episodes."""
        low, high = np.quantile(self.raw[arm][:, -500:], [0.25, 0.75], axis=1)
        return np.where(np.isnan(high - low), np.inf, high - low)

    def relative_spread(self, arm: str) -> np.ndarray:
        """The same, divided by the median of those episodes."""
        return self.spread(arm) / np.median(np.nan_to_num(self.raw[arm][:, -500:], nan=1.0), axis=1)


def _cut_by_the_budget(rows: pd.DataFrame) -> pd.Series:
    """Mark episodes that the budget cut although their seed was not stuck.

    Such an episode is its seed's last, comes after one that reached the flag, and had not become
    extremely long. Any other stopped episode tells of a seed that no longer gets out.
    """
    by_seed = rows.groupby("seed")
    last = by_seed.cumcount(ascending=False) == 0
    after_a_success = by_seed["terminated"].shift(fill_value=False)
    not_full = by_seed["episode"].transform("size") < EPISODES
    return last & not_full & after_a_success & ~rows["terminated"] & (rows["steps"] <= EXTREME)


def _middle(values: np.ndarray, rng: np.random.Generator) -> Interval:
    """Median with its interval; for no seeds at all, everything is possible."""
    if len(values) == 0:
        return Interval(np.inf, -np.inf, np.inf)
    return bootstrap_interval(values, rng=rng)


def tradeoff(curves: Curves) -> pd.DataFrame:
    """One row an arm of the sweeps and a measure: estimate and interval.

    Lengths of early episodes and the share that learns are over all seeds, the rest over those
    that learned.
    """
    rng = np.random.default_rng(np.random.SeedSequence(2021))
    rows = []
    for arm in [*(a for sweep in SWEEPS.values() for a in sweep), "sigma learned"]:
        good = curves.learned(arm)
        measures = {
            "early": _middle(curves.early(arm) / EARLY, rng),
            "learned": proportion_interval(int(good.sum()), len(SEEDS)),
            "episodes": _middle(curves.episodes_to(arm)[good], rng),
            "steps": _middle(curves.at(arm)[good], rng),
            "spread": _middle(curves.spread(arm)[good], rng),
            "return": _middle(curves.final_return(arm)[good], rng),
        }
        for measure, (estimate, low, high) in measures.items():
            values = {"estimate": estimate, "low": low, "high": high}
            rows.append({"arm": arm, "measure": measure, **values})
    return pd.DataFrame(rows)


def tradeoff_text(table: pd.DataFrame) -> pd.DataFrame:
    """One row an arm, one column a measure, each an estimate with its interval."""
    names = {
        "early": "first 10 episodes, mean steps",
        "learned": "share that learns (%)",
        "episodes": "episodes to 300 steps",
        "steps": "steps at 5,000",
        "spread": "interquartile range",
        "return": "return at 5,000",
    }
    rows = []
    for arm, measures in table.groupby("arm", sort=False):
        row = {"arm": arm}
        for one in measures.itertuples():
            unit = 100 if one.measure == "learned" else 1
            interval = Interval(one.estimate * unit, one.low * unit, one.high * unit)
            row[names[one.measure]] = _text(interval)
        rows.append(row)
    return pd.DataFrame(rows)


def milestones(curves: Curves) -> pd.DataFrame:
    """One row an arm: steps at the milestones with intervals, who learned, what was stopped."""
    rng = np.random.default_rng(np.random.SeedSequence(2018))
    rows = []
    for arm, episodes in curves.rows.items():
        good = curves.learned(arm)
        row = {"arm": arm}
        for episode in MILESTONES:
            row[f"steps at {episode:,}"] = _text(_middle(curves.at(arm, episode), rng))
        row["those that learned, at 3,000"] = _text(_middle(curves.at(arm, 3_000)[good], rng))
        row["learned"] = f"{good.sum()} of {len(SEEDS)}"
        low, high = proportion_interval(int(good.sum()), len(SEEDS))[1:]
        row["share, 95%"] = f"{low:.0%} to {high:.0%}"
        row["stopped episodes"] = int((~episodes["terminated"]).sum())
        row["seeds out of budget"] = int((episodes.groupby("seed").size() < EPISODES).sum())
        rows.append(row)
    return pd.DataFrame(rows)


def _text(interval: Interval) -> str:
    if np.isneginf(interval.low):
        return "none"
    return interval_text(interval)


def seconds(results: Results) -> pd.DataFrame:
    """Seconds one seed took, here and in the report."""
    return shared.seconds(
        results, {"as reported": (f"{ENV}, as reported, one seed", 60 * REPORTED_MINUTES)}
    )


def middle(curves: Curves, arm: str) -> int:
    """Place of the seed in the middle of those that learned, or of all if none did."""
    good = curves.learned(arm)
    places = np.flatnonzero(good) if good.any() else np.arange(len(good))
    return int(places[shared.middle(curves.at(arm)[places])])


def findings(curves: Curves, fresh: Curves) -> list[Finding]:
    """Hold the seeds against the criteria, fresh ones against those written with data known."""
    rng = np.random.default_rng(np.random.SeedSequence(2019))
    good = {arm: curves.learned(arm) for arm in curves.raw}

    def about(arm: str, episode: int) -> tuple[Evidence, Evidence]:
        steps, by_then = curves.at(arm, episode), curves.learned(arm, episode)
        return median_evidence(steps, rng), median_evidence(steps[by_then], rng)

    def lower(one: str, other: str, measure: Callable[[str], np.ndarray]) -> Evidence:
        return lower_evidence(measure(one), measure(other), rng)

    def lower_if_learned(one: str, other: str, measure: Callable[[str], np.ndarray]) -> Evidence:
        return lower_evidence(measure(one)[good[one]], measure(other)[good[other]], rng)

    def more_learn(one: str, other: str) -> Evidence:
        difference = good[one].astype(float) - good[other]
        return Evidence(*bootstrap_interval(difference, np.mean, rng=rng), seeds=len(SEEDS))

    def on_fresh_seeds(one: str, other: str, measure: Callable[[str], np.ndarray]) -> Evidence:
        better, worse = (measure(arm)[fresh.learned(arm)] for arm in (one, other))
        return lower_evidence(better, worse, np.random.default_rng(np.random.SeedSequence(2023)))

    def loss(arm: str) -> np.ndarray:
        return -fresh.final_return(arm)

    narrow, middle, wide, own = "as reported", "sigma 0.5", "sigma 1", "sigma learned"
    long = int((curves.longest_early(narrow) > EXTREME).sum())
    speed, end = curves.episodes_to, curves.at
    discounts = (("as reported", "gamma 0.9"), ("sigma 0.5", "gamma 0.9, sigma 0.5"))
    four_a, four_b, four_c, four_d, four_e, four_f = CLAIMS
    by_about, by_discount = about(narrow, 3_000), []
    for pair in discounts:
        by_discount += [lower(*pair, measure) for measure in (end, speed)]
    easier, slower = lower(wide, middle, curves.early), lower_if_learned(middle, wide, speed)
    noisier = lower_if_learned(middle, wide, curves.spread)
    relative = on_fresh_seeds(middle, wide, fresh.relative_spread)
    of_narrow = [lower_if_learned(narrow, middle, measure) for measure in (speed, end)]
    often = Evidence(*proportion_interval(long, len(SEEDS)), seeds=len(SEEDS))
    more = more_learn(middle, narrow)
    of_middle = [lower_if_learned(middle, wide, measure) for measure in (speed, end)]
    of_learned, finicky = lower_if_learned(own, middle, end), more_learn(middle, own)
    paid = [on_fresh_seeds(middle, wide, loss), on_fresh_seeds(own, middle, loss)]
    return [
        four_a.judge(*by_about),
        four_b.judge(*by_discount),
        four_c.judge(easier, slower, noisier, readings=[(easier, slower, relative)]),
        four_d.judge(*of_narrow, often),
        four_e.judge(more, *of_middle, readings=[(more, paid[0])]),
        four_f.judge(of_learned, finicky, readings=[(paid[1], finicky)]),
    ]


def closest(curves: Curves, episode: int, steps: float) -> str:
    """The arm whose seeds that learned come closest to so many steps at an episode."""
    medians = {
        arm: np.median(curves.at(arm, episode)[curves.learned(arm)])
        for arm in curves.raw
        if curves.learned(arm).sum() > len(SEEDS) / 2
    }
    return min(medians, key=lambda arm: abs(medians[arm] - steps), default="as reported")
