"""A user's task: a corridor that is left at its right end."""

import numpy as np
from gymnasium import spaces

from rl_core.worlds.tasks import task

LENGTH = 5


@task(
    n_state=1,
    observation_space=spaces.Box(0.0, 1.0, (1,)),
    action_space=spaces.Discrete(2),
    max_episode_steps=100,
)
class Corridor:
    """Observation: how far along, from 0 to 1. Action 0 goes back, 1 on. Reward: -1 a step."""

    @staticmethod
    def start(rng, state, observation):
        """Draw one of the places of the left half."""
        state[0] = rng.integers(0, LENGTH // 2)
        observation[0] = state[0] / LENGTH

    @staticmethod
    def step(state, action):
        """Go back or on; nobody leaves on the left."""
        if not 0.0 <= action[0] <= 1.0:
            raise ValueError("action must be 0 or 1")
        state[0] = max(state[0] + 2.0 * action[0] - 1.0, 0.0)
        return -1.0, state[0] == LENGTH

    @staticmethod
    def observe(state, observation):
        """See how far along."""
        observation[0] = state[0] / LENGTH


RIGHT, NOWHERE = np.ones(1, np.float32), np.full(1, 7, np.float32)
