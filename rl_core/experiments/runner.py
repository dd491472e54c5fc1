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
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from os import getpid
from pathlib import Path

import joblib
import numpy as np
import pandas as pd
from joblib.externals.loky import get_reusable_executor
from joblib.parallel import BACKENDS, EXTERNAL_BACKENDS

from rl_core.checks import distinct_seeds, instance, integer, one_of, optional, require, truth
from rl_core.experiments.arms import Arm
from rl_core.experiments.progress import Progress
from rl_core.experiments.store import DamagedResultError, Store, Stored, scratch, sweep
from rl_core.experiments.workers import Outcome, Task, run_task, use_threads
from rl_core.identity import canonical_json, digest
from rl_core.kernels.arrays import Arrays
from rl_core.training import Failure, Run
from rl_core.worlds.names import check_elsewhere

TEMPORARY = "rl_core-"  # what joblib's temporary folders are called


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
        one_of("arm", arm, list(dict.fromkeys(self.provenance.arm)))
        digests = self.provenance.digest[self.provenance.arm == arm]
        seeds = [self._store.read_arrays(name) for name in digests]
        stacked = {}
        for name in seeds[0]:
            shapes = {arrays[name].shape for arrays in seeds}
            if len(shapes) > 1:
                raise ValueError(
                    f"array {name!r} of arm {arm!r} must have one shape, got {sorted(shapes)}"
                )
            stacked[name] = np.stack([arrays[name] for arrays in seeds])
        return stacked


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
    with _told(store):
        store.clean()
    tasks = [
        Task(arm, seed, identity, digest({**identity, "seed": seed}))
        for arm, identity in zip(arms, identities, strict=True)
        for seed in seeds
    ]
    stored = {task: _read(store, task) for task in tasks}
    missing = [task for task in tasks if stored[task] is None]
    if missing:
        if workers > 1 and backend != "threading":
            _check_workers(missing)
        _work(missing, store, workers, backend, progress)
    for task in missing:
        stored[task] = store.read(task.digest)
    return _results({task: _present(task, result) for task, result in stored.items()}, store)


def _check_workers(tasks: Sequence[Task]) -> None:
    """Raise if another process would not find an arm's environment."""
    for arm in {task.arm.name: task.arm for task in tasks}.values():
        try:
            check_elsewhere(arm.env, [arm.algorithm_name.partition(":")[0]])
        except ValueError as error:
            raise ValueError(f"arm {arm.name!r}: {error}") from error


def _checked_arms(arms: object) -> list[Arm]:
    allowed = "a sequence of Arm, at least one and each name once"
    found = list(instance("arms", arms, Iterable, allowed))
    for arm in found:
        instance("arms", arm, Arm, allowed)
    names = [arm.name for arm in found]
    require(names and len(set(names)) == len(names), "arms", names, allowed)
    return found


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


def _work(tasks: Sequence[Task], store: Store, workers: int, backend: str, progress: bool) -> None:
    """Run and store `tasks` over the workers; raise at the end if some could not be done."""
    with _told(store), scratch(store.path / "scratch"):
        pass
    first = {task.digest: task for task in reversed(tasks)}  # arms may differ in name only
    work = [task for task in tasks if first[task.digest] is task]
    failed: list[Outcome] = []
    with (
        Progress(Counter(task.arm.name for task in work), progress) as shown,
        _joblib(backend, workers) as parallel,
    ):
        parent = getpid()
        for done in parallel(joblib.delayed(run_task)(task, store, parent) for task in work):
            shown.done(done.arm, done.env_steps)
            failed += [done] if done.message else []
    if failed:
        message = f"{len(failed)} of {len(work)} seeds failed; the others are stored"
        raise ExceptionGroup(message, [outcome.exception() for outcome in failed])


@contextmanager
def _told(store: Store) -> Iterator[None]:
    """Say which argument is meant if the block cannot use the store."""
    try:
        yield
    except OSError as error:
        raise ValueError(
            f"store must be a folder that can be written, got {str(store.path)!r}: {error.strerror}"
        ) from error


@contextmanager
def _joblib(backend: str, workers: int) -> Iterator[joblib.Parallel]:
    """Give joblib's `Parallel` with `workers` of this kind, with one thread each."""
    limit = {"inner_max_num_threads": 1} if backend == "loky" else {}
    threads = use_threads(1)
    home = _temporary()
    sweep(home, f"{TEMPORARY}*")
    try:
        with (
            scratch(home, TEMPORARY) as folder,
            joblib.parallel_config(
                backend=backend, n_jobs=workers, temp_folder=str(folder), **limit
            ),
        ):
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


def _temporary() -> Path:
    """Return a folder for joblib's temporary files, whose tracker takes short names in ASCII."""
    for folder in (tempfile.gettempdir(), "/tmp", "/var/tmp"):
        if folder.isascii() and len(folder) < 200 and Path(folder).is_dir():
            return Path(folder)
    raise ValueError(
        f"TMPDIR must be a folder with a short name in ASCII, got {tempfile.gettempdir()!r}"
    )


def _results(stored: Mapping[Task, Stored], store: Store) -> Results:
    tables, failures, origins = [], [], []
    for task, result in stored.items():
        arm = task.arm
        clashing = sorted(set(arm.labels) & set(result.table))
        require(not clashing, f"labels of arm {arm.name!r}", clashing, "no columns of its table")
        for position, (column, value) in enumerate({"arm": arm.name, **arm.labels}.items()):
            result.table.insert(position, column, value)
        tables.append(result.table)
        failures += [{"arm": arm.name, **dataclasses.asdict(one)} for one in result.failures]
        made = dict(result.provenance)
        del made["code"], made["format"], made["environment"]
        made["config"] = canonical_json(made["config"])
        made["snapshots"] = tuple(made["snapshots"])
        libraries, settings = made.pop("versions"), made.pop("platform")
        first = {"arm": arm.name, "seed": made.pop("seed"), "digest": task.digest}
        origins.append({**first, **made, "machine": settings["machine"], **libraries})
    columns = {"arm": str, "seed": np.int64, "episode": np.int64, "reason": str}
    return Results(
        table=pd.concat(tables, ignore_index=True),
        failures=pd.DataFrame(failures, columns=list(columns)).astype(columns),
        provenance=pd.DataFrame(origins),
        _store=store,
        _arms={task.arm.name: task.arm for task in stored},
    )
