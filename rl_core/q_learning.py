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
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from numba.extending import register_jitable
from numpy.typing import ArrayLike, NDArray

from rl_core import tabular
from rl_core.discretise import Binned
from rl_core.exploration import (
    EPSILON_GREEDY,
    EpsilonGreedy,
    Evaluation,
    ExplorationRule,
    Schedule,
    VisitDecay,
    check_integer,
    check_number,
    check_parameter,
    choose,
    step_size,
    values,
)
from rl_core.kernels.compiled import compiled
from rl_core.mdp import MDP
from rl_core.planning import value_iteration
from rl_core.tabular import Environment, Played, Streams, World, start, step
from rl_core.tabular_record import (
    Appraisal,
    Yardstick,
    as_table,
    empty_record,
    env_steps,
    make_yardstick,
    new_appraisal,
    write_episode,
    write_evaluation,
    write_loss,
)
from rl_core.training import Failure, Run

NO_LIMIT = 2**62
Q_STAR_TOLERANCE = 1e-10

Values = NDArray[np.float64]
Counts = NDArray[np.int64]
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class QLearningConfig:
    """Settings of `q_learning`.

    Attributes
    ----------
    gamma : float
        Discount, in [0, 1].
    step_size : float or Schedule or VisitDecay
        alpha, in (0, 1].
    exploration : EpsilonGreedy or Softmax or UnnormalisedSoftmax
        How actions are chosen while learning.
    max_steps : int or None
        Cap on the length of an episode. None: only the environment's own. A rule that never gets
        to an end then never returns.
    evaluation : Evaluation
        When and how the greedy policy is tried out.

    Raises
    ------
    TypeError, ValueError
        An attribute is not as described.

    Examples
    --------
    >>> QLearningConfig(step_size=VisitDecay(), exploration=EpsilonGreedy(0.9)).gamma
    0.9
    """

    gamma: float = 0.9
    step_size: float | Schedule | VisitDecay = 0.2
    exploration: ExplorationRule = field(default_factory=EpsilonGreedy)
    max_steps: int | None = None
    evaluation: Evaluation = field(default_factory=Evaluation)

    def __post_init__(self) -> None:
        check_number("gamma", self.gamma, lambda x: 0 <= x <= 1, "numbers in [0, 1]")
        if not isinstance(self.step_size, VisitDecay):
            check_parameter("step_size", self.step_size, lambda x: 0 < x <= 1, "numbers in (0, 1]")
        for name, kind in (("exploration", ExplorationRule), ("evaluation", Evaluation)):
            if not isinstance(value := getattr(self, name), kind):
                raise TypeError(f"{name} is {value!r}; allowed are instances of {kind}")
        if self.max_steps is not None:
            check_integer("max_steps", self.max_steps, least=1)


def q_learning(
    env: Environment | MDP | Binned,
    config: QLearningConfig,
    *,
    episodes: int,
    seeds: Sequence[int],
    Q_star: ArrayLike | None = None,
    snapshots: Sequence[int] = (),
    progress: Progress | None = None,
) -> Run:
    """Learn action values, once for every seed.

    Parameters
    ----------
    env : MDP or Binned or str or gymnasium.Env or callable
        A model, or a compiled task seen through a grid (`rl_core.discretise.binned`), both played
        compiled; or an environment, its id, or a function that makes one, with discrete
        observations and actions, played in a plain loop.
    config : QLearningConfig
        Settings.
    episodes : int
        Episodes a seed.
    seeds : sequence of int
        Each gives the same bits whichever others are asked for.
    Q_star : array, shape (S, A), optional
        The optimal action values. Without them all that is measured against them is NaN; so is
        what needs a model if `env` is an environment that has none.
    snapshots : sequence of int
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
    >>> from rl_core.maze import Maze
    >>> config = QLearningConfig(exploration=EpsilonGreedy(0.9))
    >>> run = q_learning(Maze().model(), config, episodes=100, seeds=[0, 1])
    >>> run.arrays["Q"].shape, len(run.table)
    ((2, 112, 4), 200)
    """
    seeds, snapshots = _check_arguments(config, episodes, seeds, snapshots)
    world, model, shape = tabular.opened(env)
    try:
        yardstick = make_yardstick(model, Q_star, shape)
        learn = _learn if isinstance(world, Played) else _learn_compiled
        learner = _Learner(learn, world, shape, yardstick)
        return _train(learner, config, episodes, seeds, snapshots, progress)
    finally:
        if isinstance(world, Played) and world.env is not env:
            world.env.close()


