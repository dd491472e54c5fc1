"""Chapter 2: what the report claims about Q-learning, what would bear it out, how it is measured.

The report's epsilon is the probability of exploiting. Here it is called `exploitation`; the learner
takes the standard epsilon, 1 - exploitation.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from report.claims import Claim, Criterion, Evidence, Finding, Reading
from report.seeds import SEEDS
from rl_core.experiments import Arm, Results
from rl_core.exploration import EpsilonGreedy, Linear, Softmax, UnnormalisedSoftmax, VisitDecay
from rl_core.q_learning import QLearningConfig
from rl_core.statistics import bootstrap_interval
from studies.on_model import q_learning_on_model
from studies.q_learning_world import GAMMA, World

EPISODES = 5_000
STEP_SIZE = 0.2
EXPLOITATION = 0.1
LATE = 1_000
"""What the agent does at the end is read off this many last episodes."""
LAST = 500
"""The error at the end is the mean over this many last episodes."""

STEP_SIZES = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 0.9)
EXPLOITATIONS = (0.1, 0.2, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95)
TEMPERATURES = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 5.0)
DECAY = VisitDecay(initial=1.0, exponent=0.6)
RISING = Linear(0.9, 0.1, EPISODES)
FILM_EPISODES = tuple(sorted({round(x) for x in np.geomspace(1, EPISODES, 90)}))
SPLIT_EPISODES = tuple(range(50, EPISODES + 1, 50))


def arm(name: str, *, step_size=STEP_SIZE, exploration=None, snapshots=(), max_steps=None) -> Arm:
    """Q-learning on the Maze, as in figure 9 but for what is given."""
    if exploration is None:
        exploration = EpsilonGreedy(1 - EXPLOITATION)
    config = QLearningConfig(
        gamma=GAMMA,
        step_size=step_size,
        exploration=exploration,
        max_steps=max_steps,
        max_env_steps=None,
    )
    learner = q_learning_on_model
    return Arm(name, learner, "rl_core/Maze-v0", config, EPISODES, snapshots=snapshots)


FIGURE_9 = arm("figure 9", snapshots=tuple(sorted({0, *FILM_EPISODES, *SPLIT_EPISODES})))
# Figure 9 itself is one of each sweep.
BY_STEP_SIZE = {
    x: FIGURE_9 if x == STEP_SIZE else arm(f"step size {x:g}", step_size=x) for x in STEP_SIZES
}
BY_EXPLOITATION = {
    x: FIGURE_9
    if x == EXPLOITATION
    else arm(f"exploitation {x:g}", exploration=EpsilonGreedy(round(1 - x, 6)))
    for x in EXPLOITATIONS
}
BY_TEMPERATURE = {
    x: arm(f"softmax, temperature {x:g}", exploration=Softmax(x)) for x in TEMPERATURES
}
DECAYING_ARM = arm("step size decays with visits", step_size=DECAY)
RISING_ARM = arm("exploitation rises from 0.1 to 0.9", exploration=EpsilonGreedy(RISING))
FAULTY_ARM = arm("faulty softmax of 2018", exploration=UnnormalisedSoftmax(), max_steps=100)
ARMS = list(
    {
        each.name: each
        for each in (
            FIGURE_9,
            *BY_STEP_SIZE.values(),
            *BY_EXPLOITATION.values(),
            *BY_TEMPERATURE.values(),
            DECAYING_ARM,
            RISING_ARM,
            FAULTY_ARM,
        )
    }.values()
)
DECAYING, RISES, FAULTY = (each.name for each in (DECAYING_ARM, RISING_ARM, FAULTY_ARM))

CLAIMS = (
    Claim(
        "2a",
        "2.1.1",
        "A large step size makes the updates oscillate, a small one makes learning slow; about "
        "0.15 is good.",
        (
            Criterion(
                "oscillation (mean change of the error from one episode to the next, last 1,000 "
                "episodes) with step size 0.9 at least 2 times that with 0.15",
                at_least=2,
            ),
            Criterion(
                "episodes until ||Q - Q*|| is first within 1 of the plateau: with 0.02 at least 2 "
                "times as many as with 0.15 (never counts as 5,000)",
                at_least=2,
            ),
            Criterion(
                "error at the end with 0.15 at most 1.5 times the smallest of the step sizes tried",
                at_most=1.5,
            ),
        ),
        "Figures S2.4, S2.5",
    ),
    Claim(
        "2b",
        "2.1.2",
        "To exploit, an exploitation probability of 0.8 to 0.9 is good; to explore, 0.1 to 0.2.",
        (
            Criterion(
                "discounted return while learning (last 1,000 episodes): the worse of 0.8 and 0.9 "
                "at least 0.9 times the best of the probabilities tried",
                at_least=0.9,
            ),
            Criterion(
                "evenness of the visits: the worse of 0.1 and 0.2 at least 0.9 times the best of "
                "the probabilities tried",
                at_least=0.9,
            ),
            Criterion(
                "error at the end: the worse of 0.1 and 0.2 at most 1.5 times the smallest of the "
                "probabilities tried",
                at_most=1.5,
            ),
        ),
        "Figure S2.6",
        reading="each seed against the best arm of its own",
        readings=(
            Reading(
                "means, against an arm chosen on other seeds",
                (
                    Criterion(
                        "discounted return while learning (last 1,000 episodes): the worse of 0.8 "
                        "and 0.9, by the mean over fresh seeds, at least 0.9 times the mean of the "
                        "probability that was best on seeds from 1,000 on",
                        at_least=0.9,
                    ),
                    Criterion(
                        "evenness of the visits: the same for the worse of 0.1 and 0.2",
                        at_least=0.9,
                    ),
                    Criterion(
                        "error at the end: the same for the worse of 0.1 and 0.2, at most 1.5 "
                        "times",
                        at_most=1.5,
                    ),
                ),
            ),
        ),
    ),
    Claim(
        "2c",
        "2.1.3",
        "A low exploitation probability gets much closer to Q* within 5,000 episodes than a high "
        "one.",
        (
            Criterion("error at the end with 0.9 at least 5 times that with 0.1", at_least=5),
            Criterion("error at the end with 0.8 at least 5 times that with 0.2", at_least=5),
        ),
        "Figure S2.6",
    ),
    Claim(
        "2d",
        "2.1.3",
        "Softmax exploration visits less diversely and gets less close to Q*.",
        (
            Criterion(
                "evenness of the visits with softmax (temperature 1, as the report's formula has "
                "it) at most 0.9 times that with exploitation 0.1",
                at_most=0.9,
            ),
            Criterion(
                "error at the end with softmax of temperature 1 at least 1.1 times that with "
                "exploitation 0.1",
                at_least=1.1,
            ),
            Criterion(
                "evenness of the visits, the same comparison for temperature 0.1", at_most=0.9
            ),
            Criterion("error at the end, the same comparison for temperature 0.1", at_least=1.1),
        ),
        "Figure S2.7",
    ),
    Claim(
        "2e",
        "2.1.3",
        "With low exploitation, behaviour stays poor even when Q is close to Q*.",
        (
            Criterion(
                "with exploitation 0.1, ||Q - Q*|| at the end is at most 0.1 above the plateau",
                at_most=0.1,
            ),
            Criterion(
                "with exploitation 0.1, the discounted return while learning (last 1,000 "
                "episodes) is at most half of the optimum v*(s0)",
                at_most=0.5,
            ),
        ),
        "Figure S2.6",
    ),
    Claim(
        "2f",
        "2.1.3",
        "With high exploitation many table entries are still unvisited after 5,000 episodes.",
        (
            Criterion(
                "with exploitation 0.9 at least 5% of the visitable entries unvisited",
                at_least=0.05,
            ),
            Criterion("with exploitation 0.8 at least 5% of them unvisited", at_least=0.05),
            Criterion("with exploitation 0.1 at most 1% of them unvisited", at_most=0.01),
        ),
        "Figure S2.6",
    ),
    Claim(
        "2g",
        "2.1.3",
        "An exploitation probability that rises over time gets both.",
        (
            Criterion(
                "rising from 0.1 to 0.9, the discounted return while learning (last 1,000 "
                "episodes) is at least 0.9 times that with constant 0.9",
                at_least=0.9,
            ),
            Criterion(
                "rising from 0.1 to 0.9, at most 1% of the visitable entries are unvisited",
                at_most=0.01,
            ),
            Criterion(
                "rising from 0.1 to 0.9, the error at the end is at most 2 times that of constant "
                "0.1",
                at_most=2,
            ),
        ),
        "Figure S2.8",
        reading="the typical seed",
        readings=(
            Reading(
                "means over seeds",
                (
                    Criterion(
                        "rising from 0.1 to 0.9, the mean discounted return while learning (last "
                        "1,000 episodes) of fresh seeds is at least 0.9 times that with constant "
                        "0.9",
                        at_least=0.9,
                    ),
                    Criterion(
                        "rising from 0.1 to 0.9, at most 1% of the visitable entries are "
                        "unvisited in the median of fresh seeds",
                        at_most=0.01,
                    ),
                    Criterion(
                        "rising from 0.1 to 0.9, the mean error at the end of fresh seeds is at "
                        "most 2 times that of constant 0.1",
                        at_most=2,
                    ),
                ),
            ),
        ),
        amended="the first criterion, open on seeds 0 to 29, is judged on seeds 100 to 279",
    ),
    Claim(
        "2h",
        "2.1.3, fig 9",
        "With epsilon 0.1 and step size 0.2 the error falls to a constant gap.",
        (
            Criterion(
                "||Q - Q*||, mean of episodes 4,001 to 5,000, is at most 0.05 above the plateau "
                "that the unreachable states set (it cannot be below)",
                at_most=0.05,
            ),
            Criterion(
                "||Q - Q*||: the mean of episodes 4,001 to 5,000 differs from that of 3,001 to "
                "4,000 by at most 0.05",
                at_least=-0.05,
                at_most=0.05,
            ),
        ),
        "Figures 9, S2.1",
        amended="the lower bound of the first criterion, 0, was struck out: nothing can fail it",
    ),
    Claim(
        "2i",
        "2.1.3",
        "The greedy policy then equals the optimal one in every state.",
        (
            Criterion(
                "share of the visitable states in which the greedy action is optimal after 5,000 "
                "episodes is 1",
                at_least=1,
            ),
            Criterion(
                "the greedy policy loses at most 1% of the optimum v*(s0)",
                at_most=0.01,
            ),
        ),
        "Figure S2.3",
    ),
)


def curves(results: Results, arm: Arm, column: str) -> np.ndarray:
    """A column of an arm's table as an array of shape (seeds, episodes)."""
    table = results.table[results.table["arm"] == arm.name]
    return table[column].to_numpy(dtype=float).reshape(-1, EPISODES)


