"""Chapter 6: the tables and the arms under time limits, and what the report claims of all agents.

Settings of the tables were chosen on seeds 1000 to 1003: of step sizes 0.1 and 0.3 and several ways
to explore, the one that learned on both cars; of the numbers of bins, 20, with which the steps at
the end were fewest. An episode of training is stopped after 3,000 steps.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from scipy.stats import kendalltau

from report import settings
from report.claims import Claim, Criterion, Evidence, Finding, Reading
from report.seeds import SEEDS
from rl_core.dqn import dqn
from rl_core.evaluation import Agent, Measure, as_learned, evaluate, greedy
from rl_core.experiments import Arm, Results, run
from rl_core.exploration import EpsilonGreedy, Linear, Trials
from rl_core.q_learning import QLearningConfig, q_learning
from rl_core.statistics import bootstrap_interval, proportion_interval
from rl_core.training import weights_of
from rl_core.worlds.discretise import gridded
from studies import continuous as continuous_study
from studies import dqn as dqn_study
from studies import reinforce as reinforce_study
from studies.fastest import Fastest, fastest
from studies.shared import of_table, of_values

ENV = {
    "Acrobot": "Acrobot-v1",
    "MountainCar": "MountainCar-v0",
    "MountainCarContinuous": "MountainCarContinuous-v0",
}
LIMIT = {"Acrobot": 500, "MountainCar": 200, "MountainCarContinuous": 999}  # Gymnasium's own
LEVELS = {"Acrobot": None, "MountainCar": None, "MountainCarContinuous": 3}  # forces -1, 0, 1

BINS = (5, 10, 20, 40, 80)  # in each of the cars' two dimensions
BEST_BINS = 20
ACROBOT_BINS = 6  # in each of six dimensions: 46,656 cells
TABLE_EPISODES = 2_000
TABLE_CAP = 3_000  # steps an episode of training
LIMITED_EPISODES = 2_000  # at most, under a time limit

EPISODES = 100  # of evaluation, an agent and seed
CAP = 5_000  # steps an episode of evaluation; a stopped one counts with these
LEARNED = 500  # steps; an agent that learned needs at most so many on average
FRESH = range(100, 100 + len(SEEDS))  # nobody had seen them when the criterion of t was changed
TRAINED_EPSILON = 0.1  # share of random actions that DQN's training comes down to
TIMED_SEEDS = 5  # of REINFORCE
TIMED_EPISODES = 20  # of DQN, as in the report
POINTS = (50, 100, 200, 400, 800)  # grid points a dimension, for the fastest way
STARTS = np.linspace(-0.6, -0.4, 401)


def table_config(name: str, bins: int, limit: int = TABLE_CAP) -> QLearningConfig:
    """Q-learning on a grid, exploring less and less over the first 500 episodes."""
    return QLearningConfig(
        gamma=0.99,
        step_size=0.3,
        exploration=EpsilonGreedy(Linear(1.0, 0.02, episodes=500)),
        max_steps=limit,
        max_env_steps=None,
        evaluation=Trials(every=TABLE_EPISODES, episodes=1, max_steps=1),  # done below
        bins=bins,
        levels=LEVELS[name],
    )


def table_arm(name: str, bins: int, limit: int = TABLE_CAP) -> Arm:
    """A table on an environment; under a time limit if one is given."""
    under = "" if limit == TABLE_CAP else ", under the limit"
    config = table_config(name, bins, limit)
    return Arm(f"{name}, table, {bins} bins{under}", q_learning, ENV[name], config, TABLE_EPISODES)


def chosen_bins(name: str) -> int:
    """The number of bins with which a table enters the comparison."""
    return ACROBOT_BINS if name == "Acrobot" else BEST_BINS


def reported_arms() -> list[Arm]:
    """The networks as the chapters before trained them, named by environment and agent."""
    studies = (
        ("REINFORCE", reinforce_study.arms(), "{}, as reported"),
        ("DQN", dqn_study.arms(), "{}, as reported"),
        ("REINFORCE", continuous_study.arms(), "as reported"),
    )
    environments = {env: name for name, env in ENV.items()}
    found = []
    for agent, of_study, pattern in studies:
        for arm in of_study:
            environment = environments[arm.env]
            if arm.name == pattern.format(environment):
                found.append(replace(arm, name=f"{environment}, {agent}"))
    return found


def limited(name: str, arm: Arm) -> Arm:
    """The same agent, trained under Gymnasium's time limit; it learns from stopped episodes too."""
    changes = {"max_episode_steps": LIMIT[name]}
    if hasattr(arm.config, "learn_from_capped"):
        changes["learn_from_capped"] = True
    return replace(
        arm,
        name=f"{arm.name}, under the limit",
        config=replace(arm.config, **changes),
        episodes=min(arm.episodes, LIMITED_EPISODES),
        snapshots=(),
    )


