"""Episodes of deep Q-learning: compiled for the known tasks, step by step for any other.

    observe s
    until the episode ends:
        take a, epsilon-greedily; observe r, s'
        store (s, a, shaped r, s', end) in the memory
        if an update is due: sample a batch from the memory and update the network
        s <- s'

Both loops draw the same uniforms from the same streams and call the same compiled functions
(`rl_core.q_update`), and the compiled tasks are exact twins of Gymnasium's (`rl_core.dynamics`), so
that training gives the same bits whichever way it goes.
"""

from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from rl_core import dynamics
from rl_core.episodes import EnvironmentLike, GymnasiumEnvironment, make_environment
from rl_core.kernels.compiled import compiled
from rl_core.q_update import (
    DUE,
    NOT_A_NUMBER,
    Learner,
    Settings,
    act,
    after_episode,
    remember,
    update,
)
from rl_core.replay import Memory

GOES_ON, DIVERGED, SHAPED_NAN = range(3)
"""How an episode's learning went: `Episode.outcome`."""


class Episode(NamedTuple):
    """What is told of an episode.

    Attributes
    ----------
    steps : int
    total : float
        Undiscounted sum of the environment's own rewards.
    terminated : bool
        False if the episode was stopped by a cap or by what `outcome` says.
    outcome : int
        `GOES_ON`; `DIVERGED`: a loss was not finite; `SHAPED_NAN`: a shaped reward was NaN.
    """

    steps: int
    total: float
    terminated: bool
    outcome: int


class Training(NamedTuple):
    """All that one seed's episodes work on."""

    settings: Settings
    learner: Learner
    memory: Memory
    shape: Any
    policy_rng: np.random.Generator
    replay_rng: np.random.Generator


@compiled
def _play(
    code: int,
    state: NDArray[np.float64],
    observation: NDArray[np.float32],
    settings: Settings,
    learner: Learner,
    memory: Memory,
    shape: Any,
    policy_rng: np.random.Generator,
    replay_rng: np.random.Generator,
    max_steps: int,
) -> tuple[int, float, bool, int]:
    """Play and learn from one episode of a compiled task; `observation` is overwritten."""
    units = np.empty(learner.sizes.sum(), np.float32)
    uniforms = np.empty(settings.batch_size)
    following, action = np.empty_like(observation), np.empty(1, np.float32)
    total = 0.0
    for t in range(max_steps):
        u, v = policy_rng.random(), policy_rng.random()
        a = act(settings, learner, observation, u, v, units)
        action[0] = a
        reward, terminated = dynamics.step(code, state, action)
        dynamics.observe(code, state, following)
        total += reward
        answer = remember(
            settings, learner, memory, shape, observation, a, reward, following, terminated
        )
        if answer == NOT_A_NUMBER:
            return t + 1, total, False, SHAPED_NAN
        if answer == DUE:
            for k in range(uniforms.size):
                uniforms[k] = replay_rng.random()
            if not update(settings, learner, memory, uniforms):
                return t + 1, total, False, DIVERGED
        if terminated:
            after_episode(learner, True)
            return t + 1, total, True, GOES_ON
        observation[:] = following
    after_episode(learner, False)
    return max_steps, total, False, GOES_ON


class CompiledWorld:
    """A compiled task with discrete actions, without time limit.

    Parameters
    ----------
    task : rl_core.dynamics.Task
    """

    def __init__(self, task: dynamics.Task) -> None:
        self.n_observations, self.n_actions = task.n_observations, task.n_actions
        self.code = task.code
        self._rng = np.random.default_rng(0)

    def seed(self, environment_seed: int) -> None:
        """Start the environment's stream, the one Gymnasium makes of this seed."""
        self._rng = np.random.default_rng(environment_seed)

    def reset(self) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
        """Draw the start of an episode: its state and its observation."""
        return dynamics.reset(self.code, self._rng)

    def play(self, training: Training, max_steps: int) -> Episode:
        """Play and learn from one episode; see `GymnasiumWorld.play`."""
        state, observation = self.reset()
        settings, learner, memory, shape, policy_rng, replay_rng = training
        return Episode(
            *_play(
                self.code,
                state,
                observation,
                settings,
                learner,
                memory,
                shape,
                policy_rng,
                replay_rng,
                max_steps,
            )
        )

    def close(self) -> None:
        """Nothing to release."""


