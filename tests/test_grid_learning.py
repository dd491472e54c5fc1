"""Q-learning through a grid: a car that learns to get out of the valley, and any environment."""

from dataclasses import replace

import numpy as np
import pytest

from rl_core.evaluation import evaluate_table
from rl_core.exploration import EpsilonGreedy
from rl_core.q_learning import QLearningConfig, q_learning
from rl_core.worlds.discretise import gridded

LEARNING = QLearningConfig(
    gamma=0.99, step_size=0.3, exploration=EpsilonGreedy(0.02), max_steps=5_000
)


def test_it_learns_mountain_car():
    config = replace(LEARNING, bins=10)
    run = q_learning("MountainCar-v0", config, episodes=1_000, seeds=[100, 101, 102])
    for position, seed in enumerate((100, 101, 102)):
        steps = run.table.loc[run.table["seed"] == seed, "steps"]
        assert steps.tail(100).median() < min(350, steps.head(20).median() / 2)
        played = evaluate_table(
            gridded("MountainCar-v0", 10),
            run.arrays["Q"][position],
            seed=seed,
            episodes=20,
            max_steps=5_000,
        )
        assert played["steps"].median() < 350


def test_a_seed_gives_the_same_bits_alone_and_among_others():
    config = replace(LEARNING, bins=8, levels=3)
    name = "MountainCarContinuous-v0"
    together = q_learning(name, config, episodes=3, seeds=[1, 2])
    alone = q_learning(name, config, episodes=3, seeds=[2])
    np.testing.assert_array_equal(together.arrays["Q"][1], alone.arrays["Q"][0])


def test_other_environments_go_through_gymnasium():
    config = replace(LEARNING, bins=5, levels=3)
    run = q_learning("Pendulum-v1", config, episodes=2, seeds=[0])
    assert run.arrays["Q"].shape == (1, 125, 3)
    assert run.table["steps"].tolist() == [200, 200]


def test_a_budget_stops_within_an_episode_and_changes_nothing_before():
    free = replace(LEARNING, bins=8)
    cut = replace(free, max_env_steps=2_000)
    all_of_it = q_learning("MountainCar-v0", free, episodes=9, seeds=[0]).table
    some = q_learning("MountainCar-v0", cut, episodes=9, seeds=[0])
    assert some.table["env_steps"].iloc[-1] == 2_000
    assert not some.table["terminated"].iloc[-1]
    assert not some.failures
    before = len(some.table) - 1
    assert some.table.iloc[:before].equals(all_of_it.iloc[:before])


def test_bad_arguments():
    for bins in (0, 1.5, (), (3, -1), np.array(3.0)):
        with pytest.raises((TypeError, ValueError), match="bins must be"):
            replace(LEARNING, bins=bins)
    with pytest.raises(ValueError, match="levels must be"):
        replace(LEARNING, bins=5, levels=1)
    with pytest.raises(TypeError, match="env must be"):
        q_learning(3, replace(LEARNING, bins=5), episodes=1, seeds=[0])
    with pytest.raises(ValueError, match="bins must be"):
        q_learning("MountainCar-v0", replace(LEARNING, bins=(5, 5, 5)), episodes=1, seeds=[0])
