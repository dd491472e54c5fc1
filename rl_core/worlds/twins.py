"""Which of Gymnasium's environments are played compiled."""

from dataclasses import replace
from typing import Any

import gymnasium

from rl_core.worlds.acrobot import Acrobot
from rl_core.worlds.cartpole import CartPole
from rl_core.worlds.mountain_car import MountainCar
from rl_core.worlds.mountain_car_continuous import MountainCarContinuous
from rl_core.worlds.pendulum import Pendulum
from rl_core.worlds.tasks import Task

# Type checkers do not see that a decorator makes something else of a class.
_TWINS: dict[str, tuple[str, Any]] = {
    "Acrobot-v1": ("acrobot:AcrobotEnv", Acrobot),
    "CartPole-v1": ("cartpole:CartPoleEnv", CartPole),
    "MountainCar-v0": ("mountain_car:MountainCarEnv", MountainCar),
    "MountainCarContinuous-v0": (
        "continuous_mountain_car:Continuous_MountainCarEnv",
        MountainCarContinuous,
    ),
    "Pendulum-v1": ("pendulum:PendulumEnv", Pendulum),
}

TASKS: dict[str, Task] = {env_id: task for env_id, (_, task) in _TWINS.items()}
"""The exact twins of Gymnasium's environments by their id."""


def twin(env_id: str) -> Task | None:
    """Return the compiled twin of an environment of Gymnasium, or None if it has none.

    An id that was registered anew with another class, arguments or wrappers has no twin. A time
    limit registered anew is the twin's, save where the twin is without: Acrobot, MountainCar and
    MountainCarContinuous are played until they end, as in the report.

    Examples
    --------
    >>> from rl_core.worlds.twins import twin
    >>> twin("CartPole-v1").max_episode_steps, twin("MountainCar-v0").max_episode_steps
    (500, None)
    >>> twin("CartPole-v0") is None
    True
    """
    task, spec = TASKS.get(env_id), gymnasium.registry.get(env_id)
    if task is None or spec is None:
        return None
    entry_point = f"gymnasium.envs.classic_control.{_TWINS[env_id][0]}"
    if spec.entry_point != entry_point or spec.kwargs or spec.additional_wrappers:
        return None
    if task.max_episode_steps in (None, spec.max_episode_steps):
        return task
    return replace(task, max_episode_steps=spec.max_episode_steps)
