"""Worlds of numbered states: model and environment alike, and what an environment may return."""

from fractions import Fraction

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces

from rl_core.maze import Maze
from rl_core.mdp import MDP
from rl_core.q_learning import QLearningConfig, q_learning
from rl_core.worlds.discretise import GriddedTask, gridded
from rl_core.worlds.tabular import (
    known_model,
    played,
    spawn_draws,
    start,
    step,
)


class Telling(gym.Env):
    """Three states, counted from `first`; tells `odd` in place of a state at step `at`."""

    action_space = spaces.Discrete(2)

    def __init__(self, odd=None, at=2, first=0, reward=1.0):
        self.observation_space = spaces.Discrete(3, start=first)
        self.odd, self.at, self.first, self.reward = odd, at, first, reward

    def _told(self):
        return self.odd if self.t == self.at else self.first + self.t % 3

    def reset(self, *, seed=None, options=None):
        """Begin with the first."""
        super().reset(seed=seed)
        self.t = 0
        return self._told(), {}

    def step(self, action):
        """Go on to the next."""
        self.t += 1
        reward = self.reward if self.t == self.at else 0.0
        return self._told(), reward, self.t == 4, False, {}


def learn(env):
    return q_learning(env, QLearningConfig(max_steps=9), episodes=2, seeds=[0])


@pytest.mark.parametrize("first", [0, -5, 7])
@pytest.mark.parametrize("at", [0, 1, 3])
@pytest.mark.parametrize(
    "odd",
    [
        *(-6, -1, 3, 10, 2**31, 2**63, -(2**70), 0.0, 1.5, np.nan, np.inf, np.float64(1)),
        *(None, "1", b"1", (), [1], (1, 1), {}, np.array([1]), np.array([0, 1]), np.array(None)),
        *(Fraction(1), 1j, np.True_, pytest.param(object(), id="object")),
    ],
    ids=repr,
)
def test_what_is_no_state_is_refused_with_environment_and_step(odd, at, first):
    if isinstance(odd, int) and first <= odd < first + 3:
        return
    with pytest.raises(ValueError, match=r"^env must keep to its observation space ") as caught:
        learn(Telling(odd, at, first))
    told = str(caught.value)
    assert f"space {spaces.Discrete(3, start=first)}, from <Telling" in told
    assert f", at step {at} of an episode, came {odd!r}" in told


@pytest.mark.parametrize(
    "kind", [int, np.int8, np.uint8, np.int16, np.uint32, np.int64, np.uint64, np.array]
)
def test_a_state_may_be_an_integer_of_any_width(kind):
    run = learn(Telling(kind(1), at=2))
    np.testing.assert_array_equal(run.arrays["visits"][0].sum(axis=1), [4, 4, 0])


@pytest.mark.parametrize("reward", [None, "3", [1.0], np.array([1.0, 2.0]), 1j, object()])
def test_a_reward_that_is_no_number_is_refused_with_environment_and_step(reward):
    if isinstance(reward, list):
        reward = [1.0, 2.0]
    message = r"^env must pay a number as reward, from <Telling.*, at step 2 of an episode, came "
    with pytest.raises(ValueError, match=message):
        learn(Telling(2, at=2, reward=reward))


@pytest.mark.parametrize(
    "reward", [1, True, np.True_, np.float16(1), np.longdouble(1), Fraction(1), np.array([1.0])]
)
def test_a_reward_may_be_a_number_of_any_kind(reward):
    assert learn(Telling(2, at=2, reward=reward)).table["return"].tolist() == [1.0, 1.0]


@pytest.mark.parametrize("env", ["rl_core/Maze-v0", "FrozenLake-v1", "CliffWalking-v1", "Taxi-v4"])
def test_an_environment_and_its_model_behave_alike(env):
    model, world = MDP.from_env(env).arrays(), played(gym.make(env).unwrapped)
    for seed in (0, 1):
        draws = [spawn_draws(seed, 1)[0] for _ in range(2)]
        rng, over, truncated = np.random.default_rng(seed), True, False
        for _ in range(300):
            if over or truncated:
                s = start(model, draws[0])
                assert start(world, draws[1]) == s
            a = int(rng.integers(world.actions.n))
            outcome = step(model, s, a, draws[0])
            told = step(world, s, a, draws[1])
            if outcome[0] < world.observations.n:  # else the state in which a model's episodes end
                assert told[0] == outcome[0]
            assert told[1:] == outcome[1:]
            s, _, over, truncated = outcome


def test_a_gridded_task_is_started_and_stepped_like_the_others():
    world = gridded("MountainCar-v0", 10)
    assert isinstance(world, GriddedTask)
    draws = spawn_draws(0, 1)[0]
    s = start(world, draws)
    assert 0 <= s < 100
    s_next, r, terminated, truncated = step(world, s, 2, draws)
    assert (0 <= s_next < 100, r, terminated, truncated) == (True, -1.0, False, False)


def test_draws_differ_between_purposes_and_seeds():
    draws = [generator for seed in (0, 1) for one in spawn_draws(seed, 2) for generator in one]
    assert len({generator.random() for generator in draws}) == 12
    assert spawn_draws(3, 1)[0].step.random() == spawn_draws(3, 2)[0].step.random()


@pytest.mark.parametrize(
    ("env", "message"),
    [
        ("MountainCar-v0", "env must have a Discrete observation space, got Box"),
        ("Blackjack-v1", "env must have a Discrete observation space, got Tuple"),
        ("Labyrinth-v0", "env must be an id that Gymnasium knows, got 'Labyrinth-v0'"),
    ],
)
def test_other_spaces_are_refused(env, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        played(env)


def test_what_was_made_for_nothing_is_closed():
    closed = []

    class Box(Telling):
        def __init__(self):
            super().__init__()
            self.action_space = spaces.Box(-1, 1, (1,))

        def close(self):
            closed.append(self)

    with pytest.raises(ValueError, match="env must have a Discrete action space, got Box"):
        played(Box)
    assert len(closed) == 1
    given = Box()
    with pytest.raises(ValueError, match="env must have a Discrete action space, got Box"):
        played(given)
    assert len(closed) == 1


def test_the_model_is_known_where_there_is_one():
    assert known_model(played(Maze)).n_states == 112
    assert known_model(played("Taxi-v4")).n_states == 501
    assert known_model(played(Telling)) is None
