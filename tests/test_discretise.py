"""Continuous worlds cut into cells: cells and actions, bad input, and the compiled path's bits."""

from fractions import Fraction

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_task import Corridor

from rl_core.evaluation import evaluate, greedy
from rl_core.exploration import EpsilonGreedy, Trials
from rl_core.q_learning import QLearningConfig, q_learning
from rl_core.worlds.discretise import (
    Discretised,
    Grid,
    action_levels,
    cell,
    checked_bins,
    gridded,
    make_grid,
)
from rl_core.worlds.environments import task_of
from rl_core.worlds.tasks import task

BOX = spaces.Box(np.array([-1.0, 0.0], np.float32), np.array([1.0, 3.0], np.float32))
FLOATS = st.floats(width=32, allow_nan=False)


class Told(gymnasium.Env):
    """Two numbers, of which the second step tells `odd`."""

    observation_space, action_space = BOX, spaces.Discrete(2)

    def __init__(self, odd=None, reward=1.0):
        self.odd, self.reward = odd, reward

    def reset(self, *, seed=None, options=None):
        """Begin in the middle."""
        super().reset(seed=seed)
        self.t = 0
        return np.array([0.0, 1.5], np.float32), {}

    def step(self, action):
        """Tell what was ordered."""
        self.t += 1
        seen = self.odd if self.t == 2 else np.array([0.5, 0.5], np.float32)
        return seen, self.reward, self.t == 3, False, {}


@task(
    n_state=1,
    observation_space=spaces.Box(0.0, 1.0, (1,)),
    action_space=spaces.Discrete(2),
    max_episode_steps=None,
)
class Vanishing:
    """Observes NaN from its third step on."""

    @staticmethod
    def start(rng, state, observation):
        """Begin at 0."""
        state[0] = observation[0] = 0.0

    @staticmethod
    def step(state, action):
        """Count."""
        state[0] += 1.0
        return -1.0, False

    @staticmethod
    def observe(state, observation):
        """See nothing after a while."""
        observation[0] = np.nan if state[0] > 2.0 else 0.5


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


@pytest.mark.parametrize("far", [1e15, 9.3e18, 1e19, 3e38, np.inf])
def test_extremes_fall_into_the_outermost_bins_on_their_side(far):
    grid = make_grid(BOX, (4, 5))
    corners = {(-far, -far): 0, (-far, far): 4, (far, -far): 15, (far, far): 19}
    for o, expected in corners.items():
        assert cell(grid, np.array(o, np.float32)) == expected
    env = Discretised(lambda: Told(np.array([far, -far])), (4, 5))
    env.reset()
    env.step(0)
    assert env.step(0)[0] == 15


@settings(deadline=None)
@given(st.tuples(FLOATS, FLOATS), st.tuples(st.integers(1, 40), st.integers(1, 40)))
def test_every_observation_has_one_of_the_cells_and_larger_numbers_none_before(o, bins):
    grid = make_grid(BOX, bins)
    found = cell(grid, np.array(o, np.float32))
    assert 0 <= found < grid.n_cells
    assert cell(grid, np.array([np.inf, o[1]], np.float32)) >= found
    assert cell(grid, np.array([o[0], -np.inf], np.float32)) <= found


@pytest.mark.parametrize("o", [(np.nan, 1.0), (0.0, np.nan), (np.nan, np.inf)])
def test_nan_has_no_cell(o):
    with pytest.raises(ValueError, match="NaN was observed, which has no cell"):
        cell(make_grid(BOX, 4), np.array(o, np.float32))


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


# What an environment returns


