"""Q-learning against hand calculations, a plain reimplementation, and itself on another path."""

import dataclasses
import json

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from gymnasium import spaces
from hypothesis import given, settings
from hypothesis import strategies as st
from odd_values import ODD, PLAIN, try_out
from test_appraisal import loss
from toy_task import Corridor

from rl_core.evaluation import evaluate, greedy
from rl_core.exploration import (
    EpsilonGreedy,
    HalfWay,
    Linear,
    Softmax,
    Trials,
    UnnormalisedSoftmax,
    VisitDecay,
)
from rl_core.identity import describe
from rl_core.kernels.appraisal import COLUMNS
from rl_core.maze import Maze
from rl_core.mdp import MDP
from rl_core.planning import optimal_actions, value_iteration
from rl_core.q_learning import (
    QLearningConfig,
    check_q_learning,
    q_learning,
)
from rl_core.worlds.tabular import spawn_draws
from studies.on_model import check_q_learning_on_model, q_learning_on_model

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
    start, step, policy = spawn_draws(7, 2)[0]
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
    assert start.random() == spawn_draws(7, 2)[0].start.random()  # the Maze's reset drew nothing


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
        (Softmax(Linear(2.0, 0.1, episodes=10)), VisitDecay(Linear(0.9, 0.5, episodes=5), 0.7)),
    ],
)
def test_the_compiled_path_and_the_plain_loop_agree_bit_for_bit(
    env, episodes, exploration, step_size
):
    config = QLearningConfig(
        step_size=step_size, exploration=exploration, evaluation=Trials(every=6, episodes=3)
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
        evaluation=Trials(every=10, max_steps=6),
    )
    capped = q_learning(MDP.from_env("FrozenLake-v1"), config, episodes=300, seeds=[0])
    limited = q_learning(
        lambda: gym.make("FrozenLake-v1", max_episode_steps=6),
        QLearningConfig(exploration=EpsilonGreedy(0.5), evaluation=Trials(every=10)),
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


# Continuous worlds through a grid

GRID = QLearningConfig(
    gamma=0.99, step_size=0.3, exploration=EpsilonGreedy(0.02), max_steps=5_000, bins=10
)


def test_tables_beyond_what_the_machine_has_are_refused():
    """Of 45,000 bins a number the car has two thousand million cells, for three actions each."""
    config = dataclasses.replace(GRID, bins=45_000)
    for refused in (
        lambda: check_q_learning("MountainCar-v0", config),
        lambda: q_learning("MountainCar-v0", config, episodes=1, seeds=[0]),
    ):
        with pytest.raises(ValueError, match=r"^bins must be less: it would take .* GiB of memory"):
            refused()


def test_a_rule_that_never_ends_meets_a_budget():
    assert QLearningConfig().max_env_steps is not None
    config = QLearningConfig(exploration=EpsilonGreedy(0.0), max_env_steps=500)
    run = q_learning(Maze().model(), config, episodes=10_000, seeds=[0])
    assert run.table["env_steps"].iloc[-1] == 500


def test_it_learns_mountain_car():
    run = q_learning("MountainCar-v0", GRID, episodes=1_000, seeds=[100, 101, 102])
    for seed in (100, 101, 102):
        steps = run.table.loc[run.table["seed"] == seed, "steps"]
        assert steps.tail(100).median() < min(350, steps.head(20).median() / 2)
        agent = greedy(run.agent(seed))
        played = evaluate("MountainCar-v0", agent, seed=seed, episodes=20, max_steps=5_000)
        assert played["steps"].median() < 350


def test_a_grid_gives_a_seed_the_same_bits_alone_and_among_others():
    config = dataclasses.replace(GRID, bins=8, levels=3)
    name = "MountainCarContinuous-v0"
    together = q_learning(name, config, episodes=3, seeds=[1, 2])
    alone = q_learning(name, config, episodes=3, seeds=[2])
    np.testing.assert_array_equal(together.arrays["Q"][1], alone.arrays["Q"][0])


def test_any_environment_is_seen_through_a_grid():
    config = dataclasses.replace(GRID, bins=(5, 3, 4), levels=3)
    run = q_learning(lambda: gym.make("Pendulum-v1"), config, episodes=2, seeds=[0])
    assert run.arrays["Q"].shape == (1, 60, 3)
    assert run.table["steps"].tolist() == [200, 200]
    same_bits(run, q_learning("Pendulum-v1", config, episodes=2, seeds=[0]))


def test_a_budget_stops_within_an_episode_on_a_grid_too():
    whole = q_learning("MountainCar-v0", GRID, episodes=9, seeds=[0])
    limited = dataclasses.replace(GRID, max_env_steps=8_000)
    cut = q_learning("MountainCar-v0", limited, episodes=9, seeds=[0])
    n = len(cut.table) - 1
    assert n >= 1
    assert cut.table["env_steps"].iloc[-1] == 8_000
    assert not cut.table["terminated"].iloc[-1]
    pd.testing.assert_frame_equal(cut.table[:n], whole.table[:n], check_exact=True)


def test_a_task_s_time_limit_cuts_learning_and_trials():
    """A corridor of five cells with a limit of 100: one who only goes back never arrives."""
    rule = EpsilonGreedy(0.0)  # all values are 0 or below: the first steps try out, ties at random
    config = QLearningConfig(
        exploration=rule, bins=5, evaluation=Trials(every=1, episodes=2, max_steps=1000, epsilon=1)
    )
    run = q_learning(Corridor, config, episodes=50, seeds=[0])
    assert (run.table["steps"] <= 100).all()
    assert run.table["eval_steps"].max() <= 100
    same_bits(run, q_learning("toy_task:Corridor", config, episodes=50, seeds=[0]))


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
        for evaluation in (Trials(), Trials(every=7, episodes=4, max_steps=9, epsilon=1))
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


# A budget of environment steps


@pytest.mark.parametrize("budget", [1, 99, 100, 101, 1000])
@pytest.mark.parametrize("plain", [False, True], ids=["compiled", "plain"])
def test_a_budget_ends_a_seed_and_changes_nothing_before(maze, budget, plain):
    """One more than an episode's end starts another; none fails, and snapshots are the last."""
    env = Maze if plain else maze
    config = QLearningConfig(exploration=EpsilonGreedy(0.9), evaluation=Trials(every=2, episodes=1))
    episodes = 12 if plain else 60
    whole = q_learning(env, config, episodes=episodes, seeds=[3, 5])
    limited = dataclasses.replace(config, max_env_steps=budget)
    cut = q_learning(env, limited, episodes=episodes, seeds=[3, 5], snapshots=(0, 1, episodes))
    assert cut.failures == ()
    for i, seed in enumerate((3, 5)):
        full = whole.table[whole.table["seed"] == seed].reset_index(drop=True)
        rows = cut.table[cut.table["seed"] == seed].reset_index(drop=True)
        before = (full["env_steps"] < budget).sum()
        assert len(rows) == min(before + 1, episodes)
        same = min(before, len(rows))
        pd.testing.assert_frame_equal(rows[:same], full[:same], check_exact=True)
        assert rows["env_steps"].iloc[-1] == min(budget, full["env_steps"].iloc[-1])
        assert rows["steps"].sum() == rows["env_steps"].iloc[-1] == cut.arrays["visits"][i].sum()
        if rows["env_steps"].iloc[-1] < full["env_steps"].iloc[before if before < episodes else -1]:
            assert not rows["terminated"].iloc[-1]
        np.testing.assert_array_equal(cut.arrays["Q_snapshots"][i, 2], cut.arrays["Q"][i])
        assert not cut.arrays["Q_snapshots"][i, 0].any()


def test_a_budget_that_ends_with_an_episode_ends_there(maze):
    whole = q_learning(maze, QLearningConfig(), episodes=9, seeds=[0])
    at = int(whole.table["env_steps"].iloc[4])
    cut = q_learning(maze, QLearningConfig(max_env_steps=at), episodes=9, seeds=[0])
    pd.testing.assert_frame_equal(cut.table, whole.table[:5], check_exact=True)
    assert cut.table["terminated"].all()


# One environment a seed


class Remembering(gym.Wrapper):
    """Pays how many episodes it has begun."""

    def __init__(self, env):
        super().__init__(env)
        self.begun = self.closed = 0

    def reset(self, **arguments):
        """Count."""
        assert not self.closed
        self.begun += 1
        return super().reset(**arguments)

    def step(self, action):
        """Pay, and end."""
        observation, _, _, _, info = super().step(action)
        return observation, float(self.begun), True, False, info

    def close(self):
        """Remember it."""
        self.closed += 1
        super().close()


def make_remembering():
    return Remembering(gym.make("FrozenLake-v1"))


@pytest.fixture
def registered():
    entry = "rl_core.maze:Maze"
    wrapper = gym.envs.registration.WrapperSpec("Remembering", "test_q_learning:Remembering", {})
    gym.register("Remembering-v0", entry_point=entry, additional_wrappers=(wrapper,))
    yield "Remembering-v0"
    del gym.registry["Remembering-v0"]


def test_what_a_wrapper_remembers_does_not_get_to_the_next_seed(registered):
    for env in (make_remembering, "test_q_learning:make_remembering", registered):
        run = q_learning(env, QLearningConfig(), episodes=3, seeds=[4, 7])
        # `reset(seed=...)` comes first, and begins an episode that is not played.
        assert run.table["return"].tolist() == [2.0, 3.0, 4.0] * 2


def test_an_environment_given_ready_made_is_for_one_seed_and_stays_open():
    for env, config in (
        (make_remembering(), QLearningConfig()),
        (Remembering(gym.make("MountainCar-v0")), QLearningConfig(bins=3)),
    ):
        with pytest.raises(ValueError, match=r"^env must be an id or a function .* several"):
            q_learning(env, config, episodes=1, seeds=[0, 1])
        check_q_learning(env, config)
        assert len(q_learning(env, config, episodes=2, seeds=iter([5])).table) == 2
        assert env.closed == 0


@pytest.mark.parametrize("bins", [None, 3])
def test_what_was_opened_is_closed(bins):
    made = []

    def make():
        made.append(Remembering(gym.make("MountainCar-v0" if bins else "FrozenLake-v1")))
        return made[-1]

    q_learning(make, QLearningConfig(bins=bins), episodes=1, seeds=[0, 1])
    assert len(made) > 1
    assert [env.closed for env in made] == [1] * len(made)


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
        ({"step_size": 0.0}, ValueError, "step_size must be a number above 0 up to 1, got 0.0"),
        ({"step_size": 1.01}, ValueError, "step_size must .*, got 1.01"),
        ({"step_size": np.nan}, ValueError, "step_size must .*, got nan"),
        ({"step_size": Linear(0.5, 0.0, episodes=9)}, ValueError, "step_size.end must .*, got 0.0"),
        ({"step_size": Linear(0.5, 0.1, steps=9)}, ValueError, "step_size must .* in episodes"),
        ({"step_size": HalfWay()}, TypeError, "step_size must .*, got HalfWay"),
        ({"step_size": "fast"}, TypeError, "step_size must .*, got 'fast'"),
        ({"gamma": 1.5}, ValueError, "gamma must be a number from 0 to 1, got 1.5"),
        ({"gamma": -0.1}, ValueError, "gamma must .*, got -0.1"),
        ({"gamma": Linear(0.5, 0.9, episodes=9)}, TypeError, "gamma must .*, got Linear"),
        ({"exploration": 0.1}, TypeError, "exploration must be EpsilonGreedy.*, got 0.1"),
        ({"evaluation": None}, TypeError, r"evaluation must be Trials\(...\), got None"),
        ({"max_steps": 0}, ValueError, "max_steps must be an integer from 1 or None, got 0"),
        ({"max_steps": 10.0}, TypeError, "max_steps must .*, got 10.0"),
        ({"max_env_steps": 0}, ValueError, "max_env_steps must be an integer from 1 or None"),
        ({"bins": 0}, ValueError, "bins must be an integer from 1"),
        ({"bins": (3, -1)}, ValueError, "bins must be an integer from 1"),
        ({"bins": ()}, ValueError, "bins must be a positive integer, or one a dimension"),
        ({"bins": 1.5}, TypeError, "bins must be an integer from 1"),
        ({"bins": 3, "levels": 1}, ValueError, "levels must be an integer from 2 or None, got 1"),
        ({"levels": 3}, ValueError, "levels must be None where bins is None, got 3"),
    ],
)
def test_wrong_settings_are_refused(arguments, error, message):
    with pytest.raises(error, match=f"^{message}"):
        QLearningConfig(**arguments)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from([field.name for field in dataclasses.fields(QLearningConfig)]), ODD)