def errors(results: Results, arms: Mapping[float, Arm]) -> dict[float, np.ndarray]:
    """The error in the visitable entries over the episodes, for each value of a parameter."""
    return {value: curves(results, arm, "rmse_visitable") for value, arm in arms.items()}


def earned_curves(results: Results, arm: Arm, window: int) -> np.ndarray:
    """The mean discounted return of every `window` episodes, shape (seeds, windows)."""
    each = GAMMA ** (curves(results, arm, "steps") - 1) * curves(results, arm, "return")
    return each.reshape(len(each), -1, window).mean(axis=2)


def summary(world: World, results: Results) -> pd.DataFrame:
    """What is compared between arms: a row an arm and seed."""
    rows = [
        {"arm": name, "seed": seed, **measures(world, table)}
        for (name, seed), table in results.table.groupby(["arm", "seed"], sort=False)
    ]
    found = pd.DataFrame(rows)
    evenly = [evenness(world, results.arrays(name)["visits"]) for name in found["arm"].unique()]
    return found.assign(evenness=np.concatenate(evenly))


def measures(world: World, table: pd.DataFrame) -> dict[str, float]:
    """What is read off the table of one seed."""
    error, late, last = table["rmse_visitable"].to_numpy(), table.iloc[-LATE:], table.iloc[-1]
    close = np.flatnonzero(table["error_norm"].to_numpy() <= world.plateau + 1)
    return {
        "error": error[-LAST:].mean(),
        "norm": table["error_norm"].iloc[-LAST:].mean(),
        "oscillation": np.abs(np.diff(error[-LATE:])).mean(),
        "slowness": close[0] + 1 if len(close) else EPISODES,
        "unvisited": 1 - last["visited_entries"] / world.entries,
        "earned": earned(late).mean(),
        "return": late["return"].mean(),
        "steps": late["steps"].mean(),
        "steps_in_all": last["env_steps"],
        "cut_off": 1 - table["terminated"].mean(),
        "optimal_share": last["optimal_states"] / world.visitable.sum(),
        "lost": last["value_lost"] / world.optimum,
        "eval_return": table["eval_return"].iloc[-LAST:].mean(),
        "eval_steps": table["eval_steps"].iloc[-LAST:].mean(),
    }