def q_learning_on_model(
    env: str,
    config: QLearningConfig,
    *,
    episodes: int,
    seeds: Sequence[int],
    snapshots: Sequence[int] = (),
    progress: Progress | None = None,
) -> Run:
    """Learn on the exact model of an environment, compiled, measured against the optimal values.

    The same bits as `q_learning` on the environment itself, several hundred times sooner. The
    environment must play what its table says and nothing else (Taxi's options do not).

    Parameters
    ----------
    env : str
        The id of an environment that `MDP.from_env` can read. Its time limit cuts episodes off as
        `config.max_steps` does.
    config, episodes, seeds, snapshots, progress
        As in `q_learning`; `gamma` below 1, as planning needs it.

    Returns
    -------
    Run
        As `q_learning` returns it.

    Raises
    ------
    TypeError, ValueError
        An argument is not as described.

    Examples
    --------
    >>> config = QLearningConfig(exploration=EpsilonGreedy(0.9))
    >>> run = q_learning_on_model("rl_core/Maze-v0", config, episodes=2000, seeds=[0])
    >>> run.table["error_norm"].iloc[[0, -1]].round().tolist()  # it cannot get below 7.957
    [25.0, 8.0]
    """
    if not isinstance(env, str):
        raise TypeError(f"env is {env!r}; allowed is an environment's id")
    seeds, snapshots = _check_arguments(config, episodes, seeds, snapshots)
    model = MDP.from_env(env)
    limit = gym.spec(env).max_episode_steps
    if limit is not None:
        evaluation = replace(config.evaluation, max_steps=min(limit, config.evaluation.max_steps))
        max_steps = min(limit, config.max_steps or limit)
        config = replace(config, max_steps=max_steps, evaluation=evaluation)
    Q_star = value_iteration(
        model, gamma=config.gamma, tolerance=Q_STAR_TOLERANCE, progress=False
    ).Q
    return q_learning(
        model,
        config,
        episodes=episodes,
        seeds=seeds,
        Q_star=Q_star,
        snapshots=snapshots,
        progress=progress,
    )


class _Task(NamedTuple):
    """The configuration as the loop reads it; schedules laid out over the episodes."""

    rule: int
    parameter: NDArray[np.float64]
    step_size: NDArray[np.float64]
    exponent: float
    gamma: float
    max_steps: int
    trial_every: int
    trial_episodes: int
    trial_max_steps: int
    trial_epsilon: float


def _task(config: QLearningConfig, episodes: int) -> _Task:
    if isinstance(config.step_size, VisitDecay):
        initial, exponent = config.step_size.initial, float(config.step_size.exponent)
    else:
        initial, exponent = config.step_size, 0.0
    return _Task(
        rule=config.exploration.kind,
        parameter=values(config.exploration.parameter, episodes),
        step_size=values(initial, episodes),
        exponent=exponent,
        gamma=float(config.gamma),
        max_steps=NO_LIMIT if config.max_steps is None else int(config.max_steps),
        trial_every=int(config.evaluation.every),
        trial_episodes=int(config.evaluation.episodes),
        trial_max_steps=int(config.evaluation.max_steps),
        trial_epsilon=float(config.evaluation.epsilon),
    )


def _learn(
    world: World,
    task: _Task,
    yardstick: Yardstick,
    appraisal: Appraisal,
    streams: Streams,
    trial_streams: Streams,
    Q: Values,
    visits: Counts,
    record: Values,
    first: int,
    last: int,
) -> int:
    """Learn from the episodes `first` to `last` - 1, write a row for each, and return `last`.

    Stop at an episode whose return is not finite and return its number instead.
    """
    for k in range(first, last):
        outcome = _learn_episode(world, task, streams, Q, visits, k)
        write_episode(record, k, outcome, Q, yardstick)
        if not np.isfinite(outcome[1]):
            return k
        on_trial = (k + 1) % task.trial_every == 0
        if on_trial or task.gamma < 1.0:
            write_loss(record, k, Q, yardstick, task.gamma, appraisal)
        if on_trial:
            trials = np.empty((task.trial_episodes, 2))
            for i in range(task.trial_episodes):
                trials[i] = _try_episode(world, task, trial_streams, Q)
            write_evaluation(record, k, trials)
    return last


@register_jitable
def _learn_episode(
    world: World, task: _Task, streams: Streams, Q: Values, visits: Counts, k: int
) -> tuple[int, float, bool, int]:
    """Learn from episode k; return its steps, return, end and newly visited entries."""
    steps, total, new_entries, terminated, truncated = 0, 0.0, 0, False, False
    s = start(world, streams)
    while not (terminated or truncated) and steps < task.max_steps:
        u, v = streams.policy.random(), streams.policy.random()
        a = choose(task.rule, task.parameter[k], Q[s], u, v)
        s_next, r, terminated, truncated = step(world, s, a, streams)
        new_entries += visits[s, a] == 0
        visits[s, a] += 1
        alpha = step_size(task.step_size[k], task.exponent, visits[s, a])
        _update(Q, s, a, r, s_next, terminated, alpha, task.gamma)
        s = s_next
        steps += 1
        total += r
    return steps, total, terminated, new_entries


