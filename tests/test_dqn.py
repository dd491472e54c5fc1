"""DQN: targets by hand, exact gradients, the memory, and what a run promises."""

import dataclasses
import json
import random
from itertools import pairwise

import gymnasium
import numpy as np
import pandas as pd
import pytest
import torch
from gymnasium import spaces
from joblib import Parallel, delayed
from scipy import stats

from rl_core import epsilon, networks, q_update, replay
from rl_core.dqn import DQNConfig, dqn
from rl_core.episodes import spawn_streams
from rl_core.epsilon import Decay, HalfWay
from rl_core.experiments import Arm
from rl_core.experiments import run as run_arms
from rl_core.q_update import COPIES, DUE, NOTHING, Settings, make_learner
from rl_core.worlds.shaping import Shaping, compiled_shape

SMALL = DQNConfig(
    batch_size=40,
    memory_size=300,
    learning_starts=200,
    copy_every=50,
    max_episode_steps=400,
)
CONFIGS = {
    "Acrobot-v1": dataclasses.replace(SMALL, shaping=Shaping("rl_core.worlds.shaping:tip_height")),
    "MountainCar-v0": dataclasses.replace(
        SMALL,
        optimiser="adam",
        biases=True,
        persistence=7,
        epsilon=Decay(1.0, 0.2, 500),
        shaping=Shaping("rl_core.worlds.shaping:distance_from_start"),
        bootstrap_through_end=True,
    ),
}


class Corridor(gymnasium.Env):
    """Three cells in a row; action 1 (counted from 5: 6) goes right, and the end pays 1."""

    observation_space = spaces.Box(0, 1, (3,), np.float32)
    action_space = spaces.Discrete(2, start=5)

    def reset(self, *, seed=None, options=None):
        """Start at the left."""
        super().reset(seed=seed)
        self.cell = 0
        return np.eye(3, dtype=np.float32)[0], {}

    def step(self, action):
        """Move; leaving on the right ends the episode."""
        assert action in (5, 6)
        self.cell = max(0, self.cell + (1 if action == 6 else -1))
        over = self.cell == 3
        return np.eye(3, dtype=np.float32)[min(self.cell, 2)], float(over), over, False, {}


class Endless(gymnasium.Env):
    """Pays 1 a step and never ends, but is cut off after each step."""

    observation_space = spaces.Box(1, 1, (1,), np.float32)
    action_space = spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        """The only state."""
        super().reset(seed=seed)
        return np.ones(1, np.float32), {}

    def step(self, action):
        """Pay, and truncate."""
        return np.ones(1, np.float32), 1.0, False, True, {}


class Breaking(Corridor):
    """Pays `payment` in the third episode of those seeds whose first draw says so."""

    def __init__(self, payment):
        self.payment = payment

    def reset(self, *, seed=None, options=None):
        """Draw whether this seed breaks."""
        observation, _ = super().reset(seed=seed)
        if seed is not None:
            self.breaks, self.episode = breaks(seed), 0
        self.episode += 1
        return observation, {}

    def step(self, action):
        """Move and pay."""
        observation, reward, *rest = super().step(action)
        return observation, self.payment if self.breaks and self.episode == 3 else reward, *rest


def breaks(environment_seed):
    return np.random.default_rng(environment_seed).random() < 0.5


class Recording(gymnasium.Wrapper):
    """Notes where episodes start and what is done in them."""

    def __init__(self, env):
        super().__init__(env)
        self.starts, self.actions = [], []

    def reset(self, **arguments):
        """Begin, and note where."""
        observation, info = super().reset(**arguments)
        self.starts.append(float(observation[0]))
        return observation, info

    def step(self, action):
        """Note the action."""
        self.actions.append(int(action))
        return super().step(action)


def nan_beyond(observation, reward):
    """A shaping that breaks: NaN left of -0.55."""
    return np.nan if observation[0] < -0.55 else reward


def doubled(observation, reward):
    """A shaping by reward and observation."""
    return 2.0 * reward + observation[0]


