"""Odd arguments for all that is public in `rl_core`: calls that work, and what is put into them.

Run as a program it makes its share of the calls, and writes a line before and after each, so that
whoever reads them can tell a hang or an abort, which no exception tells: `test_campaign.py`.
"""

import array
import datetime
import importlib
import inspect
import json
import math
import pkgutil
import re
import sys
import warnings
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import fields
from decimal import Decimal
from fractions import Fraction
from functools import cache
from numbers import Integral
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pandas as pd
import torch
from gymnasium import spaces

import rl_core
from rl_core import policies
from rl_core.checks import number
from rl_core.dqn import DQNConfig
from rl_core.evaluation import Agent, as_learned, spaces_of, uniform
from rl_core.experiments import Arm
from rl_core.exploration import Linear, Trials
from rl_core.maze import Maze
from rl_core.mdp import MDP
from rl_core.policies import MLP, Categorical, Gaussian
from rl_core.q_learning import QLearningConfig
from rl_core.reinforce import ReinforceConfig, reinforce
from rl_core.training import Training
from rl_core.worlds import discretise
from rl_core.worlds.cartpole import CartPole
from rl_core.worlds.environments import open_world

# What odd values there are, by a name under which a finding can be told and made again.


def locked(values: np.ndarray) -> np.ndarray:
    values.setflags(write=False)
    return values


class Plain:
    """Nothing in particular."""


NAMES = {
    "np": np, "pd": pd, "math": math, "torch": torch, "spaces": spaces, "gymnasium": gymnasium,
    "sys": sys, "Path": Path, "Fraction": Fraction, "Decimal": Decimal, "datetime": datetime,
    "array": array, "OrderedDict": OrderedDict, "MLP": MLP, "Plain": Plain, "locked": locked,
    "BIG": 10**400, "ROWS": np.arange(24.0).reshape(4, 6),
}  # fmt: skip

ODD: dict[str, Callable[[], Any]] = {
    text: (lambda text=text: eval(text, NAMES))
    for text in [
        *("None", "True", "False", "np.True_", "...", "NotImplemented"),
        *("-1", "0", "1", "2", "7", "-(2**63)", "2**31", "2**53 + 1", "2**63 - 1", "2**63", "BIG"),
        *("0.0", "-0.0", "0.5", "1.0", "1.5", "-0.5", "5e-324", "1e308", "-1e308"),
        *("math.nan", "math.inf", "-math.inf", "1 - 1e-15", "1 + 2j", "complex('nan')"),
        *("np.int8(-1)", "np.uint8(200)", "np.int16(3)", "np.uint16(3)", "np.int32(3)"),
        *("np.uint32(3)", "np.int64(3)", "np.uint64(2**64 - 1)", "np.float16(0.5)"),
        *("np.float32('nan')", "np.float64(2)", "np.longdouble(0.5)", "np.complex64(1)"),
        *("np.str_('x')", "np.bytes_(b'x')", "np.datetime64('2020-01-01')", "np.void(b'x')"),
        *("Fraction(1, 2)", "Fraction(3)", "Decimal('0.5')", "datetime.timedelta(1)", "pd.NA"),
        *("''", "'x'", "'x:y'", "'nowhere:Foo-v0'", "'CartPole-v1'", "'math:floor'", "'\\0'"),
        *("'\\ud800'", "'../x'", "'ä ö'", "b'x'", "bytearray(b'x')", "memoryview(b'x')"),
        *("()", "(1,)", "(0, 0)", "(None,)", "(1.5, 'x')", "[]", "[1, 2]", "[[1], [1, 2]]"),
        *("{}", "{'a': 1}", "{1: 2}", "{1}", "frozenset()", "range(0)", "range(3)", "slice(2)"),
        *("iter([0])", "(i for i in 'ab')", "array.array('d', [1.0])", "OrderedDict(x=1)"),
        *("np.array([])", "np.array(3)", "np.array(0.5)", "np.array([1])", "np.zeros(2)"),
        *("np.zeros((2, 2))", "np.zeros((2, 3, 4))", "np.zeros((0, 3))", "np.ones(3, bool)"),
        *("np.array(['x'])", "np.array([None])", "np.zeros(2, 'M8[s]')"),
        *("np.array([Fraction(1, 2)])",),
        *("np.full(3, math.nan)", "np.array([math.inf, -math.inf])", "np.zeros(2, complex)"),
        *("np.array([1, 2], '>f8')", "np.ones(2, np.float16)", "np.arange(3, dtype=np.uint64)"),
        *("np.ma.masked_array([1.0, 2.0], [0, 1])", "np.ma.masked", "np.zeros(2, [('a', 'f8')])"),
        *("locked(np.zeros(2))", "ROWS[::2, ::3]", "ROWS.T", "np.zeros(2)[::-1]"),
        *("pd.DataFrame()", "pd.DataFrame({'seed': [0], 'x': ['a']})", "pd.Series([1.0, 2.0])"),
        *("torch.zeros(2)", "torch.tensor(1.0, requires_grad=True)", "torch.nn.Linear(2, 3)"),
        *("object()", "Plain", "Plain()", "int", "len", "print", "lambda: None", "lambda *_: 1"),
        *("sys", "ValueError('x')", "Path('x')", "np.random.default_rng(0)", "MLP()"),
        *("spaces.Discrete(2)", "spaces.Box(-1, 1, (2,))", "gymnasium.make('CartPole-v1')"),
    ]
}  # fmt: skip

