"""Reward shaping: what an agent learns from, in place of what the environment pays.

A shaping is a function `f(observation, reward) -> float` of the next observation (a float32 vector)
and the environment's reward. It stands at the top of a module, is named in a config, and is
compiled, so that it runs inside the compiled loop and gives the same bits in the plain one.

`tip_height` and `distance_from_start` are the report's (section 3.2). Neither is a difference of
potentials, so the best policy under them need not be the best under the original rewards (Ng,
Harada and Russell 1999, Policy invariance under reward transformations).
"""

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numba
import numpy as np
from numba import types

from rl_core.identity import code_behind, imported
from rl_core.kernels.arrays import F32
from rl_core.kernels.compiled import compiled
from rl_core.worlds.tasks import _FirstClass

ORIGINAL = "rl_core.worlds.shaping:original"
"""The environment's own reward."""

_SIGNATURE = types.float64(types.Array(types.float32, 1, "C"), types.float64)


def original(observation: F32, reward: float) -> float:
    """The environment's own reward."""
    return reward


def tip_height(observation: F32, reward: float) -> float:
    """Acrobot: r = -(cos theta1 + cos(theta1 + theta2)), the height of the tip above the pivot.

    From -2 (hanging) to 2 (upright); the goal is above 1. An observation holds the cosines and
    sines of both angles: cos(theta1 + theta2) = cos cos - sin sin.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.worlds.shaping import tip_height
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
    >>> from rl_core.worlds.shaping import distance_from_start
    >>> distance_from_start(np.array([-0.75, 0.03], np.float32), -1.0)
    0.25
    """
    return abs(float(observation[0]) + 0.5)


def balance(observation: F32, reward: float) -> float:
    """CartPole: r = (1 - |x| / 2.4 - 2 |theta|) / 20, most for an upright pole in the middle.

    An episode ends when x (metres) leaves [-2.4, 2.4] or theta (radians) leaves [-0.21, 0.21]. The
    factor keeps the values near 1, where a network begins.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.worlds.shaping import balance
    >>> round(balance(np.array([-0.6, 3, 0.1, 5], np.float32), 1.0), 6)  # (1 - 1/4 - 1/5) / 20
    0.0275
    """
    return (reward - abs(float(observation[0])) / 2.4 - 2 * abs(float(observation[2]))) / 20


@dataclass(frozen=True)
class Shaping:
    """A shaping by name, as a config holds it.

    Attributes
    ----------
    function : str
        Where the function is: "module:name".
    code : str
        Digest of the module's source, so that an edited function counts as another one.

    Raises
    ------
    ValueError
        There is no such function, or it cannot be compiled as `f(observation, reward) -> float`.

    Examples
    --------
    >>> from rl_core.worlds.shaping import Shaping
    >>> Shaping("rl_core.worlds.shaping:tip_height").function
    'rl_core.worlds.shaping:tip_height'
    """

    function: str
    code: str = field(init=False, repr=False)

    def __post_init__(self) -> None:
        imported("function", self.function)
        try:
            compiled_shape(self.function)
        except (AttributeError, TypeError, ValueError, numba.NumbaError) as error:
            reason = str(error).strip().splitlines()[0] if str(error).strip() else "no reason given"
            raise ValueError(
                "function must be an import path of f(observation, reward) -> float that numba "
                f"compiles, got {self.function!r} ({reason})"
            ) from error
        object.__setattr__(self, "code", code_behind(self.function))


@cache
def compiled_shape(function: str) -> Any:
    """Compile the function at "module:name" to what compiled code can call.

    Every shape has the same type, so that no kernel has to be compiled anew for another one. An
    index beyond the observation is an IndexError, which reaches the caller of the loop.
    """
    options = {"nopython": True, "nogil": True, "error_model": "numpy", "boundscheck": True}
    shape: Any = _FirstClass(imported("shaping", function), targetoptions=options)
    shape.compile_only(_SIGNATURE)
    return shape


def shape_for(shaping: Shaping | None, n_observations: int) -> Any:
    """Return a compiled shape if it is for observations of this length; the original for None.

    Raises
    ------
    ValueError
        It looks for more numbers than there are.

    Examples
    --------
    >>> from rl_core.worlds.shaping import Shaping, shape_for
    >>> shape_for(Shaping("rl_core.worlds.shaping:tip_height"), 2)
    Traceback (most recent call last):
    ValueError: shaping must be a function of observations of 2 numbers, got 'rl_core.worlds.shap...
    """
    function = ORIGINAL if shaping is None else shaping.function
    shape = compiled_shape(function)
    try:
        shape(np.zeros(n_observations, np.float32), 0.0)
    except IndexError as error:
        allowed = f"a function of observations of {n_observations} numbers"
        raise ValueError(f"shaping must be {allowed}, got {function!r} ({error})") from None
    return shape


@compiled
def shaped_reward(shape: Any, observation: F32, reward: float) -> float:
    """Return what a compiled shape makes of a reward and the observation that came with it.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.worlds.shaping import compiled_shape, shaped_reward
    >>> shape = compiled_shape("rl_core.worlds.shaping:tip_height")
    >>> shaped_reward(shape, np.array([1, 0, 1, 0, 0, 0], np.float32), -1.0)
    -2.0
    """
    return float(shape(observation, reward))
