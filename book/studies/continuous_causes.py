"""Chapter 5: experiments on why seeds are lost, and what noise costs a policy that has learned.

A seed is lost if an episode after its first success gets extremely long. Two guesses are put to the
test on fresh seeds. Raw returns, and returns discounted with 0.9, lose seeds because one long
episode makes many updates on one piece of evidence. If so, one update an episode loses fewer; and
if it is not only that it moves the weights less, then so does one update with ten times the step.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from report.claims import Criterion, Evidence
from rl_core.experiments import Arm, Results, run
from rl_core.reinforce import ReinforceConfig, reinforce
from rl_core.statistics import bootstrap_interval
from studies.continuous import (
    CAP,
    ENV,
    EPISODES,
    EXTREME,
    FRESH,
    config,
)

SHORT = 500_000  # environment steps a seed: enough to get out with sigma 0.5, and to be lost
SETTINGS = {
    "returns raw": {"normalise": "none"},
    "gamma 0.9": {"gamma": 0.9},
}
UPDATES = {
    "batches of 512": {},
    "one update an episode": {"batch_size": CAP},
    "one update, ten times the step": {"batch_size": CAP, "learning_rate": 2e-2},
}
FEWER = tuple(
    Criterion(
        f"{setting}: share of seeds lost with batches of 512, minus that with {updates}, "
        "at least 0.25",
        at_least=0.25,
    )
    for setting in SETTINGS
    for updates in list(UPDATES)[1:]
)


def arms() -> list[Arm]:
    """Each setting with each way to update, sigma 0.5."""
    found = []
    for setting, changes in SETTINGS.items():
        for updates, more in UPDATES.items():
            own = {**vars(config("sigma 0.5")), **changes, **more, "max_env_steps": SHORT}
            labels = {"setting": setting, "updates": updates}
            one = ReinforceConfig(**own)
            name = f"{setting}, {updates}"
            found.append(Arm(name, reinforce, ENV, one, EPISODES, labels=labels))
    return found


def learn(store: Path) -> Results:
    """Run what the store does not have, with fresh seeds."""
    return run(arms(), seeds=FRESH, store=store)


def lost(rows: pd.DataFrame) -> np.ndarray:
    """Which seeds of an arm had an extremely long episode, or were in one, after a success."""
    out = rows.groupby("seed")["terminated"].transform("cummax")
    late = out.groupby(rows["seed"]).shift(fill_value=False) & (rows["steps"] > EXTREME)
    return late.groupby(rows["seed"]).any().reindex(FRESH).to_numpy(bool)


def judge(results: Results) -> pd.DataFrame:
    """One row a criterion: what was asked, both shares, their difference, the answer.

    A seed has the same first weights and the same first episode in both arms: differences are paired.
    """
    rng = np.random.default_rng(np.random.SeedSequence(2024))
    gone = {arm: lost(rows) for arm, rows in results.table.groupby("arm", sort=False)}
    rows, criteria = [], iter(FEWER)
    for setting in SETTINGS:
        many, *others = (f"{setting}, {updates}" for updates in UPDATES)
        for arm in others:
            criterion = next(criteria)
            difference = gone[many].astype(float) - gone[arm]
            evidence = Evidence(*bootstrap_interval(difference, np.mean, rng=rng), seeds=len(FRESH))
            rows.append(
                {
                    "criterion": criterion.text,
                    "lost, batches of 512": int(gone[many].sum()),
                    "lost, the other": int(gone[arm].sum()),
                    "difference": str(evidence),
                    "met": criterion.answer(evidence),
                }
            )
    return pd.DataFrame(rows)