def earned(table: pd.DataFrame) -> pd.Series:
    """The discounted return of each episode: the Maze pays on the last step only."""
    return GAMMA ** (table["steps"] - 1) * table["return"]


def evenness(world: World, visits: np.ndarray) -> np.ndarray:
    """How evenly visits spread over the visitable entries: exp(entropy) / entries; 1 is evenly."""
    share = visits[:, world.visitable].reshape(len(visits), -1).astype(float)
    share /= share.sum(axis=1, keepdims=True)
    entropy = -(share * np.log(np.where(share > 0, share, 1))).sum(axis=1)
    return np.exp(entropy) / world.entries


def levels(world: World, norms: np.ndarray) -> pd.DataFrame:
    """Figure 9's norm at the end, seed by seed; norms of shape (seeds, episodes)."""
    before, after = (norms[:, k : k + LATE].mean(axis=1) for k in (3_000, 4_000))
    return pd.DataFrame({"above_plateau": after - world.plateau, "change": after - before})


def settled(norms: np.ndarray, within: float = 0.05) -> int:
    """The episode from which on the median of the seeds stays this close to its level at the end.

    0.05 is what the curve of 2018 is known to.
    """
    median = np.median(norms, axis=0)
    away = np.flatnonzero(np.abs(median - median[-LATE:].mean()) > within)
    return int(away[-1]) + 2 if len(away) else 1