def environment_of(arm: str) -> str:
    """The environment that an arm's name begins with."""
    return arm.partition(",")[0]


def arms() -> list[Arm]:
    """Networks as reported, all of them under time limits, and the tables."""
    networks = reported_arms()
    tables = [table_arm(name, bins) for name in list(ENV)[1:] for bins in BINS]
    tables.append(table_arm("Acrobot", ACROBOT_BINS))
    under = [limited(environment_of(arm.name), arm) for arm in networks]
    under += [table_arm(name, chosen_bins(name), LIMIT[name]) for name in ENV]
    return [*networks, *tables, *under]


def settings_of_arms() -> pd.DataFrame:
    """Every arm, and where it differs: a table from one, a network from that without a limit."""
    every = {arm.name: arm for arm in arms()}
    table = every[f"MountainCarContinuous, table, {BEST_BINS} bins"]
    rows = []
    for name, arm in every.items():
        other = every[name.removesuffix(", under the limit")]
        rows.append(settings.table([arm], table if arm.algorithm is q_learning else other))
    return pd.concat(rows, ignore_index=True)


def learn(store: Path) -> Results:
    """Run what the store does not have; the rest is read."""
    return run(arms(), seeds=SEEDS, store=store)


def timed_arms(batch_size: int) -> list[Arm]:
    """DQN for as many episodes as the report's seconds are for, nothing else changed."""
    return [
        Arm(
            f"{name}, DQN, batches of {batch_size}",
            dqn,
            ENV[name],
            replace(dqn_study.reported(name), batch_size=batch_size),
            TIMED_EPISODES,
        )
        for name in ("Acrobot", "MountainCar")
    ]


def slow_arms() -> list[Arm]:
    """REINFORCE as reported, the time of which is taken on few seeds."""
    return [arm for arm in reported_arms() if arm.name.endswith("REINFORCE")]


def take_times(store: Path) -> pd.DataFrame:
    """Train the timed runs on seeds of their own: where they come from, a row an arm and seed.

    A run of REINFORCE takes several seconds and is far from its bound, so that it has fewer seeds.
    """
    few = run(slow_arms(), seeds=FRESH[:TIMED_SEEDS], store=store)
    small = run([*timed_arms(512), *timed_arms(32)], seeds=FRESH, store=store)
    return pd.concat([few.provenance, small.provenance], ignore_index=True)


@dataclass(frozen=True)
class Tried:
    """How an agent is tried out.

    Attributes
    ----------
    environment, agent : str
        What the tables of the chapter call them.
    arm : str or None
        What it learned; None for one that acts at random.
    acting : str
        "as learned", with the policy's own randomness, or "greedy".
    """

    environment: str
    agent: str
    arm: str | None
    acting: str

    @property
    def trained(self) -> str:
        """Under which limit the agent was trained."""
        if self.arm is None:
            return "not at all"
        return "time limit" if self.arm.endswith("under the limit") else "no limit"


def tried() -> list[Tried]:
    """All agents of the comparison, in the order of its tables."""
    found = []
    for name in ENV:
        found.append(Tried(name, "random", None, "random"))
        for arm in arms():
            if environment_of(arm.name) != name:
                continue
            agent = arm.name.removeprefix(f"{name}, ").removesuffix(", under the limit")
            stochastic = agent == "REINFORCE"
            for acting in ("as learned", "greedy") if stochastic else ("greedy",):
                found.append(Tried(name, agent, arm.name, acting))
    return found


def shaped_return(name: str) -> Callable[..., float]:
    """Undiscounted return under the rewards that chapter 4's DQN learns from."""
    if name == "Acrobot":

        def tip_height(observations, actions, rewards):
            c1, s1, c2, s2 = observations[1:, :4].T.astype(float)
            return float(-(c1 + (c1 * c2 - s1 * s2)).sum())

        return tip_height

    def distance_from_start(observations, actions, rewards):
        return float(np.abs(observations[1:, 0].astype(float) + 0.5).sum())

    return distance_from_start