def assert_same(run, other):
    pd.testing.assert_frame_equal(run.table, other.table, check_exact=True)
    assert run.arrays.keys() == other.arrays.keys()
    for name, array in run.arrays.items():
        np.testing.assert_array_equal(array, other.arrays[name], err_msg=name)
    assert run.failures == other.failures


def only(run, seeds, position):
    """The part of a run that belongs to one seed, as if it had been trained alone."""
    seed = seeds[position]
    return dataclasses.replace(
        run,
        table=run.table[run.table["seed"] == seed].reset_index(drop=True),
        arrays={name: array[position : position + 1] for name, array in run.arrays.items()},
        failures=tuple(failure for failure in run.failures if failure.seed == seed),
    )


# The memory


def filled(capacity, count):
    """A memory in which transition i has the reward i."""
    memory = replay.make_memory(capacity, 2)
    for i in range(count):
        s = np.full(2, i, np.float32)
        replay.store(memory, s, i % 3, float(i), s + 1, i % 5 == 0)
    return memory


def test_the_newest_transitions_overwrite_the_oldest():
    memory = filled(10, 25)
    assert replay.held(memory) == 10
    assert sorted(memory.rewards) == list(range(15, 25))
    np.testing.assert_array_equal(memory.observations[:, 0], memory.rewards)
    np.testing.assert_array_equal(memory.next_observations[:, 1], memory.rewards + 1)
    np.testing.assert_array_equal(memory.actions, memory.rewards.astype(int) % 3)
    np.testing.assert_array_equal(memory.ends, memory.rewards % 5 == 0)


@pytest.mark.parametrize(("capacity", "count"), [(50, 20), (50, 50), (50, 73)])
def test_sampling_is_uniform_over_what_is_held_and_over_nothing_else(capacity, count):
    memory, slots = filled(capacity, count), np.empty(20_000, np.int64)
    replay.sample(memory, np.random.default_rng(0).random(20_000), slots)
    rewards, counts = np.unique(memory.rewards[slots], return_counts=True)
    np.testing.assert_array_equal(rewards, np.arange(max(0, count - capacity), count))
    assert stats.chisquare(counts).pvalue > 1e-3


# Epsilon


def test_the_report_s_exploration_by_hand():
    state = epsilon.initial(HalfWay(0.9, 0.1))
    course = []
    for event in (epsilon.after_copy, epsilon.after_goal, epsilon.after_copy, epsilon.after_copy):
        event(state)
        epsilon.after_step(state, 10_000)
        course.append(state[epsilon.VALUE])
    np.testing.assert_allclose(course, [0.9, 0.5, 0.4, 0.35])
    for _ in range(60):
        epsilon.after_goal(state)
    assert state[epsilon.VALUE] == pytest.approx(0.1)


def test_decay_is_linear_and_then_constant_and_a_number_stays():
    for schedule, expected in ((Decay(1.0, 0.2, 8), [1, 0.9, 0.6, 0.2, 0.2]), (0.3, [0.3] * 5)):
        state = epsilon.initial(schedule)
        found = []
        for t in (0, 1, 4, 8, 100):
            epsilon.after_step(state, t)
            epsilon.after_copy(state)
            epsilon.after_goal(state)
            found.append(state[epsilon.VALUE])
        np.testing.assert_allclose(found, expected)


# Targets and gradients


def settings(**changes):
    defaults = Settings(0.9, 4, 1, 1, 10, 1, 1e-3, False, False)
    return defaults._replace(**changes)


def learner_of(sizes, batch_size, seed=0, adam=False):
    parameters = networks.xavier_uniform(sizes, np.random.default_rng(seed))
    parameters += np.random.default_rng(1).normal(0, 0.1, parameters.size).astype(np.float32)
    return make_learner(
        sizes, parameters, biases=True, adam=adam, batch_size=batch_size, schedule=0.1
    )


