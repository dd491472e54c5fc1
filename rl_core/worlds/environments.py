"""How any environment is opened and played, one step at a time.

A world is a compiled task (`rl_core.worlds.tasks`) or any Gymnasium environment. Both have the same
two verbs: `world.reset()` begins an episode in Python, and `step(world.stepper, action, following)`
goes on. A loop written with `step` is plain Python for every world, and can be compiled where the
stepper is a task's. The compiled tasks are exact twins of Gymnasium's, so that an episode is the
same, bit for bit, whichever way it is played.

What an environment returns is checked here, once, before compiled code sees it.
"""

import math
from collections.abc import Callable, Iterable
from numbers import Real
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numba.extending import overload
from numpy import copyto
from numpy.typing import NDArray

from rl_core.checks import distinct_seeds
from rl_core.kernels.arrays import BYTE, F32
from rl_core.worlds.names import Make, find, make_environment
from rl_core.worlds.tasks import Kernel, Task
from rl_core.worlds.twins import twin

EnvironmentLike = (
    str | Make | Task | gymnasium.Env[Any, Any] | Callable[[], gymnasium.Env[Any, Any]]
)
"""An id, an id with arguments, an import path, a task, an environment, or a function making one."""

_NO_NUMBERS: Any = None


class TaskWorld:
    """A compiled task.

    Parameters
    ----------
    task : rl_core.worlds.tasks.Task
    """

    as_bytes = False

    def __init__(self, task: Task) -> None:
        self.n_observations = task.n_observations
        self.n_actions = task.n_actions
        self.action_dimensions = task.action_dimensions
        self.max_episode_steps = task.max_episode_steps
        self.stepper = task.kernel()
        self._task = task
        self._rng = np.random.default_rng(0)

    def seed(self, environment_seed: int) -> None:
        """Start the environment's stream, the one Gymnasium makes of this seed."""
        self._rng = np.random.default_rng(environment_seed)

    def reset(self) -> F32:
        """Begin an episode; return its first observation."""
        observation = np.empty(self.n_observations, np.float32)
        self._task.start(self._rng, self.stepper.state, observation)
        return observation

    def close(self) -> None:
        """Nothing to release."""


class GymnasiumWorld:
    """Any Gymnasium environment with Box observations and Discrete or Box actions.

    Its time limit, if it has one, ends an episode as truncated. Observations are flattened and cast
    to float32; bytes (pictures) are scaled from 0..255 to 0..1.

    Parameters
    ----------
    environment : gymnasium.Env
    owned : bool
        Whether `close` closes the environment.

    Raises
    ------
    ValueError
        If observations are no Box, or actions neither Discrete nor Box.
    """

    def __init__(self, environment: gymnasium.Env[Any, Any], owned: bool) -> None:
        observations, actions = environment.observation_space, environment.action_space
        if not isinstance(observations, spaces.Box):
            raise ValueError(f"env must have a Box observation space, got {observations}")
        if not isinstance(actions, spaces.Discrete | spaces.Box):
            raise ValueError(f"env must have a Discrete or a Box action space, got {actions}")
        self.n_observations = math.prod(observations.shape)
        self.as_bytes = observations.dtype == np.uint8
        self.n_actions = int(actions.n) if isinstance(actions, spaces.Discrete) else 0
        self.action_dimensions = math.prod(actions.shape) if isinstance(actions, spaces.Box) else 0
        self.max_episode_steps: int | None = None
        self.stepper = self
        self._environment = environment
        self._space, self._actions = observations, actions
        # What is written as it came; -1: it has to be flattened or scaled first.
        flat = len(observations.shape) == 1 and not self.as_bytes
        self._length = self.n_observations if flat else -1
        self._owned = owned
        self._seed: int | None = None
        self._steps = 0

    def seed(self, environment_seed: int) -> None:
        """Seed the environment at its next reset."""
        self._seed = environment_seed

    def reset(self) -> F32:
        """Begin an episode; return its first observation."""
        observation, _ = self._environment.reset(seed=self._seed)
        self._seed, self._steps = None, 0
        first = np.empty(self.n_observations, np.float32)
        self._write(observation, first)
        return first

    def step(self, action: F32, following: F32) -> tuple[float, bool, bool]:
        """Take one step; see `step`."""
        self._steps += 1
        native = native_action(self._actions, action)
        seen, reward, terminated, truncated, _ = self._environment.step(native)
        try:  # the quick way: numpy refuses other shapes, but for one number, and what is no number
            copyto(following, seen if len(seen) == self._length else _NO_NUMBERS)
        except (RuntimeError, TypeError, ValueError):
            self._write(seen, following)
        if type(reward) is not float:  # numpy's float64 is one, too
            reward = float(reward) if isinstance(reward, float) else checked_reward(self, reward)
        return reward, bool(terminated), bool(truncated)

    def _write(self, seen: Any, numbers: F32) -> None:
        """Write what is seen, if it is what its space says: compiled code relies on its size."""
        numbers[:] = observed(self._space, seen, self).ravel()
        if self.as_bytes:
            numbers *= BYTE

    def __str__(self) -> str:
        name = self._environment.spec.id if self._environment.spec else self._environment
        return f"{name}, at step {self._steps} of an episode"

    def close(self) -> None:
        """Close the environment if it was made here."""
        if self._owned:
            self._environment.close()


