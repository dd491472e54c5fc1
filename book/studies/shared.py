"""What the studies of several chapters share: evidence, the seed in the middle, texts, times."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd

from report.claims import Evidence
from report.seeds import SEEDS
from rl_core.dqn import DQNConfig
from rl_core.evaluation import Agent, as_learned
from rl_core.experiments import Results
from rl_core.kernels.likelihood import Policy
from rl_core.statistics import bootstrap_interval, probability_of_improvement
from rl_core.worlds.discretise import GriddedTask
from rl_core.worlds.episodes import TableActor


def median_evidence(values: np.ndarray, rng: np.random.Generator) -> Evidence:
    """Median over seeds with its interval; of no seeds at all nothing is known.

    Examples
    --------
    >>> median_evidence(np.array([]), np.random.default_rng(0)).seeds
    0
    """
    if len(values) == 0:
        return Evidence.none()
    return Evidence(*bootstrap_interval(values, rng=rng), seeds=len(values))


def lower_evidence(one: np.ndarray, other: np.ndarray, rng: np.random.Generator) -> Evidence:
    """Probability that a seed of `one` has the lower value; without seeds, anything."""
    seeds = min(len(one), len(other))
    if seeds == 0:
        return Evidence(0.5, 0.0, 1.0, seeds=0)
    return Evidence(*probability_of_improvement(one, other, rng=rng), seeds=seeds)


def middle(steps: np.ndarray) -> int:
    """The place of the seed in the middle when all are ordered by their steps: not a pick.

    A place counts from 0 among the seeds of an arm; it is no seed. Of two in the middle it is the
    lower one.

    Parameters
    ----------
    steps : ndarray of shape (seeds,)
        In the order of the seeds; infinite where one does not get there.

    Examples
    --------
    >>> middle(np.array([9.0, 5.0, 7.0, np.inf]))
    2
    """
    order = np.argsort(steps, kind="stable")
    return int(order[(len(order) - 1) // 2])


def shown_seeds(steps: np.ndarray, good: np.ndarray) -> dict[str, int]:
    """Places of the seeds to show, by a rule: best, middle and worst at the end, first to fail.

    The middle is that of all seeds, the worst that of those that learned.

    Parameters
    ----------
    steps : ndarray of shape (seeds,)
        At the end; infinite where a seed had stopped.
    good : ndarray of bool, shape (seeds,)
        Which seeds learned.

    Examples
    --------
    >>> shown_seeds(np.array([300, np.inf, 100]), np.array([True, False, True]))
    {'best': 2, 'middle': 0, 'worst that learned': 0, 'failed': 1}
    """
    order = np.argsort(steps, kind="stable")
    learners = [place for place in order if good[place]]
    places = {"best": order[0], "middle": middle(steps)}
    places |= {"worst that learned": learners[-1]} if learners else {}
    places |= {"failed": np.flatnonzero(~good)[0]} if not good.all() else {}
    return {text: int(place) for text, place in places.items()}


def shown_agents(
    places: Mapping[str, int], agent: Callable[[int, str], Agent]
) -> dict[str, tuple[int | None, Agent]]:
    """The agents of the seeds to show, each with its seed, and the middle one before learning.

    Parameters
    ----------
    places : mapping of str to int
        Of `shown_seeds`.
    agent : callable
        Makes one of a place and a moment, as `rl_core.training.weights_of` takes them.
    """
    before = {"before learning": (None, agent(places["middle"], "initial/"))}
    return before | {text: (SEEDS[place], agent(place, "")) for text, place in places.items()}


def fate_table(
    rows: pd.DataFrame, seeds: range, fates: Sequence[str], steps: np.ndarray
) -> pd.DataFrame:
    """What became of each seed, as `interactive.seed_curves` takes it.

    Parameters
    ----------
    rows : pandas.DataFrame
        An arm's episodes: `seed` and `env_steps`, counted from the first.
    seeds : range
        In the order of what follows.
    fates : sequence of str, of length seeds
    steps : ndarray of shape (seeds,)
        At the end; infinite where a seed had stopped.
    """
    used = rows.groupby("seed")["env_steps"].max().reindex(seeds).to_numpy(int)
    end = np.where(np.isinf(steps), np.nan, steps)
    names = {"seed": list(seeds), "fate": fates, "steps_at_end": end, "env_steps": used}
    return pd.DataFrame(names)


def of_values(weights: Mapping[str, np.ndarray], epsilon: float = 0.0) -> Agent:
    """The epsilon-greedy policy of a network that puts out one action value an action.

    Examples
    --------
    >>> of_values({"layer0.weight": np.array([[1, 2]], np.float32)}).predict(np.ones(1))[0]
    np.int64(1)
    """
    return as_learned(DQNConfig(epsilon=epsilon), weights)


def of_table(world: GriddedTask, Q: np.ndarray) -> Agent:
    """The greedy policy of a table over the cells of a gridded task.

    Parameters
    ----------
    world : GriddedTask
    Q : float64 array of shape `world.shape`
        Of several largest values, one is drawn.

    Examples
    --------
    >>> from rl_core.worlds.discretise import gridded
    >>> world = gridded("MountainCar-v0", 10)
    >>> of_table(world, np.zeros(world.shape)).actor.policy.sizes
    array([2, 3])
    """
    sizes = np.array([len(world.grid.bins), len(world.actions)])
    policy = Policy(sizes, False, False, False, world.actions.shape[1])
    return Agent(TableActor(policy, world.grid, Q, world.actions, 0.0, np.empty(2)))


def interval_text(interval: tuple[float, float, float]) -> str:
    """An estimate with its interval, in whole numbers.

    Examples
    --------
    >>> interval_text((-1234.4, -np.inf, 0.2))
    '−1,234 [−∞, 0]'
    """
    texts = (f"{x:,.0f}".replace("inf", "∞").replace("-", "−") for x in interval)
    return "{} [{}, {}]".format(*texts)


def seconds(results: Results, arms: dict[str, tuple[str, float]]) -> pd.DataFrame:
    """Seconds that one seed took: here those of the processor, in the report by the clock.

    Parameters
    ----------
    results : Results
        With the arms.
    arms : dict of str to (str, float)
        For each arm what to call it, and the report's seconds.
    """
    rows = []
    for arm, (name, reported) in arms.items():
        made = results.provenance[results.provenance["arm"] == arm]
        taken = made["processor_seconds"]
        rows.append((name, reported, taken.mean(), taken.sum(), made["processor"].iloc[0]))
    columns = ["experiment", "2018 (s)", "now (s, mean)", "now, all seeds (s)", "processor"]
    return pd.DataFrame(rows, columns=columns)
