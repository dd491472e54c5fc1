"""The examples of chapter 7: the compiled room is the room, the network knows that day is round."""

import numpy as np
import pytest
import torch
from gymnasium.utils.env_checker import check_env

from examples.networks import clock
from examples.room import DAY, Room
from examples.room_task import FastRoom
from rl_core.evaluation import evaluate, uniform
from rl_core.worlds.environments import open_world, step


def test_gymnasium_s_checker_likes_the_room():
    check_env(Room(), skip_render_check=True)


@pytest.mark.filterwarnings("ignore")
def test_the_task_is_the_room_step_by_step():
    room, task, rng = Room(), open_world(FastRoom), np.random.default_rng(0)
    task.seed(7)
    for episode in range(2):
        seen, _ = room.reset(seed=7 if episode == 0 else None)
        found = task.reset()
        np.testing.assert_array_equal(seen, found)
        for _ in range(DAY):
            action = int(rng.integers(2))
            seen, reward, over, _, _ = room.step(action)
            told = step(task.stepper, np.array([action], np.float32), found)
            np.testing.assert_allclose(seen, found, rtol=1e-6)
            assert told[0] == pytest.approx(reward, abs=1e-12)
            assert told[1] == over
        assert over


def test_both_rooms_are_evaluated_alike():
    tables = [
        evaluate(env, uniform(2, 2), seed=0, episodes=5, max_steps=200) for env in (FastRoom, Room)
    ]
    np.testing.assert_allclose(tables[0]["return"], tables[1]["return"])
    assert set(tables[0]["steps"]) == {DAY}


def test_midnight_is_midnight():
    x = torch.tensor([[0.9, 0.0], [0.9, 1.0], [0.9, 0.5]])
    out = clock(2, 3)(x)
    torch.testing.assert_close(out[0], out[1])
    assert not torch.allclose(out[0], out[2])