def evaluate_both(
    env: str, agent: Agent, limit: int, *, seed: int, measures: Mapping[str, Measure] | None = None
) -> pd.DataFrame:
    """Evaluate an agent without limit, and the same episodes as if a limit had cut them off.

    What they would have been then: `limited_steps`, `limited_return`, `limited_terminated`.
    """

    def limited_return(observations, actions, rewards):
        return rewards[:limit].sum()

    measures = {**(measures or {}), "limited_return": limited_return}
    rules = {"seed": seed, "episodes": EPISODES, "max_steps": CAP, "measures": measures}
    table = evaluate(env, agent, **rules)
    table["limited_steps"] = table["steps"].clip(upper=limit)
    table["limited_terminated"] = table["terminated"] & (table["steps"] <= limit)
    return table


def try_out(one: Tried, results: Results) -> pd.DataFrame:
    """Evaluate an agent with every seed: one row an episode."""
    limit = LIMIT[one.environment]
    levels = LEVELS[one.environment]
    env = ENV[one.environment]
    tables = []
    if one.arm is None or ", table, " in one.arm:
        bins = 1 if one.arm is None else int(one.arm.split(", table, ")[1].split()[0])
        world = gridded(env, bins, levels=levels)
        Q = None if one.arm is None else results.arrays(one.arm)["Q"]
        for i, seed in enumerate(SEEDS):
            values = np.zeros(world.shape) if Q is None else Q[i]
            tables.append(evaluate_both(env, of_table(world, values), limit, seed=seed))
    else:
        arrays = results.arrays(one.arm)
        config = next(arm.config for arm in arms() if arm.name == one.arm)
        measures = {"shaped_return": shaped_return(one.environment)}
        for i, seed in enumerate(SEEDS):
            agent = make_agent(one, config, weights_of(arrays, i))
            tables.append(evaluate_both(env, agent, limit, seed=seed, measures=measures))
    table = pd.concat(tables, keys=SEEDS, names=["seed"]).reset_index(level="seed")
    for column in ("environment", "agent", "trained", "acting"):
        table.insert(0, column, getattr(one, column))
    return table.reset_index(drop=True)


def make_agent(one: Tried, config: object, weights: dict[str, np.ndarray]) -> Agent:
    """The agent of one seed."""
    if not hasattr(config, "policy"):
        return of_values(weights)
    agent = as_learned(config, weights)
    return greedy(agent) if one.acting == "greedy" else agent


def evaluate_all(results: Results) -> pd.DataFrame:
    """Evaluate every agent of `tried`; compiled episodes leave the interpreter free for others."""
    agents = Parallel(n_jobs=2, backend="threading")(
        delayed(try_out)(one, results) for one in tried()
    )
    return pd.concat(agents, ignore_index=True)


def dqn_as_trained(results: Results, policies: pd.DataFrame) -> pd.DataFrame:
    """DQN with the random actions that its training ended with, beside the greedy one: by seed.

    It stands apart from `tried`, whose policies claim 3m ranks, since it was added with these
    known.
    """
    tables = []
    for name in ("Acrobot", "MountainCar"):
        arrays = results.arrays(f"{name}, DQN")
        for i, seed in enumerate(SEEDS):
            agent = of_values(weights_of(arrays, i), TRAINED_EPSILON)
            played = evaluate_both(ENV[name], agent, LIMIT[name], seed=seed)
            played = played.assign(shaped_return=np.nan)
            who = dict(zip(KEY, (name, "DQN", "no limit", "as trained"), strict=True))
            tables.append(played.assign(**who, seed=seed))
    greedily = (policies["agent"] == "DQN") & (policies["trained"] == "no limit")
    return pd.concat([by_seed(pd.concat(tables)), policies[greedily]], ignore_index=True)


def both_ways(policies: pd.DataFrame) -> pd.DataFrame:
    """The tables of Acrobot and MountainCar below each other, for `dqn_as_trained`."""
    rows = []
    for name in ("Acrobot", "MountainCar"):
        table = summary(policies, name).drop(columns=["agent", "trained under"])
        table = table.rename(columns={f"return within {LIMIT[name]} steps": "return in time"})
        table.insert(0, "environment", name)
        rows.append(table)
    return pd.concat(rows, ignore_index=True)


KEY = ["environment", "agent", "trained", "acting"]


