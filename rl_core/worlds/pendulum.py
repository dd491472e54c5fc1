"""Pendulum: swing a pendulum up with a torque too weak to lift it, and hold it there."""

import math

import numpy as np
from gymnasium import spaces
from numba.extending import register_jitable

from rl_core.worlds.tasks import Action, Observation, State, clip, task

_MAX_SPEED = 8.0
_MAX_TORQUE = 2.0
_TIME_STEP = 0.05
_TURN = 2 * math.pi

_HIGH = np.array([1.0, 1.0, _MAX_SPEED], np.float32)


@register_jitable
def _observe(state: State, observation: Observation) -> None:
    observation[0] = math.cos(state[0])
    observation[1] = math.sin(state[0])
    observation[2] = state[1]


@task(
    n_state=2,
    observation_space=spaces.Box(-_HIGH, _HIGH),
    action_space=spaces.Box(-_MAX_TORQUE, _MAX_TORQUE, (1,)),
    max_episode_steps=200,
)
class Pendulum:
    """Gymnasium's Pendulum-v1.

        w <- clip(w + 0.05 (15 sin q + 3 u), -8, 8),    q <- q + 0.05 w,    u = clip(a, -2, 2)

    State: angle q (rad, 0 is upright), drawn from [-pi, pi], and angular velocity w (rad/s), from
    [-1, 1]. Observation: cos q, sin q, w. Reward, of the state before the step, with q in
    [-pi, pi): -(q^2 + 0.1 w^2 + 0.001 u^2). An episode ends at its time limit only.

    Source: Gymnasium, `PendulumEnv`.
    """

    @staticmethod
    def start(rng: np.random.Generator, state: State, observation: Observation) -> None:
        """Draw angle and velocity."""
        state[0], state[1] = rng.uniform(-math.pi, math.pi), rng.uniform(-1.0, 1.0)
        _observe(state, observation)

    @staticmethod
    def step(state: State, action: Action) -> tuple[float, bool]:
        """Apply a torque, which, like what is computed of it alone, has single precision."""
        angle, velocity = state[0], state[1]
        torque = np.float32(clip(np.float64(action[0]), -_MAX_TORQUE, _MAX_TORQUE))
        # numpy squares by pow(x, 2), which in single precision does not always round like x * x;
        # a constant 2 would be compiled to x * x.
        two = np.float32(2.0) + np.float32(0.0) * torque
        effort = np.float32(0.001) * np.float32(math.pow(torque, two))
        folded = (angle + math.pi) % _TURN - math.pi
        cost = math.pow(folded, np.float64(two)) + 0.1 * math.pow(velocity, np.float64(two))
        cost += np.float64(effort)
        push = np.float64(np.float32(3.0) * torque)
        velocity = velocity + (15.0 * math.sin(angle) + push) * _TIME_STEP
        state[1] = clip(velocity, -_MAX_SPEED, _MAX_SPEED)
        state[0] = angle + state[1] * _TIME_STEP
        return -cost, False

    observe = staticmethod(_observe)
