"""The same bits however an experiment is run: blocks, workers, Dask, kills, damage."""

import dataclasses
import getpass
import importlib
import os
import random
import select
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import gymnasium
import joblib
import numba
import numpy as np
import pandas as pd
import pytest
import torch
import toy_experiment
import toy_learner
import toy_task
from toy_learner import ToyConfig, count_threads, extra_column, hoard, learn

import rl_core
from rl_core.dqn import DQNConfig, dqn
from rl_core.experiments import Arm, DamagedResultWarning, provenance, run, runner
from rl_core.experiments.store import ARRAYS, RECORD, TABLE, Store
from rl_core.maze import Maze
from rl_core.policies import MLP, Gaussian
from rl_core.q_learning import QLearningConfig, q_learning
from rl_core.reinforce import ReinforceConfig, reinforce
from rl_core.worlds.names import Make

TESTS = Path(__file__).parent
PLAIN = Arm("plain", learn, "CartPole-v1", ToyConfig(), 20, (0, 20))
BOLD = Arm("bold", learn, "CartPole-v1", ToyConfig(step_size=0.5, diverging=(2,)), 15)
ACROBOT = Arm(
    "Acrobot", reinforce, "Acrobot-v1", ReinforceConfig(max_episode_steps=300), 4, (0, 2, 4)
)
CAR = Arm(
    "car",
    reinforce,
    "MountainCarContinuous-v0",
    ReinforceConfig(
        policy=Gaussian(learn_sigma=True, constant_feature=True),
        network=MLP(biases=False),
        epochs=1,
        normalise="centre",
        max_episode_steps=700,
    ),
    4,
    (0, 2, 4),
)
DEEP = Arm(
    "DQN",
    dqn,
    "MountainCar-v0",
    DQNConfig(batch_size=16, memory_size=100, learning_starts=100, max_episode_steps=200),
    4,
    (0, 2, 4),
)
quiet = {"progress": False}


def direct(arm, seeds):
    """What the learner itself gives, all seeds in one stack."""
    return arm.algorithm(
        arm.env, arm.config, episodes=arm.episodes, seeds=list(seeds), snapshots=arm.snapshots
    )


def assert_results_are(results, arms, seeds):
    """Compare with the learner called directly, every bit."""
    tables = []
    for arm in arms:
        expected = direct(arm, seeds)
        by_seed = [expected.table[expected.table.seed == seed] for seed in seeds]
        table = pd.concat(by_seed, ignore_index=True)
        table.insert(0, "arm", arm.name)
        tables.append(table)
        arrays = results.arrays(arm.name)
        assert sorted(arrays) == sorted(expected.arrays)
        for name, array in expected.arrays.items():
            assert arrays[name].dtype == array.dtype
            assert arrays[name].shape == array.shape
            assert arrays[name].tobytes() == array.tobytes()
        failures = results.failures[results.failures.arm == arm.name].drop(columns="arm")
        assert failures.to_dict("records") == [dataclasses.asdict(f) for f in expected.failures]
    pd.testing.assert_frame_equal(
        results.table, pd.concat(tables, ignore_index=True), check_exact=True
    )


@pytest.fixture
def seeds_run(monkeypatch):
    """List the arms and seeds that are run, in order; needs workers=1."""
    seeds = []

    def recorded(task, store, parent):
        seeds.append((task.arm.name, task.seed))
        return original(task, store, parent)

    original = runner.run_task
    monkeypatch.setattr(runner, "run_task", recorded)
    return seeds


# --- the same bits --------------------------------------------------------------------------------


@pytest.mark.parametrize("arm", [BOLD, ACROBOT, CAR, DEEP])
def test_a_seed_alone_gives_the_bits_it_has_among_thirty(tmp_path, arm):
    thirty = run([arm], seeds=range(30), store=tmp_path / "30", workers=1, **quiet)
    stacked = thirty.arrays(arm.name)
    for seed in (2, 9):
        alone = run([arm], seeds=[seed], store=tmp_path / "1", workers=1, **quiet)
        table = thirty.table[thirty.table.seed == seed].reset_index(drop=True)
        pd.testing.assert_frame_equal(alone.table, table, check_exact=True)
        for name, array in alone.arrays(arm.name).items():
            assert array[0].tobytes() == stacked[name][seed].tobytes()
    # and two seeds have no weights in common
    weights = {
        name: array for name, array in stacked.items() if name.endswith(("weight", "weights"))
    }
    assert weights
    for name, array in weights.items():
        assert len({of_seed.tobytes() for of_seed in array}) == 30, name


@pytest.mark.parametrize("backend", ["loky", "threading", "multiprocessing"])
def test_two_workers_give_the_same_bits(tmp_path, backend):
    arms = [PLAIN, BOLD, ACROBOT, CAR, DEEP]
    results = run(arms, seeds=range(6), store=tmp_path, backend=backend, **quiet)
    assert_results_are(results, arms, range(6))