# What is varied. A call is valid as it stands; one argument after the other is replaced.


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@cache
def lake() -> MDP:
    return MDP.from_env("FrozenLake-v1")


@cache
def maze() -> Maze:
    made = Maze(render_mode="rgb_array")
    made.reset(seed=0)
    return made


def cut() -> discretise.Discretised:
    made = discretise.Discretised("MountainCar-v0", 3)
    made.reset(seed=0)
    return made


def learn(*_: Any, **__: Any) -> Any:
    raise AssertionError("not called")


def train(training: Training) -> None:
    for _ in training.course(None, lambda: {"a": np.zeros(1)}):
        training.add(1, 1.0, True)


def agent() -> Agent:
    where = "MountainCar-v0"
    return as_learned(LINEAR, WEIGHTS, spaces=spaces_of(where), env=where)


def settings(config: Any) -> dict[str, Any]:
    return {field.name: getattr(config, field.name) for field in fields(config) if field.init}


SAVED = "saved.npz"  # an agent, where `main` makes the calls
SHORT = {"episodes": 1, "seeds": [0], "snapshots": (), "progress": None}
WEIGHTS = {"layer0.weight": np.zeros((2, 3), np.float32)}
LINEAR = ReinforceConfig(network=MLP(()), max_episode_steps=9)
SMALL = DQNConfig(
    network=MLP(()), batch_size=4, memory_size=9, learning_starts=4, max_episode_steps=9
)
TABULAR = QLearningConfig(max_steps=9)
BOX = spaces.Box(-1, 1, (2,))
DRAWN = {"level": 0.9, "resamples": 9}
POLICY = policies.make_policy(Categorical(), (), 2, 3, 0)

