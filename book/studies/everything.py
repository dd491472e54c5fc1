"""What all chapters train, before the first page is made: `python -m studies.everything` in `book`.

A chapter leaves cores idle while it draws and evaluates, and while its last seeds finish. Here the
arms of all chapters follow each other without a gap. The results go into the store, where the
chapters find them. What a chapter chooses in view of results, or takes one seed for, it trains
itself. So does a chapter that is run alone.
"""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from report.seeds import SEEDS
from rl_core.experiments import Arm, run
from studies import (
    continuous,
    continuous_causes,
    dqn,
    dqn_again,
    evaluation,
    evaluation_fresh,
    own,
    q_learning,
    q_learning_fresh,
    reinforce,
)

Plan = tuple[Iterable[Arm], Iterable[int]]


def plans() -> list[Plan]:
    """Arms and their seeds, as the chapters ask for them; those that take long come first."""
    return [
        (dqn.arms(), SEEDS),
        (dqn_again.arms(), dqn_again.FRESH),
        (dqn_again.arms_near_a_bound(), dqn_again.NEAR_A_BOUND),
        (reinforce.arms(), SEEDS),
        (reinforce.trials(), reinforce.FRESH),
        ([reinforce.arm("Acrobot", "as reported")], reinforce.NEAR_A_BOUND),
        (evaluation.arms(), SEEDS),
        (evaluation.slow_arms(), evaluation.FRESH[: evaluation.TIMED_SEEDS]),
        ([arm for size in (512, 32) for arm in evaluation.timed_arms(size)], evaluation.FRESH),
        (evaluation_fresh.arms_of_cars(), evaluation_fresh.NEAR_A_BOUND),
        (evaluation_fresh.arms_of_acrobot(), evaluation_fresh.OF_ANGLES),
        (continuous.arms(), SEEDS),
        (continuous.arms(continuous.ON_FRESH_SEEDS), continuous.FRESH),
        (continuous_causes.arms(), continuous_causes.FRESH),
        (own.arms(), SEEDS),
        (own.small_arms(), SEEDS[:2]),
        (q_learning.ARMS, SEEDS),
        (q_learning_fresh.PROBABILITIES.values(), q_learning_fresh.CHOOSING),
        (q_learning_fresh.RISE_AND_HIGH, q_learning_fresh.MANY),
    ]


def by_seeds(plans: Iterable[Plan]) -> dict[tuple[int, ...], list[Arm]]:
    """The arms that have the same seeds, under names of their own: chapters use the same names."""
    found = defaultdict(list)
    for place, (arms, seeds) in enumerate(plans):
        found[tuple(seeds)] += [replace(arm, name=f"{arm.name} ({place})") for arm in arms]
    return dict(found)


if __name__ == "__main__":
    for seeds, arms in by_seeds(plans()).items():
        run(arms, seeds=seeds, store=Path("../results/store"))
