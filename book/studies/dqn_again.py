"""Chapter 4, a second round: what the first thirty seeds left to guess, on seeds not seen before.

The criteria were written with the first round's data known, and committed before a seed from 100 on
was run. They judge sentences of this book, not claims of the report.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from report.claims import Criterion, Evidence
from report.seeds import SEEDS
from rl_core.dqn import DQNConfig, dqn
from rl_core.experiments import Arm, Results, run
from rl_core.exploration import HalfWay
from rl_core.statistics import proportion_interval
from rl_core.worlds.shaping import Shaping
from studies import dqn as first

FRESH = tuple(100 + seed for seed in SEEDS)
CAR = "MountainCar"
LONGER = 4  # times the budget
LONG = f"{CAR}, original, biases, {LONGER} times the budget"
NO_PERSISTENCE = f"{CAR}, original, all four without persistence"
NO_SCHEDULE = f"{CAR}, original, all four without the schedule"
SHAPED_MENDED = f"{CAR}, shaped, all four"
POTENTIAL_MENDED = f"{CAR}, potential, all four"
RUNS = (1, 10)  # steps for which a random action is kept

CRITERIA: Mapping[str, Criterion] = {
    LONG: Criterion(
        f"Biases alone mended, {LONGER} times the budget: share of seeds that learn (at most 500 "
        "steps a goal in the last quarter of it), at most a quarter",
        at_most=0.25,
    ),
    NO_PERSISTENCE: Criterion(
        "All four mended, but random actions are not kept: share of seeds that learn, at most a "
        "quarter",
        at_most=0.25,
    ),
    NO_SCHEDULE: Criterion(
        "All four mended, but epsilon follows the goals as in 2018: share of seeds that learn, at "
        "least three quarters",
        at_least=0.75,
    ),
    SHAPED_MENDED: Criterion(
        "All four mended, the report's shaped reward: share of seeds whose greedy policy arrives "
        "in most of 20 episodes, at most a quarter",
        at_most=0.25,
    ),
    POTENTIAL_MENDED: Criterion(
        "All four mended, shaping by a difference of potentials: the same share, at least a half",
        at_least=0.5,
    ),
}


def _random(name: str, kept: int) -> DQNConfig:
    """An agent that acts at random throughout and never begins to learn."""
    budget = first.BUDGET[name]
    return replace(
        first.mended(name, ()),
        epsilon=1.0,
        persistence=kept,
        memory_size=32,
        learning_starts=budget + 1,
    )


def controls(name: str) -> list[str]:
    """The names of the arms that act at random, by how long an action is kept."""
    return [f"{name}, random actions kept for {kept}" for kept in RUNS]


def arms() -> list[Arm]:
    """What is run on the fresh seeds."""
    all_four = first.mended(CAR, first.RIVALS)
    budget = first.BUDGET[CAR]
    configs = {
        LONG: replace(first.mended(CAR, ("biases",)), max_env_steps=LONGER * budget),
        NO_PERSISTENCE: replace(all_four, persistence=1),
        NO_SCHEDULE: replace(all_four, epsilon=HalfWay()),
        SHAPED_MENDED: replace(all_four, shaping=first.SHAPING[CAR]),
        POTENTIAL_MENDED: replace(all_four, shaping=Shaping("studies.potential:potential")),
    }
    made = [
        Arm(name, dqn, first.ENV[CAR], config, config.max_env_steps // 20)
        for name, config in configs.items()
    ]
    for name, env in first.ENV.items():
        for arm, kept in zip(controls(name), RUNS, strict=True):
            config = _random(name, kept)
            made.append(Arm(arm, dqn, env, config, config.max_env_steps // 20))
    return made


def learn(store: Path) -> Results:
    """Run what the store does not have; the rest is read."""
    return run(arms(), seeds=FRESH, store=store)


def steps_a_goal(results: Results, arm: str) -> np.ndarray:
    """Steps a goal of each seed in the last quarter of its budget."""
    budgets = {one.name: one.config.max_env_steps for one in arms()}
    of_seed = dict(list(results.table[results.table["arm"] == arm].groupby("seed")))
    return np.array([first.steps_a_goal(of_seed[seed], budgets[arm]) for seed in FRESH])


def arrives(results: Results, arm: str) -> np.ndarray:
    """Which seeds' greedy policies reach the goal in most of their episodes."""
    return np.isfinite(first.greedy_steps(results, arm, seeds=FRESH))


def good(results: Results, arm: str) -> np.ndarray:
    """Which seeds count for an arm's criterion."""
    if arm in (SHAPED_MENDED, POTENTIAL_MENDED):
        return arrives(results, arm)
    return steps_a_goal(results, arm) <= first.LEARNED


def judged(results: Results) -> pd.DataFrame:
    """Hold the fresh seeds against the criteria: one row each."""
    rows = []
    for arm, criterion in CRITERIA.items():
        count = int(good(results, arm).sum())
        share = proportion_interval(count, len(FRESH))
        rows.append(
            {
                "arm": arm,
                "criterion": criterion.text,
                "seeds": f"{count} of {len(FRESH)}",
                "share": share.estimate,
                "low": share.low,
                "high": share.high,
                "met": criterion.answer(Evidence(*share, seeds=len(FRESH))),
            }
        )
    return pd.DataFrame(rows)


def premises(second: pd.DataFrame) -> dict[str, bool]:
    """The sentences on the second round, and whether its seeds bear them out."""
    rows = second.set_index("arm")
    share, met = rows["share"], rows["met"]
    return {
        "More time alone does not mend it.": met[LONG] == "yes",
        "Persistence is what counts, and not the schedule.": (
            met[NO_SCHEDULE] == "yes" and share[NO_PERSISTENCE] <= 0.5 * share[NO_SCHEDULE]
        ),
        "With the flag, the report's shaping teaches not to arrive.": met[SHAPED_MENDED] == "yes",
        "Potentials leave the goal what it was.": (
            met[POTENTIAL_MENDED] == "yes" and share[SHAPED_MENDED] < share[POTENTIAL_MENDED]
        ),
    }
