"""Q-learning against hand calculations, a plain reimplementation, and itself on another path."""

import dataclasses
import json

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from gymnasium import spaces

from rl_core.exploration import (
    EpsilonGreedy,
    Evaluation,
    Geometric,
    Linear,
    Softmax,
    UnnormalisedSoftmax,
    VisitDecay,
)
from rl_core.identity import describe
from rl_core.maze import Maze
from rl_core.mdp import MDP
from rl_core.planning import optimal_actions, value_iteration
from rl_core.q_learning import QLearningConfig, q_learning, q_learning_on_model
from rl_core.tabular import spawn_streams
from rl_core.tabular_record import COLUMNS, make_yardstick, new_appraisal, value_lost

MEASURED = ("error_norm", "rmse", "rmse_visitable", "optimal_states", "value_lost")


@pytest.fixture(scope="module")
def maze():
    return Maze().model()


@pytest.fixture(scope="module")
def Q_star(maze):
    return value_iteration(maze, gamma=0.9, tolerance=1e-10, progress=False).Q


def chain(reward=1.0, loop=False):
    """One state, one action: it pays and ends the episode, or goes on for ever."""
    return MDP(
        successor=[[[0 if loop else 1]], [[1]]],
        probability=[[[1.0]], [[1.0]]],
        reward=[[[reward]], [[0.0]]],
        terminal=[False, True],
        start_state=[0],
        start_probability=[1.0],
    )


def coin():
    """One state, one action: the episode ends with reward 0 or 1, evenly."""
    return MDP(
        successor=[[[1, 1]], [[1, 1]]],
        probability=[[[0.5, 0.5]], [[0.5, 0.5]]],
        reward=[[[0.0, 1.0]], [[0.0, 0.0]]],
        terminal=[False, True],
        start_state=[0],
        start_probability=[1.0],
    )


def same_bits(one, other):
    pd.testing.assert_frame_equal(one.table, other.table, check_exact=True)
    assert one.arrays.keys() == other.arrays.keys()
    for name in one.arrays:
        np.testing.assert_array_equal(one.arrays[name], other.arrays[name])


# The update


def test_a_constant_step_size_forgets_the_start_geometrically():
    run = q_learning(chain(reward=3.0), QLearningConfig(step_size=0.2), episodes=7, seeds=[0])
    assert run.arrays["Q"][0, 0, 0] == pytest.approx(3.0 * (1 - 0.8**7))


def test_a_step_size_of_one_over_visits_averages_the_rewards():
    config = QLearningConfig(step_size=VisitDecay(initial=1.0, exponent=1.0))
    run = q_learning(coin(), config, episodes=40, seeds=[5])
    assert run.arrays["Q"][0, 0, 0] == pytest.approx(run.table["return"].mean())
    assert 0 < run.table["return"].mean() < 1


def test_a_scheduled_step_size_changes_from_episode_to_episode():
    config = QLearningConfig(step_size=Linear(1.0, 0.5, episodes=1))
    run = q_learning(coin(), config, episodes=3, seeds=[0])
    first, second, third = run.table["return"]
    assert run.arrays["Q"][0, 0, 0] == pytest.approx(first / 4 + second / 4 + third / 2)


def test_an_episode_that_is_cut_off_bootstraps_and_is_counted():
    config = QLearningConfig(gamma=0.5, step_size=1.0, max_steps=1)
    run = q_learning(chain(loop=True), config, episodes=10, seeds=[0])
    assert run.arrays["Q"][0, 0, 0] == 2.0 * (1 - 0.5**10)  # 1 + 1/2 + 1/4 + ...
    assert not run.table["terminated"].any()
    assert (run.table["steps"] == 1).all()