@pytest.mark.parametrize("through_end", [False, True])
def test_targets_by_hand_on_a_terminal_a_truncated_and_an_ordinary_transition(through_end):
    """With one linear layer Q(s', a) = s' W: the values of s' = (1, 2) are 1, 9 and -1."""
    _, theta = networks.pack({"layer0.weight": np.array([[1, -1, 3], [0, 5, -2]], np.float32)})
    learner = make_learner((2, 3), theta, biases=True, adam=False, batch_size=3, schedule=0.1)
    memory, following = replay.make_memory(5, 2), np.array([1, 2], np.float32)
    shape = compiled_shape("rl_core.worlds.shaping:original")
    way = settings(batch_size=3, through_end=through_end)
    for terminated in (True, False, False):  # a truncated step is stored as any other
        q_update.remember(
            way, learner, memory, shape, np.ones(2, np.float32), 1, -1.0, following, terminated
        )
    learner.slots[:] = [0, 1, 2]
    loss = q_update.loss_gradient(way, learner, memory)
    found = [q_update.target(way, memory, slot) for slot in range(3)]
    ordinary = -1.0 + 0.9 * 9.0
    expected = [ordinary if through_end else -1.0, ordinary, ordinary]
    np.testing.assert_allclose(found, expected)
    assert loss == pytest.approx(np.mean((np.array(expected) - 4.0) ** 2))  # Q(s, 1) = -1 + 5


@pytest.mark.parametrize("batch_size", [1, 32, 37, 512])
def test_the_gradient_is_torch_s(batch_size):
    sizes, rng = (6, 10, 20, 3), np.random.default_rng(3)
    learner, memory = learner_of(sizes, batch_size), replay.make_memory(60, 6)
    for _ in range(60):
        s, following = rng.normal(size=(2, 6)).astype(np.float32)
        replay.store(memory, s, rng.integers(3), rng.normal(), following, rng.random() < 0.3)
    learner.fixed[:] += rng.normal(0, 0.1, learner.fixed.size).astype(np.float32)
    replay.sample(memory, rng.random(batch_size), learner.slots)
    loss = q_update.loss_gradient(settings(batch_size=batch_size), learner, memory)
    online, fixed = (networks.to_torch(sizes, p) for p in (learner.parameters, learner.fixed))
    part = [torch.from_numpy(array[learner.slots]) for array in memory[:5]]
    s, following, actions, rewards, ends = part
    with torch.no_grad():
        y = rewards + 0.9 * fixed(following).max(1).values * ~ends
    q = online(s).gather(1, actions[:, None])[:, 0]
    expected = ((y - q) ** 2).mean()
    expected.backward()
    gradient = np.concatenate([p.grad.numpy().ravel() for p in online.parameters()])
    assert loss == pytest.approx(expected.item(), rel=1e-5)
    np.testing.assert_allclose(learner.gradient, gradient, atol=2e-5)


def test_the_gradient_is_the_loss_s_by_finite_differences():
    sizes, rng = (2, 5, 3), np.random.default_rng(4)
    learner, memory = learner_of(sizes, 8), replay.make_memory(8, 2)
    for _ in range(8):
        s, following = rng.normal(size=(2, 2)).astype(np.float32)
        replay.store(memory, s, rng.integers(3), rng.normal(), following, rng.random() < 0.3)
    learner.slots[:] = np.arange(8)
    way = settings(batch_size=8)
    q_update.loss_gradient(way, learner, memory)
    gradient, theta = learner.gradient.copy(), learner.parameters.copy()
    for i in range(theta.size):
        losses = []
        for sign in (1, -1):
            learner.parameters[:] = theta
            learner.parameters[i] += sign * np.float32(1e-2)
            losses.append(q_update.loss_gradient(way, learner, memory))
        assert gradient[i] == pytest.approx((losses[0] - losses[1]) / 2e-2, abs=2e-2)


