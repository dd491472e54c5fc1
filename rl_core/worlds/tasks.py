"""Compiled tasks: environments that a compiled loop steps through at some ten nanoseconds a step.

A task is a class with three functions, given to the decorator `task`:

    start(rng, state, observation)             draw the start of an episode and write both vectors
    step(state, action) -> reward, terminated  change the state in place
    observe(state, observation)                write what the agent sees of a state

`state` is a float64 vector of the length that the task declares, `observation` a float32 vector,
`action` a float32 vector: the continuous action, or, of length 1, the index of a discrete one.
The functions are compiled when they are first needed; they may call others that are compiled with
`rl_core.kernels.compiled.compiled` or `numba.njit`. Constants of their module are frozen as they
then are.

A loop takes a `Kernel`. Its functions have one type for all tasks, the signatures above, so that a
loop is compiled once and then plays every task, also those that were written after it.
"""

import inspect
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numba.core import cgutils, types
from numba.core.registry import CPUDispatcher
from numba.core.types import boolean, float32, float64, void
from numba.core.types.npytypes import NumPyRandomGeneratorType
from numba.experimental.function_type import FunctionModel
from numba.extending import NativeValue, register_model, typeof_impl, unbox

from rl_core.checks import fields, instance, integer, optional, require
from rl_core.kernels.arrays import F32, F64
from rl_core.kernels.compiled import compiled

State = F64
Observation = F32
Action = F32
Start = Callable[[np.random.Generator, State, Observation], None]
Step = Callable[[State, Action], tuple[float, bool]]
Observe = Callable[[State, Observation], None]

# Without these, numba is not typed.
_parts_of: Any = cgutils.create_struct_proxy
_NativeValue: Any = NativeValue
_OUTCOME = types.Tuple((float64, boolean))  # type: ignore[no-untyped-call]
_SIGNATURES: dict[str, Any] = {
    "start": void(NumPyRandomGeneratorType("npy_rng"), float64[::1], float32[::1]),
    "step": _OUTCOME(float64[::1], float32[::1]),
    "observe": void(float64[::1], float32[::1]),
}
_ARGUMENTS = {
    "start": "(rng, state, observation)",
    "step": "(state, action) that returns (reward, terminated)",
    "observe": "(state, observation)",
}


class Kernel(NamedTuple):
    """A task as compiled loops take it: the three functions, compiled, and a state of its own.

    Called from Python, the functions run compiled too. What they raise reaches the caller of the
    loop; an index beyond one of their vectors is an IndexError. Division by zero follows IEEE 754.

    Examples
    --------
    >>> import numba
    >>> import numpy as np
    >>> from rl_core.worlds.cartpole import CartPole
    >>> @numba.njit
    ... def count_steps(kernel, rng, observation, action):
    ...     kernel.start(rng, kernel.state, observation)
    ...     steps, terminated = 0, False
    ...     while not terminated:
    ...         steps += 1
    ...         reward, terminated = kernel.step(kernel.state, action)
    ...     kernel.observe(kernel.state, observation)
    ...     return steps
    >>> observation, push_left = np.empty(4, np.float32), np.zeros(1, np.float32)
    >>> count_steps(CartPole.kernel(), np.random.default_rng(0), observation, push_left)
    11
    """

    start: Start
    step: Step
    observe: Observe
    state: State


@dataclass(frozen=True, eq=False)
class Task:
    """A task with its spaces and its time limit; made by the decorator `task`.

    Attributes
    ----------
    name, module : str
        The class, and the module it was written in.
    start, step, observe : callable
        The functions as written, not compiled; see the module.
    n_state : int
        Length of the state.
    observation_space : gymnasium.spaces.Box
    action_space : gymnasium.spaces.Discrete or gymnasium.spaces.Box
    max_episode_steps : int or None
        Steps after which an episode is truncated; None for no limit.
    """

    name: str
    module: str
    start: Start
    step: Step
    observe: Observe
    n_state: int
    observation_space: spaces.Box
    action_space: spaces.Discrete[Any] | spaces.Box
    max_episode_steps: int | None

    def __post_init__(self) -> None:
        for name in _SIGNATURES:
            _check_function(name, getattr(self, name))
        fields(
            self,
            n_state=(integer, 1),
            observation_space=(instance, spaces.Box, "a gymnasium.spaces.Box"),
            action_space=(
                instance,
                spaces.Discrete | spaces.Box,
                "a gymnasium.spaces.Discrete or Box",
            ),
            max_episode_steps=(optional, integer, 1),
        )
        first = getattr(self.action_space, "start", 0)
        require(first == 0, "action_space", self.action_space, "Discrete from 0, or a Box")
        for name, length in [
            ("observation_space", self.n_observations),
            ("action_space", self.n_actions or self.action_dimensions),
        ]:
            require(length > 0, name, getattr(self, name), "a space of at least one number")

    @property
    def n_observations(self) -> int:
        """Length of the observation."""
        return math.prod(self.observation_space.shape)

    @property
    def n_actions(self) -> int:
        """Number of discrete actions; 0 where actions are continuous."""
        return int(self.action_space.n) if isinstance(self.action_space, spaces.Discrete) else 0

    @property
    def action_dimensions(self) -> int:
        """Length of a continuous action; 0 where actions are discrete."""
        return (
            math.prod(self.action_space.shape) if isinstance(self.action_space, spaces.Box) else 0
        )

    def kernel(self) -> Kernel:
        """Return the compiled functions, compiled at the first call, and a new state of zeros.

        Raises
        ------
        ValueError
            If numba cannot compile a function for the vectors described in the module.
        """
        compiled_functions = {name: _first_class(name, getattr(self, name)) for name in _SIGNATURES}
        return Kernel(**compiled_functions, state=np.zeros(self.n_state))


