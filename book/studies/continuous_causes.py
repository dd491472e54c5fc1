"""Chapter 5: experiments on why seeds are lost, and what noise costs a policy that has learned.

A seed is lost if an episode after its first success gets extremely long. Two guesses are put to the
test on fresh seeds. Raw returns, and returns discounted with 0.9, lose seeds because one long
episode makes many updates on one piece of evidence. If so, one update an episode loses fewer; and
if it is not only that it moves the weights less, then so does one update with ten times the step.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from report.claims import Criterion, Evidence
from rl_core.evaluation import Agent, as_learned, evaluate, greedy
from rl_core.experiments import Arm, Results, run
from rl_core.policies import MLP, Gaussian
from rl_core.reinforce import ReinforceConfig, reinforce
from rl_core.statistics import Interval, bootstrap_interval, proportion_interval
from rl_core.training import weights_of
from studies.continuous import (
    BUDGET,
    CAP,
    ENV,
    EPISODES,
    EXTREME,
    FRESH,
    SIGMAS,
    SWEEPS,
    Curves,
    config,
)

LIMIT = 999  # steps: Gymnasium's own time limit
REST = 0.1 * 0.3**2 * LIMIT  # what trembling about zero with sigma 0.3 costs until then
SOLVED = 90  # return, by Gymnasium
TRIES = 100  # episodes of an agent that is evaluated
FORCES = (0.2, 0.4, 0.6, 0.8, 1.0, 1.5)
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
            own = {**changes, **more, "max_env_steps": SHORT}
            labels = {"setting": setting, "updates": updates}
            one = replace(config("sigma 0.5"), **own)
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

    A seed has the same weights and the same episode to begin with in both arms: a pair.
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
                    "low": evidence.low,
                    "met": criterion.answer(evidence),
                }
            )
    return pd.DataFrame(rows)


def drivers() -> pd.DataFrame:
    """Return of drivers who push with one force along the velocity, for each sigma and force.

    mu = f sign(v), but for a narrow ramp: clip(1000 v, -f, f) by four rectified units. No more than
    an example of good driving: what they earn can be earned.
    """
    rows = []
    for sigma in SIGMAS:
        settings = ReinforceConfig(network=MLP((4,)), policy=Gaussian(mean="direct", sigma=sigma))
        for force in FORCES:
            weights = {
                "layer0.weight": np.array([[0.0] * 4, [1e3, 1e3, -1e3, -1e3]], np.float32),
                "layer0.bias": np.array([0.0, -force, 0.0, -force], np.float32),
                "layer1.weight": np.array([[1.0], [-1.0], [-1.0], [1.0]], np.float32),
                "layer1.bias": np.zeros(1, np.float32),
                "log_sigma": np.full(1, np.log(sigma), np.float32),
            }
            earned = _played(as_learned(settings, weights))[0]
            rows.append({"sigma": sigma, "force": force, "return": earned})
    return pd.DataFrame(rows)


def _played(agent: Agent) -> tuple[float, float]:
    """Mean return of an agent under the time limit, and the share of episodes that get out."""
    played = evaluate(ENV, agent, seed=0, episodes=TRIES, max_steps=LIMIT)
    return played["return"].mean(), played["terminated"].mean()


def mean_action(curves: Curves, results: Results) -> pd.DataFrame:
    """One row a seed that learned, of each sigma: as it learned to act, and by its mean alone.

    Columns `arm, seed, return, out` for the policy with its noise, `mean_return, mean_out` without.
    """
    rows = []
    for arm in (*SWEEPS["two observations"], "sigma learned"):
        arrays = results.arrays(arm)
        for position in np.flatnonzero(curves.learned(arm)):
            agent = as_learned(config(arm), weights_of(arrays, int(position)))
            rows.append((arm, curves.seeds[position], *_played(agent), *_played(greedy(agent))))
    names = ["arm", "seed", "return", "out", "mean_return", "mean_out"]
    return pd.DataFrame(rows, columns=names)


def mean_action_text(table: pd.DataFrame) -> pd.DataFrame:
    """One row an arm: medians over seeds with intervals, with and without noise."""
    rng = np.random.default_rng(np.random.SeedSequence(2025))
    rows = []
    for arm, seeds in table.groupby("arm", sort=False):
        row = {"arm": arm, "seeds that learned": len(seeds)}
        for column, text in (("return", "with its noise"), ("mean_return", "mean action")):
            low, middle, high = sorted(bootstrap_interval(seeds[column].to_numpy(), rng=rng))
            row[f"return, {text}"] = f"{middle:.0f} [{low:.0f}, {high:.0f}]"
        row["out in time, with its noise"] = f"{seeds['out'].mean():.0%}"
        row["out in time, mean action"] = f"{seeds['mean_out'].mean():.0%}"
        rows.append(row)
    return pd.DataFrame(rows)


def early_returns(curves: Curves, arm: str, episodes: int = 10) -> np.ndarray:
    """Mean return of the first episodes of each seed that learned."""
    rows = curves.rows[arm]
    means = rows[rows["episode"] <= episodes].groupby("seed")["return"].mean()
    return means.reindex(curves.seeds).to_numpy()[curves.learned(arm)]


def profiles(curves: Curves, arms: tuple[str, ...], steps: np.ndarray) -> pd.DataFrame:
    """Share of all seeds that need at most so many steps at the end, for each arm."""
    rows = []
    for arm in arms:
        share = (curves.at(arm)[:, None] <= steps).mean(axis=0)
        rows.append(pd.DataFrame({"arm": arm, "steps": steps, "share": share}))
    return pd.concat(rows, ignore_index=True)


def engines(store: Path) -> tuple[dict[str, pd.DataFrame], dict[str, float]]:
    """Seed 0 with sigma 1 through either engine: its episodes, and the processor's seconds."""
    arms = [
        Arm(engine, reinforce, ENV, replace(config("sigma 1"), engine=engine), 300)
        for engine in ("compiled", "torch")
    ]
    results = run(arms, seeds=[0], store=store)
    tables = dict(iter(results.table.groupby("arm", sort=False)))
    return tables, results.provenance.set_index("arm")["processor_seconds"].to_dict()