@pytest.mark.parametrize("adam", [False, True])
def test_updates_are_those_of_torch_with_uncached_targets(adam):
    """Weights after 30 updates with copies in between: V is cached here, computed anew in torch."""
    sizes, rng = (2, 10, 20, 3), np.random.default_rng(5)
    way = settings(batch_size=64, copy_every=7, adam=adam, learning_rate=1e-2)
    learner, memory = learner_of(sizes, 64, adam=adam), replay.make_memory(50, 2)
    online, fixed = (networks.to_torch(sizes, learner.parameters) for _ in range(2))
    parameters = list(online.parameters())
    mean_squares = [torch.ones_like(p) for p in parameters]
    moments = [(torch.zeros_like(p), torch.zeros_like(p)) for p in parameters]
    for count in range(1, 31):
        s, following = rng.normal(size=(2, 2)).astype(np.float32)
        replay.store(memory, s, rng.integers(3), rng.normal(), following, rng.random() < 0.3)
        assert q_update.update(way, learner, memory, rng.random(64))
        s, following, a, r, end = (torch.from_numpy(x[learner.slots]) for x in memory[:5])
        with torch.no_grad():
            y = r + 0.9 * fixed(following).max(1).values * ~end
        online.zero_grad()
        ((y - online(s).gather(1, a[:, None])[:, 0]) ** 2).mean().backward()
        with torch.no_grad():
            for p, v, (m1, m2) in zip(parameters, mean_squares, moments, strict=True):
                g = p.grad
                if adam:
                    m1.mul_(0.9).add_(0.1 * g)
                    m2.mul_(0.999).add_(0.001 * g * g)
                    step = 1e-2 * np.sqrt(1 - 0.999**count) / (1 - 0.9**count)
                    p -= step * m1 / (m2.sqrt() + 1e-8)
                else:
                    v.mul_(0.9).add_(0.1 * g * g)
                    p -= 1e-2 * g / (v + 1e-10).sqrt()
        if count % 7 == 0:
            fixed.load_state_dict(online.state_dict())
    expected = np.concatenate([p.detach().numpy().ravel() for p in parameters])
    np.testing.assert_allclose(learner.parameters, expected, atol=2e-3)


def test_the_fixed_network_changes_only_at_copies():
    rng, way = np.random.default_rng(6), settings(batch_size=8, copy_every=5)
    learner, memory = learner_of((2, 4, 3), 8), filled(20, 20)
    held, seen = learner.fixed.copy(), []
    for count in range(1, 21):
        assert q_update.update(way, learner, memory, rng.random(8))
        assert not np.array_equal(learner.parameters, held)
        changed = not np.array_equal(learner.fixed, held)
        assert changed == (count % 5 == 0)
        if changed:
            np.testing.assert_array_equal(learner.fixed, learner.parameters)
            seen.append(int(learner.counts[COPIES]))
        held = learner.fixed.copy()
    assert seen == [1, 2, 3, 4]


def test_learning_starts_when_told_and_goes_on_at_the_rate_told():
    way = settings(learning_starts=5, update_every=2)
    learner, memory = learner_of((2, 3), 4), replay.make_memory(10, 2)
    s, shape = np.zeros(2, np.float32), compiled_shape("rl_core.worlds.shaping:original")
    answers = [
        q_update.remember(way, learner, memory, shape, s, 0, 0.0, s, False) for _ in range(9)
    ]
    assert answers == [NOTHING] * 5 + [DUE, NOTHING, DUE, NOTHING]


def test_actions_are_greedy_random_and_kept_as_often_as_they_should():
    sizes, rng = (2, 3), np.random.default_rng(7)
    _, theta = networks.pack({"layer0.weight": np.array([[0, 0, 1], [0, 0, 0]], np.float32)})
    learner = make_learner(sizes, theta, biases=True, adam=False, batch_size=1, schedule=0.3)
    s, units = np.ones(2, np.float32), np.empty(5, np.float32)
    draws = [q_update.act(settings(), learner, s, *rng.random(2), units) for _ in range(20_000)]
    expected = 20_000 * np.array([0.1, 0.1, 0.8])
    assert stats.chisquare(np.bincount(draws), expected).pvalue > 1e-3
    way, kept = settings(persistence=4), []
    for _ in range(2_000):
        kept.append(q_update.act(way, learner, s, *rng.random(2), units))
    runs = np.diff(np.flatnonzero(np.diff([9, *kept, 9])))
    left = [
        length
        for length, start in zip(runs, np.cumsum([0, *runs[:-1]]), strict=True)
        if kept[start] != 2
    ]
    assert len(left) > 50
    assert all(length % 4 == 0 for length in left[:-1])


