"""Chapter 2 on other seeds: readings that need them, and a second target to compare with figure 9.

What is chosen by its data is chosen on seeds from 1,000 on and judged on seeds from 100 on. The
numbers of seeds were cut once, for want of time, when a few may have been run and no result had
been read (`report.amendments`).
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from report.claims import Evidence
from report.seeds import SEEDS
from rl_core.experiments import Arm, run
from rl_core.kernels.compiled import compiled
from rl_core.planning import value_iteration
from studies import q_learning as study
from studies.q_learning_world import GAMMA, World

CHOOSING = range(1_000, 1_000 + len(SEEDS))
JUDGING = range(100, 100 + 2 * len(SEEDS))
MANY = range(100, 100 + 6 * len(SEEDS))
"""For claim 2g, whose arm with constant 0.9 falls into two bundles of seeds."""
PROBABILITIES = {
    x: study.arm(f"exploitation {x:g}", exploration=study.EpsilonGreedy(round(1 - x, 6)))
    for x in study.EXPLOITATIONS
}
RISE_AND_HIGH = [PROBABILITIES[0.9], study.RISING_ARM]
RESOLUTION = 0.05
"""What the curve of 2018 is known to. A target is excluded if every seed's curve is further off."""


def summary(world: World, arms: list[Arm], seeds: range, store) -> pd.DataFrame:
    """`studies.q_learning.summary` of arms on seeds of their own."""
    return study.summary(world, run(arms, seeds=seeds, store=store))


def best_of(found: pd.DataFrame) -> dict[str, str]:
    """The arm with the best mean of each measure."""
    means = found.groupby("arm", sort=False)[["earned", "evenness", "error"]].mean()
    return {
        "earned": means["earned"].idxmax(),
        "evenness": means["evenness"].idxmax(),
        "error": means["error"].idxmin(),
    }


def readings(world: World, store) -> tuple[dict[str, list[Evidence]], dict[str, str], pd.DataFrame]:
    """The evidence of the readings that compare means; the arms chosen; all that was measured.

    `2g typical` is the median of the seeds' own ratios, on as many seeds as `2g`.
    """
    arms = {arm.name: arm for arm in PROBABILITIES.values()}
    best = best_of(summary(world, list(arms.values()), CHOOSING, store))
    asked = {PROBABILITIES[x].name for x in (0.1, 0.2, 0.8, 0.9)} | set(best.values())
    judged = summary(world, [arms[name] for name in sorted(asked)], JUDGING, store)
    many = summary(world, RISE_AND_HIGH, MANY, store)
    rise, high = (of(many, "earned", name) for name in (study.RISES, PROBABILITIES[0.9].name))
    low = of(judged, "error", PROBABILITIES[0.1].name)
    return (
        {
            "2b": [
                worst(judged, "earned", (0.8, 0.9), best["earned"]),
                worst(judged, "evenness", (0.1, 0.2), best["evenness"]),
                worst(judged, "error", (0.1, 0.2), best["error"]),
            ],
            "2g": [
                ratio_of_means(rise, high),
                study.evidence(of(many, "unvisited", study.RISES)),
                ratio_of_means(of(many, "error", study.RISES)[: len(low)], low),
            ],
            "2g typical": [study.evidence(rise / high)],
        },
        best,
        pd.concat([judged, many]).drop_duplicates(["arm", "seed"]),
    )


def of(found: pd.DataFrame, measure: str, name: str) -> np.ndarray:
    """A measure of an arm, seed by seed."""
    return found[found["arm"] == name].sort_values("seed")[measure].to_numpy(dtype=float)


def worst(found: pd.DataFrame, measure: str, of_these: tuple[float, ...], best: str) -> Evidence:
    """The worse of two probabilities, by their means, in terms of the arm chosen elsewhere."""
    reference = of(found, measure, best)
    ratios = [
        ratio_of_means(of(found, measure, PROBABILITIES[x].name), reference) for x in of_these
    ]
    pick = max if measure == "error" else min
    return pick(ratios, key=lambda ratio: ratio.estimate)


