"""REINFORCE: Monte Carlo policy gradient with categorical and Gaussian policies.

After every episode s_0, a_0, r_1, s_1, ..., s_T the parameters theta climb the log-likelihood of
the actions taken, weighted by what followed them:

    v_t = sum_{k >= t} gamma^(k - t) r_{k + 1},    normalised within the episode,
    theta <- theta + alpha * grad (1 / |B|) sum_{t in B} v_t log pi(a_t | s_t)

for minibatches B of the episode, over several epochs, with Adam in place of the plain step. The
factor gamma^t of the textbook's update is left out, as in the report and in common practice.

CartPole-v1 is learned through the plain loop with

    ReinforceConfig(gamma=0.995, hidden=(64,), learning_rate=2e-3, epochs=1)

in 1,000 episodes: these settings were chosen on seeds 1000 to 1014, of which 13 came to an average
return of at least 450 over the last 50 episodes. A test holds most of seeds 0 to 9 to the same.

    for each seed:
        draw the initial weights
        for each episode:
            play it with the present policy
            compute the returns v_t and normalise them
            for each epoch: for each minibatch of the shuffled steps: one step of Adam

Sources: R. S. Sutton and A. G. Barto, Reinforcement Learning: An Introduction (2018), sections 13.3
(REINFORCE) and 13.7 (continuous actions); R. J. Williams (1992), Simple statistical
gradient-following algorithms for connectionist reinforcement learning.
"""

import math
import sys
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from rl_core import networks, policies
from rl_core.episodes import (
    Environment,
    EnvironmentLike,
    Trajectory,
    checked_seeds,
    checked_snapshots,
    open_environment,
    spawn_streams,
)
from rl_core.kernels.compiled import compiled
from rl_core.policies import (
    Categorical,
    Gaussian,
    Policy,
    is_integer,
    is_number,
    is_one_of,
    likelihood_gradient,
    require,
)
from rl_core.training import Failure, Run

PROGRESS_EVERY = 10
"""Episodes between two reports of progress."""


@dataclass(frozen=True)
class ReinforceConfig:
    """What REINFORCE is run with. Defaults: the report's for Acrobot and MountainCar, and a budget.

    Attributes
    ----------
    gamma : float
        Discount, from 0 to 1.
    hidden : tuple of int
        Widths of the hidden layers, rectified linear units; () for a linear network.
    biases : bool
        Whether biases are learned; else they stay zero.
    policy : Categorical or Gaussian
        How the outputs of the network become actions.
    learning_rate : float
        Adam's step size alpha, above 0.
    batch_size : int
        Largest minibatch, in steps. The last one of an epoch may be smaller.
    epochs : int
        Passes over an episode, in a new random order each.
    normalise : {"standard", "centre", "none"}
        Returns within an episode: shifted to mean 0 and scaled to variance 1, only shifted, or raw.
        Equal returns have no variance to scale by: they become 0.
    max_episode_steps : int or None
        Where to stop an episode that has not ended. None: nowhere.
    max_env_steps : int or None
        Budget of environment steps a seed. The episode in which it is used up is stopped there and
        is the seed's last. None: no limit. An episode needs about 100 bytes of memory a step.
    learn_from_capped : bool
        Whether to learn from an episode stopped by a cap, the environment's own time limit
        included. Its returns leave out what would have followed. The 2018 program did not.

    Raises
    ------
    ValueError
        For a value out of range.

    Examples
    --------
    >>> ReinforceConfig(gamma=0.9, hidden=(10,)).normalise
    'standard'
    """

    gamma: float = 0.99
    hidden: tuple[int, ...] = (10, 20)
    biases: bool = True
    policy: Categorical | Gaussian = field(default_factory=Categorical)
    learning_rate: float = 1e-3
    batch_size: int = 512
    epochs: int = 3
    normalise: Literal["standard", "centre", "none"] = "standard"
    max_episode_steps: int | None = None
    max_env_steps: int | None = 10_000_000
    learn_from_capped: bool = True

    def __post_init__(self) -> None:
        forms = ("standard", "centre", "none")
        rate, hidden = self.learning_rate, self.hidden
        checks = {
            "gamma": (is_number(self.gamma) and 0 <= self.gamma <= 1, "a number from 0 to 1"),
            "hidden": (
                isinstance(hidden, tuple) and all(is_integer(width, 1) for width in hidden),
                "a tuple of positive integers",
            ),
            "biases": (isinstance(self.biases, bool), "a bool"),
            "policy": (
                isinstance(self.policy, Categorical | Gaussian),
                "Categorical() or Gaussian(...)",
            ),
            "learning_rate": (is_number(rate) and rate > 0, "a finite number above 0"),
            "batch_size": (is_integer(self.batch_size, 1), "a positive integer"),
            "epochs": (is_integer(self.epochs, 1), "a positive integer"),
            "normalise": (is_one_of(self.normalise, forms), f"one of {forms}"),
            "learn_from_capped": (isinstance(self.learn_from_capped, bool), "a bool"),
        }
        for name in ("max_episode_steps", "max_env_steps"):
            value = getattr(self, name)
            checks[name] = (value is None or is_integer(value, 1), "a positive integer or None")
        for name, (valid, allowed) in checks.items():
            require(valid, name, getattr(self, name), allowed)


