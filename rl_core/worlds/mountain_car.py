"""MountainCar: an engine too weak for the hill; the car has to swing up to the flag."""

import math

import numpy as np
from gymnasium import spaces

from rl_core.worlds.tasks import Action, Observation, State, clip, task

MIN_POSITION, MAX_POSITION, MAX_SPEED = -1.2, 0.6, 0.07
SLOPE = 0.0025
OBSERVATIONS = spaces.Box(
    np.array([MIN_POSITION, -MAX_SPEED], np.float32),
    np.array([MAX_POSITION, MAX_SPEED], np.float32),
)
"""What is the same where the force is continuous; see `rl_core.worlds.mountain_car_continuous`."""

_GOAL = 0.5
_PUSH = 0.001


@task(
    n_state=2,
    observation_space=OBSERVATIONS,
    action_space=spaces.Discrete(3),
    max_episode_steps=None,
)
class MountainCar:
    """Gymnasium's MountainCar-v0, without its time limit.

        v <- clip(v + 0.001 (a - 1) - 0.0025 cos(3 x), -0.07, 0.07),    x <- clip(x + v, -1.2, 0.6)

    State and observation: position x, drawn from [-0.6, -0.4], and velocity v, 0 at the start and
    after hitting the wall on the left. Reward: -1 a step. The episode ends at x >= 0.5.

    Sources: Gymnasium, `MountainCarEnv`; A. W. Moore (1990), Efficient memory-based learning for
    robot control; R. S. Sutton and A. G. Barto, Reinforcement Learning: An Introduction (2018),
    example 10.1.
    """

    @staticmethod
    def start(rng: np.random.Generator, state: State, observation: Observation) -> None:
        """Draw the position; the car stands."""
        state[0], state[1] = rng.uniform(-0.6, -0.4), 0.0
        observation[0], observation[1] = state[0], state[1]

    @staticmethod
    def step(state: State, action: Action) -> tuple[float, bool]:
        """Push to the left, not at all, or to the right: action 0, 1 or 2."""
        push = np.float64(action[0]) - 1.0
        position, velocity = state[0], state[1]
        velocity += push * _PUSH + math.cos(3.0 * position) * (-SLOPE)
        velocity = clip(velocity, -MAX_SPEED, MAX_SPEED)
        position = clip(position + velocity, MIN_POSITION, MAX_POSITION)
        if position == MIN_POSITION and velocity < 0.0:
            velocity = 0.0
        state[0], state[1] = position, velocity
        return -1.0, position >= _GOAL and velocity >= 0.0

    @staticmethod
    def observe(state: State, observation: Observation) -> None:
        """Observe the whole state."""
        observation[0], observation[1] = state[0], state[1]
