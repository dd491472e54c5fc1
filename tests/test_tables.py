"""Models read from Gymnasium's tables, against the tables themselves and known optima."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import wrappers

import rl_core  # noqa: F401  (registers the Maze)
from rl_core.mdp import MDP

ENVIRONMENTS = [
    ("FrozenLake-v1", {}),
    ("FrozenLake-v1", {"map_name": "8x8", "is_slippery": False}),
    ("CliffWalking-v1", {}),
    ("CliffWalking-v1", {"is_slippery": True}),
    ("Taxi-v4", {}),
    ("Taxi-v4", {"is_rainy": True}),
]


class Table(gym.Env[Any, Any]):
    """An environment that is nothing but a table."""

    def __init__(self, table: Any, start: int | None = 0) -> None:
        self.P = table
        if start is not None:
            self.initial_state_distrib = np.where(np.arange(len(table)) == start, 1.0, 0.0)


def table_values(table: Any, gamma: float, sweeps: int) -> np.ndarray:
    """Optimal values straight from a table: a dense matrix an action, and 1 - terminated."""
    n_states, n_actions = len(table), len(table[0])
    go_on = np.zeros((n_actions, n_states, n_states))
    reward = np.zeros((n_actions, n_states))
    for s in range(n_states):
        for a in range(n_actions):
            for p, following, r, terminated in table[s][a]:
                go_on[a, s, following] += p * (not terminated)
                reward[a, s] += p * r
    values = np.zeros(n_states)
    for _ in range(sweeps):
        values = (reward + gamma * go_on @ values).max(axis=0)
    return values


def model_values(model: MDP, gamma: float, sweeps: int) -> np.ndarray:
    values = np.zeros(model.n_states)
    for _ in range(sweeps):
        target = model.reward + gamma * values[model.successor]
        values = (model.probability * target).sum(axis=2).max(axis=1)
    return values


@pytest.mark.parametrize(("name", "options"), ENVIRONMENTS)
def test_optimal_values_are_those_of_the_table(name: str, options: dict[str, Any]) -> None:
    env = gym.make(name, **options)
    model = MDP.from_env(env)
    by_model = model_values(model, 0.95, 400)
    by_table = table_values(env.unwrapped.P, 0.95, 400)
    live = ~model.terminal[: len(by_table)]
    assert np.abs(by_table[live]).max() > 0.1
    np.testing.assert_allclose(by_model[: len(by_table)][live], by_table[live], atol=1e-9)
    assert not by_model[model.terminal].any()


def test_known_optima() -> None:
    lake = MDP.from_env("FrozenLake-v1")
    assert model_values(lake, 1.0, 5000)[0] == pytest.approx(14 / 17, abs=1e-9)
    cliff = MDP.from_env("CliffWalking-v1")
    assert model_values(cliff, 1.0, 100)[cliff.start_state] == -13
    taxi = MDP.from_env("Taxi-v4")
    values = model_values(taxi, 1.0, 100)
    assert taxi.start_probability @ values[taxi.start_state] == pytest.approx(7.93, abs=0.005)


def test_shapes_terminal_states_and_starts() -> None:
    lake = MDP.from_env("FrozenLake-v1")
    assert lake.successor.shape == (16, 4, 3)
    assert np.flatnonzero(lake.terminal).tolist() == [5, 7, 11, 12, 15]
    assert lake.start_state.tolist() == [0]
    cliff = MDP.from_env("CliffWalking-v1")
    assert cliff.successor.shape == (48, 4, 1)
    assert np.flatnonzero(cliff.terminal).tolist() == [47]
    assert cliff.start_state.tolist() == [36]
    taxi = MDP.from_env("Taxi-v4")
    assert taxi.successor.shape == (501, 6, 1)
    assert np.flatnonzero(taxi.terminal).tolist() == [500]
    assert len(taxi.start_state) == 300
    assert taxi.reachable_states().sum() == 401


def test_only_deliveries_are_redirected_in_taxi() -> None:
    env = gym.make("Taxi-v4").unwrapped
    model = MDP.from_env(env)
    into_extra = np.argwhere(model.successor[:500] == 500)[:, :2].tolist()
    deliveries = [[s, a] for s in range(500) for a in range(6) if env.P[s][a][0][3]]
    assert into_extra == deliveries
    assert (model.reward[:500][model.successor[:500] == 500] == 20).all()


@pytest.mark.parametrize(("name", "options"), ENVIRONMENTS)
def test_one_uniform_a_step_draws_what_gymnasium_draws(name: str, options: dict[str, Any]) -> None:
    env = gym.make(name, **options).unwrapped
    model = MDP.from_env(env)
    if name.startswith("Taxi"):
        env.reset(seed=5)
    state, _ = env.reset(seed=5)
    rng = np.random.default_rng(5)
    cumulative = np.cumsum(model.start_probability)
    assert state == model.start_state[np.argmax(cumulative > rng.random())]
    actions = np.random.default_rng(6).integers(model.n_actions, size=300)
    for action in actions:
        slot = np.argmax(np.cumsum(model.probability[state, action]) > rng.random())
        following = model.successor[state, action, slot]
        reward = model.reward[state, action, slot]
        state, given_reward, terminated, _, _ = env.step(action)
        assert given_reward == reward
        assert terminated == model.terminal[following]
        if terminated:
            state, _ = env.reset()
            start = np.argmax(cumulative > rng.random())
            assert state == model.start_state[start]
        else:
            assert state == following


def test_wrapped_made_and_bare_environments_give_the_same_model() -> None:
    models = [
        MDP.from_env("FrozenLake-v1"),
        MDP.from_env(gym.make("FrozenLake-v1")),
        MDP.from_env(gym.make("FrozenLake-v1").unwrapped),
    ]
    for name in MDP.__dataclass_fields__:
        for other in models[1:]:
            np.testing.assert_array_equal(getattr(models[0], name), getattr(other, name))


def test_rows_of_unequal_length_are_filled_with_the_state_itself() -> None:
    env = Table([[[(0.5, 0, 1.0, False), (0.5, 1, 0.0, True)]], [[(1.0, 1, 0.0, True)]]])
    model = MDP.from_env(env)
    assert model.successor.tolist() == [[[0, 1]], [[1, 1]]]
    assert model.probability.tolist() == [[[0.5, 0.5]], [[1.0, 0.0]]]
    assert model.terminal.tolist() == [False, True]


def test_a_start_state_to_return_to_is_not_terminal() -> None:
    # Leave home, come back: the episode ends at home, where it began.
    env = Table([[[(1.0, 1, 0.0, False)]], [[(1.0, 0, 1.0, True)]]])
    model = MDP.from_env(env)
    assert model.terminal.tolist() == [False, False, True]
    assert model.successor[:, 0, 0].tolist() == [1, 2, 2]
    assert model_values(model, 0.5, 10).tolist() == [0.5, 1.0, 0.0]


def test_what_the_table_says_after_the_end_does_not_matter() -> None:
    rows = [[[(1.0, 1, 1.0, True)]], [[(1.0, 1, -1.0, False)]]]
    model = MDP.from_env(Table(rows))
    assert model.terminal.tolist() == [False, True]
    assert model.reward.tolist() == [[[1.0]], [[0.0]]]


def test_a_state_that_absorbs_with_reward_0_is_terminal() -> None:
    rows = [[[(1.0, 1, 1.0, False)]], [[(1.0, 1, 0.0, False)]]]
    assert MDP.from_env(Table(rows)).terminal.tolist() == [False, True]
    rows = [[[(1.0, 1, 1.0, False)]], [[(1.0, 1, -1.0, False)]]]
    assert MDP.from_env(Table(rows)).terminal.tolist() == [False, False]


def test_quitting_without_moving_ends_the_episode() -> None:
    env = Table([[[(1.0, 0, 0.0, False)], [(1.0, 0, 3.0, True)]]])
    model = MDP.from_env(env)
    assert model.terminal.tolist() == [False, True]
    assert model_values(model, 0.9, 100).tolist() == [3.0, 0.0]


def test_transitions_of_probability_0_decide_nothing() -> None:
    rows = [[[(1.0, 1, 1.0, True), (0.0, 1, 0.0, False)]], [[(1.0, 0, 5.0, False)]]]
    model = MDP.from_env(Table(rows))
    assert model.terminal.tolist() == [False, True]


def test_the_start_may_be_given() -> None:
    rows = [[[(1.0, 1, 1.0, True)]], [[(1.0, 1, 0.0, True)]]]
    with pytest.raises(ValueError, match="start_distribution must be given"):
        MDP.from_env(Table(rows, start=None))
    model = MDP.from_env(Table(rows, start=None), start_distribution=[1.0, 0.0])
    assert model.start_state.tolist() == [0]
    uniform = MDP.from_env("rl_core/Maze-v0", start_distribution=np.full(112, 1 / 112))
    assert len(uniform.start_state) == 112
    with pytest.raises(ValueError, match=r"start_distribution.*\(2\), got \(3,\)"):
        MDP.from_env(Table(rows), start_distribution=[1.0, 0.0, 0.0])
    with pytest.raises(TypeError, match=r"start_distribution must be .*<U1"):
        MDP.from_env(Table(rows), start_distribution=["a", "b"])
    with pytest.raises(TypeError, match=r"start_distribution must be .*<U3"):
        MDP.from_env(Table(rows), start_distribution=["1.0", "0.0"])
    with pytest.raises(ValueError, match="start_probability must sum to 1"):
        MDP.from_env(Table(rows), start_distribution=[0.5, 0.0])
    with pytest.raises(ValueError, match=r"start_probability.*-1"):
        MDP.from_env(Table(rows), start_distribution=[-1.0, 2.0])


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([], "P of Table.*empty"),
        ([[]], "P of Table.*at least one; state 0 has 0"),
        ([[[(1.0, 0, 0.0, False)]], []], "P of Table.*state 1 has 0, state 0 has 1"),
        ([[[(1.0, 0, 0.0, False)]], [[], []]], "P of Table.*state 1 has 2, state 0 has 1"),
        ({0: {0: []}, 2: {0: []}}, "P of Table.*numbered from 0 .*, not so at state 1"),
        ({0: {1: []}}, "P of Table.*numbered from 0 .*, not so at state 0"),
        ([[[(1.0, 1, 0.0, False)]]], r"P of Table.*state 0, action 0 there is \(1.0, 1, 0.0"),
        ([[[(1.0, -1, 0.0, False)]]], r"P of Table.*state 0, action 0 there is \(1.0, -1"),
        ([[[(1.0, 0)]]], r"P of Table.*state 0, action 0 there is \(1.0, 0\)"),
        ([[[(1.0, 1.5, 0.0, False)]] * 2], "P of Table.*state 0, action 0 there is .1.0, 1.5"),
        ([[[(1.0, True, 0.0, False)]]] * 2, "P of Table.*state 0, action 0 there is .1.0, True"),
        ([[[(1.0, 0, 0.0, False)], [7]]], "P of Table.*state 0, action 1 there is 7"),
        ([[["rain"]]], "P of Table.*state 0, action 0 there is 'rain'"),
        ([[[("1", 0, 0.0, False)]]], "P of Table.*there is .'1', 0"),
        ([[[(1.5, 0, 0.0, False)]]], "P of Table.*there is .1.5, 0"),
        ([[[(np.nan, 0, 0.0, False)]]], "P of Table.*there is .nan, 0"),
        ([[[(1.0, 0, None, False)]]], "P of Table.*there is .1.0, 0, None"),
        ([[[(1.0, 0, 0.0, "no")]]], "P of Table.*there is .*'no'"),
        ([[3]], "P of Table.*list of transitions, not so at state 0"),
        (
            {0: {0: [(0.5, 0, 0.0, False)], 1: [(1.0, 0, 0.0, False)]}},
            "P of Table.*probability must sum to 1, at state 0, action 0 the sum is 0.5",
        ),
        ([[[(0.5, 0, 1.0, False)]]], "probability must sum to 1.*state 0, action 0"),
        ([[[(1.0, 0, np.inf, False)]]], "P of Table.*state 0, action 0 there is .1.0, 0, inf"),
    ],
)
def test_malformed_tables_are_named(rows: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        MDP.from_env(Table(rows))


def test_only_an_environment_that_says_so_is_asked_for_its_model() -> None:
    class World(Table):
        def model(self, x: float) -> float:
            return x

    rows = [[[(1.0, 1, 1.0, True)]], [[(1.0, 1, 0.0, True)]]]
    assert MDP.from_env(World(rows)).n_states == 2


def test_environments_without_a_table_are_refused() -> None:
    with pytest.raises(
        ValueError,
        match=r"env must be an id .*'Labyrinth-v0': .*doesn't exist",
    ):
        MDP.from_env("Labyrinth-v0")
    with pytest.raises(ValueError, match=r"CartPole.* has none"):
        MDP.from_env("CartPole-v1")
    with pytest.raises(TypeError, match=r"env must be a Gymnasium id, .* that makes one, got {}"):
        MDP.from_env({})  # type: ignore[arg-type]


class Halved(gym.RewardWrapper):
    """Half the reward."""

    def reward(self, reward: Any) -> float:
        """Return half."""
        return reward / 2


@pytest.mark.parametrize(
    "wrapper",
    [
        Halved,
        lambda env: wrappers.TransformReward(env, lambda reward: 2 * reward),
        lambda env: wrappers.StickyAction(env, 0.5),
        lambda env: wrappers.TransformObservation(env, lambda s: s, None),
        lambda env: wrappers.TimeLimit(Halved(env), 10),
    ],
)
@pytest.mark.parametrize("name", ["FrozenLake-v1", "rl_core/Maze-v0"])
def test_wrappers_that_may_change_the_task_are_named(name: str, wrapper: Any) -> None:
    env = wrapper(gym.make(name))
    inner = env.env if isinstance(env, wrappers.TimeLimit) else env
    with pytest.raises(ValueError, match=f"env must be .*, got {type(inner).__name__} "):
        MDP.from_env(env)


def test_a_subclass_of_a_transparent_wrapper_is_not_transparent() -> None:
    class Cheating(wrappers.TimeLimit):
        def step(self, action: Any) -> Any:
            return self.env.step(0)

    with pytest.raises(ValueError, match="got Cheating"):
        MDP.from_env(Cheating(gym.make("FrozenLake-v1"), 10))


def test_wrappers_that_leave_the_task_alone_are_read_through() -> None:
    env = wrappers.RecordEpisodeStatistics(gym.make("FrozenLake-v1"))
    env = wrappers.Autoreset(wrappers.TimeLimit(env, 7))
    np.testing.assert_array_equal(MDP.from_env(env).reward, MDP.from_env("FrozenLake-v1").reward)


def test_the_cause_that_gymnasium_gave_is_told() -> None:
    def broken() -> Any:
        raise ImportError("Box2D is not installed")

    gym.register("Broken-v0", entry_point=broken)
    try:
        with pytest.raises(ValueError, match="got 'Broken-v0': Box2D is not installed"):
            MDP.from_env("Broken-v0")
    finally:
        del gym.registry["Broken-v0"]


def test_a_start_index_of_the_environment() -> None:
    env = Table([[[(1.0, 1, 1.0, False)]], [[(1.0, 0, 0.0, False)]]], start=None)
    env.start_state_index = 1
    assert MDP.from_env(env).start_state.tolist() == [1]
    env.start_state_index = 2
    with pytest.raises(ValueError, match="start_state_index must be an integer from 0 to 1, got 2"):
        MDP.from_env(env)
