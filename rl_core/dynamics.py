"""Compiled twins of Gymnasium's Acrobot-v1, MountainCar-v0 and MountainCarContinuous-v0.

A twin does the arithmetic of the Gymnasium class, operation by operation and in the same
precision, so that both give the same observations, rewards and ends of episodes from the same start
and the same actions. Time limits are no part of the dynamics: an episode ends at the goal only.

A twin's state is a float64 vector of length 4 that `step` changes in place:

===============================  ==========================================================
task                             state
===============================  ==========================================================
`ACROBOT`                        theta1, theta2 (rad), their angular velocities (rad/s)
`MOUNTAIN_CAR`                   position, velocity, unused, unused
`MOUNTAIN_CAR_CONTINUOUS`        position, velocity, 1 after the first step (else 0), unused
===============================  ==========================================================

Sources: the classes `AcrobotEnv`, `MountainCarEnv` and `Continuous_MountainCarEnv` of Gymnasium;
R. S. Sutton and A. G. Barto, Reinforcement Learning: An Introduction (2018), example 10.1
(mountain car); R. S. Sutton (1996), Generalization in reinforcement learning (acrobot).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rl_core.kernels.compiled import compiled

ACROBOT = 0
MOUNTAIN_CAR = 1
MOUNTAIN_CAR_CONTINUOUS = 2


@dataclass(frozen=True)
class Task:
    """What a learner has to know of a compiled task.

    Attributes
    ----------
    code : int
        The number by which `step` and `observe` know the task.
    n_observations : int
        Length of the observation vector.
    n_actions : int
        Number of discrete actions; 0 where actions are continuous.
    action_dimensions : int
        Length of a continuous action; 0 where actions are discrete.
    """

    code: int
    n_observations: int
    n_actions: int
    action_dimensions: int


TASKS = {
    "Acrobot-v1": Task(ACROBOT, 6, 3, 0),
    "MountainCar-v0": Task(MOUNTAIN_CAR, 2, 3, 0),
    "MountainCarContinuous-v0": Task(MOUNTAIN_CAR_CONTINUOUS, 2, 0, 1),
}
"""The compiled tasks by their Gymnasium id."""


def reset(code: int, rng: np.random.Generator) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Draw the start of an episode.

    The draws are those of Gymnasium's `reset` when its `np_random` is `rng`. This function runs in
    numpy, not compiled, because Gymnasium takes the first observation of the acrobot from numpy's
    single precision cosine, which no other library rounds alike.

    Parameters
    ----------
    code : int
        `ACROBOT`, `MOUNTAIN_CAR` or `MOUNTAIN_CAR_CONTINUOUS`.
    rng : numpy.random.Generator
        Stream of the environment.

    Returns
    -------
    state : float64 array of shape (4,)
    observation : float32 array of shape (n_observations,)

    Examples
    --------
    >>> state, observation = reset(MOUNTAIN_CAR, np.random.default_rng(0))
    >>> state.round(3), observation.round(3)
    (array([-0.473,  0.   ,  0.   ,  0.   ]), array([-0.473,  0.   ], dtype=float32))
    """
    if code == ACROBOT:
        drawn = rng.uniform(-0.1, 0.1, 4).astype(np.float32)
        angles, velocities = drawn[:2], drawn[2:]
        observation = np.empty(6, np.float32)
        observation[0:4:2] = np.cos(angles)
        observation[1:4:2] = np.sin(angles)
        observation[4:] = velocities
        return drawn.astype(np.float64), observation
    state = np.zeros(4)
    state[0] = rng.uniform(-0.6, -0.4)
    return state, state[:2].astype(np.float32)


@compiled
def step(code: int, state: NDArray[np.float64], action: NDArray[np.float32]) -> tuple[float, bool]:
    """Take one step of a task.

    Parameters
    ----------
    code : int
        `ACROBOT`, `MOUNTAIN_CAR` or `MOUNTAIN_CAR_CONTINUOUS`.
    state : float64 array of shape (4,)
        Changed in place.
    action : float32 array of shape (1,)
        The index of a discrete action, or the force, which the task clips to [-1, 1].

    Returns
    -------
    reward : float
        Acrobot: -1, and 0 on reaching the goal. MountainCar: -1. MountainCarContinuous:
        minus 0.1 times the square of the force before it is clipped, and 100 more at the goal.
    terminated : bool
        Whether the goal is reached.

    Examples
    --------
    >>> state, _ = reset(MOUNTAIN_CAR, np.random.default_rng(0))
    >>> step(MOUNTAIN_CAR, state, np.array([2], np.float32))
    (-1.0, False)
    """
    if code == ACROBOT:
        return _step_acrobot(state, np.float64(action[0]) - 1.0)
    if code == MOUNTAIN_CAR:
        return _step_mountain_car(state, np.float64(action[0]) - 1.0)
    return _step_mountain_car_continuous(state, np.float64(action[0]))


@compiled
def observe(code: int, state: NDArray[np.float64], observation: NDArray[np.float32]) -> None:
    """Write what the agent sees of a state that `step` has reached.

    Examples
    --------
    >>> observation = np.empty(6, np.float32)
    >>> observe(ACROBOT, np.array([0.0, 0.0, 1.0, 2.0]), observation)
    >>> observation
    array([1., 0., 1., 0., 1., 2.], dtype=float32)
    """
    if code == ACROBOT:
        observation[0] = math.cos(state[0])
        observation[1] = math.sin(state[0])
        observation[2] = math.cos(state[1])
        observation[3] = math.sin(state[1])
        observation[4] = state[2]
        observation[5] = state[3]
    else:
        observation[0] = state[0]
        observation[1] = state[1]


