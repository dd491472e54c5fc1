"""A shaping of CartPole's rewards, to try DQN with."""

from rl_core.kernels.arrays import F32


def balance(observation: F32, reward: float) -> float:
    """CartPole: r = (1 - |x| / 2.4 - 2 |theta|) / 20, most for an upright pole in the middle.

    An episode ends when x (metres) leaves [-2.4, 2.4] or theta (radians) leaves [-0.21, 0.21]. The
    factor keeps the values near 1, where a network begins.
    """
    return (reward - abs(float(observation[0])) / 2.4 - 2 * abs(float(observation[2]))) / 20
