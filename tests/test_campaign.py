"""Odd arguments for every public function: each is taken, or refused by name, and nothing hangs.

One argument at a time is replaced in a call that works. What the report of a bug would begin with
(a hang, an abort, an exception that speaks of something else) fails the test.
"""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields
from decimal import Decimal
from fractions import Fraction

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from gymnasium import spaces

from rl_core import evaluation, exploration, mdp, planning, policies, statistics, training
from rl_core.dqn import DQNConfig, dqn
from rl_core.experiments import Arm, run
from rl_core.maze import Maze, random_maze
from rl_core.policies import MLP, Gaussian
from rl_core.q_learning import QLearningConfig, q_learning, q_learning_on_model
from rl_core.reinforce import ReinforceConfig, reinforce
from rl_core.worlds import discretise, environments, names, tasks
from rl_core.worlds.shaping import Shaping

SECONDS = 20  # a call that takes longer hangs; some compile
NAMELESS = 0.01  # share of refusals that need not name the argument

ODD = [
    *(None, True, False, np.True_, -1, 0, 1, 2, 3, 7, 2**31, 2**63 - 1, 2**63, -(2**70), 10**400),
    *(0.0, -0.0, 0.5, 1.0, 1.5, -0.5, 1e-300, 1e308, float("nan"), float("inf"), float("-inf")),
    *(np.uint8(200), np.int8(-1), np.int64(3), np.float16(0.5), np.float32("nan"), np.float64(2)),
    *(
        Fraction(1, 2),
        Decimal("0.5"),
        1 + 2j,
        "",
        "x",
        "x:y",
        "nowhere:Foo-v0",
        "CartPole-v1",
        b"x",
    ),
    *(
        (),
        (1,),
        (0, 0),
        [],
        [1, 2],
        [[1], [1, 2]],
        {},
        {"a": 1},
        {1},
        range(0),
        range(3),
        iter([0]),
    ),
    *(np.array([]), np.array(3), np.zeros(2), np.zeros((2, 2)), np.array(["x"]), np.array([None])),
    *(np.full(3, np.nan), np.array([np.inf, -np.inf]), pd.DataFrame(), pd.Series([1.0, 2.0])),
    *(object(), int, len, MLP(), np.random.default_rng(0), spaces.Discrete(2)),
]


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


MODEL = mdp.MDP.from_env("FrozenLake-v1")
TABLE = pd.DataFrame({"seed": [0, 0], "episode": [1, 2], "steps": [9.0, 7.0]})
WEIGHTS = {"layer0.weight": np.zeros((2, 3), np.float32)}
CONTINUOUS = {"layer0.weight": np.zeros((2, 1), np.float32), "log_sigma": np.zeros(1, np.float32)}
LINEAR = ReinforceConfig(network=MLP(()), max_episode_steps=9)
DIRECT = ReinforceConfig(network=MLP(()), policy=Gaussian(mean="direct"))
SMALL = DQNConfig(
    network=MLP(()), batch_size=4, memory_size=9, learning_starts=4, max_episode_steps=9
)
TABULAR = QLearningConfig(max_steps=9)
BOX = spaces.Box(-1, 1, (2,))
GRIDDED = discretise.gridded("MountainCar-v0", 3)
STATES = np.zeros((4, 2))
LEARN = {"episodes": 1, "seeds": [0], "snapshots": (), "progress": None}

