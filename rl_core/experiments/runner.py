"""Arms x seeds -> one tidy table, through the result store.

    for each arm, for each seed:
        if the store has the result under its digest: read it
    the rest, over the workers, one seed of one arm at a time:
        run <- algorithm(env, config, episodes, seed)
        store it
    table <- all results, in the order of arms and seeds

A learner is a pure function of environment, configuration, episodes and seed, so the result is the
same whatever the workers, their order, and however often the whole was killed and started again. A
seed is stored as soon as it is done: what is killed loses no more than the seeds in hand.
"""

import dataclasses
import os
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pandas as pd
from joblib.externals.loky import get_reusable_executor
from joblib.parallel import BACKENDS, EXTERNAL_BACKENDS

from rl_core.checks import distinct_seeds, instance, integer, one_of, optional, require, truth
from rl_core.experiments.arms import Arm
from rl_core.experiments.progress import Progress
from rl_core.experiments.store import DamagedResultError, Store
from rl_core.experiments.workers import Task, run_task, use_threads
from rl_core.identity import canonical_json, digest
from rl_core.kernels.arrays import Arrays
from rl_core.training import Failure, Run
from rl_core.worlds.names import check_elsewhere

# Named to joblib, whose tracker takes short names in ASCII, though nothing is written to it.
TEMPORARY = "/tmp" if os.path.isdir("/tmp") else tempfile.gettempdir()

Stored = tuple[Run, dict[str, Any]]  # a run without its arrays, and its provenance


class DamagedResultWarning(UserWarning):
    """A stored result was damaged and is made again."""


@dataclass(frozen=True)
class Results:
    """What came of `run`.

    Attributes
    ----------
    table : pandas.DataFrame
        The learners' tables below each other, with the columns `arm` and the arms' labels in front.
    failures : pandas.DataFrame
        `arm, seed, episode, reason`: the seeds that diverged. `table` has their rows so far.
    provenance : pandas.DataFrame
        A row an arm and seed: `arm, seed, digest, algorithm, env, config, episodes, snapshots`; the
        seconds it took by the clock (`seconds`) and of the processor (`processor_seconds`), and
        `env_steps_per_second`; `processor`, `date`, the machine's architecture and the versions of
        the libraries.
    """

    table: pd.DataFrame
    failures: pd.DataFrame
    provenance: pd.DataFrame
    _store: Store = field(repr=False)
    _arms: Mapping[str, Arm] = field(default_factory=dict, repr=False)

    def arm(self, name: str) -> Run:
        """Return an arm's results as its algorithm returned them, to make agents of.

        Raises
        ------
        ValueError
            There is no such arm.
        """
        arrays, own = self.arrays(name), self._arms[name]
        table, failed = (
            one[one["arm"] == name].drop(columns=["arm", *own.labels], errors="ignore")
            for one in (self.table, self.failures)
        )
        failures = tuple(Failure(*row) for row in failed.itertuples(index=False))
        return Run(table.reset_index(drop=True), arrays, failures, own.env, own.config)

    def arrays(self, arm: str) -> Arrays:
        """Return what the seeds of `arm` learned: each array's first axis is the seed.

        Raises
        ------
        ValueError
            There is no such arm, or an array's shape differs from seed to seed.
        """
        one_of("arm", arm, list(self._arms))
        digests = self.provenance.digest[self.provenance.arm == arm]
        seeds = [self._store.read_arrays(name) for name in digests]
        try:
            return {name: np.concatenate([arrays[name] for arrays in seeds]) for name in seeds[0]}
        except ValueError as error:
            raise ValueError(f"arrays of arm {arm!r} must have one shape each: {error}") from error


def run(
    arms: Sequence[Arm],
    *,
    seeds: Iterable[int],
    store: Path | str | Store,
    workers: int | None = None,
    backend: str = "loky",
    progress: bool = True,
) -> Results:
    """Return the results of every arm with every seed; run only those the store does not have.

    Parameters
    ----------
    arms : sequence of Arm
        With different names.
    seeds : iterable of int
        Different, from 0 to 2**63 - 1.
    store : Path or str or Store
        Folder of the results. On several machines: one that all of them see.
    workers : int, optional
        Seeds in work at once. 1: in this process. By default as many as the cores that this process
        may use, the limits of its container counted.
    backend : str
        A joblib backend: "loky" (local processes), "threading", "dask" (make a Dask `Client`
        first; its cluster sets the number of workers), or any other registered with joblib.
    progress : bool
        Whether to show the progress on stderr or in the notebook.

    Returns
    -------
    Results
        In the order of `arms` and `seeds`.

    Raises
    ------
    TypeError, ValueError
        An argument is not as described, the store cannot be written though there is work to do, or
        an arm's environment or configuration is none for its algorithm (`Arm.check`); nothing has
        run then.
    ExceptionGroup
        Seeds ended with an exception; each is named with its arm. All others were finished and
        stored before.

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
    >>> from rl_core.experiments import Arm, run
    >>> from rl_core.reinforce import ReinforceConfig, reinforce
    >>> config = ReinforceConfig(gamma=0.9, max_episode_steps=50)
    >>> arms = [Arm("gamma 0.9", reinforce, "Acrobot-v1", config, episodes=2)]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     results = run(arms, seeds=range(3), store=folder, workers=1, progress=False)
    >>> results.table.groupby(["arm", "seed"]).steps.sum().to_dict()
    {('gamma 0.9', 0): 100, ('gamma 0.9', 1): 100, ('gamma 0.9', 2): 100}
    """
    arms, seeds = _checked_arms(arms), distinct_seeds(seeds)
    workers = optional("workers", workers, integer, 1) or joblib.cpu_count()
    progress = truth("progress", progress)
    one_of("backend", backend, sorted({*BACKENDS, *EXTERNAL_BACKENDS}))
    instance("store", store, Store | Path | str, "a folder's path or a Store")
    identities = [arm.check() for arm in arms]
    store = Store(Path(store.path if isinstance(store, Store) else store).resolve())
    tasks = [
        Task(arm, seed, identity, digest({**identity, "seed": seed}))
        for arm, identity in zip(arms, identities, strict=True)
        for seed in seeds
    ]
    stored = _stored(tasks, store)
    missing = [task for task in tasks if task not in stored]
    if missing:
        if workers > 1 and backend != "threading":
            _check_workers(missing)
        _work(missing, store, workers, backend, progress)
        stored |= {task: store.read(task.digest) for task in missing}
    return _results({task: stored[task] for task in tasks}, store)


