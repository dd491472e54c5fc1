"""Tabular Q-learning: learn the optimal action values from experience alone.

    Q(s, a) <- 0 for all s, a
    for each episode:
        s <- start state
        until s is terminal or the episode is cut off:
            a <- exploration rule applied to Q(s, .)
            take a, observe r, s'
            Q(s, a) <- Q(s, a) + alpha [r + gamma max_a' Q(s', a') - Q(s, a)]
            s <- s'

(Watkins 1989; Sutton & Barto, section 6.5; the report's section 2, where pi(s') is the greedy
action.) With Q(s', .) = 0 for terminal s'. An episode that is cut off did not end: its last update
looks at Q(s', .) as any other does.

The loop is written once, in `_learn`. For an `MDP` or a gridded task it is compiled; for a
Gymnasium environment it runs as it stands. Both agree bit for bit where both play the same world.

In a continuous world the table is over the cells of a grid (`rl_core.worlds.discretise`): c, the
cell of the observed state, takes the place of s.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from numba.extending import register_jitable
from numpy.typing import ArrayLike

from rl_core import checks, exploration
from rl_core.exploration import EpsilonGreedy, ExplorationRule, Linear, Trials, VisitDecay
from rl_core.kernels import appraisal
from rl_core.kernels.appraisal import Appraisal, Yardstick
from rl_core.kernels.arrays import F64, I64, Arrays
from rl_core.kernels.choices import EPSILON_GREEDY, choose, step_size
from rl_core.kernels.compiled import compiled
from rl_core.kernels.model import NO_MODEL
from rl_core.mdp import MDP
from rl_core.planning import optimal_actions
from rl_core.training import Failure, Progress, Run
from rl_core.worlds import tabular
from rl_core.worlds.discretise import Discretised, checked_bins, gridded
from rl_core.worlds.environments import EnvironmentLike, one_seed_of, task_of
from rl_core.worlds.tabular import DiscreteWorld, Draws, Played, start, step

NO_LIMIT = 2**62


@dataclass(frozen=True)
class QLearningConfig:
    """Settings of `q_learning`.

    Attributes
    ----------
    gamma : float
        Discount, in [0, 1].
    step_size : float or Linear or VisitDecay
        alpha, in (0, 1].
    exploration : EpsilonGreedy or Softmax or UnnormalisedSoftmax
        How actions are chosen while learning.
    max_steps : int or None
        Cap on the length of an episode. None: only the environment's own, and the budget.
    max_env_steps : int or None
        Budget of environment steps a seed. The episode in which it is used up is stopped there and
        is the seed's last. None: no limit.
    evaluation : Trials
        When and how the greedy policy is tried out.
    bins : int or tuple of int or None
        In a continuous world, bins of every observed number, or of each; None in a discrete one.
    levels : int or None
        Levels of each component of a continuous action; None where actions are discrete.

    Raises
    ------
    TypeError, ValueError
        An attribute is not as described.

    Examples
    --------
    >>> from rl_core.exploration import EpsilonGreedy, VisitDecay
    >>> from rl_core.q_learning import QLearningConfig
    >>> QLearningConfig(step_size=VisitDecay(), exploration=EpsilonGreedy(0.9)).gamma
    0.9
    """

    gamma: float = 0.9
    step_size: float | Linear | VisitDecay = 0.2
    exploration: ExplorationRule = field(default_factory=EpsilonGreedy)
    max_steps: int | None = None
    max_env_steps: int | None = 10_000_000
    evaluation: Trials = field(default_factory=Trials)
    bins: int | tuple[int, ...] | None = None
    levels: int | None = None

    def __post_init__(self) -> None:
        rules = "EpsilonGreedy(...), Softmax(...) or UnnormalisedSoftmax()"
        checks.fields(
            self,
            gamma=(checks.number, 0, 1),
            step_size=(exploration.check_step_size,),
            exploration=(checks.instance, ExplorationRule, rules),
            evaluation=(checks.instance, Trials, "Trials(...)"),
            bins=(checks.optional, checked_bins),
            levels=(checks.optional, checks.integer, 2),
            **dict.fromkeys(("max_steps", "max_env_steps"), (checks.optional, checks.integer, 1)),
        )
        without = self.bins is None and self.levels is not None
        checks.require(not without, "levels", self.levels, "None where bins is None")


def q_learning(
    env: EnvironmentLike | MDP,
    config: QLearningConfig,
    *,
    episodes: int,
    seeds: Iterable[int],
    Q_star: ArrayLike | None = None,
    snapshots: Iterable[int] = (),
    progress: Progress | None = None,
) -> Run:
    """Learn action values, once for every seed.

    Parameters
    ----------
    env : MDP or str or Make or Task or gymnasium.Env or callable
        A model, played compiled; or an environment (`rl_core.worlds.environments.open_world`) with
        discrete observations and actions, played in a plain loop. With `config.bins`, a world of
        Box observations seen through a grid: compiled tasks run compiled. An environment that is
        given ready made is for one seed only.
    config : QLearningConfig
        Settings.
    episodes : int
        Episodes a seed.
    seeds : iterable of int
        Distinct, from 0. Each gives the same bits whichever others are asked for.
    Q_star : array, shape (S, A), optional
        The optimal action values. Without them all that is measured against them is NaN; so is
        what needs a model if `env` is an environment that has none.
    snapshots : iterable of int
        After which episodes to keep Q and the visit counts; 0 is before the first.
    progress : callable, optional
        Called after each seed with the episodes and environment steps so far, over all seeds.

    Returns
    -------
    Run
        The table has a row an episode, with the state of Q at its end:

        - `steps`, `return` (undiscounted), `terminated`, `env_steps`: see `Run`;
        - `visited_entries`: entries (s, a) updated so far;
        - `error_norm`: the Frobenius norm of Q - Q*; `rmse`: that divided by sqrt(S A), the root
          of the mean squared error over all entries; `rmse_visitable`: the same over the
          entries of visitable states, those that are not terminal and can be reached;
        - `optimal_states`: visitable states in which every greedy action is optimal;
        - `value_lost`: v*(s_0) - v_pi(s_0) for the greedy policy pi (ties drawn uniformly) and the
          start state s_0 (the average over several), both exact from the model, discounted. With
          gamma = 1 it can take very many sweeps, so it is then found with the evaluations only.

        After every `config.evaluation.every` episodes, NaN in between:

        - `eval_return` (undiscounted), `eval_steps`: means over the evaluation's episodes.

        Arrays: `Q` (seeds, S, A) float64, `visits` (seeds, S, A) int64, and with snapshots
        `Q_snapshots`, `visits_snapshots` (seeds, snapshots, S, A).

    Raises
    ------
    TypeError, ValueError
        An argument is not as described. Raised before anything runs.

    Notes
    -----
    `SeedSequence(seed)` spawns six streams: start states, transitions and decisions, each for
    learning and for evaluation. So neither evaluations nor the number of draws in `reset` disturb
    what follows. An environment's own generator is replaced by them; they are made as its
    `reset(seed=...)` would.

    Examples
    --------
    >>> from rl_core.exploration import EpsilonGreedy
    >>> from rl_core.q_learning import QLearningConfig, q_learning
    >>> from rl_core.maze import Maze
    >>> config = QLearningConfig(exploration=EpsilonGreedy(0.9))
    >>> run = q_learning(Maze().model(), config, episodes=100, seeds=[0, 1])
    >>> run.arrays["Q"].shape, len(run.table)
    ((2, 112, 4), 200)
    """
    check_q_learning(env, config)
    seeds = checks.distinct_seeds(one_seed_of(env, seeds))
    episodes = checks.integer("episodes", episodes, 1)
    at = checks.integers("snapshots", snapshots, 0, episodes)
    told = checks.instance, Callable, "a function of episodes and steps"
    checks.optional("progress", progress, *told)
    with _opened(env, config) as (world, model, shape):
        _check_memory(config, shape, len(seeds) * (1 + len(at)))
        yardstick = make_yardstick(model, Q_star, shape)
        task = _task(config, episodes, getattr(world, "max_steps", 0) or NO_LIMIT)
    record, failures = appraisal.empty_record(len(seeds), episodes), []
    arrays = _empty_arrays(len(seeds), len(at), shape)
    for i, seed in enumerate(seeds):
        own = {name: array[i] for name, array in arrays.items()}
        with _opened(env, config) as (world, _, _):
            failure = _train(world, task, yardstick, seed, at, own, record[i])
        failures += [] if failure is None else [failure]
        if progress is not None:
            progress((i + 1) * episodes, appraisal.env_steps(record))
    return Run(appraisal.as_table(record, seeds), arrays, tuple(failures), env, config)


def check_q_learning(env: object, config: object) -> None:
    """Raise what `q_learning` would raise for a world and a configuration; run nothing.

    `rl_core.experiments.run` calls it for every arm before it begins with any.

    Raises
    ------
    TypeError, ValueError
        If `config` is no QLearningConfig, the environment unknown, or bins or levels not for its
        spaces.

    Examples
    --------
    >>> from rl_core.q_learning import QLearningConfig, check_q_learning
    >>> check_q_learning("MountainCar-v0", QLearningConfig(bins=10))
    """
    checks.instance("config", config, QLearningConfig, "a QLearningConfig")
    assert isinstance(config, QLearningConfig)
    with _opened(env, config) as (_, _, shape):
        _check_memory(config, shape, 1)


def _check_memory(config: QLearningConfig, shape: tuple[int, int], tables: int) -> None:
    """Raise if the machine cannot hold so many tables of values and of visits."""
    checks.in_memory("bins", config.bins, 16 * shape[0] * shape[1] * tables)


@contextmanager
def _opened(env: Any, config: Any) -> Iterator[tuple[DiscreteWorld, MDP | None, tuple[int, int]]]:
    """Open the world to act in; give it with its model, if it has one, and the shape of Q."""
    if isinstance(env, MDP):
        checks.require(config.bins is None, "bins", config.bins, "None where states are numbered")
        yield env.arrays(), env, (env.n_states, env.n_actions)
        return
    if config.bins is not None and (task := task_of(env)) is not None:
        grid = gridded(task, config.bins, levels=config.levels)
        yield grid, None, grid.shape
        return
    cut = env if config.bins is None else Discretised(env, config.bins, levels=config.levels)
    world = tabular.played(cut)
    try:
        yield world, tabular.known_model(world), (int(world.observations.n), int(world.actions.n))
    finally:
        if not isinstance(env, gym.Env):  # made here
            world.env.close()


def make_yardstick(
    model: MDP | None, Q_star: ArrayLike | None, shape: tuple[int, int]
) -> Yardstick:
    """Return what tables of a shape are measured against.

    Parameters
    ----------
    model : MDP or None
        At least S states (a terminal one may be appended), or None if it is not known.
    Q_star : array, shape (S, A), or None
        The optimal action values, or None if they are not known.
    shape : tuple of int
        (S, A).

    Raises
    ------
    TypeError, ValueError
        `Q_star` is not made of finite numbers or has another shape.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.q_learning import make_yardstick
    >>> from rl_core.maze import Maze
    >>> yardstick = make_yardstick(Maze().model(), np.zeros((112, 4)), (112, 4))
    >>> int(yardstick.visitable.sum())
    92
    """
    best = np.empty((0, shape[1])) if Q_star is None else checks.floats("Q_star", Q_star, shape)
    optimal = optimal_actions(best) if len(best) else best.astype(np.bool_)
    if model is None:
        return Yardstick(best, optimal, np.empty(0, dtype=np.bool_), NO_MODEL)
    visitable = (model.reachable_states() & ~model.terminal)[: shape[0]]
    return Yardstick(best, optimal, visitable, model.arrays())


class _Task(NamedTuple):
    """The configuration as the loop reads it; schedules laid out over the episodes."""

    rule: int
    parameter: F64
    step_size: F64
    exponent: float
    gamma: float
    max_steps: int
    max_env_steps: int
    trial_every: int
    trial_episodes: int
    trial_max_steps: int
    trial_epsilon: float


def _task(config: QLearningConfig, episodes: int, limit: int) -> _Task:
    """Lay a configuration out over the episodes of a world with a time limit of its own."""
    trials = {f"trial_{name}": value for name, value in asdict(config.evaluation).items()}
    trials["trial_max_steps"] = min(config.evaluation.max_steps, limit)
    if isinstance(config.step_size, VisitDecay):
        initial, exponent = config.step_size.initial, config.step_size.exponent
    else:
        initial, exponent = config.step_size, 0.0
    return _Task(
        rule=config.exploration.kind,
        parameter=exploration.values(config.exploration.parameter, episodes),
        step_size=exploration.values(initial, episodes),
        exponent=exponent,
        gamma=config.gamma,
        max_steps=min(config.max_steps or NO_LIMIT, limit),
        max_env_steps=config.max_env_steps or NO_LIMIT,
        **trials,
    )


def _learn(
    world: DiscreteWorld,
    task: _Task,
    yardstick: Yardstick,
    known: Appraisal,
    draws: Draws,
    trial_draws: Draws,
    Q: F64,
    visits: I64,
    record: F64,
    first: int,
    last: int,
) -> int:
    """Learn from the episodes `first` to `last` - 1, write a row for each, and return `last`.

    Stop after an episode whose return is not finite, or in which the budget is used up; then return
    its number instead.
    """
    for k in range(first, last):
        left = task.max_env_steps - appraisal.steps_so_far(record, k)
        if left <= 0:
            return k - 1
        max_steps = min(task.max_steps, left)
        outcome = _learn_episode(world, task, draws, Q, visits, k, max_steps)
        appraisal.write_episode(record, k, outcome, Q, yardstick)
        if not np.isfinite(outcome[1]):
            return k
        on_trial = (k + 1) % task.trial_every == 0
        if on_trial or task.gamma < 1.0:
            lost = appraisal.value_lost(Q, yardstick, task.gamma, known)
            record[k, appraisal.VALUE_LOST] = lost
        if on_trial:
            trials = np.empty((task.trial_episodes, 2))
            for i in range(task.trial_episodes):
                trials[i] = _try_episode(world, task, trial_draws, Q)
            appraisal.write_evaluation(record, k, trials)
    return last


@register_jitable
def _learn_episode(
    world: DiscreteWorld, task: _Task, draws: Draws, Q: F64, visits: I64, k: int, max_steps: int
) -> tuple[int, float, bool, int]:
    """Learn from episode k; return its steps, return, end and newly visited entries."""
    steps, total, new_entries, terminated, truncated = 0, 0.0, 0, False, False
    s = start(world, draws)
    while not (terminated or truncated) and steps < max_steps:
        u, v = draws.policy.random(), draws.policy.random()
        a = choose(task.rule, task.parameter[k], Q[s], u, v)
        s_next, r, terminated, truncated = step(world, s, a, draws)
        new_entries += visits[s, a] == 0
        visits[s, a] += 1
        alpha = step_size(task.step_size[k], task.exponent, visits[s, a])
        _update(Q, s, a, r, s_next, terminated, alpha, task.gamma)
        s = s_next
        steps += 1
        total += r
    return steps, total, terminated, new_entries


@register_jitable
def _try_episode(world: DiscreteWorld, task: _Task, draws: Draws, Q: F64) -> tuple[float, float]:
    """Play an episode of the evaluation; return its return and steps."""
    steps, total, terminated, truncated = 0, 0.0, False, False
    s = start(world, draws)
    while not (terminated or truncated) and steps < task.trial_max_steps:
        u, v = draws.policy.random(), draws.policy.random()
        a = choose(EPSILON_GREEDY, task.trial_epsilon, Q[s], u, v)
        s, r, terminated, truncated = step(world, s, a, draws)
        steps += 1
        total += r
    return total, float(steps)


_learn_compiled = compiled(_learn)


@compiled
def _update(
    Q: F64, s: int, a: int, r: float, s_next: int, terminated: bool, alpha: float, gamma: float
) -> None:
    """Pull Q(s, a) towards the target r + gamma max_a' Q(s', a')."""
    target = r
    if not terminated:
        best = Q[s_next, 0]
        for b in range(1, Q.shape[1]):
            best = max(best, Q[s_next, b])
        target += gamma * best
    Q[s, a] += alpha * (target - Q[s, a])