def test_a_worker_that_grew_is_replaced_without_a_word(tmp_path):
    """Warnings are errors here: in the thread that replaces a worker, one would hang the run."""
    arms = [Arm("hoard", hoard, "CartPole-v1", ToyConfig(seconds=1.1), 1)]
    results = run(arms, seeds=range(6), store=tmp_path, **quiet)
    assert sorted(results.table["seed"]) == [*range(6)]


def test_dask_gives_the_same_bits(tmp_path):
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
        ) as cluster,
        Client(cluster),
    ):
        arms = [PLAIN, BOLD, ACROBOT, CAR, DEEP]
        results = run(arms, seeds=range(6), store=tmp_path, backend="dask", **quiet)
    assert_results_are(results, arms, range(6))


def test_dask_needs_a_client_only_for_work(tmp_path):
    with pytest.raises(ValueError, match="Client"):
        run([PLAIN], seeds=[0], store=tmp_path, backend="dask", **quiet)
    run([PLAIN], seeds=[0], store=tmp_path, workers=1, **quiet)
    assert len(run([PLAIN], seeds=[0], store=tmp_path, backend="dask", **quiet).table) == 20


def test_the_order_is_that_of_the_arguments(tmp_path):
    seeds = [7, 2, 5]
    results = run([BOLD, PLAIN], seeds=seeds, store=tmp_path, workers=1, **quiet)
    assert_results_are(results, [BOLD, PLAIN], seeds)
    assert list(results.provenance.seed) == seeds * 2


def test_global_random_states_are_untouched(tmp_path):
    numpy_before, torch_before = np.random.get_state()[1].copy(), torch.get_rng_state()  # noqa: NPY002
    python_before = random.getstate()
    run([PLAIN], seeds=range(2), store=tmp_path, workers=1)
    np.testing.assert_array_equal(np.random.get_state()[1], numpy_before)  # noqa: NPY002
    assert torch.equal(torch.get_rng_state(), torch_before)
    assert random.getstate() == python_before


@pytest.mark.parametrize("workers", [1, 2])
def test_a_worker_uses_one_thread(tmp_path, workers):
    before = torch.get_num_threads()
    torch.set_num_threads(3)
    try:
        arm = Arm("threads", count_threads, "CartPole-v1", ToyConfig(), 1)
        results = run([arm], seeds=[0, 1], store=tmp_path, workers=workers, **quiet)
        assert torch.get_num_threads() == 3
    finally:
        torch.set_num_threads(before)
    assert results.arrays("threads")["threads"].tolist() == [1, 1]


def test_a_worker_sees_to_its_threads_itself(tmp_path, monkeypatch):
    monkeypatch.setattr(runner, "use_threads", lambda _: 1)  # the main process does not
    before = torch.get_num_threads()
    torch.set_num_threads(3)
    try:
        arm = Arm("threads", count_threads, "CartPole-v1", ToyConfig(), 1)
        results = run([arm], seeds=[0], store=tmp_path, workers=1, **quiet)
    finally:
        torch.set_num_threads(before)
    assert results.arrays("threads")["threads"].tolist() == [1]


# --- read, not run --------------------------------------------------------------------------------


def test_what_is_stored_is_not_run_again(tmp_path, seeds_run):
    first = run([PLAIN], seeds=range(3), store=tmp_path, workers=1, **quiet)
    assert seeds_run == [("plain", 0), ("plain", 1), ("plain", 2)]
    again = run([PLAIN], seeds=range(3), store=Store(tmp_path), workers=1, **quiet)
    assert len(seeds_run) == 3
    pd.testing.assert_frame_equal(again.table, first.table, check_exact=True)
    pd.testing.assert_frame_equal(again.provenance, first.provenance, check_exact=True)


def test_more_seeds_run_only_the_new_ones(tmp_path, seeds_run):
    run([PLAIN], seeds=range(3), store=tmp_path, workers=1, **quiet)
    seeds_run.clear()
    results = run([PLAIN], seeds=range(30), store=tmp_path, workers=1, **quiet)
    assert seeds_run == [("plain", seed) for seed in range(3, 30)]
    assert_results_are(results, [PLAIN], range(30))


def test_arms_that_differ_in_name_only_share_their_results(tmp_path, seeds_run):
    other = dataclasses.replace(PLAIN, name="baseline")
    results = run([PLAIN, other], seeds=range(2), store=tmp_path, workers=1, **quiet)
    assert seeds_run == [("plain", 0), ("plain", 1)]
    assert_results_are(results, [PLAIN, other], range(2))