@register_jitable
def _try_episode(world: World, task: _Task, streams: Streams, Q: Values) -> tuple[float, float]:
    """Play an episode of the evaluation; return its return and steps."""
    steps, total, terminated, truncated = 0, 0.0, False, False
    s = start(world, streams)
    while not (terminated or truncated) and steps < task.trial_max_steps:
        u, v = streams.policy.random(), streams.policy.random()
        a = choose(EPSILON_GREEDY, task.trial_epsilon, Q[s], u, v)
        s, r, terminated, truncated = step(world, s, a, streams)
        steps += 1
        total += r
    return total, float(steps)


_learn_compiled = compiled(_learn)


@compiled
def _update(
    Q: Values, s: int, a: int, r: float, s_next: int, terminated: bool, alpha: float, gamma: float
) -> None:
    """Pull Q(s, a) towards the target r + gamma max_a' Q(s', a')."""
    target = r
    if not terminated:
        best = Q[s_next, 0]
        for b in range(1, Q.shape[1]):
            best = max(best, Q[s_next, b])
        target += gamma * best
    Q[s, a] += alpha * (target - Q[s, a])


class _Learner(NamedTuple):
    """The loop, the world it plays in, the shape of Q, and what Q is measured against."""

    learn: Callable[..., int]
    world: World
    shape: tuple[int, int]
    yardstick: Yardstick


def _train(
    learner: _Learner,
    config: QLearningConfig,
    episodes: int,
    seeds: Sequence[int],
    snapshots: Sequence[int],
    progress: Progress | None,
) -> Run:
    """Run every seed, stopping at the snapshots, and gather tables and arrays."""
    task = _task(config, episodes)
    arrays: dict[str, NDArray[Any]] = {
        "Q": np.zeros((len(seeds), *learner.shape)),
        "visits": np.zeros((len(seeds), *learner.shape), dtype=np.int64),
    }
    for name in ("Q", "visits") if snapshots else ():
        shape = (len(seeds), len(snapshots), *learner.shape)
        arrays[f"{name}_snapshots"] = np.zeros(shape, dtype=arrays[name].dtype)
    record = empty_record(len(seeds), episodes)
    failures = []
    for i, seed in enumerate(seeds):
        streams, appraisal = tabular.spawn_streams(seed, 2), new_appraisal(learner.yardstick)
        if isinstance(learner.world, Played):
            learner.world.env.reset(seed=int(seed))  # for what else the environment draws from
        Q, visits, first = arrays["Q"][i], arrays["visits"][i], 0
        for last in sorted({*snapshots, episodes}):
            stopped = learner.learn(
                *(learner.world, task, learner.yardstick, appraisal, *streams),
                *(Q, visits, record[i], first, last),
            )
            if stopped < last:
                failures.append(Failure(seed, stopped + 1, "the return is not finite"))
                break
            for j in [j for j, wanted in enumerate(snapshots) if wanted == last]:
                arrays["Q_snapshots"][i, j] = Q
                arrays["visits_snapshots"][i, j] = visits
            first = last
        if progress is not None:
            progress((i + 1) * episodes, env_steps(record))
    return Run(as_table(record, seeds), arrays, tuple(failures))


def _check_arguments(
    config: object, episodes: int, seeds: Sequence[int], snapshots: Sequence[int]
) -> tuple[list[int], list[int]]:
    """Raise on whatever does not depend on the environment; return seeds and snapshots as lists."""
    if not isinstance(config, QLearningConfig):
        raise TypeError(f"config is {config!r}; allowed is a QLearningConfig")
    check_integer("episodes", episodes, least=1)
    numbers = _integers("seeds", seeds)
    if not numbers or len(set(numbers)) < len(numbers):
        raise ValueError(f"seeds is {numbers}; allowed is at least one, each once")
    at = _integers("snapshots", snapshots)
    for episode in at:
        if episode > episodes:
            raise ValueError(f"snapshots has {episode}; allowed are 0 to {episodes}")
    return numbers, at


def _integers(name: str, values: object) -> list[int]:
    """Return a sequence of integers from 0, an array or not, as a list of Python's own."""
    if not isinstance(values, Iterable) or isinstance(values, str):
        raise TypeError(f"{name} is {values!r}; allowed is a sequence of integers from 0")
    found = list(values)
    for value in found:
        check_integer(name, value, least=0)
    return [int(value) for value in found]
