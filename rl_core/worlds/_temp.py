"""Temporary."""

import gymnasium
import numpy as np

from rl_core import dynamics
from rl_core.worlds.tasks import task


def _make(id, code, n, nobs):
    env = gymnasium.make(id)

    class T:
        @staticmethod
        def start(rng, state, observation): ...
        @staticmethod
        def step(state, action): ...
        @staticmethod
        def observe(state, observation): ...

    return task(
        n_state=4,
        observation_space=env.observation_space,
        action_space=env.action_space,
        max_episode_steps=None,
    ), T


a, b, c = dynamics.ACROBOT, dynamics.MOUNTAIN_CAR, dynamics.MOUNTAIN_CAR_CONTINUOUS
_s = lambda i: (gymnasium.make(i).observation_space, gymnasium.make(i).action_space)


@task(
    n_state=4,
    observation_space=_s("Acrobot-v1")[0],
    action_space=_s("Acrobot-v1")[1],
    max_episode_steps=None,
)
class Acrobot:
    @staticmethod
    def start(rng, state, observation):
        drawn = rng.uniform(-0.1, 0.1, 4).astype(np.float32)
        for i in range(4):
            state[i] = drawn[i]
        observation[0:4:2] = np.cos(drawn[:2])
        observation[1:4:2] = np.sin(drawn[:2])
        observation[4:] = drawn[2:]

    @staticmethod
    def step(state, action):
        return dynamics.step(a, state, action)

    @staticmethod
    def observe(state, observation):
        dynamics.observe(a, state, observation)


@task(
    n_state=4,
    observation_space=_s("MountainCar-v0")[0],
    action_space=_s("MountainCar-v0")[1],
    max_episode_steps=None,
)
class MountainCar:
    @staticmethod
    def start(rng, state, observation):
        state[:] = 0.0
        state[0] = rng.uniform(-0.6, -0.4)
        observation[0] = state[0]
        observation[1] = 0

    @staticmethod
    def step(state, action):
        return dynamics.step(b, state, action)

    @staticmethod
    def observe(state, observation):
        dynamics.observe(b, state, observation)


@task(
    n_state=4,
    observation_space=_s("MountainCarContinuous-v0")[0],
    action_space=_s("MountainCarContinuous-v0")[1],
    max_episode_steps=None,
)
class Mcc:
    @staticmethod
    def start(rng, state, observation):
        state[:] = 0.0
        state[0] = rng.uniform(-0.6, -0.4)
        observation[0] = state[0]
        observation[1] = 0

    @staticmethod
    def step(state, action):
        return dynamics.step(c, state, action)

    @staticmethod
    def observe(state, observation):
        dynamics.observe(c, state, observation)


TASKS = {"Acrobot-v1": Acrobot, "MountainCar-v0": MountainCar, "MountainCarContinuous-v0": Mcc}