@pytest.mark.parametrize(
    "change",
    [
        {"config": ToyConfig(step_size=0.1000000000000001)},
        {"env": "CartPole-v0"},
        {"episodes": 21},
        {"snapshots": (0,)},
        {"algorithm": count_threads},
    ],
)
def test_whatever_makes_a_result_makes_its_digest(change):
    changed = dataclasses.replace(PLAIN, **change)
    assert changed.identity() != PLAIN.identity()


@pytest.mark.parametrize("library", ["gymnasium", "llvmlite", "numpy", "torch"])
def test_another_version_of_a_library_runs_again(tmp_path, monkeypatch, seeds_run, library):
    run([PLAIN], seeds=[0], store=tmp_path, workers=1, **quiet)
    version = provenance.importlib.metadata.version
    monkeypatch.setattr(
        provenance.importlib.metadata,
        "version",
        lambda name: "0.0.1" if name == library else version(name),
    )
    results = run([PLAIN], seeds=[0], store=tmp_path, workers=1, **quiet)
    assert len(seeds_run) == 2
    assert list(results.provenance[library]) == ["0.0.1"]


def test_python_itself_counts(monkeypatch):
    before = PLAIN.identity()
    monkeypatch.setattr(provenance.platform, "python_version", lambda: "3.99.0")
    assert PLAIN.identity() != before


# --- a result is served only for what made it -----------------------------------------------------


WORLD = """
from dataclasses import dataclass
from gymnasium.envs.classic_control import CartPoleEnv

class Cart(CartPoleEnv):
    def __init__(self, length=0.5):
        super().__init__()
        self.length = length

@dataclass(frozen=True)
class Rule:
    epsilon: float = 0.1
"""


@dataclasses.dataclass(frozen=True)
class Ruled(ToyConfig):
    """A config with a part from another module."""

    rule: object = None


@pytest.fixture
def world(tmp_path, monkeypatch):
    """A module with an environment and a part of a config."""
    path = tmp_path / "served_world.py"
    path.write_text(WORLD)
    monkeypatch.syspath_prepend(tmp_path)
    gymnasium.register("Served-v0", entry_point="served_world:Cart")
    yield importlib.import_module("served_world")
    gymnasium.registry.pop("Served-v0", None)
    del sys.modules["served_world"]


def test_another_registration_under_the_same_id_runs_again(tmp_path, seeds_run, world):
    arm = dataclasses.replace(PLAIN, env="Served-v0")
    run([arm], seeds=[0], store=tmp_path / "store", workers=1, **quiet)
    gymnasium.registry.pop("Served-v0")
    gymnasium.register("Served-v0", entry_point="served_world:Cart", kwargs={"length": 0.6})
    run([arm], seeds=[0], store=tmp_path / "store", workers=1, **quiet)
    assert len(seeds_run) == 2
    run([arm], seeds=[0], store=tmp_path / "store", workers=1, **quiet)
    assert len(seeds_run) == 2


def test_the_code_of_a_part_of_the_config_counts(world):
    arm = dataclasses.replace(PLAIN, config=Ruled(rule=world.Rule()))
    before = arm.identity()
    path = Path(world.__file__)
    path.write_text(WORLD.replace("class Rule:", "class Rule:\n    greedy = True"))
    assert arm.identity() != before


def test_the_switches_of_numba_count(monkeypatch):
    before = PLAIN.identity()
    monkeypatch.setattr(numba.config, "OPT", 0)
    assert PLAIN.identity() != before


def test_code_that_nothing_depends_on_does_not_count(world):
    before = PLAIN.identity()
    Path(world.__file__).write_text(WORLD + "\nA = 1\n")
    assert PLAIN.identity() == before
    machinery = {"runner", "store", "progress", "workers"}
    assert not {f"rl_core.experiments.{name}" for name in machinery} & set(before["code"])


def test_an_environment_that_workers_cannot_find_is_refused(tmp_path):
    class Local(gymnasium.Env):
        pass

    gymnasium.register("Local-v0", entry_point=Local)
    try:
        with pytest.raises(TypeError, match=r"^arm 'plain': env 'Local-v0' must be registered"):
            run([dataclasses.replace(PLAIN, env="Local-v0")], seeds=[0], store=tmp_path / "store")
    finally:
        del gymnasium.registry["Local-v0"]
    assert not (tmp_path / "store").exists()


def test_an_environment_with_arguments_is_named_with_them(tmp_path):
    arm = dataclasses.replace(PLAIN, env=Make("CartPole-v1", {"sutton_barto_reward": True}))
    made = run([arm, BOLD], seeds=[0], store=tmp_path, workers=1, **quiet).provenance
    assert made.env.tolist() == ["CartPole-v1(sutton_barto_reward=True)", "CartPole-v1"]


# --- labels ---------------------------------------------------------------------------------------