CALLS: dict[str, Callable[[], dict[str, Any]]] = {
    "dqn.DQNConfig": lambda: settings(SMALL),
    "dqn.check_dqn": lambda: {"env": "MountainCar-v0", "config": SMALL},
    "dqn.dqn": lambda: {"env": "MountainCar-v0", "config": SMALL, **SHORT},
    "evaluation.Agent": lambda: settings(agent()),
    "evaluation.Agent.film": lambda: {"self": agent(), "path": "film.mp4", "env": None, "seed": 0,
                                      "max_steps": 2, "deterministic": False},
    "evaluation.Agent.predict": lambda: {"self": agent(), "observation": np.zeros(2), "state": None,
                                         "episode_start": None, "deterministic": False},
    "evaluation.Agent.save": lambda: {"self": agent(), "path": "agent.npz"},
    "evaluation.as_learned": lambda: {"config": LINEAR, "weights": WEIGHTS, "spaces": None,
                                      "env": None, "rng": None},
    "evaluation.check_fit": lambda: {"agent": uniform(2, 3), "world": open_world("MountainCar-v0")},
    "evaluation.evaluate": lambda: {"env": "MountainCar-v0", "agent": uniform(2, 3), "seed": 0,
                                    "episodes": 1, "max_steps": 9, "measures": None},
    "evaluation.evaluation_streams": lambda: {"seed": 0},
    "evaluation.greedy": lambda: {"agent": uniform(2, 3)},
    "evaluation.load": lambda: {"path": SAVED, "rng": None},
    "evaluation.rollout": lambda: {"env": "MountainCar-v0", "agent": uniform(2, 3), "rng": rng(),
                                   "max_steps": 9},
    "evaluation.spaces_of": lambda: {"env": "MountainCar-v0"},
    "evaluation.uniform": lambda: {"n_observations": 2, "n_actions": 3},
    "experiments.arms.Arm": lambda: {"name": "a", "algorithm": reinforce, "env": "CartPole-v1",
                                     "config": LINEAR, "episodes": 1, "snapshots": (),
                                     "labels": {}},
    "experiments.runner.run": lambda: {"arms": [Arm("a", reinforce, "CartPole-v1", LINEAR, 1)],
                                       "seeds": [0], "store": "store",
                                       "workers": 1, "backend": "loky", "progress": False},
    "exploration.EpsilonGreedy": lambda: {"epsilon": 0.1},
    "exploration.HalfWay": lambda: {"start": 0.9, "end": 0.1},
    "exploration.Linear": lambda: {"start": 1.0, "end": 0.1, "episodes": 3, "steps": None},
    "exploration.Linear.values": lambda: {"self": Linear(1.0, 0.1, 3), "episodes": 3},
    "exploration.Softmax": lambda: {"temperature": 0.1},
    "exploration.Trials": lambda: settings(Trials()),
    "exploration.VisitDecay": lambda: {"initial": 1.0, "exponent": 0.6},
    "exploration.check_epsilon": lambda: {"name": "value", "value": 0.1},
    "exploration.check_step_size": lambda: {"name": "value", "value": 0.1},
    "exploration.parameter_of": lambda: {"name": "value", "value": 0.1, "check": number,
                                         "unit": "episodes"},
    "exploration.schedule_state": lambda: {"epsilon": 0.1},
    "exploration.values": lambda: {"parameter": 0.1, "episodes": 3},
    "identity.describe": lambda: {"value": LINEAR, "name": "value", "modules": None},
    "identity.import_path": lambda: {"name": "thing", "thing": number, "allowed": "x"},
    "identity.imported": lambda: {"name": "path", "path": "rl_core.checks:number"},
    "maze.Maze": lambda: {"layout": "SG", "slip": 0.1, "render_mode": None},
    "maze.Maze.locate": lambda: {"self": maze(), "state": 3},
    "maze.Maze.reset": lambda: {"self": maze(), "seed": 0, "options": None},
    "maze.Maze.state": lambda: {"self": maze(), "row": 0, "column": 0, "flags": "A"},
    "maze.Maze.step": lambda: {"self": maze(), "action": 0},
    "mdp.MDP": lambda: settings(lake()),
    "mdp.MDP.following": lambda: {"self": lake(), "policy": np.zeros(16, int)},
    "mdp.MDP.from_env": lambda: {"env": "FrozenLake-v1", "start_distribution": np.eye(16)[0]},
    "modules.load_arrays": lambda: {"module": torch.nn.Linear(1, 1),
                                    "arrays": {"weight": np.zeros((1, 1)), "bias": np.zeros(1)}},
    "planning.greedy_policy": lambda: {"Q": np.zeros((3, 2))},
    "planning.optimal_actions": lambda: {"Q": np.zeros((3, 2)), "tolerance": 0.1},
    "planning.policy_evaluation": lambda: {"mdp": lake(), "policy": np.zeros(16, int),
                                           "gamma": 0.9},
    "planning.policy_iteration": lambda: {"mdp": lake(), "gamma": 0.9, "progress": False},
    "planning.q_value_iteration": lambda: {"mdp": lake(), "gamma": 0.9, "threshold": 0.1,
                                           "progress": False},
    "planning.value_iteration": lambda: {"mdp": lake(), "gamma": 0.9, "tolerance": 0.1,
                                         "progress": False},
    "policies.Gaussian": lambda: settings(Gaussian()),
    "policies.MLP": lambda: settings(MLP((3,))),
    "policies.Module": lambda: {"function": "torch.nn:Linear"},
    "policies.check_network": lambda: {"network": MLP(), "engine": None},
    "q_learning.QLearningConfig": lambda: settings(TABULAR),
    "q_learning.check_q_learning": lambda: {"env": lake(), "config": TABULAR},
    "q_learning.q_learning": lambda: {"env": lake(), "config": TABULAR,
                                      "Q_star": np.zeros((16, 4)), **SHORT},
    "reinforce.ReinforceConfig": lambda: settings(LINEAR),
    "reinforce.check_reinforce": lambda: {"env": "MountainCar-v0", "config": LINEAR},
    "reinforce.reinforce": lambda: {"env": "MountainCar-v0", "config": LINEAR, **SHORT},
    "statistics.bootstrap_interval": lambda: {"values": [1.0, 2.0], "statistic": np.median,
                                              "rng": rng(), **DRAWN},
    "statistics.iqm": lambda: {"values": [1.0, 2.0, 3.0], "axis": 0},
    "statistics.learned": lambda: {"curves": np.ones((2, 3)), "threshold": 1.0, "window": 2},
    "statistics.probability_of_improvement": lambda: {"a": [1.0, 2.0], "b": [1.0, 3.0],
                                                      "rng": rng(), **DRAWN},
    "statistics.proportion_interval": lambda: {"successes": 1, "trials": 3, "level": 0.9},
    "training.spawn_streams": lambda: {"seed": 0},
    "training.train_seeds": lambda: {"train": train, **SHORT, "env": None, "config": None},
    "training.weights_of": lambda: {"arrays": {"a": np.zeros((2, 3))}, "position": 0, "moment": ""},
    "worlds.discretise.Discretised": lambda: {"env": "MountainCar-v0", "bins": 3, "levels": None,
                                              "low": None, "high": None},
    "worlds.discretise.Discretised.reset": lambda: {"self": cut(), "seed": 0, "options": None},
    "worlds.discretise.Discretised.step": lambda: {"self": cut(), "action": 0},
    "worlds.discretise.action_levels": lambda: {"space": spaces.Box(-1, 1, (1,)), "levels": 3},
    "worlds.discretise.checked_bins": lambda: {"name": "bins", "bins": 3},
    "worlds.discretise.gridded": lambda: {"env": "MountainCar-v0", "bins": 3, "levels": None},
    "worlds.discretise.make_grid": lambda: {"space": BOX, "bins": 3, "low": None, "high": None},
    "worlds.environments.task_of": lambda: {"env": "MountainCar-v0"},
    "worlds.environments.checked_reward": lambda: {"env": "here", "reward": 1.0},
    "worlds.environments.one_seed_of": lambda: {"env": "MountainCar-v0", "seeds": [0]},
    "worlds.environments.open_world": lambda: {"env": "MountainCar-v0"},
    "worlds.environments.opened": lambda: {"env": "MountainCar-v0"},
    "worlds.maze_layout.read_layout": lambda: {"layout": "SG"},
    "worlds.names.Make": lambda: {"id": "CartPole-v1", "arguments": {}},
    "worlds.names.find": lambda: {"env": "CartPole-v1"},
    "worlds.names.identity": lambda: {"env": "CartPole-v1"},
    "worlds.names.name_of": lambda: {"env": "CartPole-v1"},
    "worlds.names.make_environment": lambda: {"env": "CartPole-v1"},
    "worlds.shaping.Shaping": lambda: {"function": "rl_core.worlds.shaping:original"},
    "worlds.tasks.Task": lambda: settings(CartPole),
    "worlds.tasks.task": lambda: {"n_state": 1, "observation_space": BOX,
                                  "action_space": spaces.Discrete(2), "max_episode_steps": 5},
}  # fmt: skip