CALLS: list[tuple[Callable, dict]] = [
    (planning.q_value_iteration, {"mdp": MODEL, "gamma": 0.9, "threshold": 0.1, "max_sweeps": 3}),
    (planning.value_iteration, {"mdp": MODEL, "gamma": 0.9, "tolerance": 0.1}),
    (planning.policy_iteration, {"mdp": MODEL, "gamma": 0.9, "evaluation_threshold": 0.1,
                                 "initial_policy": np.zeros(16, int)}),
    (planning.policy_evaluation, {"mdp": MODEL, "policy": np.zeros(16, int), "gamma": 0.9}),
    (planning.backup, {"mdp": MODEL, "V": np.zeros(16), "gamma": 0.9}),
    (planning.greedy_policy, {"Q": np.zeros((3, 2))}),
    (planning.optimal_actions, {"Q": np.zeros((3, 2)), "tolerance": 0.1}),
    (mdp.MDP.from_env, {"env": "FrozenLake-v1", "start_distribution": np.eye(16)[0]}),
    (Maze, {"slip": 0.1}),
    (random_maze, {"rows": 4, "columns": 4, "flags": 1, "wall_fraction": 0.1, "rng": rng()}),
    (policies.MLP, {"hidden": (3,), "biases": True}),
    (policies.Module, {"function": "torch.nn:Linear"}),
    (policies.Gaussian, {f.name: getattr(Gaussian(), f.name) for f in fields(Gaussian)}),
    (ReinforceConfig, {f.name: getattr(LINEAR, f.name) for f in fields(LINEAR)}),
    (DQNConfig, {f.name: getattr(SMALL, f.name) for f in fields(SMALL)}),
    (QLearningConfig, {f.name: getattr(TABULAR, f.name) for f in fields(TABULAR)}),
    (exploration.Linear, {"start": 1.0, "end": 0.1, "episodes": 3, "steps": None}),
    (exploration.Geometric, {"start": 1.0, "end": 0.1, "episodes": 3}),
    (exploration.HalfWay, {"start": 0.9, "end": 0.1}),
    (exploration.VisitDecay, {"initial": 1.0, "exponent": 0.6}),
    (exploration.EpsilonGreedy, {"epsilon": 0.1}),
    (exploration.Softmax, {"temperature": 0.1}),
    (exploration.Trials, {"every": 5, "episodes": 1, "max_steps": 5, "epsilon": 0.1}),
    (Shaping, {"function": "rl_core.worlds.shaping:tip_height"}),
    (reinforce, {"env": "MountainCar-v0", "config": LINEAR, **LEARN}),
    (dqn, {"env": "MountainCar-v0", "config": SMALL, **LEARN}),
    (q_learning, {"env": MODEL, "config": TABULAR, "Q_star": np.zeros((16, 4)), **LEARN}),
    (q_learning_on_model, {"env": "FrozenLake-v1", "config": TABULAR, **LEARN}),
    (evaluation.evaluate, {"env": "MountainCar-v0", "agent": evaluation.uniform(2, 3), "seed": 0,
                           "episodes": 1, "max_steps": 9, "limit": 5, "measures": None}),
    (evaluation.evaluate_table, {"world": GRIDDED, "Q": np.zeros((9, 3)), "seed": 0, "episodes": 1,
                                 "max_steps": 9, "limit": 5}),
    (evaluation.rollout, {"env": "MountainCar-v0", "agent": evaluation.uniform(2, 3), "rng": rng(),
                          "max_steps": 9}),
    (evaluation.action_values, {"weights": WEIGHTS, "observations": STATES}),
    (evaluation.mean_actions, {"config": DIRECT, "weights": CONTINUOUS, "observations": STATES}),
    (evaluation.as_learned, {"config": LINEAR, "weights": WEIGHTS}),
    (evaluation.of_values, {"weights": WEIGHTS, "epsilon": 0.1}),
    (training.weights_of, {"arrays": {"a": np.zeros((2, 3))}, "position": 0, "moment": ""}),
    (statistics.iqm, {"values": [1.0, 2.0, 3.0], "axis": 0}),
    (statistics.bootstrap_interval, {"values": [1.0, 2.0], "statistic": np.median, "rng": rng(),
                                     "level": 0.9, "resamples": 9}),
    (statistics.paired_difference_interval, {"a": [1.0, 2.0], "b": [1.0, 3.0], "rng": rng(),
                                             "level": 0.9, "resamples": 9}),
    (statistics.probability_of_improvement, {"a": [1.0, 2.0], "b": [1.0, 3.0], "rng": rng(),
                                             "level": 0.9, "resamples": 9}),
    (statistics.proportion_interval, {"successes": 1, "trials": 3, "level": 0.9}),
    (statistics.learning_curves, {"table": TABLE, "column": "steps", "seeds": [0], "episodes": 2,
                                  "window": 1, "average": "median"}),
    (statistics.learned, {"curves": np.ones((2, 3)), "threshold": 1.0, "window": 2}),
    (statistics.episodes_to_threshold, {"curves": np.ones((2, 3)), "threshold": 1.0, "hold": 2}),
    (discretise.make_grid, {"space": BOX, "bins": 3, "low": None, "high": None}),
    (discretise.action_levels, {"space": spaces.Box(-1, 1, (1,)), "levels": 3}),
    (discretise.Discretised, {"env": "MountainCar-v0", "bins": 3, "levels": None}),
    (discretise.gridded, {"env": "MountainCar-v0", "bins": 3, "levels": None}),
    (environments.open_world, {"env": "MountainCar-v0"}),
    (names.Make, {"id": "CartPole-v1", "arguments": {}}),
    (names.make_environment, {"env": "CartPole-v1"}),
    (names.identity, {"env": "CartPole-v1"}),
    (tasks.task, {"n_state": 1, "observation_space": BOX, "action_space": spaces.Discrete(2),
                  "max_episode_steps": 5}),
    (Arm, {"name": "a", "algorithm": reinforce, "env": "CartPole-v1", "config": LINEAR,
           "episodes": 1, "snapshots": (), "labels": {}}),
    (run, {"arms": [], "seeds": [0], "store": "x", "workers": 1, "backend": "loky"}),
]  # fmt: skip


