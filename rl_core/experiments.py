"""Experiments: arms x seeds -> one tidy table, through the result store.

    for each arm, for each seed:
        if the store has the result under its digest: read it
    the rest, in blocks of seeds, over the workers:
        run <- algorithm(env, config, episodes, block)
        store each seed of the run
    table <- all results, in the order of arms and seeds

A learner is a pure function of environment, configuration, episodes and seed, so the result is the
same whatever the blocks, the workers, their order, and however often the whole was killed and
started again. A seed's result is stored when its block is done; what is killed loses no more than
the blocks in hand.
"""

import dataclasses
import shutil
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from operator import index
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from joblib import Parallel, delayed, parallel_config
from joblib.externals.loky import get_reusable_executor
from joblib.parallel import BACKENDS, EXTERNAL_BACKENDS
from numpy.typing import NDArray

from rl_core import provenance
from rl_core.arm import Arm, check_integer
from rl_core.progress import watching
from rl_core.store import DamagedResultError, Store, Stored
from rl_core.workers import Block, Task, run_block, use_threads

LARGEST_BLOCK = 15  # seeds, unless told otherwise


class DamagedResultWarning(UserWarning):
    """A stored result was damaged and is made again."""


@dataclass(frozen=True)
class Results:
    """What came of `run`.

    Attributes
    ----------
    table : pandas.DataFrame
        The learners' tables below each other, with the column `arm` in front.
    failures : pandas.DataFrame
        `arm, seed, episode, reason`: the seeds that diverged. `table` has their rows so far.
    provenance : pandas.DataFrame
        A row an arm and seed: `arm, seed, digest, algorithm, env, config, episodes, snapshots`; the
        seconds that the block of seeds took (`block_seconds`), their number (`block_seeds`), one
        seed's share (`seconds`, so that sums are right) and `env_steps_per_second` of the block;
        `processor`, `date` and the versions of the libraries.
    """

    table: pd.DataFrame
    failures: pd.DataFrame
    provenance: pd.DataFrame
    _store: Store = field(repr=False)

    def arrays(self, arm: str) -> dict[str, NDArray[Any]]:
        """Return what the seeds of `arm` learned: each array's first axis is the seed.

        Raises
        ------
        ValueError
            There is no such arm, or an array's shape differs from seed to seed.
        """
        digests = self.provenance.digest[self.provenance.arm == arm]
        if digests.empty:
            known = sorted(set(self.provenance.arm))
            raise ValueError(f"arm is {arm!r}; allowed are {known}")
        seeds = [self._store.read_arrays(digest) for digest in digests]
        stacked = {}
        for name in seeds[0]:
            shapes = {arrays[name].shape for arrays in seeds}
            if len(shapes) > 1:
                raise ValueError(f"array {name!r} of arm {arm!r} has the shapes {sorted(shapes)}")
            stacked[name] = np.stack([arrays[name] for arrays in seeds])
        return stacked


