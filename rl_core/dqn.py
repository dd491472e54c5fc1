"""DQN: Q-learning with a deep network, experience replay and fixed targets.

    for each seed:
        draw the initial weights theta; theta- <- theta; the memory is empty
        for each episode: for each step:
            take a, epsilon-greedily on Q(s, .; theta); observe r, s'
            store (s, a, r, s', end) in the memory, in the place of the oldest
            once enough is stored: sample a batch, and one optimiser step on
                L(theta) = 1 / |B| sum (r + gamma max_a' Q(s', a'; theta-) - Q(s, a; theta))^2
            every so many updates: theta- <- theta

The lines stand in `rl_core.q_episodes` (the loop), `rl_core.q_update` (targets and update) and
`rl_core.replay` (the memory). A terminal s' has no value; a step cut short by a cap is
bootstrapped.

CartPole-v1 trains through the plain loop. With these settings the average return of the last 50
training episodes is 450 or more for most seeds (`tests/test_dqn.py` holds them to it):

    config = DQNConfig(
        hidden=(64, 64), biases=True, optimiser="adam", learning_rate=1e-3,
        batch_size=128, memory_size=100_000, learning_starts=500,
        update_every=2, copy_every=100, epsilon=Decay(1.0, 0.0, 5_000),
        shaping=Shaping("rl_core.shaping:balance"), max_env_steps=80_000,
    )
    run = dqn("CartPole-v1", config, episodes=2_000, seeds=range(10))

Sources: V. Mnih et al. (2015), Human-level control through deep reinforcement learning; R. S.
Sutton and A. G. Barto, Reinforcement Learning: An Introduction (2018), sections 6.5 and 16.5.
"""

import math
import sys
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from rl_core import networks
from rl_core.episodes import EnvironmentLike, checked_seeds, checked_snapshots, spawn_streams
from rl_core.epsilon import Decay, Epsilon, HalfWay
from rl_core.policies import is_integer, is_number, is_one_of, require
from rl_core.q_episodes import DIVERGED, SHAPED_NAN, Training, World, open_world
from rl_core.q_update import Settings, make_learner
from rl_core.replay import make_memory
from rl_core.shaping import Shaping, compiled_shape
from rl_core.training import Failure, Run

PROGRESS_EVERY = 10
"""Episodes between two reports of progress."""


@dataclass(frozen=True)
class DQNConfig:
    """What DQN is run with. Defaults: the report's for Acrobot, but with a terminal flag.

    Attributes
    ----------
    gamma : float
        Discount, from 0 to 1.
    hidden : tuple of int
        Widths of the hidden layers, rectified linear units; () for a linear network.
    biases : bool
        Whether biases are learned; else they stay zero.
    optimiser : {"rmsprop", "adam"}
        With TensorFlow 1's constants (`rl_core.networks`).
    learning_rate : float
        The optimiser's step size alpha, above 0.
    batch_size : int
        Transitions an update.
    memory_size : int
        Transitions kept, at least a batch. As many as a batch: no replay, only the latest ones.
    learning_starts : int
        Environment steps before the first update. The report waits until the memory is full.
    update_every : int
        Environment steps between two updates.
    copy_every : int
        Updates between two copies to the fixed network. 1: no fixed target.
    epsilon : float, Decay or HalfWay
        Probability that a run of one random action begins, where none is going on (the report's
        epsilon is 1 minus it).
    persistence : int
        Steps p of such a run, at most to the end of the episode. 1: the usual epsilon-greedy, and
        epsilon the share of random steps. Else that share is larger, p epsilon / (p epsilon + 1 -
        epsilon) (W. Dabney, G. Ostrovski and A. Barreto 2021, Temporally-extended epsilon-greedy
        exploration).
    shaping : Shaping or None
        What is learned from in place of the environment's reward. None: that reward.
    bootstrap_through_end : bool
        Whether terminal states are given the value the network puts on them, as in the 2018
        program, which kept no terminal flag. False is right.
    max_episode_steps : int or None
        Where to stop an episode that has not ended. None: nowhere.
    max_env_steps : int or None
        Budget of environment steps a seed. The episode in which it is used up is stopped there and
        is the seed's last. None: no limit.

    Raises
    ------
    ValueError
        For a value out of range.

    Examples
    --------
    >>> DQNConfig(shaping=Shaping("rl_core.shaping:tip_height")).memory_size
    3000
    """

    gamma: float = 0.99
    hidden: tuple[int, ...] = (10, 20)
    biases: bool = False
    optimiser: Literal["rmsprop", "adam"] = "rmsprop"
    learning_rate: float = 1e-3
    batch_size: int = 512
    memory_size: int = 3000
    learning_starts: int = 3000
    update_every: int = 1
    copy_every: int = 300
    epsilon: Epsilon = field(default_factory=HalfWay)
    persistence: int = 1
    shaping: Shaping | None = None
    bootstrap_through_end: bool = False
    max_episode_steps: int | None = None
    max_env_steps: int | None = 1_000_000

    def __post_init__(self) -> None:
        optimisers = ("rmsprop", "adam")
        rate, hidden, batch = self.learning_rate, self.hidden, self.batch_size
        fixed_epsilon = is_number(self.epsilon) and 0 <= self.epsilon <= 1  # type: ignore[operator]
        checks = {
            "gamma": (is_number(self.gamma) and 0 <= self.gamma <= 1, "a number from 0 to 1"),
            "hidden": (
                isinstance(hidden, tuple) and all(is_integer(width, 1) for width in hidden),
                "a tuple of positive integers",
            ),
            "biases": (isinstance(self.biases, bool), "a bool"),
            "optimiser": (is_one_of(self.optimiser, optimisers), f"one of {optimisers}"),
            "learning_rate": (is_number(rate) and rate > 0, "a finite number above 0"),
            "batch_size": (is_integer(batch, 1), "a positive integer"),
            "epsilon": (
                fixed_epsilon or isinstance(self.epsilon, Decay | HalfWay),
                "a number from 0 to 1, Decay(...) or HalfWay(...)",
            ),
            "shaping": (
                self.shaping is None or isinstance(self.shaping, Shaping),
                "Shaping('module:function') or None",
            ),
            "bootstrap_through_end": (isinstance(self.bootstrap_through_end, bool), "a bool"),
        }
        for name in ("learning_starts", "update_every", "copy_every", "persistence"):
            checks[name] = (is_integer(getattr(self, name), 1), "a positive integer")
        for name in ("max_episode_steps", "max_env_steps"):
            value = getattr(self, name)
            checks[name] = (value is None or is_integer(value, 1), "a positive integer or None")
        for name, (valid, allowed) in checks.items():
            require(valid, name, getattr(self, name), allowed)
        enough = is_integer(self.memory_size, batch)
        allowed = f"an integer of at least batch_size ({batch})"
        require(enough, "memory_size", self.memory_size, allowed)