def figure_9_table(norms: np.ndarray) -> pd.DataFrame:
    """Figure 9 as numbers: the median of each episode with its 95% interval, and every seed."""
    middle, low, high = bootstrap_interval(norms, rng=np.random.default_rng(2018))
    seeds = {f"seed_{seed}": curve for seed, curve in zip(SEEDS, norms, strict=True)}
    episode = np.arange(1, EPISODES + 1)
    table = pd.DataFrame({"episode": episode, "median": middle, "low": low, "high": high, **seeds})
    return table.round(4)


def distance_from_original(norms: np.ndarray, original: pd.DataFrame) -> float:
    """How far the curve of 2018 is from our median at most, where both are flat."""
    flat = original[original["episode"].between(1_500, EPISODES)]
    median = np.median(norms, axis=0)[flat["episode"].astype(int) - 1]
    return float(np.abs(flat[["low", "high"]].mean(axis=1) - median).max())


MEASURES = ("error", "unvisited", "earned", "lost")
"""What a parameter of exploration or learning is judged by."""


def swept(world: World, found: pd.DataFrame, arms: Mapping[float, str], name: str) -> pd.DataFrame:
    """The `MEASURES` of each arm and seed against the parameter `name` that the arms differ in.

    The error is an RMSE; `unvisited` is in % of the entries, `earned` and `lost` in % of the
    optimum.
    """
    scales = {"error": 1, "unvisited": 100, "earned": 100 / world.optimum, "lost": 100}
    values = {arm: x for x, arm in arms.items()}
    rows = found[found["arm"].isin(values)]
    table = rows[["seed"]].assign(**{m: scales[m] * rows[m] for m in MEASURES})
    table.insert(0, name, rows["arm"].map(values))
    return table.reset_index(drop=True)


def left_over(world: World, found: pd.DataFrame, step_sizes: Mapping[float, str]) -> pd.DataFrame:
    """The norm of the error in the visitable entries at the end, for each step size and seed."""
    table = swept(world, found, step_sizes, "step_size")
    norm = np.sqrt(world.entries) * table["error"]
    return table[["step_size", "seed"]].assign(measured=norm)


def contested(world: World, Q: np.ndarray) -> pd.DataFrame:
    """For each visitable state: the lead of its best action, and in what % of seeds Q has another.

    Q has the shape (seeds, S, A).
    """
    states = np.flatnonzero(world.visitable)
    places = [world.maze.locate(state) for state in states]
    table = pd.DataFrame(places, columns=["row", "column", "flags"])
    table.insert(0, "state", states)
    table["flags"] = table["flags"].replace("", "none")
    return table.assign(lead=world.stakes(), wrong=100 * world.wrong(Q).mean(axis=0))


