"""The fastest way up the hill: against exhaustive search, simple policies, and finer grids."""

from itertools import product

import numpy as np
import pytest

from rl_core.worlds.twins import TASKS
from studies.fastest import fastest

STARTS = np.linspace(-0.6, -0.4, 21)


@pytest.mark.parametrize("name", ["MountainCar-v0", "MountainCarContinuous-v0"])
def test_finer_grids_agree_better(name):
    gaps = []
    for points in (50, 100, 200):
        found = fastest(name, STARTS, points=points)
        gaps.append(abs(found.planned.mean() - found.driven.mean()))
        assert (found.driven == np.round(found.driven)).all()
    assert gaps[0] > gaps[1] > gaps[2]
    assert gaps[2] < 2


def _steps(name, start, forces):
    kernel = TASKS[name].kernel()
    kernel.state[0] = start
    for t, force in enumerate(forces, 1):
        if kernel.step(kernel.state, np.array([force], np.float32))[1]:
            return t
    return np.inf


def test_no_bang_bang_plan_with_few_switches_is_faster():
    """Of all ways to push left, then right, (then left, then right) none beats the planned one."""
    name, start = "MountainCarContinuous-v0", -0.5
    found = fastest(name, np.array([start]), points=200).driven[0]
    best = np.inf
    for first, second, third in product(range(0, 41, 2), range(0, 41, 2), range(0, 41, 2)):
        plan = [1.0] * first + [-1.0] * second + [1.0] * third
        best = min(best, _steps(name, start, plan + [1.0] * 60))
    assert found <= best
    assert best < found + 3


def test_close_to_the_goal_a_plan_can_be_counted():
    """Near the goal at rest on the slope beyond the top, pushing right is all there is to do."""
    name, start = "MountainCarContinuous-v0", 0.3
    pushing = _steps(name, start, [1.0] * 200)
    assert fastest(name, np.array([start]), points=400).driven[0] <= pushing


@pytest.mark.parametrize(
    ("argument", "value", "error"),
    [
        ("env", "Acrobot-v1", ValueError),
        ("env", 3, TypeError),
        ("points", 1, ValueError),
        ("points", 30_001, ValueError),
        ("points", 50.0, TypeError),
        ("positions", np.array([-2.0]), ValueError),
        ("positions", np.array([np.nan]), ValueError),
        ("positions", np.zeros((1, 2)), ValueError),
        ("positions", "here", TypeError),
    ],
)
def test_bad_arguments_are_refused_by_name(argument, value, error):
    usual = {"env": "MountainCar-v0", "positions": STARTS, "points": 50}
    with pytest.raises(error, match=rf"^{argument} must be"):
        fastest(**{**usual, argument: value})


def test_a_number_of_points_may_be_of_any_width():
    """200 x 200 points are more than fit into eight bits."""
    start = np.array([-0.5])
    small = fastest("MountainCar-v0", start, points=np.uint8(200))
    assert small.driven == fastest("MountainCar-v0", start, points=200).driven