# What a run promises


@pytest.mark.parametrize("name", CONFIGS)
def test_same_seed_same_bits_alone_again_and_among_others(name):
    arguments = {"episodes": 4, "snapshots": (2,)}
    seeds = tuple(range(100, 106))
    together = dqn(name, CONFIGS[name], seeds=seeds, **arguments)
    assert_same(together, dqn(name, CONFIGS[name], seeds=seeds, **arguments))
    for position in (0, 3, 5):
        alone = dqn(name, CONFIGS[name], seeds=[seeds[position]], **arguments)
        assert_same(only(together, seeds, position), alone)


@pytest.mark.parametrize("name", CONFIGS)
def test_training_compiled_and_through_gymnasium_gives_the_same_bits(name):
    def plain():
        return gymnasium.make(name, disable_env_checker=True).unwrapped

    arguments = {"episodes": 3, "seeds": [0, 3], "snapshots": (2,)}
    compiled = dqn(name, CONFIGS[name], **arguments)
    assert (compiled.arrays["layer0.weight"] != compiled.arrays["initial/layer0.weight"]).any()
    assert_same(compiled, dqn(plain, CONFIGS[name], **arguments))
    assert_same(compiled, dqn(plain(), CONFIGS[name], **arguments))


def test_through_the_store_with_workers_and_resumed_the_bits_are_the_same(tmp_path):
    arms = [Arm(name, dqn, name, config, 3) for name, config in CONFIGS.items()]
    arguments = {"seeds": range(4), "block": 2, "progress": False}
    one = run_arms(arms, store=tmp_path / "one", workers=1, **arguments)
    run_arms(arms[:1], store=tmp_path / "two", workers=2, seeds=[1, 3], progress=False)
    two = run_arms(arms, store=tmp_path / "two", workers=2, **arguments)
    pd.testing.assert_frame_equal(one.table, two.table, check_exact=True)
    for arm in arms:
        for name, array in one.arrays(arm.name).items():
            np.testing.assert_array_equal(array, two.arrays(arm.name)[name])


def test_seeds_differ_in_weights_actions_batches_and_environment():
    run = dqn("Acrobot-v1", SMALL, episodes=1, seeds=range(10))
    assert len(np.unique(run.arrays["initial/layer0.weight"].reshape(10, -1), axis=0)) == 10
    assert len(np.unique(run.arrays["layer0.weight"].reshape(10, -1), axis=0)) == 10
    streams = [spawn_streams(seed) for seed in range(10)]
    for draw in (
        lambda one: one.replay.random(),
        lambda one: one.policy.random(),
        lambda one: one.environment_seed,
    ):
        assert len({draw(one) for one in streams}) == 10


def test_actions_and_starts_that_the_agents_meet_differ_from_seed_to_seed():
    config = dataclasses.replace(SMALL, epsilon=1.0, learning_starts=1_000, max_episode_steps=30)
    config = dataclasses.replace(config, hidden=())
    met = []
    for seed in range(10):
        env = Recording(gymnasium.make("MountainCar-v0").unwrapped)
        dqn(env, config, episodes=1, seeds=[seed])
        met.append((env.starts[0], tuple(env.actions)))
    starts, actions = zip(*met, strict=True)
    assert len(set(starts)) == 10
    assert len(set(actions)) == 10


def test_global_random_states_are_left_alone():
    before = torch.get_rng_state(), str(np.random.get_state()), random.getstate()  # noqa: NPY002
    dqn("Acrobot-v1", SMALL, episodes=2, seeds=[0, 1])
    dqn("CartPole-v1", dataclasses.replace(SMALL, learning_starts=20), episodes=2, seeds=[0])
    assert torch.equal(before[0], torch.get_rng_state())
    assert before[1:] == (str(np.random.get_state()), random.getstate())  # noqa: NPY002