def split_table(after: np.ndarray, parts: dict[str, np.ndarray]) -> pd.DataFrame:
    """The parts of the squared error at each snapshot, a row an episode and seed."""
    seeds = next(iter(parts.values())).shape[0]
    index = {"episode": np.tile(after, seeds), "seed": np.repeat(np.arange(seeds), len(after))}
    return pd.DataFrame(index | {name: part.ravel() for name, part in parts.items()})


def final_split(parts: dict[str, np.ndarray]) -> pd.DataFrame:
    """The parts after the last episode, and their sum."""
    last = {name: part[:, -1] for name, part in parts.items()}
    whole = sum(last.values())
    rows = []
    for name, part in (*last.items(), ("all", whole)):
        found = evidence(part)
        share = 100 * np.median(part / whole)
        values = {"squared error": found.estimate, "low": found.low, "high": found.high}
        rows.append({"entries": name, **values, "share (%)": share})
    return pd.DataFrame(rows)


def findings(
    world: World,
    found: pd.DataFrame,
    figure_9: pd.DataFrame,
    readings: Mapping[str, Sequence[Evidence]],
) -> list[Finding]:
    """Hold the seeds' measures (`summary` of all arms, `levels`) against the criteria.

    `readings` is what `studies.q_learning_fresh.readings` found on other seeds.
    """

    def of(measure: str, name: str) -> np.ndarray:
        rows = found[found["arm"] == name].sort_values("seed")
        return rows[measure].to_numpy(dtype=float)

    def stack(measure: str, arms) -> np.ndarray:
        return np.stack([of(measure, x.name) for x in arms])

    a, x, t = BY_STEP_SIZE, BY_EXPLOITATION, BY_TEMPERATURE
    low, softmax, cold = x[0.1].name, t[1.0].name, t[0.1].name
    judged = {
        "2a": (
            of("oscillation", a[0.9].name) / of("oscillation", a[0.15].name),
            of("slowness", a[0.02].name) / of("slowness", a[0.15].name),
            of("error", a[0.15].name) / stack("error", a.values()).min(axis=0),
        ),
        "2b": (
            stack("earned", (x[0.8], x[0.9])).min(axis=0) / stack("earned", x.values()).max(axis=0),
            stack("evenness", (x[0.1], x[0.2])).min(axis=0)
            / stack("evenness", x.values()).max(axis=0),
            stack("error", (x[0.1], x[0.2])).max(axis=0) / stack("error", x.values()).min(axis=0),
        ),
        "2c": (
            of("error", x[0.9].name) / of("error", low),
            of("error", x[0.8].name) / of("error", x[0.2].name),
        ),
        "2d": (
            of("evenness", softmax) / of("evenness", low),
            of("error", softmax) / of("error", low),
            of("evenness", cold) / of("evenness", low),
            of("error", cold) / of("error", low),
        ),
        "2e": (of("norm", low) - world.plateau, of("earned", low) / world.optimum),
        "2f": (
            of("unvisited", x[0.9].name),
            of("unvisited", x[0.8].name),
            of("unvisited", low),
        ),
        "2g": (
            of("earned", RISES) / of("earned", x[0.9].name),  # replaced: decided on more seeds
            of("unvisited", RISES),
            of("error", RISES) / of("error", low),
        ),
        "2h": (figure_9["above_plateau"].to_numpy(), figure_9["change"].to_numpy()),
        "2i": (of("optimal_share", low), of("lost", low)),
    }
    pieces = {name: [evidence(values) for values in each] for name, each in judged.items()}
    pieces["2g"][:1] = readings["2g typical"]
    others = {c.id: [readings[c.id]] if c.readings else [] for c in CLAIMS}
    return [c.judge(*pieces[c.id], readings=others[c.id]) for c in CLAIMS]


def evidence(values: np.ndarray) -> Evidence:
    """The median over seeds with its 95% interval."""
    interval = bootstrap_interval(values, rng=np.random.default_rng(2018))
    return Evidence(*interval, seeds=len(values))