@compiled
def discounted_returns(rewards: NDArray[np.float64], gamma: float) -> NDArray[np.float64]:
    """v_t = r_{t+1} + gamma v_{t+1}, backwards from v_T = 0.

    Parameters
    ----------
    rewards : float64 array of shape (T,)
    gamma : float

    Returns
    -------
    float64 array of shape (T,)

    Examples
    --------
    >>> discounted_returns(np.array([1.0, 2.0, 4.0]), 0.5)
    array([3., 4., 4.])
    """
    returns = np.empty(rewards.size)
    following = 0.0
    for t in range(rewards.size - 1, -1, -1):
        following = rewards[t] + gamma * following
        returns[t] = following
    return returns


@compiled
def normalised(returns: NDArray[np.float64], centre: bool, scale: bool) -> NDArray[np.float64]:
    """Shift returns to mean 0 if `centre`, and scale them to variance 1 if `scale` as well.

    Examples
    --------
    >>> normalised(np.array([1.0, 3.0]), True, True)
    array([-1.,  1.])
    """
    if not centre:
        return returns
    deviations: NDArray[np.float64] = returns - returns.mean()
    deviation = math.sqrt((deviations * deviations).mean())
    if scale:
        equal = deviation <= 1e-12 * abs(returns.mean())  # up to rounding
        deviations *= 0.0 if equal else 1.0 / deviation
    return deviations


class _Adam(NamedTuple):
    """State of the optimiser of one seed."""

    first: NDArray[np.float32]
    second: NDArray[np.float32]
    trainable: NDArray[np.float32]
    steps: NDArray[np.int64]


class _Settings(NamedTuple):
    """The part of the config that the compiled learner reads."""

    gamma: float
    centre: bool
    scale: bool
    batch_size: int
    learning_rate: float


@compiled
def _learn(
    settings: _Settings,
    policy: Policy,
    parameters: NDArray[np.float32],
    adam: _Adam,
    orders: NDArray[np.int64],
    observations: NDArray[np.float32],
    actions: NDArray[np.float32],
    rewards: NDArray[np.float64],
) -> None:
    """Learn from an episode: change the parameters and the state of their optimiser in place.

    `orders`, of shape (epochs, T), holds the order of the steps in each epoch.
    """
    returns = discounted_returns(rewards, settings.gamma)
    returns = normalised(returns, settings.centre, settings.scale)
    largest = min(settings.batch_size, rewards.size)
    shape = (policy.sizes.sum(), networks.padded(largest))
    units, deltas = np.empty(shape, np.float32), np.empty(shape, np.float32)
    gradient = np.empty(parameters.size, np.float32)
    for order in orders:
        for start in range(0, rewards.size, largest):
            batch = order[start : start + largest]
            likelihood_gradient(
                policy,
                parameters,
                observations[batch],
                actions[batch],
                (returns[batch] / batch.size).astype(np.float32),
                units,
                deltas,
                gradient,
            )
            gradient *= adam.trainable
            adam.steps[0] += 1
            networks.adam_step(
                parameters,
                gradient,
                adam.first,
                adam.second,
                adam.steps[0],
                settings.learning_rate,
            )


