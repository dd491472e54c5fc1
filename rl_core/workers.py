"""What a worker does: train a block of seeds of one arm and store each seed's result."""

import sys
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd

from rl_core import provenance, sources
from rl_core.arm import Arm
from rl_core.progress import Reporter
from rl_core.run import Run
from rl_core.store import Store


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


@dataclass(frozen=True, eq=False)
class Block:
    """What a worker does at a time: some seeds of one arm, trained as one stack.

    Attributes
    ----------
    tasks : tuple of Task
        One a seed.
    report : Path
        The file its progress is written to.
    """

    tasks: tuple[Task, ...]
    report: Path

    @property
    def arm(self) -> Arm:
        """The arm of all its tasks."""
        return self.tasks[0].arm

    @property
    def identity(self) -> Mapping[str, Any]:
        """The identity of all its tasks."""
        return self.tasks[0].identity

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds."""
        return tuple(task.seed for task in self.tasks)

    @property
    def episodes(self) -> int:
        """Episodes to do, over all seeds."""
        return int(self.arm.episodes) * len(self.tasks)


@dataclass(frozen=True)
class BlockError:
    """An exception that ended a block, in words, since not every exception can travel.

    Attributes
    ----------
    message : str
        Arm, seeds, and what was raised.
    details : str
        The traceback in the worker.
    """

    message: str
    details: str

    def exception(self) -> RuntimeError:
        """Return an exception that tells all of this."""
        error = RuntimeError(self.message)
        error.add_note(self.details)
        return error


def run_block(block: Block, store: Store) -> BlockError | None:
    """Train a block and store each of its seeds; return the exception that ended it, if any."""
    try:
        _train(block, store)
    except Exception as error:
        seeds = ", ".join(map(str, block.seeds))
        message = f"arm {block.arm.name!r}, seeds {seeds}: {type(error).__name__}: {error}"
        return BlockError(message, traceback.format_exc())
    return None


def _train(block: Block, store: Store) -> None:
    arm = block.arm
    _check_process(block.identity)
    use_threads(1)
    report = Reporter(block.report)
    report(0, 0)
    started = time.perf_counter()
    run = arm.algorithm(
        arm.env,
        arm.config,
        episodes=block.identity["episodes"],
        seeds=block.seeds,
        snapshots=tuple(block.identity["snapshots"]),
        progress=report,
    )
    seconds = time.perf_counter() - started
    _check_run(run, block.seeds)
    env_steps = _env_steps(run.table)
    made = {
        "block_seeds": len(block.tasks),
        "block_seconds": seconds,
        "seconds": seconds / len(block.tasks),
        "env_steps_per_second": env_steps / seconds,
        "processor": provenance.processor(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    for position, task in enumerate(block.tasks):
        store.write(
            task.digest,
            run.table[run.table["seed"] == task.seed],
            {name: array[position] for name, array in run.arrays.items()},
            [failure for failure in run.failures if failure.seed == task.seed],
            {**task.identity, "seed": task.seed, **made},
        )
    report.finish(block.episodes, env_steps)


def use_threads(count: int) -> int:
    """Let torch use `count` threads in this process, if it is loaded; return how many it used.

    Blocks get one thread each: there are as many of them as cores, and the number of threads may
    change the order in which torch sums, hence the bits.
    """
    torch = sys.modules.get("torch")
    if torch is None:
        return 1
    before: int = torch.get_num_threads()
    torch.set_num_threads(count)
    return before


def _check_process(identity: Mapping[str, Any]) -> None:
    """Check that this process has the code and the versions that the digest tells of."""
    sources.check_loaded(identity["code"])
    if provenance.versions() != identity["versions"]:
        raise RuntimeError(
            f"the worker has the versions {provenance.versions()}, but the experiment was started "
            f"with {identity['versions']}"
        )


def _check_run(run: object, seeds: Sequence[int]) -> None:
    """Check what an algorithm returned before it is taken apart by seed."""
    if not isinstance(run, Run):
        raise TypeError(f"the algorithm returned {type(run).__name__}; allowed is a Run")
    if "seed" not in run.table or "arm" in run.table:
        columns = list(run.table.columns)
        raise ValueError(f"the table has the columns {columns}; 'seed' is needed, 'arm' is not")
    named = {*run.table["seed"], *(failure.seed for failure in run.failures)}
    if not named <= set(seeds):
        raise ValueError(f"the run tells of the seeds {sorted(named)}; asked were {list(seeds)}")
    for name, array in run.arrays.items():
        if array.shape[:1] != (len(seeds),):
            raise ValueError(
                f"array {name!r} has shape {array.shape}; its first axis must be {len(seeds)} seeds"
            )


def _env_steps(table: pd.DataFrame) -> int:
    """Return the environment steps of all seeds, 0 where the table does not count them."""
    if "env_steps" not in table:
        return 0
    return int(table.groupby("seed")["env_steps"].max().sum())