def by_seed(episodes: pd.DataFrame) -> pd.DataFrame:
    """Means over the episodes of each agent and seed: one row a policy."""
    columns = {
        "steps": "mean",
        "return": "mean",
        "terminated": "mean",
        "shaped_return": "mean",
        "limited_steps": "mean",
        "limited_return": "mean",
        "limited_terminated": "mean",
    }
    return episodes.groupby([*KEY, "seed"], sort=False).agg(columns).reset_index()


def summary(policies: pd.DataFrame, name: str) -> pd.DataFrame:
    """The table of an environment: medians over seeds with 95% intervals."""
    rng = np.random.default_rng(np.random.SeedSequence(2021))

    def interval(values: pd.Series, digits: int) -> str:
        numbers = bootstrap_interval(values.to_numpy(), rng=rng)
        estimate, low, high = (f"{x:z,.{digits}f}" for x in numbers)  # z: no -0.0
        return _minus(f"{estimate} [{low}, {high}]")

    digits = 1 if name == "MountainCarContinuous" else 0
    rows = []
    of_environment = policies[policies["environment"] == name]
    for key, seeds in of_environment.groupby(KEY[1:], sort=False):
        rows.append(
            {
                **dict(zip(("agent", "trained under", "acts"), key, strict=True)),
                "steps, no limit": interval(seeds["steps"], 0),
                "reached (%)": 100 * seeds["terminated"].mean(),
                f"return within {LIMIT[name]} steps": interval(seeds["limited_return"], digits),
                "reached in time (%)": 100 * seeds["limited_terminated"].mean(),
            }
        )
    return pd.DataFrame(rows)


def of_agent(
    policies: pd.DataFrame, name: str, agent: str, acting: str, trained: str = "no limit"
) -> pd.DataFrame:
    """The rows of an agent, one a seed."""
    return policies[(policies[KEY] == [name, agent, trained, acting]).all(axis=1)]


def steps_of(
    policies: pd.DataFrame, name: str, agent: str, acting: str, trained: str = "no limit"
) -> np.ndarray:
    """Mean steps of every seed of an agent, without limit."""
    return of_agent(policies, name, agent, acting, trained)["steps"].to_numpy()


def reached(policies: pd.DataFrame, results: Results, name: str) -> dict[str, float]:
    """What the text quotes of REINFORCE in an environment.

    The share of episodes that get to the goal (%), and what a seed trained (10⁶ steps, median),
    without the time limit and under it.
    """
    free = of_agent(policies, name, "REINFORCE", "as learned")
    greedily = of_agent(policies, name, "REINFORCE", "greedy")
    under = of_agent(policies, name, "REINFORCE", "as learned", "time limit")
    trained = {
        which: np.median(training(results, f"{name}, {arm}")) / 1e6
        for which, arm in (("free", "REINFORCE"), ("limited", "REINFORCE, under the limit"))
    }
    return {
        "reached": float(100 * free["terminated"].mean()),
        "greedy-reached": float(100 * greedily["terminated"].mean()),
        "in-time": float(100 * free["limited_terminated"].mean()),
        "under-in-time": float(100 * under["limited_terminated"].mean()),
        "under-reached": float(100 * under["terminated"].mean()),
        "free-steps": float(trained["free"]),
        "limited-steps": float(trained["limited"]),
    }


def optima() -> dict[str, list[Fastest]]:
    """The fastest ways up, on finer and finer grids."""
    return {
        name: [fastest(ENV[name], STARTS, points=points) for points in POINTS]
        for name in ("MountainCar", "MountainCarContinuous")
    }


def training(results: Results, arm: str) -> np.ndarray:
    """Environment steps that each seed of an arm took to train."""
    rows = results.table[results.table["arm"] == arm]
    return rows.groupby("seed")["env_steps"].max().to_numpy()


# The claims. Criteria are fixed before seeds 0 to 29 are run; that of t, which was changed with
# those seeds known, before seeds 100 to 129. The report's seconds of DQN are for 20 episodes, so
# these are timed; its text has batches of 512, its program of 32. A run's time is the processor's,
# on one core, and not the clock's, which counts whatever else the machine has to do.

TIMES = {  # seconds, in the report
    "Acrobot, REINFORCE": 120,
    "MountainCar, REINFORCE": 180,
    "MountainCarContinuous, REINFORCE": 180,
    "Acrobot, DQN": 3,
    "MountainCar, DQN": 5,
}