@compiled
def _clip(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


# Acrobot: two links of mass 1 and length 1, centres of mass at 0.5, moments of inertia 1, g = 9.8.
# The folded constants below are exact in binary, save the last, which rounds as Gymnasium's does.

_MAX_SPEED_1 = 4 * math.pi
_MAX_SPEED_2 = 9 * math.pi
_TIME_STEP = 0.2
_GRAVITY_1 = 1.5 * 9.8  # (m1 lc1 + m2 l1) g
_GRAVITY_2 = 0.5 * 9.8  # m2 lc2 g


@compiled
def _accelerations(
    theta1: float, theta2: float, omega1: float, omega2: float, torque: float
) -> tuple[float, float]:
    """Angular accelerations of both joints: the equations of the book, not of the 1996 paper."""
    two = 2.0 + 0.0 * torque  # numpy squares by pow(x, 2.0); a constant would be compiled to x * x
    cosine, sine = math.cos(theta2), math.sin(theta2)
    d1 = 0.25 + (1.25 + cosine) + 1.0 + 1.0
    d2 = (0.25 + 0.5 * cosine) + 1.0
    phi2 = _GRAVITY_2 * math.cos(theta1 + theta2 - math.pi / 2.0)
    phi1 = (
        -0.5 * math.pow(omega2, two) * sine
        - omega2 * omega1 * sine
        + _GRAVITY_1 * math.cos(theta1 - math.pi / 2)
        + phi2
    )
    acceleration2 = (torque + d2 / d1 * phi1 - 0.5 * math.pow(omega1, two) * sine - phi2) / (
        0.25 + 1.0 - math.pow(d2, two) / d1
    )
    acceleration1 = -(d2 * acceleration2 + phi1) / d1
    return acceleration1, acceleration2


@compiled
def _wrap(angle: float) -> float:
    """Bring an angle into [-pi, pi] by whole turns."""
    turn = math.pi - -math.pi
    while angle > math.pi:
        angle = angle - turn
    while angle < -math.pi:
        angle = angle + turn
    return angle


@compiled
def _step_acrobot(state: NDArray[np.float64], torque: float) -> tuple[float, bool]:
    """One Runge-Kutta step of fourth order over 0.2 s with constant torque on the second joint."""
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
    state[2] = _clip(omega1 + sixth * (a1 + 2.0 * a2 + 2.0 * a3 + a4), -_MAX_SPEED_1, _MAX_SPEED_1)
    state[3] = _clip(omega2 + sixth * (b1 + 2.0 * b2 + 2.0 * b3 + b4), -_MAX_SPEED_2, _MAX_SPEED_2)
    terminated = -math.cos(state[0]) - math.cos(state[1] + state[0]) > 1.0
    return (0.0 if terminated else -1.0), terminated


_MIN_POSITION, _MAX_POSITION, _MAX_SPEED = -1.2, 0.6, 0.07
_GOAL, _GOAL_CONTINUOUS = 0.5, 0.45
_PUSH, _PUSH_CONTINUOUS, _SLOPE = 0.001, 0.0015, 0.0025


@compiled
def _step_mountain_car(state: NDArray[np.float64], push: float) -> tuple[float, bool]:
    """One step of MountainCar-v0, in double precision; `push` is -1, 0 or 1."""
    position, velocity = state[0], state[1]
    velocity += push * _PUSH + math.cos(3.0 * position) * (-_SLOPE)
    velocity = _clip(velocity, -_MAX_SPEED, _MAX_SPEED)
    position = _clip(position + velocity, _MIN_POSITION, _MAX_POSITION)
    if position == _MIN_POSITION and velocity < 0.0:
        velocity = 0.0
    state[0], state[1] = position, velocity
    return -1.0, position >= _GOAL and velocity >= 0.0


@compiled
def _single(value: float) -> float:
    """Round to single precision. Sums and products of two singles, rounded so, are exact twins."""
    return np.float64(np.float32(value))


@compiled
def _step_mountain_car_continuous(state: NDArray[np.float64], force: float) -> tuple[float, bool]:
    """One step of MountainCarContinuous-v0.

    Gymnasium keeps this state in single precision from the first step on, but in double precision
    before it; an unclipped force is single, a clipped one double. Each result is rounded
    accordingly.
    """
    position, velocity = state[0], state[1]
    started = state[2] == 1.0
    slope = _SLOPE * math.cos(_single(3.0 * position) if started else 3.0 * position)
    if -1.0 <= force <= 1.0:
        change = _single(_single(force * _single(_PUSH_CONTINUOUS)) - _single(slope))
    else:
        change = _clip(force, -1.0, 1.0) * _PUSH_CONTINUOUS - slope
    if started:
        velocity = _single(velocity + _single(change))
        velocity = _clip(velocity, -_single(_MAX_SPEED), _single(_MAX_SPEED))
        position = _single(position + velocity)
        position = _clip(position, _single(_MIN_POSITION), _single(_MAX_POSITION))
        low, goal = _single(_MIN_POSITION), _single(_GOAL_CONTINUOUS)
    else:
        velocity = _clip(velocity + change, -_MAX_SPEED, _MAX_SPEED)
        position = _clip(position + velocity, _MIN_POSITION, _MAX_POSITION)
        low, goal = _MIN_POSITION, _GOAL_CONTINUOUS
    if position == low and velocity < 0.0:
        velocity = 0.0
    terminated = position >= goal and velocity >= 0.0
    state[0], state[1], state[2] = _single(position), _single(velocity), 1.0
    return (100.0 if terminated else 0.0) - force * force * 0.1, terminated