def test_it_finds_the_optimal_values_of_the_maze(maze, Q_star):
    config = QLearningConfig(step_size=VisitDecay(1.0, 0.6), exploration=EpsilonGreedy(0.9))
    run = q_learning(maze, config, episodes=20_000, seeds=[1001], Q_star=Q_star)
    last = run.table.iloc[-1]
    assert last["rmse_visitable"] < 0.02
    assert last["optimal_states"] >= 85
    assert last["value_lost"] < 1e-3
    # What no experience can reduce: the values of the states that cannot be reached.
    unreachable = ~maze.reachable_states()
    plateau = np.linalg.norm(Q_star[unreachable])
    assert plateau == pytest.approx(7.957, abs=5e-4)
    assert plateau <= last["error_norm"] < plateau + 0.02
    assert not run.arrays["Q"][0, unreachable].any()


def test_it_is_the_textbook_program(Q_star):
    """The same run, written anew for Gymnasium without any of the package's loops."""
    episodes, alpha, gamma, epsilon = 60, 0.3, 0.9, 0.6
    start, step, policy = spawn_streams(7, 2)[0]
    env = Maze()
    Q, visits, rows = np.zeros((112, 4)), np.zeros((112, 4), dtype=int), []
    for _ in range(episodes):
        s, _ = env.reset()
        env.np_random = step
        steps, total, terminated = 0, 0.0, False
        while not terminated:
            u, v = policy.random(), policy.random()
            greedy = [a for a in range(4) if Q[s, a] == max(Q[s])]
            a = int(v * 4) if u < epsilon else greedy[int(v * len(greedy))]
            s_next, r, terminated, _, _ = env.step(a)
            target = r + (0.0 if terminated else gamma * max(Q[s_next]))
            Q[s, a] += alpha * (target - Q[s, a])
            visits[s, a] += 1
            s, steps, total = s_next, steps + 1, total + r
        rows.append((steps, total, (visits > 0).sum(), np.linalg.norm(Q - Q_star)))
    config = QLearningConfig(gamma=gamma, step_size=alpha, exploration=EpsilonGreedy(epsilon))
    run = q_learning(Maze().model(), config, episodes=episodes, seeds=[7], Q_star=Q_star)
    np.testing.assert_array_equal(run.arrays["Q"][0], Q)
    np.testing.assert_array_equal(run.arrays["visits"][0], visits)
    ours = run.table[["steps", "return", "visited_entries", "error_norm"]].to_numpy(dtype=float)
    assert ours == pytest.approx(np.array(rows, dtype=float))
    assert start.random() == spawn_streams(7, 2)[0].start.random()  # the Maze's reset drew nothing


# The two paths


@pytest.mark.parametrize(
    ("env", "episodes"),
    [
        ("rl_core/Maze-v0", 60),
        ("FrozenLake-v1", 200),
        ("CliffWalking-v1", 12),
        ("Taxi-v4", 12),
    ],
)
@pytest.mark.parametrize(
    ("exploration", "step_size"),
    [
        (EpsilonGreedy(0.5), 0.2),
        (Softmax(Geometric(2.0, 0.1, episodes=10)), VisitDecay(Linear(0.9, 0.5, 5), 0.7)),
    ],
)
def test_the_compiled_path_and_the_plain_loop_agree_bit_for_bit(
    env, episodes, exploration, step_size
):
    config = QLearningConfig(
        step_size=step_size, exploration=exploration, evaluation=Evaluation(every=6, episodes=3)
    )
    snapshots = (0, 3, episodes)
    compiled = q_learning_on_model(
        env, config, episodes=episodes, seeds=[3, 11], snapshots=snapshots
    )
    model = MDP.from_env(env)
    Q_star = value_iteration(model, gamma=0.9, tolerance=1e-10, progress=False).Q
    n_states = gym.make(env).observation_space.n
    plain = q_learning(
        *(env, config),
        episodes=episodes,
        seeds=[3, 11],
        Q_star=Q_star[:n_states],
        snapshots=snapshots,
    )
    assert compiled.arrays["Q"].any()
    for name, array in plain.arrays.items():
        np.testing.assert_array_equal(compiled.arrays[name][..., :n_states, :], array)
    # Taxi's model has one more state, in which all its episodes end: one more row of zeros.
    drop = ["rmse"] if len(Q_star) > n_states else []
    pd.testing.assert_frame_equal(
        compiled.table.drop(columns=drop), plain.table.drop(columns=drop), check_exact=True
    )
    assert plain.table.notna().any().all()


