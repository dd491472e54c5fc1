"""Whole episodes: compiled for the known tasks, step by step through Gymnasium for any other.

Both draw actions with the same compiled function from the same stream, and the compiled tasks are
exact twins of Gymnasium's (`rl_core.dynamics`), so that an episode is the same, bit for bit,
whichever way it is played.
"""

import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from rl_core import dynamics, networks
from rl_core.kernels.compiled import compiled
from rl_core.policies import Policy, choose_action, draw_noise, is_integer, require

EnvironmentLike = str | gymnasium.Env[Any, Any] | Callable[[], gymnasium.Env[Any, Any]]
"""A Gymnasium id, an environment, or a function that makes one."""


def checked_seeds(seeds: Iterable[int]) -> tuple[int, ...]:
    """Return the seeds if they are distinct non-negative integers, at least one.

    Raises
    ------
    ValueError
        If they are not.

    Examples
    --------
    >>> checked_seeds(range(3))
    (0, 1, 2)
    """
    require(isinstance(seeds, Iterable), "seeds", seeds, "one or more non-negative integers")
    given = tuple(seeds)
    valid = len(given) > 0 and all(is_integer(seed, 0) for seed in given)
    require(valid, "seeds", given, "one or more non-negative integers")
    require(len(set(given)) == len(given), "seeds", given, "distinct")
    return tuple(int(seed) for seed in given)


def checked_snapshots(snapshots: Iterable[int], episodes: int) -> tuple[int, ...]:
    """Return the episodes after which to keep a copy, if they are integers from 0 to `episodes`.

    Raises
    ------
    ValueError
        If they are not.

    Examples
    --------
    >>> checked_snapshots((n for n in (0, 20)), episodes=20)
    (0, 20)
    """
    allowed = f"integers from 0 to {episodes}"
    require(isinstance(snapshots, Iterable), "snapshots", snapshots, allowed)
    given = tuple(snapshots)
    valid = all(is_integer(episode, 0) and episode <= episodes for episode in given)
    require(valid, "snapshots", given, allowed)
    return tuple(int(episode) for episode in given)


class Streams(NamedTuple):
    """The independent sources of randomness of one seed.

    Attributes
    ----------
    environment_seed : int
        What the first `reset` of the environment is seeded with.
    policy : numpy.random.Generator
        Draws actions.
    network : numpy.random.Generator
        Draws initial weights and the order of the samples in an epoch.
    replay : numpy.random.Generator
        Draws from a replay buffer, where there is one.
    """

    environment_seed: int
    policy: np.random.Generator
    network: np.random.Generator
    replay: np.random.Generator


def spawn_streams(seed: int) -> Streams:
    """Spawn the streams of a seed from one `numpy.random.SeedSequence(seed)`.

    Examples
    --------
    >>> bool(spawn_streams(0).policy.random() == spawn_streams(0).policy.random())
    True
    >>> bool(spawn_streams(0).policy.random() == spawn_streams(1).policy.random())
    False
    """
    environment, *others = np.random.SeedSequence(seed).spawn(4)
    policy, network, replay = (np.random.default_rng(sequence) for sequence in others)
    return Streams(int(environment.generate_state(1)[0]), policy, network, replay)


class Trajectory:
    """Room for one episode, used again for the next and enlarged when an episode needs more.

    Attributes
    ----------
    observations : float32 array of shape (capacity + 1, n_observations)
    actions : float32 array of shape (capacity, action_width)
    rewards : float64 array of shape (capacity,)
    """

    def __init__(self, n_observations: int, action_width: int, capacity: int = 4096) -> None:
        self.observations = np.empty((capacity + 1, n_observations), np.float32)
        self.actions = np.empty((capacity, action_width), np.float32)
        self.rewards = np.empty(capacity)

    @property
    def capacity(self) -> int:
        """Steps that fit."""
        return len(self.rewards)

    def first(
        self, steps: int
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64]]:
        """Observations, actions and rewards of the first steps: views."""
        return self.observations[:steps], self.actions[:steps], self.rewards[:steps]

    def grow(self) -> None:
        """Double the room and keep what it holds."""
        larger = Trajectory(
            self.observations.shape[1], self.actions.shape[1], capacity=2 * self.capacity
        )
        larger.observations[: self.capacity + 1] = self.observations
        larger.actions[: self.capacity] = self.actions
        larger.rewards[: self.capacity] = self.rewards
        self.observations, self.actions = larger.observations, larger.actions
        self.rewards = larger.rewards


