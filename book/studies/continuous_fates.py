"""Chapter 5: what becomes of seeds that do not learn, and how far noise alone gets."""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pandas as pd

from report.seeds import SEEDS
from rl_core.evaluation import as_learned, rollout
from rl_core.experiments import Results
from rl_core.policies import MLP, Gaussian
from rl_core.reinforce import ReinforceConfig
from rl_core.training import weights_of
from studies import shared
from studies.continuous import ENV, EXTREME, VARIANTS, Curves
from studies.policy_maps import mean_actions

FATES = (
    "learned",
    "slow or late",
    "never out",
    "out, then idle",
    "out, then pressing",
)


def fates(curves: Curves, arm: str, log_sigma: np.ndarray) -> list[str]:
    """What became of each seed.

    One that still gets out at its end, but needs too many steps, or has no budget left to come to
    the last episode, is slow or late. Another that ended in an episode that was stopped is stuck.
    What its policy does there
    follows from the cost: a step costs 0.1 (mu^2 + sigma^2) on average. It idles if the root mean
    square of mu is at most half the engine's force, and presses if it is more.

    Parameters
    ----------
    curves : Curves
    arm : str
    log_sigma : array of shape (seeds, 1)
        As the run ended with it.
    """
    found = []
    outcomes = zip(SEEDS, curves.learned(arm), curves.cut(arm), strict=True)
    for position, (seed, good, cut) in enumerate(outcomes):
        rows = curves.rows[arm]
        rows = rows[rows["seed"] == seed]
        stopped = rows[~rows["terminated"] & (rows["steps"] > EXTREME)]
        if good:
            found.append("learned")
        elif cut or stopped.empty or rows["terminated"].iloc[-1]:
            found.append("slow or late")
        elif not rows["terminated"].any():
            found.append("never out")
        else:
            force = _mean_force(stopped.iloc[-1], log_sigma[position, 0])
            found.append("out, then idle" if force <= 0.5 else "out, then pressing")
    return found


def _mean_force(episode: pd.Series, log_sigma: float) -> float:
    """Root mean square of mu in an episode that did not reach the flag."""
    square = -10 * episode["return"] / episode["steps"] - np.exp(2 * float(log_sigma))
    return float(np.sqrt(max(square, 0.0)))


def pressing_forces(curves: Curves, arm: str, log_sigma: np.ndarray) -> np.ndarray:
    """Root mean square of mu of each seed that ended pressing, in its last long episode.

    Parameters
    ----------
    curves, arm, log_sigma
        As for `fates`.
    """
    found = []
    for position, fate in enumerate(fates(curves, arm, log_sigma)):
        rows = curves.rows[arm]
        rows = rows[(rows["seed"] == SEEDS[position]) & ~rows["terminated"]]
        if fate == "out, then pressing":
            long = rows[rows["steps"] > EXTREME].iloc[-1]
            found.append(_mean_force(long, log_sigma[position, 0]))
    return np.array(found)


def fate_table(curves: Curves, results: Results) -> pd.DataFrame:
    """Seeds of each arm by what became of them."""
    rows = []
    for arm in VARIANTS:
        names = fates(curves, arm, results.arrays(arm)["log_sigma"])
        rows.append({"arm": arm, **{fate: names.count(fate) for fate in FATES}})
    return pd.DataFrame(rows)


def shown_seeds(curves: Curves, arm: str) -> dict[str, int]:
    """Places of the seeds to show of an arm."""
    return shared.shown_seeds(curves.at(arm), curves.learned(arm))


def of_each_seed(curves: Curves, results: Results, arm: str) -> pd.DataFrame:
    """What became of each seed of an arm."""
    names = fates(curves, arm, results.arrays(arm)["log_sigma"])
    return shared.fate_table(curves.rows[arm], SEEDS, names, curves.at(arm))


def learned_sigma(curves: Curves, results: Results) -> str:
    """Sigma at the end, of the seeds that learned it and the task: median and range."""
    good = curves.learned("sigma learned")
    if not good.any():
        return "none"
    sigma = np.exp(results.arrays("sigma learned")["log_sigma"][good, 0])
    return f"{np.median(sigma):.2f} ({sigma.min():.2f} to {sigma.max():.2f})"


def first_not_learned(curves: Curves, arm: str) -> int:
    """Position of the first seed that got out of the valley and did not learn; else 0."""
    out = curves.rows[arm].groupby("seed")["terminated"].any().reindex(SEEDS).to_numpy()
    return int(np.argmax(out & ~curves.learned(arm)))


def initial_force(config: ReinforceConfig, arrays: Mapping[str, np.ndarray]) -> np.ndarray:
    """Size of each seed's untrained mean for a car at rest at the bottom of the valley."""
    bottom = np.array([[-np.pi / 6, 0.0]])
    weights = (weights_of(arrays, position, "initial/") for position in range(len(SEEDS)))
    return np.array([abs(mean_actions(config, one, bottom)[0, 0]) for one in weights])


def noise_alone(sigma: float, episodes: int = 100, max_steps: int = 200_000) -> np.ndarray:
    """Steps to the goal for a mean of zero and noise of standard deviation sigma.

    Infinite where the car was not out after `max_steps`.
    """
    settings = ReinforceConfig(network=MLP(()), policy=Gaussian(mean="direct", sigma=sigma))
    weights = {
        "layer0.weight": np.zeros((2, 1), np.float32),
        "log_sigma": np.full(1, np.log(sigma), np.float32),
    }

    agent = as_learned(settings, weights)

    def play(stream: np.random.SeedSequence) -> float:
        one = rollout(ENV, agent, np.random.default_rng(stream), max_steps)
        return len(one.rewards) if one.terminated else np.inf

    with ThreadPoolExecutor(2) as threads:  # compiled episodes do not hold the interpreter's lock
        return np.array([*threads.map(play, np.random.SeedSequence(2022).spawn(episodes))])