def test_a_time_limit_truncates_without_terminating():
    config = QLearningConfig(exploration=EpsilonGreedy(1.0), max_steps=500)
    run = q_learning_on_model("Taxi-v4", config, episodes=40, seeds=[0, 1])
    limit = gym.spec("Taxi-v4").max_episode_steps
    cut = run.table[~run.table["terminated"]]
    assert len(cut) > 0
    assert (cut["steps"] == limit).all()
    assert (run.table["steps"] <= limit).all()


def test_a_cap_is_a_time_limit():
    config = QLearningConfig(
        exploration=EpsilonGreedy(0.5),
        max_steps=6,
        evaluation=Evaluation(every=10, max_steps=6),
    )
    capped = q_learning(MDP.from_env("FrozenLake-v1"), config, episodes=300, seeds=[0])
    limited = q_learning(
        lambda: gym.make("FrozenLake-v1", max_episode_steps=6),
        QLearningConfig(exploration=EpsilonGreedy(0.5), evaluation=Evaluation(every=10)),
        episodes=300,
        seeds=[0],
    )
    same_bits(capped, limited)
    assert 0 < capped.table["terminated"].mean() < 1


def test_environments_may_come_as_id_factory_or_instance(Q_star):
    config = QLearningConfig(exploration=EpsilonGreedy(0.9))
    ways = ["rl_core/Maze-v0", Maze, Maze(), gym.make("rl_core/Maze-v0")]
    runs = [q_learning(way, config, episodes=5, seeds=[2], Q_star=Q_star) for way in ways]
    for run in runs[1:]:
        same_bits(runs[0], run)


class Shifted(gym.Env):
    """Spaces that do not count from 0, and no model; pays for actions 7 and 8, two steps long."""

    observation_space = spaces.Discrete(3, start=10)
    action_space = spaces.Discrete(2, start=7)

    def __init__(self, rewards=(1.0, 2.0)):
        self.rewards = rewards

    def reset(self, *, seed=None, options=None):  # noqa: D102
        super().reset(seed=seed)
        self.s = 10
        return self.s, {}

    def step(self, action):  # noqa: D102
        assert self.action_space.contains(action)
        self.s += 1
        return self.s, self.rewards[action - 7], self.s == 12, False, {}


class RoundTrip(Shifted):
    """Ends where it began: 10, 11, and 10 again, which pays and terminates."""

    def step(self, action):  # noqa: D102
        self.s = 21 - self.s
        return self.s, float(self.s == 10), self.s == 10, False, {}


def test_nothing_is_expected_after_the_end_even_of_a_state_that_has_a_value():
    config = QLearningConfig(gamma=0.5, step_size=1.0, exploration=EpsilonGreedy(1.0))
    run = q_learning(RoundTrip, config, episodes=60, seeds=[0])
    np.testing.assert_array_equal(run.arrays["Q"][0], [[0.5, 0.5], [1.0, 1.0], [0.0, 0.0]])


def test_spaces_need_not_count_from_zero():
    config = QLearningConfig(gamma=0.5, step_size=1.0, exploration=EpsilonGreedy(1.0))
    run = q_learning(
        Shifted, config, episodes=60, seeds=[0], Q_star=[[2.0, 3.0], [1.0, 2.0], [0.0, 0.0]]
    )
    np.testing.assert_array_equal(run.arrays["Q"][0], [[2.0, 3.0], [1.0, 2.0], [0.0, 0.0]])
    last = run.table.iloc[-1]
    assert last["error_norm"] == last["rmse"] == 0.0
    # What it takes a model to know:
    assert last[["rmse_visitable", "optimal_states", "value_lost"]].isna().all()