World = TaskWorld | GymnasiumWorld


def native_action(space: spaces.Space[Any], action: F32) -> Any:
    """Return an action of a Discrete or a Box space as Gymnasium's environments take it.

    Examples
    --------
    >>> import numpy as np
    >>> from gymnasium import spaces
    >>> from rl_core.worlds.environments import native_action
    >>> native_action(spaces.Discrete(3, start=-1), np.array([2], np.float32))
    1
    """
    if isinstance(space, spaces.Discrete):
        return int(action[0]) + int(space.start)
    return action.astype(space.dtype).reshape(space.shape)


def observed(space: spaces.Space[Any], seen: Any, env: object) -> NDArray[Any]:
    """Return what was seen of an environment, of which errors tell, as an array.

    Compiled code relies on its size.

    Raises
    ------
    ValueError
        It is not made of numbers, or its shape is not that of the space.

    Examples
    --------
    >>> from gymnasium import spaces
    >>> from rl_core.worlds.environments import observed
    >>> observed(spaces.Box(0, 9, (2,)), [1, 2], "Pond-v0")
    array([1, 2])
    """
    try:
        array = np.asarray(seen)
    except (RuntimeError, TypeError, ValueError):  # ragged, or what its own code raises
        array = np.asarray(None)
    if array.shape != space.shape or array.dtype.kind not in "fiub":
        raise ValueError(
            f"env must keep to its observation space {space}, from {env}, came an observation of "
            f"shape {array.shape} and type {array.dtype}"
        )
    return array


def checked_reward(env: object, reward: Any) -> float:
    """Return a reward from an environment, of which errors tell, as a float if it is one number.

    Raises
    ------
    ValueError
        It is not.

    Examples
    --------
    >>> import gymnasium
    >>> import numpy as np
    >>> from rl_core.worlds.environments import checked_reward
    >>> checked_reward(gymnasium.make("FrozenLake-v1"), np.array([1]))
    1.0
    """
    single = isinstance(reward, np.ndarray) and reward.size == 1
    number = reward.item() if single or isinstance(reward, np.generic) else reward
    try:
        if isinstance(number, Real):
            return float(number)
    except OverflowError:  # an integer that no float holds
        pass
    raise ValueError(f"env must pay a number as reward, from {env}, came {reward!r}")


