"""The report's shaped rewards (section 3.2), which its DQN learns from.

Neither is a difference of potentials.
"""

from rl_core.kernels.arrays import F32


def tip_height(observation: F32, reward: float) -> float:
    """Acrobot: r = -(cos theta1 + cos(theta1 + theta2)), the height of the tip above the pivot.

    From -2 (hanging) to 2 (upright); the goal is above 1. An observation holds the cosines and
    sines of both angles: cos(theta1 + theta2) = cos cos - sin sin.

    Examples
    --------
    >>> import numpy as np
    >>> from studies.rewards import tip_height
    >>> hanging, bent = [1, 0, 1, 0, 0, 0], [0, 1, 0.6, 0.8, 5, 7]  # cosine, sine, cosine, sine
    >>> [tip_height(np.array(o, np.float32), -1.0) for o in (hanging, bent)]
    [-2.0, 0.800000011920929]
    """
    cosine1, sine1 = float(observation[0]), float(observation[1])
    cosine2, sine2 = float(observation[2]), float(observation[3])
    return -(cosine1 + (cosine1 * cosine2 - sine1 * sine2))


def distance_from_start(observation: F32, reward: float) -> float:
    """MountainCar: r = |position - (-0.5)|, the distance from the middle of the starting places.

    From 0 to 1, which is at the flag.

    Examples
    --------
    >>> import numpy as np
    >>> from studies.rewards import distance_from_start
    >>> distance_from_start(np.array([-0.75, 0.03], np.float32), -1.0)
    0.25
    """
    return abs(float(observation[0]) + 0.5)