def test_labels_become_columns_and_make_no_other_result(tmp_path, seeds_run):
    arms = [
        dataclasses.replace(PLAIN, name=f"rate {rate}", labels={"rate": rate, "biases": True})
        for rate in (0.1, 0.2)
    ]
    results = run([PLAIN], seeds=[0], store=tmp_path, workers=1, **quiet)
    labelled = run(arms, seeds=[0], store=tmp_path, workers=1, **quiet)
    assert len(seeds_run) == 1
    assert list(labelled.table)[:4] == ["arm", "rate", "biases", "seed"]
    assert labelled.table.groupby("arm").rate.unique().explode().tolist() == [0.1, 0.2]
    columns = list(results.table)[1:]
    assert labelled.table.loc[:19, columns].equals(results.table[columns])


def test_a_label_that_is_a_column_of_the_table_is_refused(tmp_path):
    arm = dataclasses.replace(ACROBOT, labels={"loss": 1})
    run([arm], seeds=[0], store=tmp_path, workers=1, **quiet)
    arm = Arm("extra", extra_column, "CartPole-v1", ToyConfig(), 1, labels={"extra": 1})
    with pytest.raises(ValueError, match="labels of arm 'extra' must be no columns of its table"):
        run([arm], seeds=[0], store=tmp_path, workers=1, **quiet)


# --- what is told besides -------------------------------------------------------------------------


def test_failures_are_stored_and_reported(tmp_path, seeds_run):
    for _ in range(2):
        results = run([PLAIN, BOLD], seeds=range(4), store=tmp_path, workers=1, **quiet)
        assert results.failures.to_dict("records") == [
            {"arm": "bold", "seed": 2, "episode": 3, "reason": "weights are NaN"}
        ]
    assert len(seeds_run) == 8
    rows = results.table[(results.table.arm == "bold")].groupby("seed").size()
    assert rows.to_dict() == {0: 15, 1: 15, 2: 3, 3: 15}
    none = run([PLAIN], seeds=range(4), store=tmp_path, workers=1, **quiet).failures
    assert list(none.columns) == ["arm", "seed", "episode", "reason"]
    assert none.empty


def test_provenance_tells_what_made_a_result(tmp_path):
    arm = dataclasses.replace(PLAIN, config=ToyConfig(seconds=0.001))
    made = run([arm], seeds=range(5), store=tmp_path, workers=1, **quiet).provenance
    assert list(made.columns[:3]) == ["arm", "seed", "digest"]
    row = made.iloc[4]
    assert row.algorithm == "toy_learner:learn"
    assert '"step_size":0.1' in row.config
    assert (row.env, row.episodes, row.snapshots) == ("CartPole-v1", 20, (0, 20))
    assert torch.__version__.startswith(row.torch)
    assert row.processor
    assert row.machine == os.uname().machine
    assert row.date[:2] == "20"
    assert row.seconds >= 20 * 0.001  # the learner slept so long,
    assert 0 < row.processor_seconds < row.seconds  # which is no work
    steps = direct(arm, [4]).arrays["env_steps"].sum()
    assert row.env_steps_per_second == pytest.approx(steps / row.seconds)


def test_nothing_stored_tells_of_this_machine_but_its_processor(tmp_path):
    results = run([PLAIN], seeds=[0], store=tmp_path, workers=1, **quiet)
    (folder,) = (tmp_path / "results").iterdir()
    assert folder.name == results.provenance.digest[0]
    content = b"".join(path.read_bytes() for path in folder.iterdir()).decode("latin-1")
    package = str(Path(rl_core.__file__).parent)
    for telling in (str(tmp_path), package, str(Path.home()) + "/"):
        assert telling not in content
    assert f'"{socket.gethostname()}"' not in content
    assert f'"{getpass.getuser()}"' not in content


def test_arrays_of_an_unknown_arm(tmp_path):
    results = run([PLAIN], seeds=[0], store=tmp_path, workers=1, **quiet)
    with pytest.raises(ValueError, match="arm must be one of 'plain', got 'bold'"):
        results.arrays("bold")


# --- what goes wrong ------------------------------------------------------------------------------