def test_without_optimal_values_the_errors_are_missing(maze):
    run = q_learning(maze, QLearningConfig(), episodes=50, seeds=[0])
    assert run.table[list(MEASURED)].isna().all(axis=None)
    assert run.table["visited_entries"].iloc[-1] == (run.arrays["visits"] > 0).sum()
    assert run.table["eval_return"].notna().sum() == 1


# What is recorded


def test_the_record_is_what_the_snapshots_say(maze, Q_star):
    config = QLearningConfig(exploration=EpsilonGreedy(0.7))
    at = tuple(range(0, 401, 25))  # between the evaluations too
    run = q_learning(maze, config, episodes=400, seeds=[4], Q_star=Q_star, snapshots=at)
    assert list(run.table.columns) == ["seed", "episode", *COLUMNS]
    visitable = maze.reachable_states() & ~maze.terminal
    optimal = optimal_actions(Q_star)
    assert not run.arrays["Q_snapshots"][0, 0].any()
    for j, episode in enumerate(at[1:], start=1):
        Q, visits = run.arrays["Q_snapshots"][0, j], run.arrays["visits_snapshots"][0, j]
        row = run.table.set_index("episode").loc[episode]
        assert row["visited_entries"] == (visits > 0).sum()
        assert row["env_steps"] == visits.sum() == run.table["steps"][:episode].sum()
        assert row["error_norm"] == pytest.approx(np.linalg.norm(Q - Q_star))
        assert row["rmse"] == pytest.approx(row["error_norm"] / np.sqrt(448))
        inside = np.sqrt(np.mean((Q - Q_star)[visitable] ** 2))
        assert row["rmse_visitable"] == pytest.approx(inside)
        greedy = np.isclose(Q, Q.max(axis=1, keepdims=True), rtol=0, atol=0)
        right = (~greedy | optimal).all(axis=1)
        assert row["optimal_states"] == right[visitable].sum()
        assert row["value_lost"] == pytest.approx(loss(maze, Q, Q_star), abs=1e-9)


def test_the_value_lost_is_known_after_every_episode(maze, Q_star):
    every = tuple(range(1, 61))
    config = QLearningConfig(step_size=0.9, exploration=EpsilonGreedy(0.5))
    run = q_learning(maze, config, episodes=60, seeds=[2], Q_star=Q_star, snapshots=every)
    expected = [loss(maze, Q, Q_star) for Q in run.arrays["Q_snapshots"][0]]
    assert run.table["value_lost"].tolist() == pytest.approx(expected, abs=1e-9)
    assert len(set(np.round(expected, 6))) > 10


def test_an_appraisal_goes_on_from_the_policy_before(maze, Q_star):
    yardstick = make_yardstick(maze, Q_star, Q_star.shape)
    appraisal, rng = new_appraisal(yardstick), np.random.default_rng(0)
    for noise in (0.0, 0.02, 0.02, 0.3, 5.0, 0.0):
        Q = Q_star + noise * rng.normal(size=Q_star.shape)
        lost = value_lost(Q, yardstick, 0.9, appraisal)
        assert lost == pytest.approx(loss(maze, Q, Q_star), abs=1e-9)
        assert value_lost(2 * Q, yardstick, 0.9, appraisal) == lost  # the same policy


def loss(mdp, Q, Q_star, gamma=0.9):
    """The value lost by the greedy policy, from the linear equations of its value."""
    greedy = np.isclose(Q, Q.max(axis=1, keepdims=True), rtol=0, atol=0)
    weight = (greedy / greedy.sum(axis=1, keepdims=True))[:, :, None] * mdp.probability
    P = np.zeros((mdp.n_states, mdp.n_states))
    np.add.at(P, (np.arange(mdp.n_states)[:, None, None], mdp.successor), weight)
    V = np.linalg.solve(np.eye(mdp.n_states) - gamma * P, (weight * mdp.reward).sum(axis=(1, 2)))
    return mdp.start_probability @ (Q_star.max(axis=1) - V)[mdp.start_state]