@compiled
def _play(
    code: int,
    state: NDArray[np.float64],
    policy: Policy,
    parameters: NDArray[np.float32],
    rng: np.random.Generator,
    observations: NDArray[np.float32],
    actions: NDArray[np.float32],
    rewards: NDArray[np.float64],
    start: int,
    stop: int,
) -> tuple[int, bool]:
    """Play steps `start` to `stop` of an episode of a compiled task, or up to its end."""
    units = np.empty(policy.sizes.sum(), np.float32)
    noise = np.empty(policy.action_width)
    for t in range(start, stop):
        draw_noise(policy, rng, noise)
        choose_action(policy, parameters, observations[t], noise, units, actions[t])
        rewards[t], terminated = dynamics.step(code, state, actions[t])
        dynamics.observe(code, state, observations[t + 1])
        if terminated:
            return t + 1, True
    return stop, False


class CompiledEnvironment:
    """A compiled task as an environment that plays whole episodes, without time limit.

    Parameters
    ----------
    task : rl_core.dynamics.Task
    """

    def __init__(self, task: dynamics.Task) -> None:
        self.n_observations = task.n_observations
        self.n_actions = task.n_actions
        self.action_dimensions = task.action_dimensions
        self._code = task.code
        self._rng = np.random.default_rng(0)

    def seed(self, environment_seed: int) -> None:
        """Start the environment's stream, the one Gymnasium makes of this seed."""
        self._rng = np.random.default_rng(environment_seed)

    def play(
        self,
        policy: Policy,
        parameters: NDArray[np.float32],
        rng: np.random.Generator,
        max_steps: int,
        trajectory: Trajectory,
    ) -> tuple[int, bool]:
        """Play one episode; see `GymnasiumEnvironment.play`."""
        state, trajectory.observations[0] = dynamics.reset(self._code, self._rng)
        steps, terminated = 0, False
        while True:
            steps, terminated = _play(
                self._code,
                state,
                policy,
                parameters,
                rng,
                trajectory.observations,
                trajectory.actions,
                trajectory.rewards,
                steps,
                min(max_steps, trajectory.capacity),
            )
            if terminated or steps == max_steps:
                return steps, terminated
            trajectory.grow()

    def close(self) -> None:
        """Nothing to release."""