@pytest.mark.parametrize("workers", [1, 2])
def test_a_failing_seed_does_not_take_the_others_down(tmp_path, workers):
    raising = Arm("raising", learn, "CartPole-v1", ToyConfig(raising=(3, 4)), 15)
    arguments = {"seeds": range(6), "store": tmp_path, "workers": workers, **quiet}
    with pytest.raises(ExceptionGroup, match="2 of 12 seeds failed") as caught:
        run([raising, PLAIN], **arguments)
    messages = sorted(str(error) for error in caught.value.exceptions)
    assert messages == [
        "arm 'raising', seed 3: ValueError: cannot learn from 3",
        "arm 'raising', seed 4: ValueError: cannot learn from 4",
    ]
    assert "toy_learner.py" in caught.value.exceptions[0].__notes__[0]  # the worker's traceback
    assert len(list((tmp_path / "results").iterdir())) == 4 + 6
    assert list((tmp_path / "scratch").iterdir()) == []


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (None, "must return a Run, got NoneType"),
        (rl_core.training.Run(pd.DataFrame({"steps": [1]})), "must have the column 'seed'"),
        (rl_core.training.Run(pd.DataFrame({"seed": [1], "arm": ["a"]})), "and no 'arm'"),
        (rl_core.training.Run(pd.DataFrame({"seed": [9]})), r"must tell of seed 0 only, got \[9\]"),
        (
            rl_core.training.Run(pd.DataFrame({"seed": [0]}), {"weights": np.zeros((2, 3))}),
            r"'weights' must have one seed as its first axis, got shape \(2, 3\)",
        ),
    ],
)
def test_what_is_no_proper_run_is_not_stored(tmp_path, monkeypatch, returned, message):
    monkeypatch.setattr(toy_learner, "broken", lambda *_, **__: returned, raising=False)
    toy_learner.broken.__module__, toy_learner.broken.__qualname__ = "toy_learner", "broken"
    arm = Arm("broken", toy_learner.broken, "CartPole-v1", ToyConfig(), 5)
    with pytest.raises(ExceptionGroup) as caught:
        run([arm], seeds=[0], store=tmp_path, workers=1, **quiet)
    assert caught.group_contains(RuntimeError, match=message)
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize("file", [TABLE, ARRAYS, RECORD])
@pytest.mark.parametrize("damage", ["truncated", "flipped", "missing"])
def test_a_damaged_result_is_named_and_made_again(tmp_path, seeds_run, file, damage):
    before = run([BOLD, PLAIN], seeds=range(3), store=tmp_path, workers=1, **quiet)
    digest = before.provenance.digest[4]  # plain, seed 1
    path = tmp_path / "results" / digest / file
    content = bytearray(path.read_bytes())
    chance = random.Random(f"{file} {damage}")
    if damage == "truncated":
        path.write_bytes(content[: chance.randrange(len(content))])
    elif damage == "flipped":
        content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
        path.write_bytes(content)
    else:
        path.unlink()
    seeds_run.clear()
    with pytest.warns(DamagedResultWarning) as caught:
        results = run([BOLD, PLAIN], seeds=range(3), store=tmp_path, workers=1, **quiet)
    (warning,) = caught
    assert str(path) in str(warning.message)
    assert str(warning.message).startswith("arm 'plain', seed 1: ")
    assert warning.filename == __file__
    assert seeds_run == [("plain", 1)]
    assert_results_are(results, [BOLD, PLAIN], range(3))
    run([BOLD, PLAIN], seeds=range(3), store=tmp_path, workers=1, **quiet)
    assert len(seeds_run) == 1


@dataclasses.dataclass
class Thawed:
    """A config that can change."""

    step_size: float = 0.1


@dataclasses.dataclass(frozen=True)
class Odd:
    """A config that JSON cannot tell from others."""

    thing: object = dataclasses.field(default_factory=lambda: {1, 2})


def local_class():
    """Return a frozen dataclass that no other process can find."""

    @dataclasses.dataclass(frozen=True)
    class Local:
        step_size: float = 0.1

    return Local


def in_main(*_, **__):
    """A function that a notebook or script defines: workers have another `__main__`."""