class HangError(Exception):
    """A call took too long."""


@contextmanager
def at_most(seconds: int) -> Iterator[None]:
    def late(*_: object) -> None:
        raise HangError

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def outcome(function: Callable, arguments: dict, name: str) -> str:
    """Say what came of a call: "taken", "named", "nameless", or what should not have happened."""
    try:
        with at_most(SECONDS), np.errstate(all="ignore"):
            function(**arguments)
    except (TypeError, ValueError, ArithmeticError) as error:
        words = str(error).replace("_", " ")
        return "named" if name.replace("_", " ") in words else f"nameless: {error}"
    except HangError:
        return "hangs"
    except Exception as error:  # whatever else it is, it is not what was promised
        return f"{type(error).__name__}: {error}"
    return "taken"


WORK = {"episodes", "max_steps", "resamples", "rows", "columns"}


@pytest.mark.filterwarnings("ignore")
def test_every_odd_argument_is_taken_or_refused_by_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tried, bad, nameless = 0, [], []
    for function, valid in CALLS:
        for name in valid:
            for odd in ODD:
                if name in WORK and isinstance(odd, int) and 2**31 <= odd < 2**63:
                    continue  # allowed, and a long day's work
                if name == "progress" and callable(odd):
                    continue  # allowed; what it raises is its own
                found = outcome(function, {**valid, name: odd}, name)
                tried += 1
                told = f"{function.__qualname__}({name}={odd!r}): {found}"
                if found.startswith("nameless"):
                    nameless.append(told)
                elif found not in ("taken", "named"):
                    bad.append(told)
    assert tried >= 3_000
    assert not bad, f"{len(bad)} of {tried}:\n" + "\n".join(text[:300] for text in bad[:60])
    assert len(nameless) <= NAMELESS * tried, f"{len(nameless)} of {tried}:\n" + "\n".join(
        text[:200] for text in nameless[:60]
    )


def test_the_calls_themselves_work(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for function, valid in CALLS:
        if function is not run:  # it wants at least one arm
            function(**valid)
    assert gym.spec("CartPole-v1")