def test_table_and_arrays_have_the_form_agreed():
    run = dqn("MountainCar-v0", SMALL, episodes=3, seeds=[4, 2], snapshots=(0, 2))
    columns = {
        "seed": "int64",
        "episode": "int64",
        "steps": "int64",
        "return": "float64",
        "terminated": "bool",
        "env_steps": "int64",
    }
    assert {name: str(dtype) for name, dtype in run.table.dtypes.items()} == columns
    assert run.table["seed"].tolist() == [4, 4, 4, 2, 2, 2]
    assert run.table["episode"].tolist() == [1, 2, 3] * 2
    steps = run.table.groupby("seed")["steps"].cumsum()
    np.testing.assert_array_equal(run.table["env_steps"], steps)
    shapes = {f"layer{i}.weight": (2, a, b) for i, (a, b) in enumerate(pairwise((2, 10, 20, 3)))}
    moments = ("", "initial/", "episode2/")
    expected = {m + name: shape for m in moments for name, shape in shapes.items()}
    assert {name: array.shape for name, array in run.arrays.items()} == expected
    assert {array.dtype for array in run.arrays.values()} == {np.dtype(np.float32)}


def test_returns_are_of_the_original_reward_also_where_it_is_shaped():
    for name, config in CONFIGS.items():
        table = dqn(name, config, episodes=3, seeds=[0]).table
        at_goal = table["terminated"] if name == "Acrobot-v1" else 0
        np.testing.assert_array_equal(table["return"], at_goal - table["steps"])


def test_shaping_by_one_s_own_function_runs_compiled_and_plain():
    config = dataclasses.replace(SMALL, shaping=Shaping("test_dqn:doubled"))
    compiled = dqn("MountainCar-v0", config, episodes=2, seeds=[0])
    plain = dqn(gymnasium.make("MountainCar-v0").unwrapped, config, episodes=2, seeds=[0])
    assert_same(compiled, plain)
    other = dqn("MountainCar-v0", SMALL, episodes=2, seeds=[0])
    assert not np.array_equal(compiled.arrays["layer0.weight"], other.arrays["layer0.weight"])


def test_a_snapshot_holds_what_a_shorter_run_ends_with():
    long = dqn("Acrobot-v1", SMALL, episodes=4, seeds=[0, 1], snapshots=(2,))
    short = dqn("Acrobot-v1", SMALL, episodes=2, seeds=[0, 1])
    for name in ("layer0.weight", "layer2.weight"):
        np.testing.assert_array_equal(long.arrays[f"episode2/{name}"], short.arrays[name])
        assert not np.array_equal(long.arrays[name], short.arrays[name])


def test_weights_without_biases_keep_none():
    run = dqn("Acrobot-v1", SMALL, episodes=2, seeds=[0])
    assert not any(name.endswith("bias") for name in run.arrays)


def test_progress_counts_everything_and_changes_nothing():
    seen = []
    config = dataclasses.replace(SMALL, max_env_steps=5_000)
    arguments = {"episodes": 25, "seeds": [3, 1]}
    run = dqn("Acrobot-v1", config, **arguments, progress=lambda *event: seen.append(event))
    assert_same(run, dqn("Acrobot-v1", config, **arguments))
    assert seen == sorted(seen)
    assert len(seen) > 2
    assert seen[-1] == (50, run.table.groupby("seed")["env_steps"].max().sum())


def test_a_budget_ends_a_seed_and_a_cap_an_episode():
    config = dataclasses.replace(SMALL, max_episode_steps=300, max_env_steps=1000)
    table = dqn("MountainCar-v0", config, episodes=20, seeds=[0, 1]).table
    for _, rows in table.groupby("seed"):
        assert rows["steps"].tolist() == [300, 300, 300, 100]
        assert not rows["terminated"].any()


def test_a_time_limit_of_the_environment_truncates():
    run = dqn(lambda: gymnasium.make("MountainCar-v0"), SMALL, episodes=2, seeds=[0])
    assert run.table["steps"].tolist() == [200, 200]
    assert not run.table["terminated"].any()