in_main.__module__ = "__main__"


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"name": ""}, ValueError, "name must be a text that is not empty, got ''"),
        ({"name": 3}, TypeError, "name must be a text"),
        ({"env": None}, TypeError, "env must be a Gymnasium id, a Make, an import path, .*, got N"),
        ({"config": Thawed()}, TypeError, "config must be a frozen dataclass's .*, got Thawed"),
        ({"config": {"gamma": 1}}, TypeError, "config must be a frozen dataclass"),
        ({"config": ToyConfig}, TypeError, "config must be a frozen dataclass"),
        ({"config": Odd()}, TypeError, r"config\.thing must be made of .*, got \{1, 2\}"),
        (
            {"config": local_class()()},
            TypeError,
            r"config must be .* can be imported .* got <class",
        ),
        ({"episodes": 0}, ValueError, "episodes must be an integer from 1, got 0"),
        ({"episodes": 10.0}, TypeError, r"episodes must be an integer from 1, got 10\.0"),
        ({"episodes": True}, TypeError, "episodes must be .*, got True"),
        ({"snapshots": [0]}, TypeError, r"snapshots must be a tuple of integers, got \[0\]"),
        ({"snapshots": (21,)}, ValueError, "snapshots must be an integer from 0 to 20, got 21"),
        ({"snapshots": (-1,)}, ValueError, "snapshots must be an integer from 0 to 20, got -1"),
        ({"algorithm": lambda: None}, TypeError, "algorithm must be a function at the top of a"),
        ({"algorithm": "learn"}, TypeError, "algorithm must be a function .*, got 'learn'"),
        ({"algorithm": in_main}, TypeError, "algorithm must be a function at the top of a"),
        ({"labels": {"seed": 1}}, ValueError, "labels must be texts other than .*, got 'seed'"),
        ({"labels": {1: 1}}, ValueError, "labels must be texts other than .*, got 1"),
        ({"labels": {"a": [1]}}, TypeError, r"labels\['a'\] must be a str, .*, got \[1\]"),
        ({"labels": "a"}, TypeError, "labels must be a mapping"),
    ],
)
def test_an_arm_refuses(monkeypatch, change, error, message):
    monkeypatch.setattr(sys.modules["__main__"], "in_main", in_main, raising=False)
    with pytest.raises(error, match=message):
        dataclasses.replace(PLAIN, **change)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"arms": []}, ValueError, r"arms must be .* at least one .*, got \[\]"),
        ({"arms": [PLAIN, PLAIN]}, ValueError, "each name once, got .'plain', 'plain'"),
        ({"arms": PLAIN}, TypeError, "arms must be a sequence of Arm.*, got Arm"),
        ({"arms": ["plain"]}, TypeError, "arms must be a sequence of Arm.*, got 'plain'"),
        ({"seeds": []}, ValueError, r"seeds must be one or more, each once, got \(\)"),
        ({"seeds": [1, 2, 1]}, ValueError, r"seeds must be one or more, each once, got \(1, 2, 1"),
        ({"seeds": [1, np.int64(1)]}, ValueError, "each once"),
        ({"seeds": [0, -3]}, ValueError, "seeds must be an integer from 0, got -3"),
        ({"seeds": [2**63]}, ValueError, r"seeds must be an integer from 0 below 2\*\*63, got 92"),
        ({"seeds": [0.5]}, TypeError, r"seeds must be an integer from 0, got 0\.5"),
        ({"seeds": [True]}, TypeError, "seeds must be an integer from 0, got True"),
        ({"seeds": 30}, TypeError, "seeds must be a sequence of integers from 0, got 30"),
        ({"store": 3}, TypeError, "store must be a folder's path or a Store, got 3"),
        ({"store": None}, TypeError, "store must be"),
        ({"workers": 0}, ValueError, "workers must be an integer from 1 or None, got 0"),
        ({"workers": 1.5}, TypeError, r"workers must be .*, got 1\.5"),
        ({"backend": "Dask"}, ValueError, "backend must be one of .*'dask'.*'loky'.*, got 'Dask'"),
    ],
)
def test_run_refuses(tmp_path, change, error, message):
    arguments = {"arms": [PLAIN], "seeds": [0], "store": tmp_path / "store"} | change
    with pytest.raises(error, match=message):
        run(arguments.pop("arms"), **arguments)
    assert not (tmp_path / "store").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"env": "Pole-v7"}, "env must be an id that Gymnasium knows, got 'Pole-v7'"),
        ({"env": "nowhere:Foo-v0"}, "env must have a module that can be imported, got 'nowhere:"),
        ({"env": "MountainCarContinuous-v0"}, "policy must be Gaussian"),
        ({"config": ToyConfig()}, "config must be a ReinforceConfig, got ToyConfig"),
        ({"algorithm": dqn}, "config must be a DQNConfig, got ReinforceConfig"),
        (
            {"algorithm": dqn, "config": DQNConfig(), "env": "MountainCarContinuous-v0"},
            "env must have a Discrete action space",
        ),
        (
            {"algorithm": q_learning, "config": QLearningConfig(bins=(5, 5))},
            r"bins must be a positive integer, or 6 of them, got \(5, 5\)",
        ),
    ],
)
def test_an_arm_that_cannot_run_stops_all_before_anything_runs(tmp_path, change, message):
    wrong = dataclasses.replace(ACROBOT, name="wrong", **change)
    with pytest.raises((TypeError, ValueError), match=f"^arm 'wrong': {message}"):
        run([PLAIN, wrong], seeds=[0], store=tmp_path / "store", workers=1, **quiet)
    assert not (tmp_path / "store").exists()


def test_an_arm_takes_a_class_a_function_or_a_task_and_keeps_where_it_stands():
    for env, path in [
        (Maze, "rl_core.maze:Maze"),
        (toy_task.Corridor, "toy_task:Corridor"),
        (Make("Pendulum-v1", {"g": 5.0}), Make("Pendulum-v1", {"g": 5.0})),
    ]:
        assert dataclasses.replace(ACROBOT, env=env).env == path
    for nowhere in (lambda: Maze(), gymnasium.make("CartPole-v1"), 3):
        with pytest.raises(TypeError, match=r"^env must be a Gymnasium id, a Make, .*file of its"):
            dataclasses.replace(ACROBOT, env=nowhere)