_ORIGINAL = "rl_core.shaping:original"


@dataclass
class _Seed:
    """What became of one seed."""

    seed: int
    parameters: NDArray[np.float32]
    snapshots: dict[str, NDArray[np.float32]]
    rows: list[tuple[int, float, bool]] = field(default_factory=list)  # steps, return, terminated
    env_steps: int = 0
    failure: Failure | None = None


def _training(world: World, config: DQNConfig, seed: int) -> tuple[Training, NDArray[np.float32]]:
    """Set up a seed: its streams, first weights and empty memory."""
    streams = spawn_streams(seed)
    world.seed(streams.environment_seed)
    sizes = (world.n_observations, *config.hidden, world.n_actions)
    parameters = networks.xavier_uniform(sizes, streams.network)
    adam = config.optimiser == "adam"
    learner = make_learner(
        sizes,
        parameters,
        biases=config.biases,
        adam=adam,
        batch_size=config.batch_size,
        schedule=config.epsilon,
    )
    settings = Settings(
        float(config.gamma),
        config.batch_size,
        config.learning_starts,
        config.update_every,
        config.copy_every,
        config.persistence,
        float(config.learning_rate),
        adam,
        config.bootstrap_through_end,
    )
    shape = compiled_shape(config.shaping.function if config.shaping else _ORIGINAL)
    memory = make_memory(config.memory_size, world.n_observations)
    training = Training(settings, learner, memory, shape, streams.policy, streams.replay)
    return training, parameters


def _train(
    world: World,
    config: DQNConfig,
    episodes: int,
    seed: int,
    snapshots: Collection[int],
    report: Callable[[int, int], object],
) -> _Seed:
    """Train one seed, and tell `report` its episodes and environment steps so far."""
    training, parameters = _training(world, config, seed)
    trained = _Seed(seed, parameters, {"initial/": parameters.copy()})
    budget = config.max_env_steps or sys.maxsize
    for episode in range(1, episodes + 1):
        max_steps = min(config.max_episode_steps or sys.maxsize, budget - trained.env_steps)
        steps, total, terminated, outcome = world.play(training, max_steps)
        trained.rows.append((steps, total, terminated))
        trained.env_steps += steps
        if outcome == SHAPED_NAN and config.shaping is not None:
            raise ValueError(
                f"shaping {config.shaping.function!r} returned NaN at step {steps} of episode "
                f"{episode}, seed {seed}"
            )
        if not math.isfinite(total):
            trained.failure = Failure(seed, episode, f"the return is {total}")
            break
        if outcome == DIVERGED or not np.isfinite(parameters).all():
            trained.failure = Failure(seed, episode, "the loss or a weight is not finite")
            break
        if episode in snapshots:
            trained.snapshots[f"episode{episode}/"] = parameters.copy()
        if episode % PROGRESS_EVERY == 0:
            report(episode, trained.env_steps)
        if trained.env_steps >= budget:
            break
    return trained