def step(stepper: Kernel | GymnasiumWorld, action: F32, following: F32) -> tuple[float, bool, bool]:
    """Take one step of a world.

    Parameters
    ----------
    stepper : Kernel or GymnasiumWorld
        `world.stepper`; changed in place.
    action : float32 array of shape (action_width,)
        The index of a discrete action, counted from 0, or a continuous one as drawn.
    following : float32 array of shape (n_observations,)
        The next observation is written here.

    Returns
    -------
    reward : float
    terminated, truncated : bool

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.worlds.environments import open_world, step
    >>> world = open_world("MountainCar-v0")
    >>> world.seed(0)
    >>> following = world.reset()
    >>> step(world.stepper, np.array([2], np.float32), following)
    (-1.0, False, False)
    """
    if isinstance(stepper, Kernel):
        return _step_task(stepper, action, following)
    return stepper.step(action, following)


def _step_task(stepper: Kernel, action: F32, following: F32) -> tuple[float, bool, bool]:
    reward, terminated = stepper.step(stepper.state, action)
    stepper.observe(stepper.state, following)
    return reward, terminated, False


overload(step, inline="always", strict=False)(lambda stepper, action, following: _step_task)


def open_world(env: EnvironmentLike) -> World:
    """Open an environment to be played.

    Parameters
    ----------
    env : str, Make, Task, gymnasium.Env or callable
        The ids in `rl_core.worlds.twins.TASKS` are played compiled, with the time limit that the
        task declares. Any other id is made by Gymnasium, with the limit it is registered with, and
        so is an id with arguments (`Make`). An import path "module:name" leads to a task, or to a
        function or class that makes an environment. An environment is taken as it is.

    Returns
    -------
    TaskWorld or GymnasiumWorld

    Raises
    ------
    ValueError
        If there is no such environment, or the spaces are of another kind.
    TypeError
        If `env` is none of these.

    Examples
    --------
    >>> from rl_core.worlds.environments import open_world
    >>> open_world("Acrobot-v1").n_actions
    3
    """
    task = task_of(env)
    if task is not None:
        return TaskWorld(task)
    made = opened(env)
    try:
        return GymnasiumWorld(made, owned=made is not env)
    except ValueError:
        if made is not env:
            made.close()
        raise


def task_of(env: object) -> Task | None:
    """Return the compiled task that `env` is or names, if there is one.

    Examples
    --------
    >>> from rl_core.worlds.environments import task_of
    >>> task_of("FrozenLake-v1") is None
    True
    """
    found = (twin(env) or find(env)) if isinstance(env, str) else env
    return found if isinstance(found, Task) else None


def opened(env: Any) -> gymnasium.Env[Any, Any]:
    """Return an environment: itself, what a function makes, or what its name stands for.

    Raises
    ------
    TypeError, ValueError
        As `open_world`.

    Examples
    --------
    >>> from rl_core.worlds.environments import opened
    >>> opened("FrozenLake-v1").observation_space
    Discrete(16)
    """
    if isinstance(env, str | Make):
        return make_environment(env)
    made = env
    if callable(env) and not isinstance(env, gymnasium.Env):
        try:
            made = env()
        except TypeError as error:
            raise TypeError(
                f"env must be a function without arguments, got {env!r}: {error}"
            ) from (error)
    allowed = "a Gymnasium id, an import path, a task, an environment or a function that makes one"
    if not isinstance(made, gymnasium.Env):
        raise TypeError(f"env must be {allowed}, got {env!r}")
    return made


def one_seed_of(env: object, seeds: Iterable[int]) -> tuple[int, ...]:
    """Return the seeds, unless there are several and the environment is ready made.

    What an environment or its wrappers remember would go from one seed to the next, and the seeds
    would share it.

    Raises
    ------
    ValueError
        With what to give instead.

    Examples
    --------
    >>> import gymnasium
    >>> from rl_core.worlds.environments import one_seed_of
    >>> one_seed_of(gymnasium.make("CartPole-v1"), [0, 1])
    Traceback (most recent call last):
    ValueError: env must be an id or a function that makes an environment where there are several...
    """
    found = distinct_seeds(seeds)
    if isinstance(env, gymnasium.Env) and len(found) > 1:
        raise ValueError(
            "env must be an id or a function that makes an environment where there are several "
            f"seeds, which would share what one environment remembers, got {env!r}"
        )
    return found