class GymnasiumEnvironment:
    """Any Gymnasium environment with Box observations, played step by step.

    Its time limit, if it has one, ends an episode as truncated. Observations are flattened and cast
    to float32.

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
        self.n_actions = int(actions.n) if isinstance(actions, spaces.Discrete) else 0
        self.action_dimensions = math.prod(actions.shape) if isinstance(actions, spaces.Box) else 0
        self._environment = environment
        self._actions = actions
        self._owned = owned
        self._seed: int | None = None

    def seed(self, environment_seed: int) -> None:
        """Seed the environment at its next reset."""
        self._seed = environment_seed

    def play(
        self,
        policy: Policy,
        parameters: NDArray[np.float32],
        rng: np.random.Generator,
        max_steps: int,
        trajectory: Trajectory,
    ) -> tuple[int, bool]:
        """Play one episode into `trajectory`.

        Parameters
        ----------
        policy : Policy
        parameters : float32 array of shape (P,)
        rng : numpy.random.Generator
            Stream of the policy.
        max_steps : int
            Where to stop an episode that has not ended.
        trajectory : Trajectory
            Its first `steps` rows are written, and the last observation after them.

        Returns
        -------
        steps : int
        terminated : bool
            False if the episode was stopped by `max_steps` or truncated by the environment.
        """
        units = np.empty(policy.sizes.sum(), np.float32)
        draw = rng.standard_normal if policy.gaussian else rng.random
        observation, _ = self._environment.reset(seed=self._seed)
        self._seed = None
        trajectory.observations[0] = np.ravel(observation)
        for t in range(max_steps):
            if t == trajectory.capacity:
                trajectory.grow()
            action = trajectory.actions[t]
            # Drawn in numpy, because a generator takes long to hand to compiled code.
            noise = draw(policy.action_width)
            choose_action(policy, parameters, trajectory.observations[t], noise, units, action)
            observation, reward, terminated, truncated, _ = self._environment.step(
                self._native(action)
            )
            trajectory.rewards[t] = reward
            trajectory.observations[t + 1] = np.ravel(observation)
            if terminated or truncated:
                return t + 1, bool(terminated)
        return max_steps, False

    def _native(self, action: NDArray[np.float32]) -> Any:
        """Give an action the form the environment takes."""
        if isinstance(self._actions, spaces.Discrete):
            return int(action[0]) + int(self._actions.start)
        return action.astype(self._actions.dtype).reshape(self._actions.shape)

    def close(self) -> None:
        """Close the environment if it was made here."""
        if self._owned:
            self._environment.close()


Environment = CompiledEnvironment | GymnasiumEnvironment


def make_environment(env: str) -> gymnasium.Env[Any, Any]:
    """Make an environment by its id, with the time limit it is registered with.

    Raises
    ------
    ValueError
        If Gymnasium does not know the id, or the module it names cannot be imported.

    Examples
    --------
    >>> make_environment("nowhere:Foo-v0")
    Traceback (most recent call last):
    ValueError: env must be an id that Gymnasium knows, got 'nowhere:Foo-v0'
    """
    try:
        return gymnasium.make(env, disable_env_checker=True)
    except (gymnasium.error.Error, ImportError) as error:
        raise ValueError(f"env must be an id that Gymnasium knows, got {env!r}") from error


def check_fit(
    policy: Policy, parameters: NDArray[np.float32], environment: Environment, name: str
) -> None:
    """Raise unless a policy takes the observations of an environment and puts out its actions.

    Parameters
    ----------
    policy : Policy
    parameters : float32 array of shape (P,)
    environment : CompiledEnvironment or GymnasiumEnvironment
    name : str
        What the message calls the policy.

    Raises
    ------
    ValueError
        If the number of inputs, the kind or number of actions, or P is another.

    Examples
    --------
    >>> policy = Policy(np.array([2, 5]), False, False, False, 1)
    >>> check_fit(policy, np.zeros(15, np.float32), open_environment("MountainCar-v0"), "agent")
    Traceback (most recent call last):
    ValueError: agent must be a categorical policy of 3 actions, got a categorical policy of 5
    """
    inputs = environment.n_observations + policy.constant_feature
    sizes = policy.sizes.tolist()
    require(sizes[0] == inputs, name, sizes, f"a network of {inputs} inputs")
    if environment.n_actions > 0:
        allowed = f"a categorical policy of {environment.n_actions} actions"
        fits = not policy.gaussian and sizes[-1] == environment.n_actions
    else:
        allowed = f"a Gaussian policy of {environment.action_dimensions} components"
        fits = policy.gaussian and policy.action_width == environment.action_dimensions
    if not fits:
        kind = "Gaussian" if policy.gaussian else "categorical"
        width = policy.action_width if policy.gaussian else sizes[-1]
        raise ValueError(f"{name} must be {allowed}, got a {kind} policy of {width}")
    count = networks.count_parameters(sizes) + policy.gaussian * policy.action_width
    shape = np.shape(parameters)
    require(shape == (count,), name, shape, f"a policy with parameters of shape ({count},)")


def open_environment(env: EnvironmentLike) -> Environment:
    """Make an environment that plays whole episodes.

    Parameters
    ----------
    env : str, gymnasium.Env or callable
        The ids in `rl_core.dynamics.TASKS` are played compiled and have no time limit. Any other id
        is made by Gymnasium, with the time limit it is registered with. An environment, or what a
        function without arguments returns, is taken as it is.

    Returns
    -------
    CompiledEnvironment or GymnasiumEnvironment

    Raises
    ------
    ValueError
        If Gymnasium does not know the id, or the spaces do not fit.
    TypeError
        If `env` is none of the three.

    Examples
    --------
    >>> open_environment("Acrobot-v1").n_actions
    3
    """
    if isinstance(env, str):
        if env in dynamics.TASKS:
            return CompiledEnvironment(dynamics.TASKS[env])
        return GymnasiumEnvironment(make_environment(env), owned=True)
    if isinstance(env, gymnasium.Env):
        return GymnasiumEnvironment(env, owned=False)
    made = env() if callable(env) else env
    if not isinstance(made, gymnasium.Env):
        raise TypeError(
            f"env must be a Gymnasium id, environment or a function that makes one, got {env!r}"
        )
    return GymnasiumEnvironment(made, owned=True)