def check_dqn(env: EnvironmentLike, config: DQNConfig) -> None:
    """Raise what `dqn` would raise for an environment and a configuration; run nothing.

    `rl_core.experiments.run` calls it for every arm before it begins with any.

    Raises
    ------
    ValueError, TypeError
        If `config` is no DQNConfig, the environment unknown, or its spaces of another kind.

    Examples
    --------
    >>> check_dqn("MountainCar-v0", DQNConfig())
    """
    require(isinstance(config, DQNConfig), "config", config, "a DQNConfig")
    open_world(env).close()


def dqn(
    env: EnvironmentLike,
    config: DQNConfig,
    *,
    episodes: int,
    seeds: Iterable[int],
    snapshots: Collection[int] = (),
    progress: Callable[[int, int], object] | None = None,
) -> Run:
    """Train one network a seed with DQN.

    Seeds share nothing, the memory included: a seed gives the same bits alone and among any others.

    Parameters
    ----------
    env : str, gymnasium.Env or callable
        A Gymnasium id, an environment, or a function that makes one, with Box observations and
        Discrete actions. Acrobot-v1 and MountainCar-v0, given by id, are played compiled and
        without time limit; anything else goes through Gymnasium's own `reset` and `step`.
    config : DQNConfig
    episodes : int
        Episodes a seed, at least 1.
    seeds : iterable of int
        Distinct and non-negative.
    snapshots : collection of int
        Episodes, from 0 to `episodes`, after which to keep a copy of the weights. The initial ones,
        before the first episode, are kept anyway.
    progress : callable, optional
        Called now and then with the episodes and environment steps done, over all seeds. A seed
        that ended early counts with all its episodes.

    Returns
    -------
    Run
        `table` has the columns `seed`, `episode` (from 1), `steps`, `return` (undiscounted, of the
        environment's own rewards also where they are shaped), `terminated` (false: stopped by a
        cap) and `env_steps` (of this seed so far). Rows of a seed that diverged or used up its
        budget end there, that episode included.
        `arrays` holds, with one row a seed, the last weights as `layer0.weight` of shape
        (seeds, inputs, outputs), `layer0.bias` and so on, and copies under `initial/...` and
        `episode20/...`, which are the last weights of seeds that ended before. `failures` names
        seeds whose returns, loss or weights were no longer finite.

    Raises
    ------
    ValueError, TypeError
        If an argument is out of range, the environment unknown or of other spaces, or a shaped
        reward NaN.

    Examples
    --------
    >>> config = DQNConfig(batch_size=32, learning_starts=100, max_episode_steps=200)
    >>> run = dqn("MountainCar-v0", config, episodes=2, seeds=[0, 1])
    >>> run.table["steps"].tolist(), run.arrays["layer0.weight"].shape
    ([200, 200, 200, 200], (2, 2, 10))
    """
    seeds = checked_seeds(seeds)
    require(isinstance(config, DQNConfig), "config", config, "a DQNConfig")
    require(is_integer(episodes, 1), "episodes", episodes, "a positive integer")
    snapshots = checked_snapshots(snapshots, episodes)
    allowed = "a function of episodes and steps, or None"
    require(progress is None or callable(progress), "progress", progress, allowed)
    trained: list[_Seed] = []
    for seed in seeds:
        steps_before = sum(one.env_steps for one in trained)
        report = partial(_report, progress, len(trained) * episodes, steps_before)
        world = open_world(env)
        try:
            sizes = (world.n_observations, *config.hidden, world.n_actions)
            trained.append(_train(world, config, episodes, seed, snapshots, report))
        finally:
            world.close()
        report(episodes, trained[-1].env_steps)
    failures = tuple(one.failure for one in trained if one.failure is not None)
    return Run(_table(trained), _arrays(sizes, config.biases, trained, snapshots), failures)


def _report(
    progress: Callable[[int, int], object] | None,
    episodes_before: int,
    steps_before: int,
    episode: int,
    env_steps: int,
) -> None:
    """Add a seed's episodes and steps to those of the seeds before it, and tell `progress`."""
    if progress is not None:
        progress(episodes_before + episode, steps_before + env_steps)


def _table(trained: Sequence[_Seed]) -> pd.DataFrame:
    """One row an episode, seeds in the order asked for."""
    tables = []
    for one in trained:
        table = pd.DataFrame(one.rows, columns=["steps", "return", "terminated"])
        table.insert(0, "seed", one.seed)
        table.insert(1, "episode", np.arange(1, len(table) + 1))
        table["env_steps"] = table["steps"].cumsum()
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _arrays(
    sizes: Sequence[int], biases: bool, trained: Sequence[_Seed], snapshots: Collection[int]
) -> dict[str, NDArray[np.float32]]:
    """Weights by name, stacked over seeds: the last, the first, and those of the snapshots."""
    arrays = {}
    moments = [f"episode{episode}/" for episode in sorted(set(snapshots) - {0})]
    for moment in ["", "initial/", *moments]:
        stacked = np.stack([one.snapshots.get(moment, one.parameters) for one in trained])
        for name, array in networks.unpack(sizes, stacked).items():
            if biases or not name.endswith("bias"):
                arrays[moment + name] = np.ascontiguousarray(array)
    return arrays
