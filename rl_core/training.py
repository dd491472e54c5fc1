"""What the learners share: streams of random numbers, the loop over seeds, tables and failures."""

import importlib
import math
import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from rl_core.checks import distinct_seeds, instance, integer, integers, optional, require
from rl_core.kernels.arrays import Arrays

PROGRESS_EVERY = 10
"""Episodes between two reports of progress."""

Progress = Callable[[int, int], object]
"""Is told episodes and environment steps done, over all seeds."""


@dataclass(frozen=True)
class Failure:
    """A seed that could not go on.

    Attributes
    ----------
    seed : int
        The seed that stopped.
    episode : int
        The episode (counted from 1) in which it stopped.
    reason : str
        What was found, in words.
    """

    seed: int
    episode: int
    reason: str


@dataclass(frozen=True)
class Run:
    """The outcome of training one or more seeds of one arm.

    Attributes
    ----------
    table : pandas.DataFrame
        One row an episode. Learners write at least the columns `seed`, `episode` (from 1), `steps`,
        `return` (undiscounted), `terminated` (false: stopped by a cap) and `env_steps` (environment
        steps of that seed so far, this episode included).
    arrays : dict of str to numpy.ndarray
        What was learned, for example the weights; the first axis is the seed, in the order of
        the seeds asked for.
    failures : tuple of Failure
        Seeds that diverged. Their rows up to the failure stay in `table`.
    env, config : object
        What was trained on, and with.
    """

    table: pd.DataFrame
    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    failures: tuple[Failure, ...] = ()
    env: Any = None
    config: Any = None

    def agent(self, seed: int, moment: str = "", rng: np.random.Generator | None = None) -> Any:
        """Return what a seed has learned, as an `rl_core.evaluation.Agent`.

        Parameters
        ----------
        seed : int
            One of those trained.
        moment : str
            As for `weights_of`: "" for the last weights.
        rng : numpy.random.Generator, optional
            What the agent draws from; by default one of seed 0.

        Raises
        ------
        TypeError, ValueError
            There is no such seed or moment, or the run does not say what it was trained with.

        Examples
        --------
        >>> from rl_core.reinforce import ReinforceConfig, reinforce
        >>> run = reinforce("CartPole-v1", ReinforceConfig(), episodes=1, seeds=[0])
        >>> agent = run.agent(seed=0)
        >>> action, _ = agent.predict([0.0, 0.0, 0.1, 0.0])
        """
        seeds = self.table["seed"].unique().tolist()
        require(seed in seeds, "seed", seed, f"one of {seeds}")
        weights = weights_of(self.arrays, seeds.index(seed), moment)
        # By name, since an import would make what plays episodes a part of what trains (`sources`).
        evaluation = importlib.import_module("rl_core.evaluation")
        spaces = None if self.env is None else evaluation.spaces_of(self.env)
        return evaluation.as_learned(self.config, weights, spaces=spaces, env=self.env, rng=rng)


class Streams(NamedTuple):
    """The independent sources of randomness of one seed.

    Attributes
    ----------
    environment_seed : int
        What the first `reset` of the environment is seeded with.
    policy : numpy.random.Generator
        Draws actions.
    network : numpy.random.Generator
        Draws initial weights and the order of the samples in an epoch.
    replay : numpy.random.Generator
        Draws from a replay buffer, where there is one.
    """

    environment_seed: int
    policy: np.random.Generator
    network: np.random.Generator
    replay: np.random.Generator


def spawn_streams(seed: int) -> Streams:
    """Spawn the streams of a seed from one `numpy.random.SeedSequence(seed)`.

    Examples
    --------
    >>> from rl_core.training import spawn_streams
    >>> bool(spawn_streams(0).policy.random() == spawn_streams(0).policy.random())
    True
    >>> bool(spawn_streams(0).policy.random() == spawn_streams(1).policy.random())
    False
    """
    environment, *others = np.random.SeedSequence(integer("seed", seed)).spawn(4)
    policy, network, replay = (np.random.default_rng(sequence) for sequence in others)
    return Streams(int(environment.generate_state(1)[0]), policy, network, replay)


