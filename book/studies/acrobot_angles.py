"""Acrobot as its state: two angles and two speeds, where Gymnasium shows six numbers.

In a file of its own: what is learned with it is stored under a digest of this file.
"""

import math

import numpy as np
from gymnasium import spaces

from rl_core.worlds.acrobot import Acrobot
from rl_core.worlds.tasks import Observation, State, task

_HIGH = np.array([math.pi, math.pi, 4 * math.pi, 9 * math.pi], np.float32)


@task(
    n_state=4,
    observation_space=spaces.Box(-_HIGH, _HIGH),
    action_space=spaces.Discrete(3),
    max_episode_steps=None,
)
class AcrobotAngles:
    """Gymnasium's Acrobot-v1 that shows theta1, theta2 (rad) and their velocities (rad/s)."""

    @staticmethod
    def start(rng: np.random.Generator, state: State, observation: Observation) -> None:
        """Draw both angles and velocities, as Gymnasium does."""
        for i in range(4):
            state[i] = np.float32(rng.uniform(-0.1, 0.1))
            observation[i] = state[i]

    step = staticmethod(Acrobot.step)

    @staticmethod
    def observe(state: State, observation: Observation) -> None:
        """Show the state."""
        for i in range(4):
            observation[i] = state[i]