@pytest.mark.parametrize("payment", [np.nan, np.inf, 1e300])
def test_a_seed_that_diverges_is_named_and_the_others_go_on(payment):
    seeds = tuple(range(8))
    broken = [seed for seed in seeds if breaks(spawn_streams(seed).environment_seed)]
    config = dataclasses.replace(SMALL, batch_size=8, learning_starts=8, max_episode_steps=50)
    arguments = {"episodes": 6, "seeds": seeds}
    run = dqn(lambda: Breaking(payment), config, **arguments)
    healthy = dqn(Corridor, config, **arguments)
    assert 0 < len(broken) < len(seeds)
    assert [failure.seed for failure in run.failures] == broken
    assert all(failure.episode >= 3 for failure in run.failures)
    for position, seed in enumerate(seeds):
        if seed not in broken:
            assert_same(only(run, seeds, position), only(healthy, seeds, position))


def test_a_shaping_that_returns_nan_is_told_with_its_step():
    config = dataclasses.replace(SMALL, shaping=Shaping("test_dqn:nan_beyond"))
    message = r"'test_dqn:nan_beyond' returned NaN at step \d+ of episode 1, seed 0"
    for env in ("MountainCar-v0", gymnasium.make("MountainCar-v0").unwrapped):
        with pytest.raises(ValueError, match=message):
            dqn(env, config, episodes=1, seeds=[0])


# What is learned


def test_the_values_of_a_corridor_are_learned():
    """Gamma 0.5 and a reward of 1 at the end: Q*(s, right) = 1/4, 1/2, 1."""
    config = DQNConfig(
        gamma=0.5,
        hidden=(),
        optimiser="adam",
        learning_rate=1e-2,
        batch_size=32,
        memory_size=500,
        learning_starts=50,
        copy_every=20,
        epsilon=0.5,
    )
    run = dqn(Corridor, config, episodes=400, seeds=range(3))
    expected = [[0.125, 0.25], [0.125, 0.5], [0.25, 1.0]]
    np.testing.assert_allclose(run.arrays["layer0.weight"], [expected] * 3, atol=0.03)
    through = dataclasses.replace(config, bootstrap_through_end=True)
    run = dqn(Corridor, through, episodes=400, seeds=range(3))
    assert (run.arrays["layer0.weight"][:, 2, 1] > 1.5).all()  # 1 + 0.5 * 2: the end is worth more


def test_a_truncated_step_is_stored_as_one_that_goes_on():
    """Gamma 0.5 and 1 a step for ever: Q* = 2. Were truncation taken for the end, Q would be 1."""
    config = DQNConfig(
        gamma=0.5,
        hidden=(),
        optimiser="adam",
        learning_rate=1e-2,
        batch_size=16,
        memory_size=100,
        learning_starts=16,
        copy_every=20,
        epsilon=0.5,
    )
    run = dqn(Endless, config, episodes=1_000, seeds=[0, 1])
    assert not run.table["terminated"].any()
    np.testing.assert_allclose(run.arrays["layer0.weight"], 2.0, atol=0.05)


CART_POLE = DQNConfig(
    hidden=(64, 64),
    biases=True,
    optimiser="adam",
    learning_rate=1e-3,
    batch_size=128,
    memory_size=100_000,
    learning_starts=500,
    update_every=2,
    copy_every=100,
    epsilon=Decay(1.0, 0.0, 5_000),
    shaping=Shaping("rl_core.worlds.shaping:balance"),
    max_env_steps=80_000,
)


@pytest.mark.slow
def test_cart_pole_is_solved_through_the_plain_loop():
    """An average return of at least 450 over the last 50 episodes, for most seeds.

    The settings were chosen on the seeds 1000 to 1013. On 1004 to 1013 all ten got there.
    """
    halves = Parallel(n_jobs=2)(
        delayed(dqn)("CartPole-v1", CART_POLE, episodes=2_000, seeds=seeds)
        for seeds in (range(5), range(5, 10))
    )
    table = pd.concat(half.table for half in halves)
    last = table.groupby("seed")["return"].apply(lambda returns: returns.tail(50).mean())
    assert (last >= 450).sum() >= 7


