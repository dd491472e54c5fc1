"""Reward shaping: what an agent learns from, in place of what the environment pays.

A shaping is a function `f(observation, reward) -> float` of the next observation (a float32 vector)
and the environment's reward. It stands at the top of a module, is named in a config, and is
compiled, so that it runs inside the compiled loop and gives the same bits in the plain one.

Unless it adds a difference of potentials, the best policy under a shaping need not be the best
under the original rewards (Ng, Harada and Russell 1999, Policy invariance under reward
transformations).
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
    >>> Shaping("rl_core.worlds.shaping:original").function
    'rl_core.worlds.shaping:original'
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
    >>> import numpy as np
    >>> from rl_core.worlds.shaping import shape_for
    >>> shape_for(None, 2)(np.zeros(2, np.float32), -1.0)
    -1.0
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
    >>> from rl_core.worlds.shaping import shape_for, shaped_reward
    >>> shaped_reward(shape_for(None, 6), np.array([1, 0, 1, 0, 0, 0], np.float32), -1.0)
    -1.0
    """
    return float(shape(observation, reward))
