"""MountainCarContinuous: the car on the hill, with a force that costs fuel."""

import math

import numpy as np
from gymnasium import spaces

from rl_core.kernels.compiled import uncounted
from rl_core.worlds.mountain_car import MAX_POSITION, MAX_SPEED, MIN_POSITION, OBSERVATIONS, SLOPE
from rl_core.worlds.tasks import Action, Observation, State, clip, task

_GOAL = 0.45
_PUSH = 0.0015


@uncounted
def _single(value: float) -> float:
    """Round to single precision. Sums and products of two singles, rounded so, are exact twins."""
    return np.float64(np.float32(value))


@task(
    n_state=3,
    observation_space=OBSERVATIONS,
    action_space=spaces.Box(-1.0, 1.0, (1,)),
    max_episode_steps=None,
)
class MountainCarContinuous:
    """Gymnasium's MountainCarContinuous-v0, without its time limit.

        v <- clip(v + 0.0015 clip(a, -1, 1) - 0.0025 cos(3 x), -0.07, 0.07)
        x <- clip(x + v, -1.2, 0.6)

    State: position x, drawn from [-0.6, -0.4], velocity v, 0 at the start and after hitting the
    wall on the left, and 1 after the first step (else 0). Observation: x and v. Reward: -0.1 a^2,
    of the force before it is clipped, and 100 more at the goal x >= 0.45, where the episode ends.

    Gymnasium keeps this state in single precision from the first step on, but in double precision
    before it; an unclipped force is single, a clipped one double. Each result is rounded
    accordingly.

    Source: Gymnasium, `Continuous_MountainCarEnv`; see also `rl_core.worlds.mountain_car`.
    """

    @staticmethod
    def start(rng: np.random.Generator, state: State, observation: Observation) -> None:
        """Draw the position; the car stands."""
        state[0], state[1], state[2] = rng.uniform(-0.6, -0.4), 0.0, 0.0
        observation[0], observation[1] = state[0], state[1]

    @staticmethod
    def step(state: State, action: Action) -> tuple[float, bool]:
        """Push with a force."""
        force = np.float64(action[0])
        position, velocity = state[0], state[1]
        started = state[2] == 1.0
        slope = SLOPE * math.cos(_single(3.0 * position) if started else 3.0 * position)
        if -1.0 <= force <= 1.0:
            change = _single(_single(force * _single(_PUSH)) - _single(slope))
        else:
            change = clip(force, -1.0, 1.0) * _PUSH - slope
        if started:
            velocity = _single(velocity + _single(change))
            velocity = clip(velocity, -_single(MAX_SPEED), _single(MAX_SPEED))
            position = _single(position + velocity)
            position = clip(position, _single(MIN_POSITION), _single(MAX_POSITION))
            low, goal = _single(MIN_POSITION), _single(_GOAL)
        else:
            velocity = clip(velocity + change, -MAX_SPEED, MAX_SPEED)
            position = clip(position + velocity, MIN_POSITION, MAX_POSITION)
            low, goal = MIN_POSITION, _GOAL
        if position == low and velocity < 0.0:
            velocity = 0.0
        terminated = position >= goal and velocity >= 0.0
        state[0], state[1], state[2] = _single(position), _single(velocity), 1.0
        return (100.0 if terminated else 0.0) - force * force * 0.1, terminated

    @staticmethod
    def observe(state: State, observation: Observation) -> None:
        """Observe position and velocity."""
        observation[0], observation[1] = state[0], state[1]