# Bad input


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("gamma", -0.1),
        ("gamma", 1.1),
        ("gamma", np.nan),
        ("hidden", (10, 0)),
        ("hidden", [10]),
        ("biases", 1),
        ("optimiser", "sgd"),
        ("optimiser", np.array(["adam", "sgd"])),
        ("learning_rate", 0.0),
        ("learning_rate", np.inf),
        ("batch_size", 0),
        ("memory_size", 511),
        ("memory_size", 600.0),
        ("learning_starts", 0),
        ("update_every", 0),
        ("copy_every", 0),
        ("copy_every", 2.5),
        ("epsilon", 1.5),
        ("epsilon", "low"),
        ("epsilon", None),
        ("persistence", 0),
        ("shaping", "rl_core.worlds.shaping:tip_height"),
        ("bootstrap_through_end", 0),
        ("max_episode_steps", 0),
        ("max_env_steps", -1),
    ],
)
def test_a_setting_out_of_range_is_refused(field, value):
    with pytest.raises(ValueError, match=rf"^{field} must be .*, got "):
        DQNConfig(**{field: value})


@pytest.mark.parametrize("schedule", [Decay, HalfWay])
@pytest.mark.parametrize("changes", [{"start": 1.1}, {"end": -0.1}, {"end": np.nan}])
def test_a_schedule_out_of_range_is_refused(schedule, changes):
    (name,) = changes
    with pytest.raises(ValueError, match=rf"^epsilon.{name} must be a number from 0 to 1"):
        schedule(**changes)


@pytest.mark.parametrize(
    "function",
    [
        "rl_core.worlds.shaping",
        "rl_core.nowhere:f",
        "rl_core.worlds.shaping:nothing",
        "rl_core.worlds.shaping:Shaping",
        3,
    ],
)
def test_an_impossible_shaping_is_refused(function):
    with pytest.raises(ValueError, match=r"^shaping must be "):
        Shaping(function)


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("seeds", []),
        ("seeds", [1, 1]),
        ("seeds", [-1]),
        ("seeds", [True]),
        ("seeds", 5),
        ("seeds", None),
        ("episodes", 0),
        ("snapshots", (11,)),
        ("snapshots", 5),
        ("progress", 5),
        ("config", None),
    ],
)
def test_an_argument_out_of_range_is_refused_before_anything_runs(argument, value):
    def refuse():
        raise AssertionError("an environment was made")

    arguments = {"config": SMALL, "episodes": 10, "seeds": [0], argument: value}
    with pytest.raises(ValueError, match=rf"^{argument} must be .*, got "):
        dqn(refuse, arguments.pop("config"), **arguments)


def test_environments_with_other_spaces_are_refused():
    with pytest.raises(ValueError, match="Discrete action space"):
        dqn("MountainCarContinuous-v0", SMALL, episodes=1, seeds=[0])
    with pytest.raises(ValueError, match="Box observation space"):
        dqn("FrozenLake-v1", SMALL, episodes=1, seeds=[0])
    several = gymnasium.make("CartPole-v1").unwrapped
    several.action_space = spaces.MultiDiscrete([2, 2])
    with pytest.raises(ValueError, match=r"env must have a Discrete action space, got MultiD"):
        dqn(several, SMALL, episodes=1, seeds=[0])
    with pytest.raises(ValueError, match="env must be an id that Gymnasium knows"):
        dqn("Pole-v7", SMALL, episodes=1, seeds=[0])
    with pytest.raises(ValueError, match="env must be an id that Gymnasium knows"):
        dqn("nowhere:Foo-v0", SMALL, episodes=1, seeds=[0])
    with pytest.raises(TypeError, match="env must be a Gymnasium id"):
        dqn(3, SMALL, episodes=1, seeds=[0])


def test_a_config_is_plain_data():
    for config in CONFIGS.values():
        assert json.loads(json.dumps(dataclasses.asdict(config)))["gamma"] == 0.99
    one, two = Shaping("test_dqn:doubled"), Shaping("rl_core.worlds.shaping:tip_height")
    assert one.code != two.code