def timed(name: str, batch_size: int) -> str:
    """The arm that is timed for one of `TIMES`."""
    return f"{name}, batches of {batch_size}" if name.endswith("DQN") else name


def _in_time(batch_size: int) -> tuple[Criterion, ...]:
    return tuple(
        Criterion(
            f"{timed(name, batch_size)}: the report's {seconds} s are at least 1 times the "
            "processor's seconds of one run, median over seeds",
            at_least=1,
        )
        for name, seconds in TIMES.items()
    )


def _as_few_steps(text: str) -> Criterion:
    return Criterion(
        f"{text}, median over all seeds, at most 1.25 times those of REINFORCE's network, median "
        "over the seeds that learned",
        at_most=1.25,
    )


WORKABLE = tuple(
    _as_few_steps(f"{name}: steps of the greedy table with {BEST_BINS} bins a dimension")
    for name in ("MountainCar", "MountainCarContinuous")
)
OFTEN = tuple(
    Criterion(
        f"{name}: share of seeds whose greedy table needs at most {LEARNED} steps on average, at "
        "least 0.8 (fresh seeds)",
        at_least=0.8,
    )
    for name in ("MountainCar", "MountainCarContinuous")
)

CLAIMS = (
    Claim(
        "3m",
        "3.3",
        "Steps to completion and undiscounted return rank policies the same.",
        tuple(
            Criterion(
                f"{name}: Kendall's tau between the rankings of all evaluated policies by fewest "
                "steps and by highest undiscounted return (no time limit) at least 0.99",
                at_least=0.99,
            )
            for name in ("Acrobot", "MountainCar")
        ),
        "Figure S6.2",
    ),
    Claim(
        "3n",
        "3.4",
        "In a continuous world, discretising is a workable alternative to function approximation.",
        (
            *WORKABLE,
            _as_few_steps(f"Acrobot: steps of the greedy table with {ACROBOT_BINS} bins a number"),
            *OFTEN,
        ),
        "Figure S6.3",
        reading="Acrobot by the six numbers it shows",
        readings=(
            Reading(
                "Acrobot by its four angles and speeds",
                (
                    *WORKABLE,
                    _as_few_steps(
                        "Acrobot (fresh seeds): steps of the greedy table on angles and speeds"
                    ),
                    *OFTEN,
                ),
            ),
        ),
        amended="the shares of seeds are near their bound, so judged on seeds 100 to 199 instead; "
        "a second reading, on seeds 130 to 199",
    ),
    Claim(
        "t",
        "3.1-4",
        "Wall-clock time for one run: 2 and 3 minutes (REINFORCE), 3 and 5 seconds (DQN), "
        "3 minutes (continuous).",
        _in_time(512),
        "Table 6.9",
        reading="batches of 512, as the report says",
        readings=(Reading("batches of 32, as its program has", _in_time(32)),),
        amended="DQN is timed for 20 episodes, each run by itself and in seconds of the processor; "
        "two readings. Judged on seeds 100 to 129 (REINFORCE: 100 to 104)",
    ),
)


def agreement(policies: pd.DataFrame, by: str, name: str) -> Evidence:
    """Kendall's tau-b between fewest steps and highest `by`; the bootstrap draws seeds."""
    rng = np.random.default_rng(np.random.SeedSequence(2022))
    of_environment = policies[policies["environment"] == name].dropna(subset=[by])
    groups = [rows[["steps", by]].to_numpy() for _, rows in of_environment.groupby("seed")]

    def tau(chosen: Sequence[int]) -> float:
        steps, values = np.concatenate([groups[i] for i in chosen]).T
        return float(kendalltau(-steps, values).statistic)

    n = len(groups)
    drawn = [tau(rng.integers(n, size=n)) for _ in range(1_000)]
    low, high = np.quantile(drawn, [0.025, 0.975])
    estimate = tau(range(n))
    return Evidence(estimate, min(low, estimate), max(high, estimate), seeds=n)