def test_the_value_lost_is_averaged_over_start_states():
    model = MDP.from_env("Taxi-v4")
    Q_star = value_iteration(model, gamma=0.9, tolerance=1e-10, progress=False).Q
    run = q_learning_on_model("Taxi-v4", QLearningConfig(), episodes=50, seeds=[0])
    lost = run.table["value_lost"].iloc[-1]
    assert lost == pytest.approx(loss(model, run.arrays["Q"][0], Q_star), abs=1e-9)
    assert lost > 1


def test_the_optimal_table_loses_nothing(maze, Q_star):
    config = QLearningConfig(step_size=VisitDecay(1.0, 0.6), exploration=EpsilonGreedy(0.9))
    run = q_learning(maze, config, episodes=20_000, seeds=[1000], Q_star=Q_star)
    evaluated = run.table.dropna()
    assert evaluated["value_lost"].min() > -1e-9
    assert evaluated["value_lost"].max() > 0.05
    assert evaluated["value_lost"].iloc[-1] < 1e-3
    assert evaluated["eval_return"].iloc[-40:].mean() > evaluated["eval_return"].iloc[:5].mean()


def test_a_policy_that_never_ends_has_no_value_without_discount():
    config = QLearningConfig(gamma=1.0, max_steps=5)
    run = q_learning(chain(loop=True), config, episodes=50, seeds=[0], Q_star=[[9.0], [0.0]])
    assert np.isnan(run.table["value_lost"].iloc[-1])


def test_the_evaluation_plays_short_episodes_and_leaves_learning_alone(maze):
    runs = [
        q_learning(
            *(maze, QLearningConfig(exploration=EpsilonGreedy(0.5), evaluation=evaluation)),
            episodes=60,
            seeds=[0],
        )
        for evaluation in (Evaluation(), Evaluation(every=7, episodes=4, max_steps=9, epsilon=1))
    ]
    np.testing.assert_array_equal(runs[0].arrays["Q"], runs[1].arrays["Q"])
    evaluated = runs[1].table.dropna(subset="eval_steps")
    assert evaluated["episode"].tolist() == [7, 14, 21, 28, 35, 42, 49, 56]
    assert (evaluated["eval_steps"] == 9).all()  # a random walk is not at the goal so soon
    assert runs[0].table.dropna(subset="eval_steps")["episode"].tolist() == [50]


def test_the_evaluation_returns_what_the_greedy_policy_earns():
    run = q_learning(chain(reward=3.0), QLearningConfig(), episodes=50, seeds=[0])
    assert run.table["eval_return"].iloc[-1] == 3.0
    assert run.table["eval_steps"].iloc[-1] == 1.0


def test_the_faulty_softmax_of_2018_never_leaves_the_start(maze):
    config = QLearningConfig(exploration=UnnormalisedSoftmax(), max_steps=100)
    run = q_learning(maze, config, episodes=20, seeds=[0])
    assert not run.table["terminated"].any()
    assert (run.table["visited_entries"] == 1).all()
    assert run.arrays["visits"][0, 0, 0] == 2000


# Randomness


def test_a_seed_gives_the_same_bits_alone_and_among_others(maze, Q_star):
    config = QLearningConfig(exploration=Softmax(0.2))
    several = q_learning(maze, config, episodes=60, seeds=[5, 0, 9], Q_star=Q_star)
    alone = q_learning(maze, config, episodes=60, seeds=[9], Q_star=Q_star)
    np.testing.assert_array_equal(several.arrays["Q"][2], alone.arrays["Q"][0])
    of_nine = several.table[several.table["seed"] == 9].reset_index(drop=True)
    pd.testing.assert_frame_equal(of_nine, alone.table, check_exact=True)
    assert several.table["seed"].unique().tolist() == [5, 0, 9]
    assert len({Q.tobytes() for Q in several.arrays["Q"]}) == 3