def test_settings_of_any_type_become_plain_or_are_refused_by_name(name, value):
    def make(**settings):
        return QLearningConfig(**{"bins": 3} | settings)

    config = try_out(make, name, value)
    if config is not None:
        plain = (*PLAIN, EpsilonGreedy, Trials, tuple)
        assert all(type(found) in plain for found in vars(config).values()), vars(config)
        bins = config.bins if isinstance(config.bins, tuple) else (3,)
        assert {type(number) for number in bins} == {int}


class Untouchable(Maze):
    """A maze in which nothing may run."""

    def reset(self, **_):  # noqa: D102
        raise AssertionError("it ran")


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (
            {"Q_star": np.zeros((112, 3))},
            ValueError,
            r"Q_star must be .*\(112, 4\), got \(112, 3\)",
        ),
        ({"Q_star": np.full((112, 4), np.nan)}, ValueError, "Q_star must be finite, at"),
        ({"Q_star": [["a"] * 4] * 112}, TypeError, "Q_star must be an array of numbers"),
        ({"Q_star": [[1.0], [1.0, 2.0]]}, ValueError, r"Q_star must .*\(112, 4\), got \[\[1.0\]"),
        ({"episodes": 0}, ValueError, "episodes must be an integer from 1, got 0"),
        ({"episodes": 2.5}, TypeError, "episodes must .*, got 2.5"),
        ({"seeds": []}, ValueError, r"seeds must be one or more, each once, got \(\)"),
        ({"seeds": [0, 0]}, ValueError, r"seeds must be one or more, each once|env must be"),
        ({"seeds": [-1]}, ValueError, "seeds must be an integer from 0, got -1"),
        ({"seeds": 3}, TypeError, "seeds must be a sequence of integers from 0, got 3"),
        ({"seeds": None}, TypeError, "seeds must be a sequence of integers from 0, got None"),
        ({"snapshots": 5}, TypeError, "snapshots must be a sequence of integers from 0, got 5"),
        ({"snapshots": (11,)}, ValueError, "snapshots must be an integer from 0 to 10, got 11"),
        ({"progress": "x"}, TypeError, "progress must be a function .*, got 'x'"),
        ({"config": {"gamma": 0.9}}, TypeError, "config must be a QLearningConfig, got {'gamma'"),
        ({"env": "MountainCar-v0"}, ValueError, "env must have a Discrete observation space"),
        ({"env": "Blackjack-v1"}, ValueError, "env must have a Discrete observation space"),
        ({"env": 3}, TypeError, "env must be a Gymnasium id.*, got 3"),
        ({"env": "Labyrinth-v0"}, ValueError, "env must be an id that Gymnasium knows"),
        ({"env": lambda: 3}, TypeError, "env must be a Gymnasium id.*, got <function"),
    ],
)
def test_wrong_arguments_are_refused_before_anything_runs(arguments, error, message):
    usual = {"env": Untouchable(), "config": QLearningConfig(), "episodes": 10, "seeds": [0]}
    with pytest.raises(error, match=f"^({message})"):
        q_learning(**{**usual, **arguments})
    usual["env"] = Maze().model()
    with pytest.raises(error, match=f"^({message})"):
        q_learning(**{**usual, **arguments})