def _stored(tasks: Sequence[Task], store: Store) -> dict[Task, Stored]:
    """Return what the store has of `tasks`; make sure that it can take the rest."""
    found: dict[Task, Stored] = {}
    try:
        store.clean()
        for task in tasks:
            try:
                found[task] = store.read(task.digest)
            except KeyError:
                continue
            except DamagedResultError as error:
                told = f"arm {task.arm.name!r}, seed {task.seed}: {error}; it is made again"
                warnings.warn(told, DamagedResultWarning, stacklevel=3)
        if len(found) < len(tasks):
            with store.scratch():
                pass
    except OSError as error:
        raise ValueError(
            f"store must be a folder that can be written, got {str(store.path)!r}: {error.strerror}"
        ) from error
    return found


def _check_workers(tasks: Sequence[Task]) -> None:
    """Raise if another process would not find an arm's environment."""
    for arm in {task.arm.name: task.arm for task in tasks}.values():
        try:
            check_elsewhere(arm.env, [arm.algorithm_name.partition(":")[0]])
        except ValueError as error:
            raise ValueError(f"arm {arm.name!r}: {error}") from error


def _checked_arms(arms: object) -> list[Arm]:
    allowed = "a sequence of Arm, at least one and each name once"
    given = instance("arms", arms, Iterable, allowed)
    found = [instance("arms", arm, Arm, allowed) for arm in given]
    names = [arm.name for arm in found]
    require(names and len(set(names)) == len(names), "arms", names, allowed)
    return found


def _work(tasks: Sequence[Task], store: Store, workers: int, backend: str, progress: bool) -> None:
    """Run and store `tasks` over the workers; raise at the end if some could not be done."""
    first = {task.digest: task for task in reversed(tasks)}  # arms may differ in name only
    work = [task for task in tasks if first[task.digest] is task]
    failed = []
    with (
        Progress(Counter(task.arm.name for task in work), progress) as shown,
        _joblib(backend, workers) as parallel,
    ):
        parent = os.getpid()
        for done in parallel(joblib.delayed(run_task)(task, store, parent) for task in work):
            shown.done(done.arm, done.env_steps)
            if done.error is not None:
                failed.append(done.error)
    if failed:
        message = f"{len(failed)} of {len(work)} seeds failed; the others are stored"
        raise ExceptionGroup(message, failed)


@contextmanager
def _joblib(backend: str, workers: int) -> Iterator[joblib.Parallel]:
    """Give joblib's `Parallel` with `workers` of this kind, with one thread each."""
    limit = {"inner_max_num_threads": 1} if backend == "loky" else {}
    threads = use_threads(1)
    try:
        with (
            joblib.parallel_config(
                backend=backend, n_jobs=workers, max_nbytes=None, temp_folder=TEMPORARY, **limit
            ),
            warnings.catch_warnings(),
        ):
            # loky replaces a worker that grew. Said as an error, it would end the thread that does.
            warnings.filterwarnings("ignore", "A worker stopped while some jobs were given")
            try:
                parallel = joblib.Parallel(batch_size=1, return_as="generator_unordered")
            except ValueError:  # this backend gives all results at the end
                parallel = joblib.Parallel(batch_size=1)
            yield parallel
    finally:
        use_threads(threads)
        if backend == "loky" and workers > 1:
            # The next call must not get workers that hold the code of today.
            get_reusable_executor(reuse=True).shutdown(wait=True)


def _results(stored: Mapping[Task, Stored], store: Store) -> Results:
    tables, failures, origins = [], [], []
    for task, (run, provenance) in stored.items():
        arm = task.arm
        clashing = sorted(set(arm.labels) & set(run.table))
        require(not clashing, f"labels of arm {arm.name!r}", clashing, "no columns of its table")
        for position, (column, value) in enumerate({"arm": arm.name, **arm.labels}.items()):
            run.table.insert(position, column, value)
        tables.append(run.table)
        failures += [{"arm": arm.name, **dataclasses.asdict(one)} for one in run.failures]
        made = dict(provenance)
        first = {"arm": arm.name, "seed": task.seed, "digest": task.digest}
        libraries, machine = made.pop("versions"), made.pop("platform")["machine"]
        made |= {"config": canonical_json(made["config"]), "snapshots": tuple(made["snapshots"])}
        origins.append({**first, **made, "machine": machine, **libraries})
    columns = {"arm": str, "seed": np.int64, "episode": np.int64, "reason": str}
    return Results(
        table=pd.concat(tables, ignore_index=True),
        failures=pd.DataFrame(failures, columns=list(columns)).astype(columns),
        provenance=pd.DataFrame(origins).drop(columns=["code", "environment", "format"]),
        _store=store,
        _arms={task.arm.name: task.arm for task in stored},
    )