# What is public and is not varied, each with the reason. All else must have a call above.

INSIDE = {
    "checks": "the checks themselves: what they are told stands in code; tests/test_checks.py",
    "dqn.DQNConfig.report_2018": "its arguments are those of DQNConfig",
    "dqn.TorchLearner": "made by dqn",
    "dqn.act": "in the loop of dqn, every step",
    "dqn.play": "the loop of dqn",
    "evaluation.Rollout": "returned",
    "experiments.progress": "inside run",
    "experiments.provenance": "takes nothing",
    "experiments.runner.Results": "returned",
    "experiments.store": "inside run; tests/test_store.py",
    "experiments.workers": "inside run",
    "identity.canonical_json": "of what describe returns",
    "identity.digest": "of what describe returns",
    "identity.code_behind": "of a path that was imported",
    "identity.restored": "inside load, of what describe returns",
    "mdp.checked_policy": "inside the planners",
    "modules.Adam": "as torch's optimisers",
    "modules.RMSProp": "as torch's optimisers",
    "modules.as_arrays": "of what make_module returns",
    "modules.make_module": "inside the learners, of a config and a world that were checked",
    "modules.perceptron": "inside make_module",
    "modules.train_networks": "inside the learners; what it is told is checked by train_seeds",
    "modules.reproducible": "around training; its seed is a seed that was checked",
    "planning.Plan": "returned",
    "policies.initial_log_sigma": "of what make_policy returns",
    "policies.initial_parameters": "of what make_policy returns",
    "policies.make_policy": "of a config and a world that were checked",
    "policies.trainable": "of what make_policy returns",
    "q_learning.make_yardstick": "inside q_learning",
    "reinforce.TorchLearner": "made by reinforce",
    "reinforce.log_probability": "in the loss, every batch",
    "sources": "about modules that are loaded",
    "statistics.Interval": "returned",
    "training.Failure": "returned",
    "worlds.environments.native_action": "of a space and an action that were checked",
    "worlds.environments.observed": "inside step; tests/test_environments.py",
    "training.Run": "returned",
    "training.Streams": "returned",
    "training.Training": "given to learners by train_seeds",
    "worlds.discretise.Grid": "made by make_grid",
    "worlds.discretise.GriddedTask": "made by gridded",
    "worlds.environments.GymnasiumWorld": "made by open_world",
    "worlds.environments.TaskWorld": "made by open_world",
    "worlds.environments.step": "every step; what an environment returns: test_environments.py",
    "worlds.episodes": "the loop over an episode, every step",
    "worlds.maze_layout.find": "of what read_layout returns",
    "worlds.maze_layout.draw_maze": "of a Maze that was checked",
    "worlds.shaping.compiled_shape": "inside Shaping",
    "worlds.shaping.original": "every step",
    "worlds.shaping.shape_for": "inside dqn, of a config that was checked",
    "worlds.names.check_elsewhere": "inside run, of an environment that was found",
    "worlds.tables": "inside MDP.from_env",
    "worlds.tabular": "every step, of a world that was opened",
    "worlds.tasks.Kernel": "made by Task.kernel",
    "worlds.twins.twin": "of a text",
}