class Training:
    """The course of one seed: how long it goes on, and what is kept of it.

    Parameters
    ----------
    seed : int
    episodes : int
        How many there are at most.
    snapshots : collection of int
        Episodes after which to keep what is learned.
    report : callable
        Told the seed's episodes and environment steps so far, now and then.

    Examples
    --------
    >>> from rl_core.training import Training
    >>> training = Training(seed=0, episodes=3, snapshots=(), report=lambda episodes, steps: None)
    >>> for episode in training.course(max_env_steps=25, learned=dict):
    ...     training.add(steps=10, total=-10.0, terminated=True)
    >>> training.table()["env_steps"].tolist()
    [10, 20, 30]
    """

    def __init__(
        self, seed: int, episodes: int, snapshots: Collection[int], report: Progress
    ) -> None:
        self.seed, self.episodes, self.env_steps = seed, episodes, 0
        self.failure: Failure | None = None
        self.kept: dict[str, Arrays] = {}
        self._snapshots, self._report = set(snapshots), report
        self._rows: list[tuple[int, int, int, float, bool, int]] = []
        self._budget = sys.maxsize

    def course(self, max_env_steps: int | None, learned: Callable[[], Arrays]) -> Iterator[int]:
        """Yield the numbers of the episodes, until they, the budget or the seed itself end.

        Parameters
        ----------
        max_env_steps : int or None
            The budget.
        learned : callable
            Gives the arrays that are learned, by name. Copies are kept before the first episode,
            after the last, and at the snapshots; one that is not finite ends the seed.
        """
        self._budget = max_env_steps or sys.maxsize
        self._keep("initial/", learned())
        for episode in range(1, self.episodes + 1):
            yield episode
            if not all(np.isfinite(array).all() for array in learned().values()):
                self.fail("a weight is not finite")
            if episode in self._snapshots:
                self._keep(f"episode{episode}/", learned())
            if episode % PROGRESS_EVERY == 0:
                self._report(episode, self.env_steps)
            if self.failure is not None or self.env_steps >= self._budget:
                break
        self._keep("", learned())

    def _keep(self, moment: str, arrays: Arrays) -> None:
        self.kept[moment] = {name: np.array(array) for name, array in arrays.items()}

    def max_steps(self, *limits: int | None) -> int:
        """Return where an episode has to stop: at the least of limits and the budget's rest."""
        return min(self._budget - self.env_steps, *(limit or sys.maxsize for limit in limits))

    def add(self, steps: int, total: float, terminated: bool) -> None:
        """Add the row of an episode; a return that is not finite ends the seed."""
        self.env_steps += steps
        episode = len(self._rows) + 1
        self._rows.append((self.seed, episode, steps, total, terminated, self.env_steps))
        if not math.isfinite(total):
            self.fail(f"the return is {total}")

    def fail(self, reason: str) -> None:
        """End the seed with this episode."""
        self.failure = self.failure or Failure(self.seed, len(self._rows), reason)

    def table(self) -> pd.DataFrame:
        """Return one row an episode."""
        columns = ["seed", "episode", "steps", "return", "terminated", "env_steps"]
        return pd.DataFrame(self._rows, columns=columns)

    def arrays(self) -> Arrays:
        """Return what was kept, by moment and name; a moment never reached is the last one."""
        moments = ["", "initial/", *(f"episode{n}/" for n in sorted(self._snapshots - {0}))]
        return {
            moment + name: array
            for moment in moments
            for name, array in self.kept.get(moment, self.kept[""]).items()
        }


def train_seeds(
    train: Callable[[Training], None],
    *,
    episodes: int,
    seeds: Any,
    snapshots: Any = (),
    progress: Progress | None = None,
    env: Any = None,
    config: Any = None,
) -> Run:
    """Train one seed after the other; they share nothing.

    Parameters
    ----------
    train : callable
        Trains `training.seed`: goes through `training.course` and adds a row an episode.
    episodes : int
        Episodes a seed, at least 1.
    seeds : iterable of int
        Distinct, from 0.
    snapshots : iterable of int
        Episodes, from 0 to `episodes`, after which to keep a copy of what is learned.
    progress : callable, optional
        Called now and then with the episodes and environment steps done, over all seeds. A seed
        that ended early counts with all its episodes.
    env, config : object
        For the `Run`, so that it can make agents.

    Raises
    ------
    TypeError, ValueError
        An argument is not as described; nothing has run then.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.training import train_seeds
    >>> def train(training):
    ...     for _ in training.course(None, lambda: {"weights": np.zeros(3)}):
    ...         training.add(steps=7, total=1.0, terminated=True)
    >>> run = train_seeds(train, episodes=2, seeds=[0, 1])
    >>> len(run.table), run.arrays["weights"].shape
    (4, (2, 3))
    """
    instance("train", train, Callable, "a function of a Training")
    seeds, episodes = distinct_seeds(seeds), integer("episodes", episodes, 1)
    snapshots = integers("snapshots", snapshots, 0, episodes)
    optional("progress", progress, instance, Callable, "a function of episodes and steps")
    done: list[Training] = []

    def report(now: int, steps: int) -> None:
        if progress is not None:
            progress(len(done) * episodes + now, sum(one.env_steps for one in done) + steps)

    for seed in seeds:
        training = Training(seed, episodes, snapshots, report)
        train(training)
        allowed = "a function that goes through training.course to its end"
        require("" in training.kept, "train", train, allowed)
        report(episodes, training.env_steps)
        done.append(training)
    table = pd.concat([one.table() for one in done], ignore_index=True)
    kept = [one.arrays() for one in done]
    arrays = {name: np.stack([of_seed[name] for of_seed in kept]) for name in kept[0]}
    failures = tuple(one.failure for one in done if one.failure is not None)
    return Run(table, arrays, failures, env, config)


def weights_of(
    arrays: Mapping[str, NDArray[Any]], position: int, moment: str = ""
) -> dict[str, NDArray[Any]]:
    """Take the weights of one seed out of a run's arrays.

    Parameters
    ----------
    arrays : mapping of str to array
        `Run.arrays`.
    position : int
        Which seed, counted from 0 in the order asked for.
    moment : str
        "" for the last weights, "initial/" for the first, "episode1000/" for a snapshot.

    Returns
    -------
    dict of str to array
        For example `layer0.weight` of shape (inputs, outputs).

    Raises
    ------
    TypeError, ValueError
        If the run has no such snapshot, or no such seed.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.training import weights_of
    >>> arrays = {f"{moment}layer0.weight": np.zeros((30, 2, 3)) for moment in ("", "initial/")}
    >>> weights_of(arrays, 0, "initial/")["layer0.weight"].shape
    (2, 3)
    """
    instance("arrays", arrays, Mapping, "a mapping of names to arrays")
    instance("moment", moment, str, "a text")
    require(all(isinstance(name, str) for name in arrays), "arrays", list(arrays), "named by texts")
    names = [name for name in arrays if name.rpartition("/")[0] == moment.rstrip("/")]
    require(names, "moment", moment, f"one of which the arrays are, {sorted(arrays)}")
    position = integer("position", position, 0, min(len(arrays[name]) for name in names) - 1)
    return {name.rpartition("/")[2]: arrays[name][position] for name in names}
