"""Acrobot: two links hanging from a pivot; torque on the joint between them shall swing them up."""

import math

import numpy as np
from gymnasium import spaces
from numba.extending import overload

from rl_core.kernels.arrays import F32
from rl_core.kernels.compiled import inlined, uncounted
from rl_core.worlds.tasks import Action, Observation, State, clip, task

# Two links of mass 1 and length 1, centres of mass at 0.5, moments of inertia 1, g = 9.8.
# The folded constants below are exact in binary, save the last, which rounds as Gymnasium's does.

_MAX_SPEED_1 = 4 * math.pi
_MAX_SPEED_2 = 9 * math.pi
_TIME_STEP = 0.2
_GRAVITY_1 = 1.5 * 9.8  # (m1 lc1 + m2 l1) g
_GRAVITY_2 = 0.5 * 9.8  # m2 lc2 g

_HIGH = np.array([1.0, 1.0, 1.0, 1.0, _MAX_SPEED_1, _MAX_SPEED_2], np.float32)


@uncounted
def _in_doubt(x: float, square: float) -> bool:
    """Whether pow(x, 2.0), by which numpy squares, may be another number than x * x.

    The error of x * x is exact (T. J. Dekker 1971). Where it is below 0.487 units in the last
    place, a pow whose own error is below 0.512 units gives x * x. That of glibc is, as its source
    has it: at most 0.511 of its exp, and 2 |log x| 1.5 / 2^15 of its log, if x is not too small.
    """
    scaled = 134217729.0 * x
    high = scaled - (scaled - x)
    low = x - high
    error = ((high * high - square) + 2.0 * high * low) + low * low
    return abs(x) < 1e-4 or square + 1.025 * error != square


@inlined
def _accelerations(
    theta1: float, theta2: float, omega1: float, omega2: float, torque: float
) -> tuple[float, float]:
    """Angular accelerations of both joints: the equations of the book, not of the 1996 paper."""
    cosine, sine = math.cos(theta2), math.sin(theta2)
    d1 = 0.25 + (1.25 + cosine) + 1.0 + 1.0
    d2 = (0.25 + 0.5 * cosine) + 1.0
    square1, square2, square3 = omega1 * omega1, omega2 * omega2, d2 * d2
    if _in_doubt(omega1, square1) or _in_doubt(omega2, square2) or _in_doubt(d2, square3):
        two = 2.0 + 0.0 * torque  # a constant would be compiled to x * x
        square1, square2, square3 = math.pow(omega1, two), math.pow(omega2, two), math.pow(d2, two)
    phi2 = _GRAVITY_2 * math.cos(theta1 + theta2 - math.pi / 2.0)
    phi1 = (
        -0.5 * square2 * sine
        - omega2 * omega1 * sine
        + _GRAVITY_1 * math.cos(theta1 - math.pi / 2)
        + phi2
    )
    acceleration2 = (torque + d2 / d1 * phi1 - 0.5 * square1 * sine - phi2) / (
        0.25 + 1.0 - square3 / d1
    )
    acceleration1 = -(d2 * acceleration2 + phi1) / d1
    return acceleration1, acceleration2


@uncounted
def _wrap(angle: float) -> float:
    """Bring an angle into [-pi, pi] by whole turns."""
    turn = math.pi - -math.pi
    while angle > math.pi:
        angle = angle - turn
    while angle < -math.pi:
        angle = angle + turn
    return angle


def _observe(state: State, observation: Observation) -> None:
    observation[0] = math.cos(state[0])
    observation[1] = math.sin(state[0])
    observation[2] = math.cos(state[1])
    observation[3] = math.sin(state[1])
    observation[4] = state[2]
    observation[5] = state[3]


def _observe_start(state: State, observation: Observation) -> None:
    """Observe with numpy's single precision cosine, as Gymnasium does after `reset`."""
    angles: F32 = state[:2].astype(np.float32)
    observation[0:4:2] = np.cos(angles)
    observation[1:4:2] = np.sin(angles)
    observation[4:] = state[2:]


# No other library rounds like numpy's single precision cosine: compiled code rounds the double one.
overload(_observe_start, strict=False)(lambda state, observation: _observe)


@task(
    n_state=4,
    observation_space=spaces.Box(-_HIGH, _HIGH),
    action_space=spaces.Discrete(3),
    max_episode_steps=None,
)
class Acrobot:
    """Gymnasium's Acrobot-v1, without its time limit.

    State: theta1 (rad, 0 is down), theta2 (rad, relative to the first link), and their velocities
    (rad/s), all drawn from [-0.1, 0.1] in single precision. Action a: torque a - 1 (N m) on the
    second joint. Observation: cos theta1, sin theta1, cos theta2, sin theta2, both velocities.
    Reward: -1, and 0 on reaching the goal -cos(theta1) - cos(theta1 + theta2) > 1.

    The first observation of compiled episodes may differ from Gymnasium's in the last bit of its
    cosines; `Acrobot.start`, in numpy, gives Gymnasium's.

    Sources: Gymnasium, `AcrobotEnv`; R. S. Sutton (1996), Generalization in reinforcement learning;
    R. S. Sutton and A. G. Barto, Reinforcement Learning: An Introduction (1998), section 11.3.
    """

    @staticmethod
    def start(rng: np.random.Generator, state: State, observation: Observation) -> None:
        """Draw both angles and velocities."""
        for i in range(4):
            state[i] = np.float32(rng.uniform(-0.1, 0.1))
        _observe_start(state, observation)

    @staticmethod
    def step(state: State, action: Action) -> tuple[float, bool]:
        """Take one Runge-Kutta step of fourth order over 0.2 s with constant torque."""
        torque = np.float64(action[0]) - 1.0
        half, sixth = _TIME_STEP / 2.0, _TIME_STEP / 6.0
        theta1, theta2, omega1, omega2 = state[0], state[1], state[2], state[3]
        a1, b1 = _accelerations(theta1, theta2, omega1, omega2, torque)
        # Velocities at the second, third and fourth point, and the accelerations there.
        v2, w2 = omega1 + half * a1, omega2 + half * b1
        a2, b2 = _accelerations(theta1 + half * omega1, theta2 + half * omega2, v2, w2, torque)
        v3, w3 = omega1 + half * a2, omega2 + half * b2
        a3, b3 = _accelerations(theta1 + half * v2, theta2 + half * w2, v3, w3, torque)
        v4, w4 = omega1 + _TIME_STEP * a3, omega2 + _TIME_STEP * b3
        a4, b4 = _accelerations(theta1 + _TIME_STEP * v3, theta2 + _TIME_STEP * w3, v4, w4, torque)
        state[0] = _wrap(theta1 + sixth * (omega1 + 2.0 * v2 + 2.0 * v3 + v4))
        state[1] = _wrap(theta2 + sixth * (omega2 + 2.0 * w2 + 2.0 * w3 + w4))
        speed1 = omega1 + sixth * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        speed2 = omega2 + sixth * (b1 + 2.0 * b2 + 2.0 * b3 + b4)
        state[2] = clip(speed1, -_MAX_SPEED_1, _MAX_SPEED_1)
        state[3] = clip(speed2, -_MAX_SPEED_2, _MAX_SPEED_2)
        terminated = -math.cos(state[0]) - math.cos(state[1] + state[0]) > 1.0
        return (0.0 if terminated else -1.0), terminated

    observe = staticmethod(_observe)