HOW = {"name", "allowed", "check", "modules", "unit"}
"""Arguments that say how to check and how to tell of it: they stand in code."""

WORK = {"episodes": 10**4, "resamples": 10**4, "max_steps": 10**4, "max_episode_steps": 10**4,
        "rows": 10**3, "columns": 10**3, "points": 10**3, "n_inputs": 10**4, "n_outputs": 10**4,
        "n_observations": 10**4, "n_actions": 10**4, "n_states": 10**6, "n": 10**3,
        "hidden": 10**4, "workers": 1}  # fmt: skip
"""More of it is allowed, and is a day's work, all the memory, or a process each: not tried out."""

EVERY = 4
"""Of the odd values for an argument, one in so many is tried: with 1 it takes minutes."""


def too_much(name: str, value: object) -> bool:
    """Whether the value is an allowed amount of work that a test cannot wait for."""
    if name == "workers" and value is None:  # as many as there are cores
        return True
    amounts = value if isinstance(value, list | tuple) else [value]
    return name in WORK and any(
        isinstance(one, Integral) and not isinstance(one, bool) and WORK[name] < one < 2**63
        for one in amounts
    )


def public() -> Iterator[str]:
    """Name what is public in `rl_core` and not machine code: functions, classes and methods."""
    for module in pkgutil.walk_packages(rl_core.__path__, "rl_core."):
        name = module.name.removeprefix("rl_core.")
        if name == "__main__" or name.startswith("kernels"):  # arithmetic on checked arrays
            continue
        for key, thing in vars(importlib.import_module(module.name)).items():
            own = getattr(thing, "__module__", None) == module.name
            if key.startswith("_") or not own or not callable(thing) or hasattr(thing, "py_func"):
                continue
            if not inspect.isclass(thing):
                yield f"{name}.{key}"
            elif not issubclass(thing, Exception):
                yield f"{name}.{key}"
                yield from (f"{name}.{key}.{method}" for method in _methods(thing))