def test_snapshots_do_not_change_the_run(maze):
    config = QLearningConfig()
    plain = q_learning(maze, config, episodes=80, seeds=[1])
    watched = q_learning(maze, config, episodes=80, seeds=[1], snapshots=(80, 0, 33))
    np.testing.assert_array_equal(plain.arrays["Q"], watched.arrays["Q"])
    np.testing.assert_array_equal(watched.arrays["Q_snapshots"][0, 0], watched.arrays["Q"][0])
    assert watched.arrays["visits_snapshots"].sum(axis=(2, 3)).tolist() == [
        [plain.table["steps"].sum(), 0, plain.table["steps"][:33].sum()]
    ]


def test_global_random_states_are_left_alone():
    np.random.seed(1)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    q_learning("FrozenLake-v1", QLearningConfig(), episodes=5, seeds=[0])
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002


def test_progress_counts_over_all_seeds(maze):
    calls = []
    run = q_learning(
        *(maze, QLearningConfig()),
        episodes=10,
        seeds=[0, 1],
        progress=lambda episodes, env_steps: calls.append((episodes, env_steps)),
    )
    per_seed = run.table.groupby("seed")["steps"].sum().tolist()
    assert calls == [(10, per_seed[0]), (20, sum(per_seed))]


# Failures and wrong arguments


def test_a_return_that_is_not_finite_stops_that_seed_only():
    class Breaking(Shifted):
        count = 0

        def step(self, action):
            type(self).count += 1
            s, r, *rest = super().step(action)
            return s, np.inf if type(self).count == 7 else r, *rest

    run = q_learning(Breaking, QLearningConfig(), episodes=10, seeds=[0, 1])
    assert [(f.seed, f.episode) for f in run.failures] == [(0, 4)]
    assert "not finite" in run.failures[0].reason
    assert run.table.groupby("seed").size().tolist() == [4, 10]


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"step_size": 0.0}, ValueError, r"step_size is 0.0; allowed are numbers in \(0, 1\]"),
        ({"step_size": 1.01}, ValueError, "step_size is 1.01"),
        ({"step_size": np.nan}, ValueError, "step_size is nan"),
        ({"step_size": Linear(0.5, 0.0, 9)}, ValueError, "step_size.end is 0.0"),
        ({"step_size": "fast"}, TypeError, "step_size is 'fast'"),
        ({"gamma": 1.5}, ValueError, r"gamma is 1.5; allowed are numbers in \[0, 1\]"),
        ({"gamma": -0.1}, ValueError, "gamma is -0.1"),
        ({"gamma": Linear(0.5, 0.9, 9)}, TypeError, "gamma is Linear"),
        ({"exploration": 0.1}, TypeError, "exploration is 0.1; allowed are instances of"),
        ({"evaluation": None}, TypeError, "evaluation is None"),
        ({"max_steps": 0}, ValueError, "max_steps is 0; allowed are integers from 1"),
        ({"max_steps": 10.0}, TypeError, "max_steps is 10.0"),
    ],
)
def test_wrong_settings_are_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        QLearningConfig(**arguments)


