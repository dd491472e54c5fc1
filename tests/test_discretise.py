"""Continuous worlds cut into cells: cells and actions, bad input, and the compiled path's bits."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from rl_core.exploration import EpsilonGreedy, Trials
from rl_core.q_learning import QLearningConfig, q_learning
from rl_core.worlds.discretise import Discretised, action_levels, cell, gridded, make_grid

BOX = spaces.Box(np.array([-1.0, 0.0], np.float32), np.array([1.0, 3.0], np.float32))


def test_cells_are_numbered_with_the_last_dimension_fastest():
    grid = make_grid(BOX, (2, 3))
    centres = [(x, y) for x in (-0.5, 0.5) for y in (0.5, 1.5, 2.5)]
    assert [cell(grid, np.array(o, np.float32)) for o in centres] == list(range(6))
    assert grid.n_cells == 6


def test_what_lies_on_or_beyond_a_bound_falls_into_the_outermost_bin():
    grid = make_grid(BOX, 4)
    for inside, beyond in (((-0.9, 0.1), (-5.0, -5.0)), ((0.9, 2.9), (1.0, 3.0))):
        assert cell(grid, np.array(inside, np.float32)) == cell(grid, np.array(beyond, np.float32))
    assert cell(grid, np.array([9.0, 9.0], np.float32)) == 15


def test_cells_agree_with_numpys_digitize():
    grid = make_grid(BOX, (7, 11))
    observations = np.random.default_rng(0).uniform([-1.2, -0.2], [1.2, 3.2], (2_000, 2))
    observations = observations.astype(np.float32)
    edges = [np.linspace(a, b, n + 1)[1:-1] for a, b, n in zip(*grid, strict=True)]
    expected = [np.digitize(observations[:, k].astype(float), edges[k]) for k in (0, 1)]
    found = [cell(grid, o) for o in observations]
    np.testing.assert_array_equal(found, expected[0] * 11 + expected[1])


def test_levels_of_actions():
    np.testing.assert_array_equal(action_levels(spaces.Discrete(3, start=5), None), [[0], [1], [2]])
    two = spaces.Box(np.array([-1.0, 0.0]), np.array([1.0, 2.0]), dtype=np.float64)
    found = action_levels(two, 3)
    assert found.shape == (9, 2)
    assert {tuple(action) for action in found} == {(a, b) for a in (-1, 0, 1) for b in (0, 1, 2)}


@pytest.mark.parametrize("bins", [0, -3, 2.5, "many", True, (3,), (3, 3, 3), (3, 0), 10**6])
def test_bad_bins(bins):
    with pytest.raises((TypeError, ValueError), match="bins must be"):
        make_grid(BOX, bins)
    with pytest.raises((TypeError, ValueError), match="bins must be"):
        gridded("MountainCar-v0", bins)


def test_unbounded_observations_need_bounds():
    with pytest.raises(ValueError, match=r"low must be finite in every dimension.*inf"):
        Discretised("CartPole-v1", 5)
    low, high = np.array([-2.4, -3, -0.21, -3]), np.array([2.4, 3, 0.21, 3])
    env = Discretised("CartPole-v1", 5, low=low, high=high)
    assert env.observation_space == spaces.Discrete(625)
    observation, _ = env.reset(seed=0)
    assert observation in env.observation_space
    for bad in (low[:3], high):
        with pytest.raises(ValueError, match="low must be"):
            Discretised("CartPole-v1", 5, low=bad, high=high)


def test_spaces_that_do_not_fit():
    with pytest.raises(ValueError, match="observation space must be a Box"):
        Discretised("FrozenLake-v1", 5)
    with pytest.raises(ValueError, match="levels must be None"):
        Discretised("MountainCar-v0", 5, levels=3)
    for levels in (None, 1, 2.0):
        with pytest.raises((TypeError, ValueError), match="levels must be an integer from 2"):
            gridded("MountainCarContinuous-v0", 5, levels=levels)
    with pytest.raises(ValueError, match="action space must be bounded"):
        action_levels(spaces.Box(-np.inf, np.inf, (1,)), 3)
    with pytest.raises(ValueError, match="action space must be Discrete or a Box"):
        action_levels(spaces.MultiDiscrete([2, 2]), None)
    with pytest.raises(ValueError, match="low must be finite"):
        gridded("CartPole-v1", 5)
    with pytest.raises(TypeError, match="env must be a compiled task"):
        gridded("FrozenLake-v1", 5)
    with pytest.raises(TypeError, match="env must be"):
        Discretised(lambda: 3, 5)


TASKS = [("MountainCar-v0", None), ("MountainCarContinuous-v0", 5), ("Acrobot-v1", None)]


@pytest.mark.parametrize(("name", "levels"), TASKS)
def test_the_compiled_path_gives_the_bits_of_the_wrapped_environment(name, levels):
    config = QLearningConfig(
        gamma=0.99,
        exploration=EpsilonGreedy(0.3),
        max_steps=300,
        evaluation=Trials(every=5, episodes=2, max_steps=50),
    )

    def wrapped():
        env = gymnasium.make(name, disable_env_checker=True, max_episode_steps=-1)
        return Discretised(env, 6, levels=levels)

    seen = replace(config, bins=6, levels=levels)
    fast = q_learning(name, seen, episodes=10, seeds=[3, 4])
    plain = q_learning(wrapped, config, episodes=10, seeds=[3, 4])
    for array in ("Q", "visits"):
        np.testing.assert_array_equal(fast.arrays[array], plain.arrays[array])
    assert fast.table.equals(plain.table)
    assert not np.array_equal(fast.arrays["Q"][0], fast.arrays["Q"][1])
    assert np.count_nonzero(fast.arrays["visits"]) > 30


def test_a_time_limit_below_the_wrapper_truncates():
    run = q_learning(
        Discretised("MountainCar-v0", 10),
        QLearningConfig(gamma=0.99, exploration=EpsilonGreedy(1.0)),
        episodes=2,
        seeds=[0],
    )
    assert run.table["steps"].tolist() == [200, 200]
    assert not run.table["terminated"].any()
