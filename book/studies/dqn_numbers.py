"""Chapter 4: the numbers of its prose, by their names there."""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.stats import fisher_exact

from report.claims import Finding
from rl_core.experiments import Results
from studies import dqn as study
from studies import dqn_again as again
from studies.dqn import Curves

Numbers = dict[str, str | int]


def steps(value: float) -> str:
    """As the prose has them; endless for a learner that never arrives."""
    return f"{value:,.0f}".replace("inf", "∞")


def of_figure_13(curves: Curves, trained: dict[str, dict[float, np.ndarray]]) -> Numbers:
    """Whether MountainCar stays where the report says, and whether it needs random actions."""
    arm = "MountainCar, as reported"
    within = study.within(curves, arm, 105, 175)
    numbers: Numbers = {}
    for k, inside in zip(study.MILESTONES, within, strict=True):
        at = curves.at(arm, k)
        numbers |= {f"inside-{k}": inside, f"car-{k}": f"{np.median(at):.0f}"}
        numbers[f"car-good-{k}"] = int((at <= study.LEARNED).sum())
    for name in study.ENV:
        for epsilon, needed in trained[f"{name}, as reported"].items():
            numbers[f"{name} at {epsilon}"] = steps(np.median(needed))
            numbers[f"{name} lost at {epsilon}"] = int(np.isinf(needed).sum())
    return numbers


def of_tricks(
    curves: Curves, near: Curves, findings: Iterable[Finding], tricks: Iterable[str]
) -> Numbers:
    """What each trick is worth, and how far the discount sees within the budget."""
    said = {finding.claim.id: finding.evidence for finding in findings}
    numbers: Numbers = {
        f"{claim} {k}": str(evidence)
        for claim in ("3i", "3j", "3k")
        for k, evidence in enumerate(said[claim], 1)
    }
    for name in study.ENV:
        of = near if name == "Acrobot" else curves
        times = [study.tenths_to_200(of, f"{name}, {it}") for it in ("shaped", "shaped, gamma 0.9")]
        numbers[f"ties {name}"] = f"{study.ties(*times):.0%}"
        for trick in tricks:
            needed = curves.steps_a_goal(f"{name}, {trick}")
            numbers[f"{name}, {trick} count"] = int((needed <= study.LEARNED).sum())
            numbers[f"{name}, {trick} median"] = steps(np.median(needed))
    car = "MountainCar"
    copies = (study.BUDGET[car] - study.MEMORY[car]) // study.reported(car).copy_every
    left = {f"left {gamma}": f"{gamma**copies:.0%}" for gamma in (0.99, 0.9)}
    return numbers | {"copies": copies} | left


def of_replay(curves: Curves, results: Results, variants: Sequence[str]) -> Numbers:
    """What is mended by what: seeds that learn, that ever see the goal, and greedy ones."""
    n_seeds = len(study.SEEDS)
    numbers: Numbers = {}
    for name in study.ENV:
        for variant in variants:
            share = curves.share(f"{name}, {variant}")[0]
            numbers[f"{name}-{variant}"] = round(share * n_seeds)
        greedy = study.greedy_steps(results, f"{name}, original, all four")
        numbers[f"{name}-greedy"] = steps(np.median(greedy))
        numbers[f"{name}-stuck"] = int(np.isinf(greedy).sum())
        numbers[f"{name}-arrive"] = int(np.isfinite(greedy).sum())
        for arm in ("original", "original, no replay"):
            seen, times = study.goals(curves, f"{name}, {arm}")
            numbers |= {f"{name}, {arm} seen": seen, f"{name}, {arm} times": times}
    mended = study.mended("MountainCar", study.RIVALS)
    numbers["random-share"] = f"{study.random_share(mended, mended.epsilon.end):.0%}"
    saw = [numbers[f"MountainCar, {arm} seen"] for arm in ("original", "original, no replay")]
    odds = fisher_exact([saw, [n_seeds - count for count in saw]])
    return numbers | {"fisher": f"{odds.pvalue:.2g}"}


def of_chance(fresh: Results) -> Numbers:
    """What an agent needs that learns nothing."""
    return {
        f"{name}-random-{kept}": steps(np.median(again.steps_a_goal(fresh, arm)))
        for name in study.ENV
        for arm, kept in zip(again.controls(name), again.RUNS, strict=True)
    }