def test_an_id_that_a_worker_would_not_know_is_refused_before_anything_runs(tmp_path):
    """A notebook registered it; a module that registers it when imported is found by workers."""
    gymnasium.register(
        "Short-v0", "gymnasium.envs.classic_control:CartPoleEnv", max_episode_steps=9
    )
    try:
        arm = dataclasses.replace(ACROBOT, name="short", env="Short-v0", episodes=2, snapshots=())
        here = run([arm], seeds=[0, 1], store=tmp_path / "here", workers=1, **quiet)
        assert here.table["steps"].max() <= 9
        message = r"^arm 'short': env must be known to workers, .* say 'module:Short-v0'"
        with pytest.raises(ValueError, match=message):
            run([arm], seeds=[0, 1], store=tmp_path / "store", workers=2, **quiet)
        assert not list((tmp_path / "store").glob("results/*"))
    finally:
        del gymnasium.registry["Short-v0"]


def test_an_arm_s_results_make_agents(tmp_path):
    arm = dataclasses.replace(ACROBOT, labels={"rate": 0.1})
    results = run([PLAIN, arm], seeds=[3, 1], store=tmp_path, workers=1, **quiet)
    made = results.arm(arm.name)
    assert list(made.table) == ["seed", *list(made.table)[1:]]
    assert "rate" not in made.table
    weights = made.agent(1).weights["layer0.weight"]
    np.testing.assert_array_equal(weights, results.arrays(arm.name)["layer0.weight"][1])


# --- several processes, and kills -----------------------------------------------------------------


