"""CartPole: balance a pole on a cart by pushing the cart."""

import math

import numpy as np
from gymnasium import spaces

from rl_core.worlds.tasks import Action, Observation, State, task

_GRAVITY = 9.8
_POLE_MASS = 0.1
_MASS = 0.1 + 1.0  # pole and cart
_HALF_LENGTH = 0.5
_POLE_MOMENT = 0.1 * 0.5  # mass times half length
_FORCE = 10.0
_TIME_STEP = 0.02
_MAX_ANGLE = 12 * 2 * math.pi / 360
_MAX_POSITION = 2.4

_HIGH = np.array([2 * _MAX_POSITION, np.inf, 2 * _MAX_ANGLE, np.inf], np.float32)


@task(
    n_state=4,
    observation_space=spaces.Box(-_HIGH, _HIGH),
    action_space=spaces.Discrete(2),
    max_episode_steps=500,
)
class CartPole:
    """Gymnasium's CartPole-v1.

        u = (F + m l w^2 sin q) / M,    F = +-10 N,    m = 0.1 kg,    M = 1.1 kg,    l = 0.5 m
        dw/dt = (g sin q - u cos q) / (l (4/3 - m cos^2 q / M)),    dv/dt = u - m l dw/dt cos q / M

    State and observation: position x (m) and velocity v (m/s) of the cart, angle q (rad, 0 is
    upright) and angular velocity w (rad/s) of the pole, all drawn from [-0.05, 0.05]. A step is
    Euler's over 0.02 s. Action 0 pushes to the left, 1 to the right. Reward: 1 a step, also for the
    last, which leaves |x| <= 2.4 m or |q| <= 12 degrees.

    Sources: Gymnasium, `CartPoleEnv`; A. G. Barto, R. S. Sutton and C. W. Anderson (1983),
    Neuronlike adaptive elements that can solve difficult learning control problems; R. V. Florian
    (2007), Correct equations for the dynamics of the cart-pole system.
    """

    @staticmethod
    def start(rng: np.random.Generator, state: State, observation: Observation) -> None:
        """Draw the whole state."""
        for i in range(4):
            state[i] = rng.uniform(-0.05, 0.05)
        observation[:] = state

    @staticmethod
    def step(state: State, action: Action) -> tuple[float, bool]:
        """Push to the left or to the right."""
        position, velocity, angle, turning = state[0], state[1], state[2], state[3]
        force = _FORCE if action[0] == 1.0 else -_FORCE
        cosine, sine = math.cos(angle), math.sin(angle)
        pushed = (force + _POLE_MOMENT * (turning * turning) * sine) / _MASS
        inertia = _HALF_LENGTH * (4.0 / 3.0 - _POLE_MASS * (cosine * cosine) / _MASS)
        turning_change = (_GRAVITY * sine - cosine * pushed) / inertia
        velocity_change = pushed - _POLE_MOMENT * turning_change * cosine / _MASS
        state[0] = position + _TIME_STEP * velocity
        state[1] = velocity + _TIME_STEP * velocity_change
        state[2] = angle + _TIME_STEP * turning
        state[3] = turning + _TIME_STEP * turning_change
        fallen = state[2] < -_MAX_ANGLE or state[2] > _MAX_ANGLE
        return 1.0, fallen or state[0] < -_MAX_POSITION or state[0] > _MAX_POSITION

    @staticmethod
    def observe(state: State, observation: Observation) -> None:
        """Observe the whole state."""
        for i in range(4):
            observation[i] = state[i]
