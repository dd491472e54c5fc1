"""Q-learning through a grid: a car that learns to get out of the valley, and any environment."""

import numpy as np
import pytest

from rl_core.evaluation import evaluate_table
from rl_core.exploration import EpsilonGreedy
from rl_core.grid_learning import GridConfig, q_learning_on_grid
from rl_core.q_learning import QLearningConfig
from rl_core.worlds.discretise import binned

LEARNING = QLearningConfig(
    gamma=0.99, step_size=0.3, exploration=EpsilonGreedy(0.02), max_steps=5_000
)


def test_it_learns_mountain_car():
    run = q_learning_on_grid(
        "MountainCar-v0", GridConfig(10, learning=LEARNING), episodes=1_000, seeds=[100, 101, 102]
    )
    for position, seed in enumerate((100, 101, 102)):
        steps = run.table.loc[run.table["seed"] == seed, "steps"]
        assert steps.tail(100).median() < min(350, steps.head(20).median() / 2)
        played = evaluate_table(
            binned("MountainCar-v0", 10),
            run.arrays["Q"][position],
            seed=seed,
            episodes=20,
            max_steps=5_000,
        )
        assert played["steps"].median() < 350


def test_a_seed_gives_the_same_bits_alone_and_among_others():
    config = GridConfig(8, levels=3, learning=LEARNING)
    name = "MountainCarContinuous-v0"
    together = q_learning_on_grid(name, config, episodes=3, seeds=[1, 2])
    alone = q_learning_on_grid(name, config, episodes=3, seeds=[2])
    np.testing.assert_array_equal(together.arrays["Q"][1], alone.arrays["Q"][0])


def test_other_environments_go_through_gymnasium():
    config = GridConfig(5, levels=3, learning=LEARNING)
    run = q_learning_on_grid("Pendulum-v1", config, episodes=2, seeds=[0])
    assert run.arrays["Q"].shape == (1, 125, 3)
    assert run.table["steps"].tolist() == [200, 200]


def test_bad_arguments():
    for bins in (0, 1.5, (), (3, -1)):
        with pytest.raises(ValueError, match="bins must be"):
            GridConfig(bins)
    with pytest.raises(ValueError, match="levels must be"):
        GridConfig(5, levels=1)
    with pytest.raises(TypeError, match="learning is"):
        GridConfig(5, learning=None)
    with pytest.raises(ValueError, match="config must be a GridConfig"):
        q_learning_on_grid("MountainCar-v0", LEARNING, episodes=1, seeds=[0])
    with pytest.raises(ValueError, match="env must be a Gymnasium id"):
        q_learning_on_grid(3, GridConfig(5), episodes=1, seeds=[0])
    with pytest.raises(ValueError, match="bins must be"):
        q_learning_on_grid("MountainCar-v0", GridConfig((5, 5, 5)), episodes=1, seeds=[0])