def start(*command, **environment):
    """Start a program in a process group of its own."""
    path = os.pathsep.join([str(TESTS), str(Path(rl_core.__file__).parents[1])])
    return subprocess.Popen(
        [sys.executable, "-W", "error", *map(str, command)],
        env={**os.environ, "PYTHONPATH": path, **{k: str(v) for k, v in environment.items()}},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def finish(process):
    """Return what a program printed, once it has ended well."""
    output, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    return output.split()


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    """The fingerprints of the experiments, from one process that ran them through."""
    fingerprints = {}
    for learner, arms in toy_experiment.ARMS.items():
        store, seeds = tmp_path_factory.mktemp("store"), toy_experiment.SEEDS
        results = run(arms, seeds=seeds, store=store, workers=1, **quiet)
        assert_results_are(results, arms, seeds)
        fingerprints[learner] = toy_experiment.fingerprint(results)
    return fingerprints


def test_two_runners_at_once_do_not_disturb_each_other(tmp_path, uninterrupted):
    script = TESTS / "toy_experiment.py"
    processes = [start(script, "toy", tmp_path, workers) for workers in (1, 2)]
    for process in processes:
        assert finish(process) == ["begun", uninterrupted["toy"]]
    assert len(list((tmp_path / "results").iterdir())) == 12


def wait_for_work(process, store, before):
    """Wait until `process` has stored a result; return whether it has, or all is done."""
    while set(store.path.glob("results/*")) <= before:
        if select.select([process.stdout], [], [], 0.01)[0]:
            return False
    return True


@pytest.mark.slow
@pytest.mark.parametrize(
    ("learner", "workers", "kills", "latest"),
    [("toy", 1, 12, 1.2), ("toy", 2, 5, 1.0), ("reinforce", 2, 3, 2.0)],
)
def test_killed_at_random_moments_and_resumed(
    tmp_path, uninterrupted, learner, workers, kills, latest
):
    """Twenty kills together, each of the whole process group."""
    program = (TESTS / "toy_experiment.py", learner)
    moments = random.Random(workers)
    fresh = (Store(tmp_path / f"store {number}") for number in range(20 * kills))
    store, stored = next(fresh), 0
    counts = []  # results in the store after each kill
    while len(counts) < kills:
        before = set(store.path.glob("results/*"))
        with start(*program, store.path, workers) as process:
            assert process.stdout.readline() == "begun\n"
            moment = moments.uniform(0, latest)  # of an experiment that works about as long
            finished = not wait_for_work(process, store, before)
            if finished or select.select([process.stdout], [], [], moment)[0]:
                assert process.stdout.readline().strip() == uninterrupted[learner]
                # It was quicker than the kill: the next one starts from an empty store. (In one
                # that has everything there would be no work to kill, for ever.)
                store, stored = next(fresh), 0
                continue
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
        results = list(store.path.glob("results/*"))
        for result in results:
            store.read(result.name)  # raises if there were half a result
        assert len(results) >= stored  # what was stored stays
        stored = len(results)
        counts.append(stored)
    if kills > 10:  # among so many, some came in the middle
        assert any(0 < count < 12 for count in counts)
    last = finish(start(*program, store.path, workers))
    assert last == ["begun", uninterrupted[learner]]


STALE = """
import sys, pathlib
sys.path.insert(0, {folder!r})
import toy_copy
from rl_core.experiments import Arm, run

def steps():
    arm = Arm("stale", toy_copy.learn, "CartPole-v1", toy_copy.ToyConfig(), 3)
    try:
        results = run([arm], seeds=[0, 1], store={store!r}, workers={workers})
    except ExceptionGroup as group:
        return group.exceptions[0]
    return sorted(set(results.table.steps))

if __name__ == "__main__":
    assert len(steps()) > 1
    source = pathlib.Path(toy_copy.__file__)
    source.write_text(source.read_text().replace("stream.integers(1, 500)", "12345"))
    print(steps())
"""


@pytest.mark.parametrize(
    ("workers", "outcome"),
    [(1, "toy_copy was changed after this process loaded it: restart"), (2, "[12345]")],
)
def test_code_that_is_no_longer_on_disk_is_not_run(tmp_path, workers, outcome):
    """Otherwise old code's results would be kept under the new code's digest."""
    (tmp_path / "toy_copy.py").write_text((TESTS / "toy_learner.py").read_text())
    script = tmp_path / "script.py"
    store = str(tmp_path / "store")
    script.write_text(STALE.format(folder=str(tmp_path), store=store, workers=workers))
    assert outcome in " ".join(finish(start(script)))


# --- where it lies, and what it leaves ------------------------------------------------------------


def test_the_default_number_of_workers_is_that_of_the_cores_we_may_use(tmp_path, monkeypatch):
    asked = []
    original = runner._joblib
    monkeypatch.setattr(runner.joblib, "cpu_count", lambda: 3)
    monkeypatch.setattr(runner, "_joblib", lambda *them: asked.append(them) or original(*them))
    run([PLAIN], seeds=[0], store=tmp_path, backend="threading", **quiet)
    assert asked == [("threading", 3)]


def test_a_store_that_cannot_be_written_is_told_before_work_begins(tmp_path, seeds_run):
    (tmp_path / "file").touch()
    for store, reason in ((tmp_path / "file" / "x", "Not a dir"), (tmp_path / ("x" * 300), "too")):
        with pytest.raises(ValueError, match=f"store must be a folder that can be .*{reason}"):
            run([PLAIN], seeds=[0], store=store, workers=1, **quiet)
    assert seeds_run == []


@pytest.mark.skipif(sys.platform != "linux", reason="paths in bytes")
def test_paths_may_be_long_and_of_any_letters(tmp_path, uninterrupted):
    """A checkout below /home/jürgen, in a terminal that knows ASCII only."""
    folder = tmp_path / "jürgens wörk" / ("x" * 200) / ("y" * 200)
    store, temporary = folder / "störe", folder / "temporary"
    temporary.mkdir(parents=True)
    for name in ("toy_experiment.py", "toy_learner.py"):
        (folder / name).write_text((TESTS / name).read_text())
    process = start(folder / "toy_experiment.py", "toy", store, 2, LC_ALL="C", TMPDIR=temporary)
    assert finish(process) == ["begun", uninterrupted["toy"]]


def test_what_the_dead_left_is_removed_though_there_is_no_work(tmp_path, seeds_run):
    run([PLAIN], seeds=[0], store=tmp_path, workers=1, **quiet)
    (tmp_path / "scratch" / "of the dead").mkdir()
    run([PLAIN], seeds=[0], store=tmp_path, workers=1, **quiet)
    assert len(seeds_run) == 1
    assert list((tmp_path / "scratch").iterdir()) == []


def test_joblib_writes_no_temporary_files(tmp_path, monkeypatch):
    """Else there would be some to remove after a kill."""
    monkeypatch.setattr(runner, "TEMPORARY", str(tmp_path / "temporary"))
    with runner._joblib("loky", 2) as parallel:
        task = joblib.delayed(isinstance)(np.zeros(10**6), np.memmap)
        assert list(parallel([task, task])) == [False, False]
    assert not (tmp_path / "temporary").exists()


def children(pid):
    """The processes that a process has started, by Linux's /proc."""
    return [
        int(child)
        for task in Path(f"/proc/{pid}/task").iterdir()
        for child in (task / "children").read_text().split()
    ]


def is_alive(pid):
    """Whether a process runs; one that nobody has waited for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="knows children by Linux's /proc")
def test_workers_end_with_their_parent(tmp_path):
    program = TESTS / "toy_experiment.py"
    with start(program, "slow", tmp_path, 2) as process:
        assert process.stdout.readline() == "begun\n"
        while not list(tmp_path.glob("results/*")):
            time.sleep(0.05)
        workers = children(process.pid)
        assert len(workers) >= 2
        process.kill()  # it alone, not its group
    for _ in range(600):
        if not any(map(is_alive, workers)):
            break
        time.sleep(0.05)
    assert not any(map(is_alive, workers))
    assert len(list(tmp_path.glob("results/*"))) < len(toy_experiment.SEEDS)