def relative_steps(table: np.ndarray, network: np.ndarray, rng: np.random.Generator) -> Evidence:
    """Median steps of tables over those of networks that learned; the bootstrap draws both.

    Parameters
    ----------
    table, network : ndarray of shape (seeds,)
        Mean steps, of the same seeds. A draw of seeds takes the tables and the networks of these.
    rng : numpy.random.Generator
    """
    good = np.where(network <= LEARNED, network, np.nan)
    if np.isnan(good).all():
        return Evidence.none()
    drawn = rng.integers(len(table), size=(10_000, len(table)))
    drawn = drawn[~np.isnan(good[drawn]).all(axis=1)]  # without any network there is no ratio
    ratios = np.median(table[drawn], axis=1) / np.nanmedian(good[drawn], axis=1)
    low, high = (float(limit) for limit in np.quantile(ratios, [0.025, 0.975]))
    estimate = float(np.median(table) / np.nanmedian(good))
    return Evidence(estimate, min(low, estimate), max(high, estimate), seeds=len(table))


def findings(
    policies: pd.DataFrame, times: pd.DataFrame, fresh: Mapping[str, np.ndarray]
) -> list[Finding]:
    """Hold the seeds against the criteria: those evaluated, those timed for t, fresh ones of 3n.

    Parameters
    ----------
    policies, times : pandas.DataFrame
        See `by_seed` and `take_times`.
    fresh : mapping of str to ndarray of shape (seeds,)
        Mean steps of fresh seeds by arm, see `studies.evaluation_fresh.mean_steps`.
    """
    rng = np.random.default_rng(np.random.SeedSequence(2023))

    def relative(name: str) -> Evidence:
        network = steps_of(policies, name, "REINFORCE", "as learned")
        table = steps_of(policies, name, f"table, {chosen_bins(name)} bins", "greedy")
        return relative_steps(table, network, rng)

    def share(name: str) -> Evidence:
        table = fresh[f"{name}, table, {BEST_BINS} bins"]
        count = int((table <= LEARNED).sum())
        return Evidence(*proportion_interval(count, len(table)), seeds=len(table))

    three_m, three_n, _ = CLAIMS
    cars = ("MountainCar", "MountainCarContinuous")
    of_cars, six = [relative(name) for name in cars], relative("Acrobot")
    often = [share(name) for name in cars]
    table, network = (fresh[f"Acrobot, {arm}"] for arm in ("table of angles", "as reported"))
    angles = relative_steps(table, network, rng)
    return [
        three_m.judge(
            *(agreement(policies, "return", name) for name in ("Acrobot", "MountainCar"))
        ),
        three_n.judge(*of_cars, six, *often, readings=[(*of_cars, angles, *often)]),
        judged_times(times),
    ]


def judged_times(times: pd.DataFrame) -> Finding:
    """Hold the timed runs against the criterion of t, in both readings."""
    rng = np.random.default_rng(np.random.SeedSequence(2026))

    def speed(batch_size: int) -> list[Evidence]:
        taken = {name: seconds_of(times, timed(name, batch_size)) for name in TIMES}
        return [
            Evidence(*bootstrap_interval(TIMES[name] / seconds, rng=rng), seeds=len(seconds))
            for name, seconds in taken.items()
        ]

    return CLAIMS[-1].judge(*speed(512), readings=[speed(32)])


def agreements(policies: pd.DataFrame) -> pd.DataFrame:
    """How far steps and returns agree: Kendall's tau, and the share of pairs they order apart."""
    rows = []
    for name in ENV:
        for by, rewards in (("return", "as paid"), ("shaped_return", "shaped")):
            if by == "shaped_return" and name == "MountainCarContinuous":
                continue
            found = agreement(policies, by, name)
            chosen = policies[policies["environment"] == name].dropna(subset=[by])
            pairs = np.sign(np.subtract.outer(*[-chosen["steps"].to_numpy()] * 2)) * np.sign(
                np.subtract.outer(*[chosen[by].to_numpy()] * 2)
            )
            rows.append(
                {
                    "environment": name,
                    "rewards": rewards,
                    "policies": len(chosen),
                    "Kendall's τ": _minus(
                        f"{found.estimate:.3f} [{found.low:.3f}, {found.high:.3f}]"
                    ),
                    "pairs apart (%)": 100 * np.mean(pairs[np.triu_indices(len(chosen), 1)] < 0),
                }
            )
    return pd.DataFrame(rows)