class Untouchable(Maze):
    """A maze in which nothing may run."""

    def reset(self, **_):  # noqa: D102
        raise AssertionError("it ran")


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"Q_star": np.zeros((112, 3))}, ValueError, r"Q_star .*\(112, 3\); .* \(112, 4\)"),
        ({"Q_star": np.full((112, 4), np.nan)}, ValueError, "Q_star has entries .* not finite"),
        ({"Q_star": [["a"] * 4] * 112}, TypeError, "Q_star has dtype"),
        ({"Q_star": [[1.0], [1.0, 2.0]]}, ValueError, r"Q_star is \[\[1.0\].* \(112, 4\)"),
        ({"episodes": 0}, ValueError, "episodes is 0; allowed are integers from 1"),
        ({"episodes": 2.5}, TypeError, "episodes is 2.5"),
        ({"seeds": []}, ValueError, r"seeds is \[\]"),
        ({"seeds": [0, 0]}, ValueError, r"seeds is \[0, 0\]; allowed .* once"),
        ({"seeds": [-1]}, ValueError, "seeds is -1; allowed are integers from 0"),
        ({"seeds": 3}, TypeError, "seeds is 3; allowed is a sequence of integers from 0"),
        ({"snapshots": 5}, TypeError, "snapshots is 5; allowed is a sequence of integers from 0"),
        ({"snapshots": (11,)}, ValueError, "snapshots has 11; allowed are 0 to 10"),
        ({"config": {"gamma": 0.9}}, TypeError, "config is {'gamma': 0.9}"),
        ({"env": "MountainCar-v0"}, ValueError, "env has the observation space Box.*Discrete"),
        ({"env": "Blackjack-v1"}, ValueError, r"env has the observation space Tuple"),
        ({"env": 3}, TypeError, "env is 3; allowed is an MDP"),
        ({"env": "Labyrinth-v0"}, ValueError, "env is 'Labyrinth-v0'; allowed are ids that Gymn"),
        ({"env": lambda: 3}, TypeError, "allowed is an MDP"),
    ],
)
def test_wrong_arguments_are_refused_before_anything_runs(arguments, error, message):
    usual = {"env": Untouchable(), "config": QLearningConfig(), "episodes": 10, "seeds": [0]}
    with pytest.raises(error, match=message):
        q_learning(**{**usual, **arguments})
    usual["env"] = Maze().model()
    with pytest.raises(error, match=message):
        q_learning(**{**usual, **arguments})


def test_seeds_and_snapshots_may_be_arrays(maze):
    config = QLearningConfig(exploration=EpsilonGreedy(0.9))
    by_array = q_learning(maze, config, episodes=4, seeds=np.arange(3), snapshots=np.array([0, 4]))
    same_bits(by_array, q_learning(maze, config, episodes=4, seeds=[0, 1, 2], snapshots=(0, 4)))


class Unrelated(gym.Env):
    """Two states, no model; what it calls `P` or `model` is something else."""

    observation_space, action_space = spaces.Discrete(2), spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):  # noqa: D102
        super().reset(seed=seed)
        return 0, {}

    def step(self, action):  # noqa: D102
        return 1, float(action), True, False, {}


@pytest.mark.parametrize(
    "attributes",
    [
        *({"P": 3}, {"P": np.eye(3)}, {"P": "none"}, {"P": {0: 1.0}}, {"P": [[None]]}),
        *({"P": [[[(1.0, 0, 0.0, False)], [3]]] * 2}, {"P": lambda s: s}),
        *({"model": lambda self, x: x}, {"model": lambda self: 3}, {"model": 3}),
    ],
)
def test_an_environment_may_use_the_names_of_a_model_for_something_else(attributes):
    env = type("Odd", (Unrelated,), attributes)()
    run = q_learning(env, QLearningConfig(), episodes=20, seeds=[0], Q_star=np.zeros((2, 2)))
    assert run.table["value_lost"].isna().all()
    assert run.arrays["visits"].sum() == 20


def test_only_an_environment_with_a_model_is_played_by_its_model():
    with pytest.raises(ValueError, match="must have a transition table"):
        q_learning_on_model("MountainCar-v0", QLearningConfig(), episodes=1, seeds=[0])
    with pytest.raises(TypeError, match="allowed is an environment's id"):
        q_learning_on_model(Maze(), QLearningConfig(), episodes=1, seeds=[0])


def test_the_configuration_can_be_written_as_json():
    config = QLearningConfig(step_size=VisitDecay(), exploration=EpsilonGreedy(Linear(1, 0.1, 9)))
    assert json.loads(json.dumps(dataclasses.asdict(config)))["step_size"]["exponent"] == 0.6
    assert describe(config)["exploration"]["epsilon"]["class"] == "Linear"
