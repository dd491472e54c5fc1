"""What a worker does: train one seed of one arm and store the result."""

import importlib
import os
import sys
import threading
import time
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, NamedTuple

from rl_core import sources
from rl_core.experiments import provenance
from rl_core.experiments.arms import Arm
from rl_core.experiments.store import Store
from rl_core.training import Run

WATCH_SECONDS = 0.5


@dataclass(frozen=True, eq=False)
class Task:
    """One arm with one seed.

    Attributes
    ----------
    arm : Arm
        The arm.
    seed : int
        The seed.
    identity : mapping
        What decides the result's bits, the seed aside (`Arm.identity`).
    digest : str
        The digest of identity and seed, under which the store keeps the result.
    """

    arm: Arm
    seed: int
    identity: Mapping[str, Any]
    digest: str


class Outcome(NamedTuple):
    """What a worker sends back; the result itself is in the store.

    Attributes
    ----------
    arm : str
        The arm's name.
    env_steps : int
        Environment steps done.
    error : RuntimeError or None
        If an exception ended it: arm, seed and what was raised, in words, since not every exception
        can travel. A note holds the traceback in the worker.
    """

    arm: str
    env_steps: int
    error: RuntimeError | None


def run_task(task: Task, store: Store, parent: int) -> Outcome:
    """Train a seed and store what came of it; tell of the exception that ended it, if any.

    Parameters
    ----------
    task : Task
    store : Store
    parent : int
        The process that started the run. A worker that is its child ends with it.
    """
    _end_with(parent)
    try:
        return Outcome(task.arm.name, _train(task, store), None)
    except Exception as error:
        kind = type(error).__name__
        told = RuntimeError(f"arm {task.arm.name!r}, seed {task.seed}: {kind}: {error}")
        told.add_note(traceback.format_exc())
        return Outcome(task.arm.name, 0, told)


def _train(task: Task, store: Store) -> int:
    """Return the environment steps."""
    arm = task.arm
    _check_process(task.identity)
    use_threads(1)
    started, computed = time.perf_counter(), time.thread_time()
    run = arm.algorithm(
        arm.env, arm.config, episodes=arm.episodes, seeds=(task.seed,), snapshots=arm.snapshots
    )
    computed, seconds = time.thread_time() - computed, time.perf_counter() - started
    _check_run(run, task.seed)
    env_steps = int(run.table["env_steps"].max()) if "env_steps" in run.table else 0
    origin = {
        **task.identity,
        "seed": task.seed,
        "seconds": seconds,
        "processor_seconds": computed,
        "env_steps_per_second": env_steps / seconds,
        "processor": provenance.processor(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    store.write(task.digest, run, origin)
    return env_steps


def use_threads(count: int) -> int:
    """Let torch use `count` threads in this process, if it is loaded; return how many it used.

    Each worker gets one thread: there are as many of them as cores, and the number of threads may
    change the order in which torch sums, hence the bits.
    """
    if "torch" not in sys.modules:
        return 1
    torch = importlib.import_module("torch")  # waits where another thread is loading it
    before: int = torch.get_num_threads()
    torch.set_num_threads(count)
    return before


def _end_with(parent: int) -> None:
    """End this process as soon as `parent`, if that started it, is no more.

    A killed process tells its children nothing: they would train on, and wait for more for ever.
    """
    name = f"ends with {parent}"
    if os.getppid() != parent or any(thread.name == name for thread in threading.enumerate()):
        return

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(WATCH_SECONDS)
        os._exit(1)

    threading.Thread(target=watch, name=name, daemon=True).start()


def _check_process(identity: Mapping[str, Any]) -> None:
    """Check that this process has the code, versions and settings that the digest tells of."""
    sources.check_loaded(identity["code"])
    here = {"versions": provenance.versions(), "platform": provenance.platform_settings()}
    for kind, found in here.items():
        if found != identity[kind]:
            raise RuntimeError(
                f"{kind} of the worker must be those of the process that started the experiment, "
                f"{identity[kind]}, got {found}"
            )


def _check_run(run: object, seed: int) -> None:
    """Check what an algorithm returned before it is stored."""
    if not isinstance(run, Run):
        raise TypeError(f"the algorithm must return a Run, got {type(run).__name__}")
    if "seed" not in run.table or "arm" in run.table:
        columns = list(run.table.columns)
        raise ValueError(f"the table must have the column 'seed' and no 'arm', got {columns}")
    named = {*run.table["seed"], *(failure.seed for failure in run.failures)}
    if not named <= {seed}:
        raise ValueError(f"the run must tell of seed {seed} only, got {sorted(named)}")
    for name, array in run.arrays.items():
        if array.shape[:1] != (1,):
            raise ValueError(
                f"array {name!r} must have one seed as its first axis, got shape {array.shape}"
            )