def _orders(config: ReinforceConfig, steps: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Draw the order of the steps in each epoch; where one batch takes all it is of no account."""
    orders = np.tile(np.arange(steps), (config.epochs, 1))
    if steps > config.batch_size:
        for order in orders:
            rng.shuffle(order)
    return orders


@dataclass
class _Seed:
    """What became of one seed."""

    seed: int
    parameters: NDArray[np.float32]
    snapshots: dict[str, NDArray[np.float32]]
    rows: list[tuple[int, float, bool]] = field(default_factory=list)  # steps, return, terminated
    env_steps: int = 0
    failure: Failure | None = None


def _train(
    environment: Environment,
    policy: Policy,
    config: ReinforceConfig,
    episodes: int,
    seed: int,
    snapshots: Collection[int],
    report: Callable[[int, int], object],
) -> _Seed:
    """Train one seed, and tell `report` its episodes and environment steps so far."""
    streams = spawn_streams(seed)
    environment.seed(streams.environment_seed)
    parameters = policies.initial_parameters(policy, config.policy, streams.network)
    adam = _Adam(
        np.zeros_like(parameters),
        np.zeros_like(parameters),
        policies.trainable(policy, config.policy, config.biases),
        np.zeros(1, np.int64),
    )
    settings = _Settings(
        float(config.gamma),
        config.normalise != "none",
        config.normalise == "standard",
        config.batch_size,
        float(config.learning_rate),
    )
    trajectory = Trajectory(environment.n_observations, policy.action_width)
    trained = _Seed(seed, parameters, {"initial/": parameters.copy()})
    budget = config.max_env_steps or sys.maxsize
    for episode in range(1, episodes + 1):
        max_steps = min(config.max_episode_steps or sys.maxsize, budget - trained.env_steps)
        steps, terminated = environment.play(
            policy, parameters, streams.policy, max_steps, trajectory
        )
        with np.errstate(invalid="ignore", over="ignore"):
            episode_return = float(trajectory.rewards[:steps].sum())
        trained.rows.append((steps, episode_return, terminated))
        trained.env_steps += steps
        if not math.isfinite(episode_return):
            trained.failure = Failure(seed, episode, f"the return is {episode_return}")
            break
        if terminated or config.learn_from_capped:
            orders = _orders(config, steps, streams.network)
            _learn(settings, policy, parameters, adam, orders, *trajectory.first(steps))
        if not np.isfinite(parameters).all():
            trained.failure = Failure(seed, episode, "a weight is not finite after learning")
            break
        if episode in snapshots:
            trained.snapshots[f"episode{episode}/"] = parameters.copy()
        if episode % PROGRESS_EVERY == 0:
            report(episode, trained.env_steps)
        if trained.env_steps >= budget:
            break
    return trained


def check_reinforce(env: EnvironmentLike, config: ReinforceConfig) -> None:
    """Raise what `reinforce` would raise for an environment and a configuration; run nothing.

    `rl_core.experiments.run` calls it for every arm before it begins with any.

    Raises
    ------
    ValueError, TypeError
        If `config` is no ReinforceConfig, the environment unknown, or its spaces of another kind.

    Examples
    --------
    >>> check_reinforce("MountainCar-v0", ReinforceConfig())
    """
    require(isinstance(config, ReinforceConfig), "config", config, "a ReinforceConfig")
    environment = open_environment(env)
    try:
        _policy(config, environment)
    finally:
        environment.close()


def reinforce(
    env: EnvironmentLike,
    config: ReinforceConfig,
    *,
    episodes: int,
    seeds: Iterable[int],
    snapshots: Collection[int] = (),
    progress: Callable[[int, int], object] | None = None,
) -> Run:
    """Train one policy a seed with REINFORCE.

    Seeds share nothing: a seed gives the same bits alone and among any others.

    Parameters
    ----------
    env : str, gymnasium.Env or callable
        A Gymnasium id, an environment, or a function that makes one. Acrobot-v1, MountainCar-v0 and
        MountainCarContinuous-v0, given by id, are played compiled and without time limit; anything
        else goes through Gymnasium's own `reset` and `step` (`rl_core.episodes.open_environment`).
    config : ReinforceConfig
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
        `table` has the columns `seed`, `episode` (from 1), `steps`, `return` (undiscounted),
        `terminated` (false: stopped by a cap) and `env_steps` (of this seed so far). Rows of a seed
        that diverged or used up its budget end there, that episode included.
        `arrays` holds, with one row a seed, the last weights as `layer0.weight` of shape
        (seeds, inputs, outputs), `layer0.bias` and so on, `log_sigma` for a Gaussian, and copies
        under `initial/...` and `episode1000/...`, which are the last weights of seeds that ended
        before. `failures` names seeds whose weights or returns were no longer finite.

    Raises
    ------
    ValueError, TypeError
        If an argument is out of range, the environment unknown, or its spaces not the policy's.

    Examples
    --------
    >>> config = ReinforceConfig(hidden=(4,), max_episode_steps=200)
    >>> run = reinforce("Acrobot-v1", config, episodes=2, seeds=[0, 1])
    >>> run.table["episode"].tolist(), run.arrays["layer0.weight"].shape
    ([1, 2, 1, 2], (2, 6, 4))
    """
    seeds = checked_seeds(seeds)
    require(isinstance(config, ReinforceConfig), "config", config, "a ReinforceConfig")
    require(is_integer(episodes, 1), "episodes", episodes, "a positive integer")
    snapshots = checked_snapshots(snapshots, episodes)
    allowed = "a function of episodes and steps, or None"
    require(progress is None or callable(progress), "progress", progress, allowed)
    trained: list[_Seed] = []
    for seed in seeds:
        steps_before = sum(one.env_steps for one in trained)
        report = partial(_report, progress, len(trained) * episodes, steps_before)
        environment = open_environment(env)
        try:
            policy = _policy(config, environment)
            trained.append(_train(environment, policy, config, episodes, seed, snapshots, report))
        finally:
            environment.close()
        report(episodes, trained[-1].env_steps)
    failures = tuple(one.failure for one in trained if one.failure is not None)
    return Run(_table(trained), _arrays(policy, config, trained, snapshots), failures)


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


def _policy(config: ReinforceConfig, environment: Environment) -> Policy:
    return policies.make_policy(
        config.policy,
        config.hidden,
        environment.n_observations,
        environment.n_actions,
        environment.action_dimensions,
    )


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
    policy: Policy, config: ReinforceConfig, trained: Sequence[_Seed], snapshots: Collection[int]
) -> dict[str, NDArray[np.float32]]:
    """Weights by name, stacked over seeds: the last, the first, and those of the snapshots."""
    arrays = {}
    moments = [f"episode{episode}/" for episode in sorted(set(snapshots) - {0})]
    for moment in ["", "initial/", *moments]:
        stacked = np.stack([one.snapshots.get(moment, one.parameters) for one in trained])
        for name, array in policies.unpack(policy, stacked).items():
            if config.biases or not name.endswith("bias"):
                arrays[moment + name] = np.ascontiguousarray(array)
    return arrays
