"""A shaping of MountainCar's reward that cannot change which policy is best.

In a file of its own: what is learned with it is stored under a digest of this file.
"""

import numpy as np
from numpy.typing import NDArray

GAMMA = 0.99  # the discount it goes with


def potential(observation: NDArray[np.float32], reward: float) -> float:
    """Return r + gamma Phi(s') - Phi(s) with Phi(s) = |x + 0.5|, and Phi = 0 where the car arrives.

    A reward that changes by a difference of potentials leaves the best policy what it was (Ng,
    Harada and Russell 1999). A shaping is not told s; but the car moves by its new velocity,
    x' = x + v', so that x = x' - v'. Only where it hits the wall on the left, which takes its
    velocity, that x is off, by less than 0.07.

    Examples
    --------
    >>> round(potential(np.array([0.2, 0.05], np.float32), -1.0), 4)  # -1 + 0.99 * 0.7 - 0.65
    -0.957
    >>> round(potential(np.array([0.52, 0.04], np.float32), -1.0), 4)  # -1 - 0.98
    -1.98
    """
    x, v = float(observation[0]), float(observation[1])
    after = 0.0 if x >= 0.5 and v >= 0.0 else abs(x + 0.5)
    return reward + GAMMA * after - abs(x - v + 0.5)