def task(
    *,
    n_state: int,
    observation_space: spaces.Box,
    action_space: spaces.Discrete[Any] | spaces.Box,
    max_episode_steps: int | None,
) -> Callable[[type], Task]:
    """Make a task of a class with the static functions `start`, `step` and `observe`.

    Parameters
    ----------
    n_state : int
        Length of the state.
    observation_space : gymnasium.spaces.Box
        Observations are flat float32 vectors, whatever the shape and type of the space.
    action_space : gymnasium.spaces.Discrete or gymnasium.spaces.Box
    max_episode_steps : int or None
        Steps after which an episode is truncated; None for no limit.

    Raises
    ------
    TypeError, ValueError
        If an argument or a function of the class is missing or not as described.

    Examples
    --------
    A walk along the integers that starts at 0 and ends at 3:

    >>> import numpy as np
    >>> from gymnasium import spaces
    >>> from rl_core.worlds.tasks import task
    >>> @task(n_state=1, observation_space=spaces.Box(-np.inf, np.inf, (1,)),
    ...       action_space=spaces.Discrete(2), max_episode_steps=100)
    ... class Walk:
    ...     @staticmethod
    ...     def start(rng, state, observation):
    ...         state[0] = observation[0] = 0.0
    ...     @staticmethod
    ...     def step(state, action):
    ...         state[0] += 1.0 if action[0] == 1.0 else -1.0
    ...         return -1.0, state[0] == 3.0
    ...     @staticmethod
    ...     def observe(state, observation):
    ...         observation[0] = state[0]
    >>> Walk.n_observations, Walk.n_actions
    (1, 2)
    >>> kernel, right = Walk.kernel(), np.ones(1, np.float32)
    >>> [kernel.step(kernel.state, right) for _ in range(3)]
    [(-1.0, False), (-1.0, False), (-1.0, True)]
    """

    def decorate(described: type) -> Task:
        instance("task", described, type, "put on a class")
        functions: dict[str, Any] = {name: getattr(described, name, None) for name in _SIGNATURES}
        return Task(
            name=described.__qualname__,
            module=described.__module__,
            **functions,
            n_state=n_state,
            observation_space=observation_space,
            action_space=action_space,
            max_episode_steps=max_episode_steps,
        )

    return decorate


@compiled
def clip(value: float, low: float, high: float) -> float:
    """Bring a number into [low, high].

    Examples
    --------
    >>> from rl_core.worlds.tasks import clip
    >>> clip(3.0, -1.0, 1.0)
    1.0
    """
    return min(max(value, low), high)


def _check_function(name: str, function: object) -> None:
    allowed = f"a plain function of {_ARGUMENTS[name]}"
    arguments = inspect.signature(instance(name, function, FunctionType, allowed)).parameters
    wanted = len(_SIGNATURES[name].args)
    require(len(arguments) == wanted, name, f"({', '.join(arguments)})", allowed)


class _FirstClassType(types.FunctionType):
    """Numba's type of functions with one signature, which it would ask slowly at every call."""


register_model(_FirstClassType)(FunctionModel)


class _FirstClass(CPUDispatcher):
    """A compiled function whose type is its signature, not itself.

    `numba.cfunc` makes such functions too, but an exception in one of those is printed and lost.
    """

    _numba_type_: Any = None
    address = 0

    def compile_only(self, signature: Any) -> None:
        """Compile for the one signature that there will be."""
        self.compile(signature)
        self.disable_compile()
        result: Any = next(iter(self.overloads.values()))
        self.address = result.library.get_pointer_to_function(result.fndesc.llvm_func_name)
        self._numba_type_ = _FirstClassType(signature)


def _unbox(numba_type: Any, function: Any, c: Any) -> Any:
    """Read where the machine code of a `_FirstClass` is."""
    found = _parts_of(numba_type)(c.context, c.builder)
    address = c.pyapi.object_getattr_string(function, "address")
    found.jit_addr = c.pyapi.long_as_voidptr(address)
    c.pyapi.decref(address)
    found.py_addr = c.builder.bitcast(function, found.py_addr.type)
    return _NativeValue(found._getvalue())


@cache
def _kernel_type() -> Any:
    functions = [_FirstClassType(signature) for signature in _SIGNATURES.values()]
    return types.NamedTuple([*functions, float64[::1]], Kernel)  # type: ignore[no-untyped-call]


unbox(_FirstClassType)(_unbox)  # type: ignore[no-untyped-call]
# All kernels are of one type, which numba would else put together anew at every call.
typeof_impl.register(Kernel, lambda kernel, context: _kernel_type())


@cache
def _first_class(name: str, function: Callable[..., Any]) -> Any:
    signature, file = _SIGNATURES[name], Path(function.__code__.co_filename)
    own = file.is_relative_to(Path(__file__).parents[1])
    options = {"nopython": True, "nogil": True, "error_model": "numpy", "boundscheck": True}
    options["_nrt"] = not own or name == "start"  # others may make arrays; see `uncounted`
    made: Any = _FirstClass(function, targetoptions=options)
    if own:  # others' machine code would be kept under a stamp that does not know their constants
        kept: Any = compiled(function)
        made._cache = kept._cache
    try:
        made.compile_only(signature)
    except Exception as error:  # numba has many
        told = re.sub(r"^Failed in .*?\) ", "", " ".join(str(error).split()))
        reason = re.split(r" (?:During:|File|There are) ", told)[0]
        raise ValueError(
            f"{name} must be a function of {_ARGUMENTS[name]} that numba compiles, "
            f"got {function.__module__}.{function.__qualname__}: {reason}"
        ) from error
    return made