class GymnasiumWorld:
    """Any Gymnasium environment with Box observations and Discrete actions.

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
        If the spaces are others.
    """

    def __init__(self, environment: gymnasium.Env[Any, Any], owned: bool) -> None:
        actions = environment.action_space
        if not isinstance(actions, spaces.Discrete):
            raise ValueError(f"env must have a Discrete action space, got {actions}")
        self.n_observations = GymnasiumEnvironment(environment, owned).n_observations
        self.n_actions, self._start = int(actions.n), int(actions.start)
        self._environment, self._owned = environment, owned
        self._seed: int | None = None

    def seed(self, environment_seed: int) -> None:
        """Seed the environment at its next reset."""
        self._seed = environment_seed

    def reset(self) -> NDArray[np.float32]:
        """Begin an episode; return its first observation."""
        observation, _ = self._environment.reset(seed=self._seed)
        self._seed = None
        return np.ravel(observation).astype(np.float32)

    def step(self, action: int) -> tuple[NDArray[np.float32], float, bool, bool]:
        """Take one step: the next observation, the reward, and whether it terminated or truncated.

        Actions are counted from 0, wherever the space starts.
        """
        seen, reward, terminated, truncated, _ = self._environment.step(action + self._start)
        observation = np.ravel(seen).astype(np.float32)
        return observation, float(reward), bool(terminated), bool(truncated)

    def play(self, training: Training, max_steps: int) -> Episode:
        """Play and learn from one episode.

        Parameters
        ----------
        training : Training
            Its learner and memory are changed.
        max_steps : int
            Where to stop an episode that has not ended.
        """
        settings, learner, memory, shape, policy_rng, replay_rng = training
        units = np.empty(learner.sizes.sum(), np.float32)
        observation, total = self.reset(), 0.0
        for t in range(max_steps):
            u, v = policy_rng.random(2)
            a = act(settings, learner, observation, u, v, units)
            following, reward, terminated, truncated = self.step(a)
            total += reward
            answer = remember(
                settings, learner, memory, shape, observation, a, reward, following, terminated
            )
            if answer == NOT_A_NUMBER:
                return Episode(t + 1, total, False, SHAPED_NAN)
            # Drawn in numpy, because a generator takes long to hand to compiled code.
            if answer == DUE and not update(
                settings, learner, memory, replay_rng.random(settings.batch_size)
            ):
                return Episode(t + 1, total, False, DIVERGED)
            if terminated or truncated:
                after_episode(learner, terminated)
                return Episode(t + 1, total, terminated, GOES_ON)
            observation = following
        after_episode(learner, False)
        return Episode(max_steps, total, False, GOES_ON)

    def close(self) -> None:
        """Close the environment if it was made here."""
        if self._owned:
            self._environment.close()


World = CompiledWorld | GymnasiumWorld


def open_world(env: EnvironmentLike) -> World:
    """Make an environment in which a deep Q-network can learn.

    Parameters
    ----------
    env : str, gymnasium.Env or callable
        Acrobot-v1 and MountainCar-v0, given by id, are played compiled and have no time limit. Any
        other id is made by Gymnasium, with the time limit it is registered with. An environment, or
        what a function without arguments returns, is taken as it is.

    Raises
    ------
    ValueError
        If Gymnasium does not know the id, observations are no Box, or actions not Discrete.
    TypeError
        If `env` is none of the three.

    Examples
    --------
    >>> open_world("MountainCar-v0").n_actions
    3
    """
    if isinstance(env, str):
        if env in dynamics.TASKS and dynamics.TASKS[env].n_actions > 0:
            return CompiledWorld(dynamics.TASKS[env])
        return GymnasiumWorld(make_environment(env), owned=True)
    if isinstance(env, gymnasium.Env):
        return GymnasiumWorld(env, owned=False)
    made = env() if callable(env) else env
    if not isinstance(made, gymnasium.Env):
        raise TypeError(
            f"env must be a Gymnasium id, environment or a function that makes one, got {env!r}"
        )
    return GymnasiumWorld(made, owned=True)