def run(
    arms: Sequence[Arm],
    *,
    seeds: Iterable[int],
    store: Path | str | Store,
    workers: int = 2,
    backend: str = "loky",
    block: int | None = None,
    progress: bool = True,
) -> Results:
    """Return the results of every arm with every seed; run only those the store does not have.

    Parameters
    ----------
    arms : sequence of Arm
        With different names.
    seeds : iterable of int
        Different and not negative.
    store : Path or str or Store
        Folder of the results. On several machines: one that all of them see.
    workers : int
        Blocks of seeds in work at once. 1: in this process.
    backend : str
        A joblib backend: "loky" (local processes), "threading", "dask" (make a Dask `Client`
        first; its cluster sets the number of workers), or any other registered with joblib.
    block : int, optional
        Seeds trained as one stack, at most. By default 15, or so few that an arm makes two stacks
        for each of several workers: then none stands idle for long at the end.
    progress : bool
        Whether to show the progress on stderr or in the notebook.

    Returns
    -------
    Results
        In the order of `arms` and `seeds`.

    Raises
    ------
    TypeError, ValueError
        An argument is not as described, or an arm's environment or configuration is none for its
        algorithm (`Arm.check`); nothing has run then.
    ExceptionGroup
        Blocks ended with an exception; each is named with its arm and seeds. All others
        were finished and stored before.

    Warns
    -----
    DamagedResultWarning
        A stored file was damaged. It is named, and its result made again.

    Notes
    -----
    A worker that dies (no memory, a kill) ends the call with joblib's error. As after any
    interruption, what was finished is stored, and the same call goes on from there.

    Examples
    --------
    >>> import tempfile
    >>> from rl_core.reinforce import ReinforceConfig, reinforce
    >>> config = ReinforceConfig(gamma=0.9, max_episode_steps=50)
    >>> arms = [Arm("gamma 0.9", reinforce, "Acrobot-v1", config, episodes=2)]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     results = run(arms, seeds=range(3), store=folder, workers=1, progress=False)
    >>> results.table.groupby(["arm", "seed"]).steps.sum().to_dict()
    {('gamma 0.9', 0): 100, ('gamma 0.9', 1): 100, ('gamma 0.9', 2): 100}
    """
    arms, seeds = _checked_arms(arms), _checked_seeds(seeds)
    check_integer("workers", workers, least=1)
    if block is None:
        shares = 1 if workers == 1 else 2 * workers
        block = min(LARGEST_BLOCK, -(-len(seeds) // shares))
    check_integer("block", block, least=1)
    if backend not in (allowed := sorted({*BACKENDS, *EXTERNAL_BACKENDS})):
        raise ValueError(f"backend is {backend!r}; allowed are {allowed}")
    if not isinstance(store, Store | Path | str):
        raise TypeError(f"store is {store!r}; allowed are a folder's path and a Store")
    store = Store(Path(store.path if isinstance(store, Store) else store).resolve())
    tasks = [task for arm in arms for task in _tasks(arm, seeds)]
    stored = {task: _read(store, task) for task in tasks}
    missing = [task for task in tasks if stored[task] is None]
    if missing:
        _work(missing, store, workers, backend, block, progress)
    for task in missing:
        stored[task] = store.read(task.digest)
    return _results({task: _present(task, result) for task, result in stored.items()}, store)


def _checked_arms(arms: object) -> list[Arm]:
    if not isinstance(arms, Iterable):
        raise TypeError(f"arms is {arms!r}; allowed is a sequence of Arm")
    arms = list(arms)
    for arm in arms:
        if not isinstance(arm, Arm):
            raise TypeError(f"arms has {arm!r}; allowed are instances of Arm")
    names = [arm.name for arm in arms]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if not arms or repeated:
        raise ValueError(f"arms has the names {names}; allowed is at least one, each name once")
    for arm in arms:
        arm.check()
    return arms


def _checked_seeds(seeds: object) -> list[int]:
    if not isinstance(seeds, Iterable):
        raise TypeError(f"seeds is {seeds!r}; allowed is an iterable of integers")
    seeds = list(seeds)
    for seed in seeds:
        check_integer("seeds", seed, least=0)
    if not seeds or len(set(seeds)) < len(seeds):
        raise ValueError(f"seeds is {seeds}; allowed is at least one, each once")
    return [index(seed) for seed in seeds]


def _tasks(arm: Arm, seeds: Sequence[int]) -> list[Task]:
    identity = arm.identity()
    digests = [provenance.digest({**identity, "seed": seed}) for seed in seeds]
    return [Task(arm, seed, identity, name) for seed, name in zip(seeds, digests, strict=True)]


def _read(store: Store, task: Task) -> Stored | None:
    """Return the task's result, or None if it has to be made; warn if it was damaged."""
    try:
        return store.read(task.digest)
    except DamagedResultError as error:
        warnings.warn(
            f"arm {task.arm.name!r}, seed {task.seed}: {error}; it is made again",
            DamagedResultWarning,
            stacklevel=4,
        )
        return None


def _present(task: Task, result: Stored | None) -> Stored:
    if result is None:
        raise RuntimeError(
            f"the result of arm {task.arm.name!r}, seed {task.seed} was stored and is gone"
        )
    return result


def _work(
    tasks: Sequence[Task], store: Store, workers: int, backend: str, block: int, progress: bool
) -> None:
    """Run and store `tasks` over the workers; raise at the end if some could not be done."""
    store.clean()
    folder = store.scratch()
    blocks = _longest_first(_blocks(tasks, folder, block), store)
    reports: dict[str, dict[Path, int]] = {}
    for unit in blocks:
        reports.setdefault(unit.arm.name, {})[unit.report] = unit.episodes
    try:
        with watching(reports, folder, progress), _joblib(backend, workers, folder):
            errors = Parallel(batch_size=1)(delayed(run_block)(unit, store) for unit in blocks)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    failed = [error.exception() for error in errors if error is not None]
    if failed:
        message = f"{len(failed)} of {len(blocks)} blocks failed; the others are stored"
        raise ExceptionGroup(message, failed)


@contextmanager
def _joblib(backend: str, workers: int, folder: Path) -> Iterator[None]:
    """Let joblib's `Parallel` use `workers` of this kind, with one thread each.

    `folder` takes joblib's temporary files, so that a killed run leaves none elsewhere.
    """
    limit = {"inner_max_num_threads": 1} if backend == "loky" else {}
    threads = use_threads(1)
    try:
        with parallel_config(backend=backend, n_jobs=workers, temp_folder=str(folder), **limit):
            yield
    finally:
        use_threads(threads)
        if backend == "loky" and workers > 1:
            # The next call must not get workers that hold the code of today.
            get_reusable_executor(reuse=True).shutdown(wait=True)


def _blocks(tasks: Sequence[Task], folder: Path, size: int) -> list[Block]:
    """Return `tasks` in blocks of at most `size` seeds of one arm, as even as can be."""
    first = {task.digest: task for task in reversed(tasks)}  # arms may differ in name only
    by_arm: dict[str, list[Task]] = {}
    for task in tasks:
        if first[task.digest] is task:
            by_arm.setdefault(task.arm.name, []).append(task)
    blocks: list[Block] = []
    for of_arm in by_arm.values():
        for part in np.array_split(np.arange(len(of_arm)), -(-len(of_arm) // size)):
            blocks.append(Block(tuple(of_arm[i] for i in part), folder / f"{len(blocks)}.json"))
    return blocks


def _longest_first(blocks: list[Block], store: Store) -> list[Block]:
    """Return `blocks` by the time they took when last run, those never run before all others.

    Nothing is known of those: they stay in the order given.
    """
    seconds = {_work_of(made): made["seconds"] for made in store.provenances()}

    def expected(block: Block) -> float:
        known: float = seconds.get(_work_of(block.identity), np.inf)
        return known * len(block.tasks)

    return sorted(blocks, key=expected, reverse=True)


def _work_of(identity: Mapping[str, Any]) -> str:
    """Return what decides how long a seed takes, the code's version aside."""
    keys = ("algorithm", "env", "config", "episodes")
    return provenance.canonical_json([identity[key] for key in keys])


def _results(stored: Mapping[Task, Stored], store: Store) -> Results:
    tables, failures, origins = [], [], []
    for task, result in stored.items():
        result.table.insert(0, "arm", task.arm.name)
        tables.append(result.table)
        failures += [
            {"arm": task.arm.name, **dataclasses.asdict(failure)} for failure in result.failures
        ]
        made = dict(result.provenance)
        del made["code"], made["format"]
        made["config"] = provenance.canonical_json(made["config"])
        made["snapshots"] = tuple(made["snapshots"])
        libraries = made.pop("versions")
        first = {"arm": task.arm.name, "seed": made.pop("seed"), "digest": task.digest}
        origins.append({**first, **made, **libraries})
    columns = {"arm": str, "seed": np.int64, "episode": np.int64, "reason": str}
    return Results(
        table=pd.concat(tables, ignore_index=True),
        failures=pd.DataFrame(failures, columns=list(columns)).astype(columns),
        provenance=pd.DataFrame(origins),
        _store=store,
    )