def _empty_arrays(n_seeds: int, n_snapshots: int, shape: tuple[int, int]) -> Arrays:
    """Return tables and counts of zeros for every seed, and room for the snapshots of both."""
    kinds = {"Q": np.float64, "visits": np.int64}
    arrays: Arrays = {name: np.zeros((n_seeds, *shape), kind) for name, kind in kinds.items()}
    for name, kind in kinds.items() if n_snapshots else ():
        arrays[f"{name}_snapshots"] = np.zeros((n_seeds, n_snapshots, *shape), kind)
    return arrays


def _train(
    world: DiscreteWorld,
    task: _Task,
    yardstick: Yardstick,
    seed: int,
    snapshots: Sequence[int],
    arrays: Arrays,
    record: F64,
) -> Failure | None:
    """Run one seed, pausing at the snapshots; return why it failed, if it did."""
    learn = _learn if isinstance(world, Played) else _learn_compiled
    draws, trial_draws = tabular.spawn_draws(seed, 2)
    if isinstance(world, Played):
        world.env.reset(seed=seed)  # for what else the environment draws from
    known, first = appraisal.new_appraisal(yardstick), 0
    Q, visits = arrays["Q"], arrays["visits"]
    for last in sorted({*snapshots, len(record)}):
        stopped = learn(
            world, task, yardstick, known, draws, trial_draws, Q, visits, record, first, last
        )
        ended = stopped < last  # then later snapshots are of the last table
        for j, at in enumerate(snapshots):
            if at == last or (ended and at > last):
                arrays["Q_snapshots"][j], arrays["visits_snapshots"][j] = Q, visits
        if ended:
            bad = not np.isfinite(record[stopped, appraisal.RETURN])
            return Failure(seed, stopped + 1, "the return is not finite") if bad else None
        first = last
    return None