@pytest.mark.parametrize(
    ("env", "config", "message"),
    [
        (Maze().model(), QLearningConfig(bins=4), "bins must be None where states are numbered"),
        ("FrozenLake-v1", QLearningConfig(bins=4), "env's observation space must be a Box"),
        (
            "MountainCar-v0",
            QLearningConfig(bins=(4, 4, 4)),
            "bins must be a positive integer, or 2",
        ),
        ("MountainCar-v0", QLearningConfig(bins=4, levels=3), "levels must be None"),
        ("Pendulum-v1", QLearningConfig(bins=4), "levels must be an integer from 2"),
        ("CartPole-v1", QLearningConfig(bins=4), "low must be finite"),
    ],
)
def test_bins_and_levels_have_to_go_with_the_world(env, config, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        check_q_learning(env, config)
    with pytest.raises(ValueError, match=f"^{message}"):
        q_learning(env, config, episodes=1, seeds=[0])


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
    with pytest.raises(TypeError, match=r"^env must be an environment's id, got "):
        q_learning_on_model(Maze(), QLearningConfig(), episodes=1, seeds=[0])
    for config, message in (
        (QLearningConfig(gamma=1), r"^gamma must be below 1, for planning, got 1.0"),
        (QLearningConfig(bins=5), r"^bins must be None where states are numbered, got 5"),
    ):
        with pytest.raises(ValueError, match=message):
            check_q_learning_on_model("rl_core/Maze-v0", config)
        with pytest.raises(ValueError, match=message):
            q_learning_on_model("rl_core/Maze-v0", config, episodes=1, seeds=[0])


def test_the_configuration_can_be_written_as_json():
    config = QLearningConfig(
        step_size=VisitDecay(), exploration=EpsilonGreedy(Linear(1, 0.1, episodes=9))
    )
    assert json.loads(json.dumps(dataclasses.asdict(config)))["step_size"]["exponent"] == 0.6
    assert describe(config)["exploration"]["epsilon"]["class"] == "rl_core.exploration:Linear"
