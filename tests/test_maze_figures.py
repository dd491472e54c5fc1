"""The drawings of the Maze show what the tables say."""

from itertools import pairwise

import numpy as np
import pytest

from drawings.maze import Move, episode_frames, follow_policy, situation_figure
from rl_core.maze import Maze
from rl_core.planning import value_iteration


@pytest.fixture(scope="module")
def maze():
    return Maze()


def texts(figure):
    return [text.get_text() for text in figure.axes[0].texts]


def arrows(figure):
    return [a for a in figure.axes[0].texts if getattr(a, "arrow_patch", None) is not None]


def test_a_situation_shows_every_value_to_three_digits(maze):
    Q = np.random.default_rng(5).uniform(0, 2, (112, 4))
    figure = situation_figure(maze, Q, "AC")
    for row, column in maze.cells.tolist():
        if (row, column) not in maze.goals:
            assert f"{Q[maze.state(row, column, 'AC')].max():.3f}" in texts(figure)
    assert "pays 2" in texts(figure)
    assert len(arrows(figure)) == 13  # one for each free cell but the goal


def test_all_optimal_actions_get_an_arrow(maze):
    assert len(arrows(situation_figure(maze, np.zeros((112, 4)), ""))) == 4 * 13


def test_cells_no_episode_can_be_in_are_hatched(maze):
    hatched = {}
    for flags in maze.flag_sets:
        patches = situation_figure(maze, np.eye(112, 4), flags).axes[0].patches
        hatched[flags] = sum(patch.get_hatch() is not None for patch in patches)
    assert hatched == {"": 3, "A": 2, "B": 2, "C": 2, "AB": 1, "AC": 1, "BC": 1, "ABC": 0}


def test_an_episode_is_noted_move_by_move(maze):
    policy = value_iteration(maze.model(), gamma=0.9).policy
    moves = follow_policy(maze, policy, seed=1)
    assert moves[0].state == 0
    assert all(a.next_state == b.state for a, b in pairwise(moves))
    assert maze.locate(moves[-1].next_state)[:2] == (0, 4)


def test_a_policy_that_never_arrives_is_reported():
    with pytest.raises(RuntimeError, match="did not reach the goal"):
        follow_policy(Maze(slip=0), np.full(112, 2), seed=0)


def test_the_film_has_every_move_and_marks_slips(maze):
    moves = [Move(0, 1, False, 8, 0.0), Move(8, 1, True, 8, 0.0)]
    frames = list(episode_frames(maze, moves, frames_per_move=4))
    assert len(frames) == 4 * 2 + 8
    assert all(frame.shape == frames[0].shape and frame.dtype == np.uint8 for frame in frames)
    orange = [np.all(frame == (230, 159, 0), axis=2).sum() for frame in frames]
    assert not any(orange[:5])
    assert all(count > 500 for count in orange[5:8])


def test_a_film_needs_time_to_show_a_move(maze):
    with pytest.raises(ValueError, match="frames_per_move must be an integer from 3, got 2"):
        episode_frames(maze, [Move(0, 1, False, 8, 0.0)], frames_per_move=2)
    with pytest.raises(ValueError, match="moves must be one move or more"):
        episode_frames(maze, [])


def test_what_cannot_be_drawn_is_refused_by_name(maze):
    with pytest.raises(ValueError, match=r"flags must be one of .*got 'D'"):
        situation_figure(maze, np.zeros((112, 4)), "D")
    with pytest.raises(ValueError, match=r"Q must be .*\(112, 4\), got \(16, 4\)"):
        situation_figure(maze, np.zeros((16, 4)), "A")
    with pytest.raises(ValueError, match="Q must be finite"):
        situation_figure(maze, np.full((112, 4), np.nan), "A")
    with pytest.raises(ValueError, match="policy must be of 112 actions, got 16"):
        follow_policy(maze, np.zeros(16, int), seed=0)
    with pytest.raises(ValueError, match="policy must be an integer from 0 to 3, got "):
        follow_policy(maze, np.full(112, 4), seed=0)