def gentle(forces: Sequence[float]) -> pd.DataFrame:
    """A hand-made driver of MountainCarContinuous: push the way the car moves, so hard only.

    `reached` is the share of episodes that get to the goal: with too little force none does, since
    the wall on the left takes what speed the car has there.
    """
    world = gridded(ENV["MountainCarContinuous"], (1, 2), levels=2)
    along = np.array([[1.0, 0.0], [0.0, 1.0]])
    rows = []
    for force in forces:
        softer = world._replace(actions=(world.actions * force).astype(np.float32))
        driver = of_table(softer, along)
        rules = {"seed": 0, "episodes": EPISODES, "max_steps": 10 * CAP}
        played = evaluate(ENV["MountainCarContinuous"], driver, **rules)
        means = {name: played[name].mean() for name in ("steps", "return")}
        rows.append({"force": force, **means, "reached": played["terminated"].mean()})
    return pd.DataFrame(rows)


def gentlest(drivers: pd.DataFrame) -> tuple[pd.Series, pd.Series]:
    """Of `gentle`'s drivers: the one with the least force that always arrives, and the next."""
    by_force = drivers.sort_values("force", ascending=False, ignore_index=True)
    arriving = int((by_force["reached"] == 1).cummin().sum())
    return by_force.loc[arriving - 1], by_force.loc[arriving]


def refinement(found: dict[str, list[Fastest]]) -> pd.DataFrame:
    """Mean steps of the fastest way, by the values and as driven, on finer and finer grids."""
    return pd.DataFrame(
        [
            {
                "environment": name,
                "grid points a dimension": one.points,
                "steps by the values": one.planned.mean(),
                "steps as driven": one.driven.mean(),
                "fewest": int(one.driven.min()),
                "most": int(one.driven.max()),
            }
            for name, grids in found.items()
            for one in grids
        ]
    )


def seconds_of(times: pd.DataFrame, arm: str) -> np.ndarray:
    """Seconds of the processor that each seed of a timed arm took."""
    return times.loc[times["arm"] == arm, "processor_seconds"].to_numpy()


def compared_times(times: pd.DataFrame) -> pd.DataFrame:
    """Seconds of one run, in the report and here."""
    rows = []
    for name, then in TIMES.items():
        for arm in dict.fromkeys(timed(name, batch_size) for batch_size in (512, 32)):
            made = times[times["arm"] == arm]
            seconds = made["processor_seconds"]
            rows.append(
                {
                    "run": arm,
                    "episodes": made["episodes"].iloc[0],
                    "seeds": len(made),
                    "2018 (s)": then,
                    "now (s)": seconds.median(),
                    "fastest": seconds.min(),
                    "slowest": seconds.max(),
                    "then / now": then / seconds.median(),
                    "processor": made["processor"].iloc[0],
                }
            )
    return pd.DataFrame(rows)


def costs(results: Results, policies: pd.DataFrame, name: str) -> pd.DataFrame:
    """What each number of bins costs and brings on a car, one row a seed."""
    rows = []
    for bins in BINS:
        arm = f"{name}, table, {bins} bins"
        steps = training(results, arm)
        visits = results.arrays(arm)["visits"]
        reached = steps_of(policies, name, f"table, {bins} bins", "greedy")
        rows.append(
            pd.DataFrame(
                {
                    "environment": name,
                    "bins": bins,
                    "seed": list(SEEDS),
                    "steps": reached,
                    "training_steps": steps,
                    "entries_visited": (visits > 0).sum(axis=(1, 2)),
                }
            )
        )
    return pd.concat(rows, ignore_index=True)


def by_bins(costs: dict[str, pd.DataFrame], fewest: dict[str, float]) -> pd.DataFrame:
    """What bins bring and cost: medians over seeds with 95% intervals, and seeds that fail."""
    rng = np.random.default_rng(np.random.SeedSequence(2025))
    rows = []
    for name, table in costs.items():
        for bins, seeds in table.groupby("bins"):
            middle, low, high = bootstrap_interval(seeds["steps"].to_numpy(), rng=rng)
            entries = bins**2 * len(gridded(ENV[name], 1, levels=LEVELS[name]).actions)
            rows.append(
                {
                    "environment": name,
                    "bins": bins,
                    "cells": bins**2,
                    "steps": f"{middle:,.0f} [{low:,.0f}, {high:,.0f}]",
                    "above the fastest": middle - fewest[name],
                    "seeds above 500": int((seeds["steps"] > LEARNED).sum()),
                    "training steps (10⁶)": seeds["training_steps"].median() / 1e6,
                    "entries visited (%)": 100 * seeds["entries_visited"].median() / entries,
                }
            )
    return pd.DataFrame(rows)


def _minus(text: str) -> str:
    """Set minus signs, not hyphens."""
    return text.replace("-", "−")