@pytest.mark.parametrize(
    "odd",
    [
        *(None, 0.5, "ab", [0.1], [0.1, 0.2, 0.3], np.zeros(3), np.zeros((1, 2)), np.zeros(60)),
        *([np.nan, 0.0], np.array([0.0, np.nan]), np.array(["a", "b"]), [[1.0], [1.0, 2.0]]),
        *([None, 1.0], np.array([1j, 0]), {}, pytest.param(object(), id="object")),
    ],
    ids=repr,
)
def test_what_has_no_cell_is_refused_with_environment_and_step(odd):
    message = r"^env must keep to its observation space Box\(.*, from <Told.*, at step 2 of an "
    for bins in (QLearningConfig(bins=5), QLearningConfig(bins=(5, 3))):
        with pytest.raises(ValueError, match=message):
            q_learning(lambda: Told(odd), bins, episodes=1, seeds=[0])


@pytest.mark.parametrize("reward", [None, "3", np.zeros(2), 1j])
def test_a_reward_that_is_no_number_is_refused_with_environment_and_step(reward):
    env = Discretised(lambda: Told(np.zeros(2), reward), 5)
    env.reset()
    message = r"^env must pay a number as reward, from <Told.*, at step 1 of an episode, came "
    with pytest.raises(ValueError, match=message):
        env.step(0)


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.float64, np.int8, np.uint64, list])
def test_an_observation_may_be_of_any_type_of_number(kind):
    odd = [0, 2] if kind is list else np.array([0, 2], kind)
    run = q_learning(lambda: Told(odd), QLearningConfig(bins=(2, 3)), episodes=1, seeds=[0])
    assert run.arrays["visits"][0].sum(axis=1).tolist() == [0, 0, 0, 1, 1, 1]


def test_a_task_that_observes_nan_ends_the_loop_and_indexes_nothing():
    with pytest.raises(ValueError, match=r"^env must keep to its spaces: NaN was observed"):
        q_learning(Vanishing, QLearningConfig(bins=4, max_steps=9), episodes=1, seeds=[0])


# Bad arguments


@pytest.mark.parametrize("bins", [0, -3, (3,), (3, 3, 3), (3, 0), 10**6, (), [], np.zeros(0, int)])
def test_bins_that_cannot_be(bins):
    with pytest.raises(ValueError, match=r"^bins must be"):
        make_grid(BOX, bins)
    with pytest.raises(ValueError, match=r"^bins must be"):
        gridded("MountainCar-v0", bins)


@pytest.mark.parametrize(
    "bins", [2.5, "many", True, None, (2.5, 3), (True, 3), np.array(2.0), Fraction(4), b"ab", {3}]
)
def test_bins_that_are_no_integers(bins):
    with pytest.raises(TypeError, match=r"^bins must be"):
        make_grid(BOX, bins)


@pytest.mark.parametrize("bins", [4, np.uint8(4), np.array([4, 4]), [4, 4], (np.int16(4), 4)])
def test_bins_in_every_form(bins):
    assert make_grid(BOX, bins).bins.tolist() == [4, 4]
    assert checked_bins("bins", bins) in (4, (4, 4))


def test_unbounded_observations_need_bounds():
    with pytest.raises(ValueError, match=r"^low must be finite in every dimension.*inf"):
        Discretised("CartPole-v1", 5)
    low, high = np.array([-2.4, -3, -0.21, -3]), np.array([2.4, 3, 0.21, 3])
    env = Discretised("CartPole-v1", 5, low=low, high=high)
    assert env.observation_space == spaces.Discrete(625)
    observation, _ = env.reset(seed=0)
    assert observation in env.observation_space
    for bad in (low[:3], high, np.where(low < -2.5, np.nan, low), -np.full(4, 1.7e308)):
        with pytest.raises(ValueError, match=r"^low must be"):
            Discretised("CartPole-v1", 5, low=bad, high=np.maximum(high, -bad[0]))


@pytest.mark.parametrize(("low", "high"), [(-np.inf, 1.0), (-1.0, np.inf), (-np.inf, np.inf)])
def test_a_box_that_is_half_bounded_is_unbounded(low, high):
    space = spaces.Box(np.array([-1, low]), np.array([1, high]), dtype=np.float64)
    with pytest.raises(ValueError, match=r"^(low|high) must be finite in every dimension"):
        make_grid(space, 3)
    with pytest.raises(ValueError, match=r"^env's action space must be bounded"):
        action_levels(space, 3)