def _methods(thing: type) -> Iterator[str]:
    for key, value in vars(thing).items():
        function = getattr(value, "__func__", value)
        if not key.startswith("_") and inspect.isfunction(function):
            yield key


def arguments(name: str) -> list[str]:
    """Name the arguments that can be replaced."""
    return [key for key in inspect.signature(found(name)).parameters if key not in ("self", "cls")]


def takes_nothing(name: str) -> bool:
    """Whether there is nothing to replace."""
    return not arguments(name)


def inside(name: str) -> bool:
    """Whether it or what it belongs to is listed in `INSIDE`."""
    parts = name.split(".")
    return any(".".join(parts[:n]) in INSIDE for n in range(1, len(parts) + 1))


def found(name: str) -> Callable[..., Any]:
    """Return what has this name below `rl_core`."""
    function: Callable[..., Any] = pkgutil.resolve_name(f"rl_core.{name}")
    return function


def plan(every: int = EVERY) -> list[tuple[str, str, str]]:
    """List the calls: what is called, which argument is replaced, and the odd value's name.

    Each argument gets one odd value in `every`, the next argument the next ones.
    """
    replaced = [
        (name, argument)
        for name, valid in CALLS.items()
        for argument in valid()
        if argument != "self" and argument not in HOW
    ]
    return [
        (name, argument, odd)
        for i, (name, argument) in enumerate(replaced)
        for odd in list(ODD)[i % every :: every]
        if not too_much(argument, ODD[odd]())
    ]


def outcome(name: str, argument: str, odd: str) -> str:
    """Make a call and say what came of it: "taken", "named", "nameless: ...", or worse."""
    valid = CALLS[name]()
    valid[argument] = ODD[odd]()
    function = found(name)
    try:
        function(**valid)
    except Exception as error:
        told = f"{type(error).__name__}: {error}"
        kinds = (kind.__name__ for kind in type(error).__mro__[:-3])  # without what all are
        promised = isinstance(error, TypeError | ValueError) or any(
            kind in (function.__doc__ or "") for kind in kinds
        )
        if not promised:
            return f"unrelated: {told}"
        said = _names(argument, str(error)) or isinstance(error, OSError)  # which names the file
        return "named" if said else f"nameless: {told}"
    return "taken"


def _names(argument: str, message: str) -> bool:
    return argument in re.findall(r"\w+", message)


def main(share: int, shares: int, first: int) -> None:
    """Make every call of a share from number `first` on; write what comes of each."""
    warnings.simplefilter("ignore")
    agent().save(SAVED)
    told = sys.stdout
    sys.stdout = sys.stderr  # what a function prints is not read
    for name in CALLS:  # compiles and imports what will be needed
        found(name)(**CALLS[name]())
        print("warmer", file=told, flush=True)
    print("warm", file=told, flush=True)
    for i, call in list(enumerate(plan()))[share::shares]:
        if i >= first:
            print(json.dumps([i]), file=told, flush=True)
            print(json.dumps([i, outcome(*call)[:300]]), file=told, flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
