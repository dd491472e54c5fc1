"""Chapter 6 on other seeds: criteria of 3n near their bound, and Acrobot's table on four numbers.

Nobody had looked at these seeds when the criteria stood. Of the first thirty, 28 tables of either
car learned: that is near the bound of four in five, so that a hundred others decide, once and
alone. What Acrobot shows are six numbers, of which a sine and a cosine belong together; a table on
its two angles and two speeds was tuned as those of the cars were. On seeds 1000 to 1003, of 6, 8,
10 and 12 bins a dimension and step sizes 0.1 and 0.3, 6 bins and 0.3 needed the fewest steps. Seeds
100 to 129 left open whether it is as good as the network: the ratio of steps was 1.02, from 0.86 to
1.35, against a bound of 1.25. So seeds 130 to 199 decide, once and alone.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from report.seeds import FULL, SEEDS
from rl_core.evaluation import as_learned, evaluate
from rl_core.experiments import Arm, Results, run
from rl_core.q_learning import q_learning
from rl_core.statistics import bootstrap_interval
from rl_core.training import weights_of
from rl_core.worlds.discretise import gridded
from studies import evaluation as first
from studies import reinforce as reinforce_study
from studies.shared import interval_text, of_table

NEAR_A_BOUND = range(100, 100 + 100 * len(SEEDS) // FULL)
OF_ANGLES = NEAR_A_BOUND[len(SEEDS) :]
CARS = ("MountainCar", "MountainCarContinuous")
ANGLES = "studies.acrobot_angles:AcrobotAngles"
ANGLE_BINS = 6  # in each of four dimensions: 1,296 cells


def arms_of_cars() -> list[Arm]:
    """The tables whose shares of seeds that learn are near their bound."""
    return [first.table_arm(name, first.BEST_BINS) for name in CARS]


def arms_of_acrobot() -> list[Arm]:
    """The table on angles and speeds, and the network it is held against."""
    config = first.table_config("Acrobot", ANGLE_BINS)
    table = Arm("Acrobot, table of angles", q_learning, ANGLES, config, first.TABLE_EPISODES)
    return [table, reinforce_study.arm("Acrobot", "as reported")]


def learn(store: Path) -> tuple[Results, Results]:
    """Run what the store does not have: the cars, and Acrobot."""
    return (
        run(arms_of_cars(), seeds=NEAR_A_BOUND, store=store),
        run(arms_of_acrobot(), seeds=OF_ANGLES, store=store),
    )


def mean_steps(cars: Results, acrobot: Results) -> dict[str, np.ndarray]:
    """Mean steps of each seed after learning, as in the tables of the chapter, by arm.

    Tables are greedy, the network acts as it learned to; an episode is stopped after 5,000 steps.
    """
    rules = {"episodes": first.EPISODES, "max_steps": first.CAP}
    found = {}
    for results, arms, seeds in (
        (cars, arms_of_cars(), NEAR_A_BOUND),
        (acrobot, arms_of_acrobot()[:1], OF_ANGLES),
    ):
        for arm in arms:
            levels = first.LEVELS[first.environment_of(arm.name)]
            world = gridded(arm.env, arm.config.bins, levels=levels)
            tables = zip(results.arrays(arm.name)["Q"], seeds, strict=True)
            played = [
                evaluate(arm.env, of_table(world, Q), seed=seed, **rules) for Q, seed in tables
            ]
            found[arm.name] = np.array([one["steps"].mean() for one in played])
    network, arrays = arms_of_acrobot()[1], acrobot.arrays("Acrobot, as reported")
    agents = [as_learned(network.config, weights_of(arrays, i)) for i in range(len(OF_ANGLES))]
    played = [
        evaluate(network.env, a, seed=s, **rules) for a, s in zip(agents, OF_ANGLES, strict=True)
    ]
    found[network.name] = np.array([one["steps"].mean() for one in played])
    return found


def compared(found: Mapping[str, np.ndarray]) -> pd.DataFrame:
    """One row an arm: its seeds, their median steps with the interval, and how many learned."""
    rng = np.random.default_rng(np.random.SeedSequence(2028))
    rows = []
    for arm, steps in found.items():
        middle = interval_text(bootstrap_interval(steps, rng=rng))
        learned = int((steps <= first.LEARNED).sum())
        rows.append({"arm": arm, "seeds": len(steps), "steps": middle, "learned": learned})
    return pd.DataFrame(rows)