def test_spaces_that_do_not_fit():
    with pytest.raises(ValueError, match="observation space must be a Box"):
        Discretised("FrozenLake-v1", 5)
    with pytest.raises(ValueError, match=r"^levels must be None"):
        Discretised("MountainCar-v0", 5, levels=3)
    for levels, error in ((None, ValueError), (1, ValueError), (2.0, TypeError), (True, TypeError)):
        with pytest.raises(error, match=r"^levels must be an integer from 2"):
            gridded("MountainCarContinuous-v0", 5, levels=levels)
    with pytest.raises(ValueError, match="action space must be Discrete or a Box"):
        action_levels(spaces.MultiDiscrete([2, 2]), None)
    for env in ("Blackjack-v1", "rl_core.maze:Maze", 3):
        with pytest.raises(TypeError, match=r"^env must be a compiled task, got"):
            gridded(env, 5)
    with pytest.raises(TypeError, match=r"^env must be a Gymnasium id"):
        Discretised(lambda: 3, 5)


@pytest.mark.parametrize(("levels", "dimensions"), [(300, 2), (10**9, 1), (2, 64)])
def test_more_actions_than_a_table_can_hold_are_refused_at_once(levels, dimensions):
    with pytest.raises(ValueError, match=r"^levels must be such that there are at most 65536"):
        action_levels(spaces.Box(-1, 1, (dimensions,)), levels)


# Compiled tasks

TASKS = [
    ("MountainCar-v0", None),
    ("MountainCarContinuous-v0", 5),
    ("Acrobot-v1", None),
    ("Pendulum-v1", 3),
]


@pytest.mark.parametrize(("name", "levels"), TASKS)
def test_the_compiled_path_gives_the_bits_of_the_wrapped_environment(name, levels):
    config = QLearningConfig(
        gamma=0.99,
        exploration=EpsilonGreedy(0.3),
        max_steps=300,
        evaluation=Trials(every=5, episodes=2, max_steps=50),
        bins=6,
        levels=levels,
    )

    def plain():
        limit = 200 if name == "Pendulum-v1" else -1
        return gymnasium.make(name, disable_env_checker=True, max_episode_steps=limit)

    fast = q_learning(name, config, episodes=10, seeds=[3, 4])
    slow = q_learning(plain, config, episodes=10, seeds=[3, 4])
    for array in ("Q", "visits"):
        np.testing.assert_array_equal(fast.arrays[array], slow.arrays[array])
    assert fast.table.equals(slow.table)
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


def test_tasks_are_found_by_id_path_or_as_they_are():
    assert task_of("toy_task:Corridor") is task_of(Corridor) is Corridor
    assert task_of("MountainCar-v0").n_actions == 3
    assert task_of("Blackjack-v1") is task_of("rl_core.maze:Maze") is task_of(None) is None


def test_a_user_s_own_task_is_learned_through_a_grid_and_evaluated():
    config = QLearningConfig(gamma=0.9, exploration=EpsilonGreedy(0.3), bins=5)
    run = q_learning("toy_task:Corridor", config, episodes=200, seeds=[0])
    Q = run.arrays["Q"][0]
    np.testing.assert_allclose(Q[4, 1], -1.0, atol=1e-6)
    np.testing.assert_allclose(Q[3, 1], -1.9, atol=1e-3)
    assert (Q[:, 1] > Q[:, 0])[:5].all()
    assert gridded("toy_task:Corridor", 5).max_steps == 100
    agent = greedy(run.agent(0))
    played = evaluate("toy_task:Corridor", agent, seed=0, episodes=20, max_steps=50)
    assert played["terminated"].all()
    assert set(played["steps"]) == {4, 5}


def test_a_grid_is_plain_arrays():
    grid = make_grid(BOX, 3)
    assert isinstance(grid, Grid)
    assert [array.dtype.kind for array in grid] == ["f", "f", "i"]
