"""Q-learning on the exact model of an environment: what the arms of chapter 2 run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import gymnasium as gym

from rl_core import checks
from rl_core.mdp import MDP
from rl_core.planning import value_iteration
from rl_core.q_learning import QLearningConfig, check_q_learning, q_learning
from rl_core.training import Progress, Run

Q_STAR_TOLERANCE = 1e-10


def q_learning_on_model(
    env: str,
    config: QLearningConfig,
    *,
    episodes: int,
    seeds: Iterable[int],
    snapshots: Iterable[int] = (),
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
    >>> from rl_core.exploration import EpsilonGreedy
    >>> from rl_core.q_learning import QLearningConfig
    >>> from studies.on_model import q_learning_on_model
    >>> config = QLearningConfig(exploration=EpsilonGreedy(0.9))
    >>> run = q_learning_on_model("rl_core/Maze-v0", config, episodes=2000, seeds=[0])
    >>> run.table["error_norm"].iloc[[0, -1]].round().tolist()  # it cannot get below 7.957
    [25.0, 8.0]
    """
    check_q_learning_on_model(env, config)
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


def check_q_learning_on_model(env: object, config: object) -> None:
    """Raise what `q_learning_on_model` would raise for an environment and a configuration.

    Raises
    ------
    TypeError, ValueError
        If `env` is no id or has no model, or `config` is no QLearningConfig with gamma below 1.

    Examples
    --------
    >>> from rl_core.q_learning import QLearningConfig
    >>> from studies.on_model import check_q_learning_on_model
    >>> check_q_learning_on_model("rl_core/Maze-v0", QLearningConfig())
    """
    checks.instance("env", env, str, "an environment's id")
    checks.instance("config", config, QLearningConfig, "a QLearningConfig")
    assert isinstance(env, str)
    assert isinstance(config, QLearningConfig)
    checks.require(config.gamma < 1, "gamma", config.gamma, "below 1, for planning")
    check_q_learning(MDP.from_env(env), config)