def parting(tables: dict[str, pd.DataFrame]) -> int:
    """The first episode in which the two engines do not take the same steps; 0 if none."""
    one, other = (rows["steps"].to_numpy() for rows in tables.values())
    both = min(len(one), len(other))
    parted = np.flatnonzero(one[:both] != other[:both])
    return int(parted[0]) + 1 if len(parted) else 0


def numbers_of_noise(alone: dict[float, np.ndarray]) -> dict[str, str | int]:
    """How far noise of each width gets alone, and what it has cost by then."""
    numbers: dict[str, str | int] = {"longest": f"{CAP:,}", "tried alone": len(alone[0.3])}
    for sigma, steps in alone.items():
        median, driven = np.median(steps), np.minimum(steps, CAP).mean()
        numbers[f"out {sigma}"] = f"{np.isfinite(steps).mean():.0%}"
        numbers[f"noise {sigma}"] = f"{median:,.0f}".replace("inf", "∞")
        numbers[f"cost {sigma}"] = f"{0.1 * sigma**2 * driven:,.0f}"
    return numbers


def got_out(alone: np.ndarray, curves: Curves) -> tuple[Interval, Interval]:
    """Shares with 95% intervals: episodes of noise alone, and seeds as reported, that got out."""
    ever = curves.rows["as reported"].groupby("seed")["terminated"].any()
    return (
        proportion_interval(int(np.isfinite(alone).sum()), len(alone)),
        proportion_interval(int(ever.sum()), len(curves.seeds)),
    )


def numbers_of_chance(escaped: Interval, ever: Interval, seeds: int) -> dict[str, str | int]:
    """How many seeds noise alone would get out within the budget, and how many did get out."""
    tries = BUDGET // CAP
    chance, *chances = (f"{1 - (1 - share) ** tries:.0%}" for share in escaped)
    return {
        "tries": tries,
        "chance": chance,
        "chances": " to ".join(chances),
        "ever": round(ever.estimate * seeds),
        "ever-low": f"{ever.low:.0%}",
    }


def numbers_of_rest(first_returns: np.ndarray) -> dict[str, str | int]:
    """How the first episodes of those that learned compare with resting."""
    return {
        "limit": LIMIT,
        "still": f"{REST:.0f}",
        "clumsy": int((first_returns < -REST).sum()),
        "learned-wide": len(first_returns),
        "clumsy-return": f"{np.median(first_returns):,.0f}".replace("-", "−"),
    }