def ratio_of_means(values: np.ndarray, reference: np.ndarray) -> Evidence:
    """The ratio of two arms' means over the same seeds, with its 95% bootstrap interval."""
    rng = np.random.default_rng(2018)
    drawn = rng.integers(0, len(values), (10_000, len(values)))
    ratios = values[drawn].mean(axis=1) / reference[drawn].mean(axis=1)
    low, high = np.quantile(ratios, (0.025, 0.975))
    estimate = values.mean() / reference.mean()
    return Evidence(
        float(estimate), float(min(low, estimate)), float(max(high, estimate)), seeds=len(values)
    )


def on_policy(world: World, seeds=SEEDS, episodes: int = study.EPISODES) -> np.ndarray:
    """Figure 9 with the target of SARSA: ||Q - Q*|| after each episode, shape (seeds, episodes).

    The target is r + gamma Q(s', a') with the action a' that is then taken, epsilon-greedy as in
    figure 9. (Sutton and Barto, section 6.4.)
    """
    mdp = world.model
    norms = np.empty((len(seeds), episodes))
    for row, seed in zip(norms, seeds, strict=True):
        Q, rng = np.zeros(world.Q_star.shape), np.random.default_rng(seed)
        slip = float(mdp.probability[0, 0, 1])
        start = int(mdp.start_state[0])
        epsilon = 1 - study.EXPLOITATION
        _sarsa(
            *(mdp.successor, mdp.reward, mdp.terminal, slip, start),
            *(epsilon, study.STEP_SIZE, GAMMA, Q, world.Q_star, row, rng),
        )
    return norms


@compiled
def _sarsa(
    successor, reward, terminal, slip, start, epsilon, alpha, gamma, Q, Q_star, norms, rng
) -> None:
    """Learn, and write the norm of the error after each episode over `norms`."""
    for k in range(len(norms)):
        s = start
        a = _epsilon_greedy(Q[s], epsilon, rng)
        while not terminal[s]:
            slipped = int(rng.random() < slip)
            s_next, target, a_next = successor[s, a, slipped], reward[s, a, slipped], 0
            if not terminal[s_next]:
                a_next = _epsilon_greedy(Q[s_next], epsilon, rng)
                target += gamma * Q[s_next, a_next]
            Q[s, a] += alpha * (target - Q[s, a])
            s, a = s_next, a_next
        norms[k] = np.sqrt(((Q - Q_star) ** 2).sum())


@compiled
def _epsilon_greedy(q, epsilon: float, rng) -> int:
    """A random action with probability epsilon, else a best one, drawn among equals."""
    if rng.random() < epsilon:
        return rng.integers(0, len(q))
    best = np.flatnonzero(q == q.max())
    return best[rng.integers(0, len(best))]


def collected_by_bumping(world: World) -> float:
    """The plateau in a maze in which bumping into a wall enters the own cell again.

    In the course's maze only a move off the grid does. It matters only to one who stands on a flag
    without holding it: there the move would collect it.
    """
    maze, mdp = world.maze, world.model
    successor = mdp.successor.copy()
    for letter, (row, column) in maze.flag_cells.items():
        for flags in (held for held in maze.flag_sets if letter not in held):
            state = maze.state(row, column, flags)
            stays = successor[state] == state
            successor[state][stays] = maze.state(row, column, "".join(sorted(flags + letter)))
    names = ("probability", "reward", "terminal", "start_state", "start_probability")
    other = type(mdp)(successor=successor, **{name: getattr(mdp, name) for name in names})
    Q = value_iteration(other, gamma=GAMMA, tolerance=1e-10, progress=False).Q
    return float(np.linalg.norm(Q[~world.reachable]))


def distances(norms: np.ndarray, original: pd.DataFrame) -> np.ndarray:
    """How far each seed's curve is at most from that of 2018, where that is flat."""
    return np.array([study.distance_from_original(norm[None], original) for norm in norms])


def stuck_with(world: World, found: pd.DataFrame, arms: Mapping[float, str]) -> pd.DataFrame:
    """For each arm: seeds that lose more than a tenth, and those of them that carry one flag.

    Flags are those brought home in the evaluations of the last episodes, to the nearest number.
    """
    rows = []
    for x, name in arms.items():
        flags = found[(found["arm"] == name) & (found["lost"] > 0.1)]["eval_return"].round()
        rows.append({"exploitation": x, "stuck": len(flags), "one flag": int((flags == 1).sum())})
    return pd.DataFrame(rows).set_index("exploitation")
