"""REINFORCE: the parts by hand, exact gradients, and what a run promises."""

import dataclasses
import itertools
import json
import random

import gymnasium
import numpy as np
import pandas as pd
import pytest
import torch
from gymnasium import spaces
from hypothesis import given, settings
from hypothesis import strategies as st

from rl_core import networks, policies, provenance, reinforce
from rl_core.dynamics import TASKS
from rl_core.episodes import Trajectory, open_environment, spawn_streams
from rl_core.policies import Categorical, Gaussian, make_policy
from rl_core.reinforce import ReinforceConfig, discounted_returns, normalised
from rl_core.rollouts import mean_actions, weights_of

CONFIGS = {
    "Acrobot-v1": ReinforceConfig(max_episode_steps=700),
    "MountainCar-v0": ReinforceConfig(max_episode_steps=1500),
    "MountainCarContinuous-v0": ReinforceConfig(
        policy=Gaussian(sigma=0.5, constant_feature=True),
        biases=False,
        learning_rate=2e-3,
        epochs=1,
        normalise="centre",
        max_episode_steps=1500,
    ),
}


class Chain(gymnasium.Env):
    """Two states, two actions, three steps; each action moves or stays, luck has its say."""

    STEPS = 3
    OBSERVATIONS = np.array([[1.0, -0.5], [0.3, 1.0]])
    MOVE = np.array([[0.2, 0.9], [0.7, 0.4]])  # probability to change state, by state and action
    REWARD = np.array([[1.0, -1.0], [0.5, 2.0]])

    observation_space = spaces.Box(-1, 1, (2,), np.float64)
    action_space = spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        """Start in state 0."""
        super().reset(seed=seed)
        self.s, self.t = 0, 0
        return self.OBSERVATIONS[self.s], {}

    def step(self, action):
        """Pay, then move."""
        reward = self.REWARD[self.s, action]
        if self.np_random.random() < self.MOVE[self.s, action]:
            self.s = 1 - self.s
        self.t += 1
        return self.OBSERVATIONS[self.s], reward, self.t == self.STEPS, False, {}


class Bandit(gymnasium.Env):
    """One step: the reward is a function of the action."""

    observation_space = spaces.Box(0, 1, (1,), np.float32)

    def __init__(self, action_space, reward):
        self.action_space, self.reward = action_space, reward

    def reset(self, *, seed=None, options=None):
        """There is one state."""
        super().reset(seed=seed)
        return np.ones(1, np.float32), {}

    def step(self, action):
        """Pay and end."""
        return np.ones(1, np.float32), float(self.reward(action)), True, False, {}


class Breaking(Bandit):
    """Pays zero for a while; then, in the seeds where the first draw says so, `payment`."""

    def __init__(self, payment):
        super().__init__(spaces.Discrete(2), None)
        self.payment = payment

    def reset(self, *, seed=None, options=None):
        """Draw whether this seed breaks."""
        observation, _ = super().reset(seed=seed)
        if seed is not None:
            self.breaks, self.episode = breaks(seed), 0
        self.episode += 1
        return observation, {}

    def step(self, action):
        """Pay and end."""
        observation, _, *rest = np.ones(1, np.float32), 0.0, True, False, {}
        pays = self.breaks and self.episode == 4
        return observation, self.payment if pays else float(action), *rest


def breaks(environment_seed):
    return np.random.default_rng(environment_seed).random() < 0.5


def run_of(env, config=None, **arguments):
    return reinforce.reinforce(env, config or CONFIGS[env], **arguments)


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


# Returns


def test_returns_by_hand():
    rewards = np.array([-1.0, -1.0, -1.0, 0.0])
    np.testing.assert_allclose(discounted_returns(rewards, 0.9), [-2.71, -1.9, -1.0, 0.0])
    np.testing.assert_allclose(discounted_returns(np.array([1.0, 2.0, 3.0]), 1.0), [6, 5, 3])
    np.testing.assert_allclose(discounted_returns(np.array([1.0, 2.0, 3.0]), 0.0), [1, 2, 3])


def test_normalised_by_hand():
    returns = np.array([1.0, 2.0, 6.0])
    np.testing.assert_allclose(normalised(returns, False, False), returns)
    np.testing.assert_allclose(normalised(returns, True, False), [-2.0, -1.0, 3.0])
    scaled = np.array([-2.0, -1.0, 3.0]) / np.sqrt(14 / 3)
    np.testing.assert_allclose(normalised(returns, True, True), scaled)
    for equal in (7.0, 0.1, -1e-9, 0.0):  # the mean of three 0.1 is not 0.1
        np.testing.assert_array_equal(normalised(np.full(3, equal), True, True), 0.0)


@settings(deadline=None)
@given(st.lists(st.floats(-100, 100), min_size=2, max_size=50), st.floats(0, 1))
def test_returns_obey_their_recursion_and_their_moments(rewards, gamma):
    rewards = np.array(rewards)
    returns = discounted_returns(rewards, gamma)
    np.testing.assert_allclose(returns[:-1], rewards[:-1] + gamma * returns[1:], atol=1e-9)
    assert returns[-1] == rewards[-1]
    scaled = normalised(returns, True, True)
    assert scaled.mean() == pytest.approx(0, abs=1e-6)
    if returns.std() > 1e-6:
        assert scaled.std() == pytest.approx(1)


def test_returns_of_an_escape_by_hand():
    """Every push costs a tenth of its square; the last step brings a hundred as well."""
    forces = np.array([1.0, -2.0, 3.0])
    rewards = -0.1 * forces**2 + np.array([0.0, 0.0, 100.0])
    expected = [-0.1 + 0.9 * (-0.4 + 0.9 * 99.1), -0.4 + 0.9 * 99.1, 99.1]
    np.testing.assert_allclose(discounted_returns(rewards, 0.9), expected)


# Gradients


def chain_policy():
    policy = make_policy(Categorical(), (4,), 2, 2, 0)
    rng = np.random.default_rng(1)
    parameters = policies.initial_parameters(policy, Categorical(), rng)
    return policy, parameters + rng.normal(0, 0.3, parameters.size).astype(np.float32)


def chain_probabilities(policy, parameters):
    hidden = Chain.OBSERVATIONS @ parameters[:8].reshape(4, 2).T + parameters[8:12]
    scores = np.maximum(hidden, 0) @ parameters[12:20].reshape(2, 4).T + parameters[20:]
    return np.exp(scores) / np.exp(scores).sum(axis=1, keepdims=True)


def chain_trajectories(probabilities):
    """Every trajectory of the chain: its probability, states, actions and rewards."""
    for actions in itertools.product((0, 1), repeat=Chain.STEPS):
        for moves in itertools.product((False, True), repeat=Chain.STEPS):
            s, probability, states, rewards = 0, 1.0, [], []
            for action, moved in zip(actions, moves, strict=True):
                chance = Chain.MOVE[s, action]
                probability *= probabilities[s, action] * (chance if moved else 1 - chance)
                states.append(s)
                rewards.append(Chain.REWARD[s, action])
                s = 1 - s if moved else s
            yield probability, states, np.array(actions), np.array(rewards)


def chain_value(policy, parameters):
    """J(theta): the expected undiscounted return, by enumeration."""
    every = chain_trajectories(chain_probabilities(policy, parameters))
    return sum(probability * rewards.sum() for probability, _, _, rewards in every)


def exact_gradient(policy, parameters):
    gradient = np.empty(parameters.size)
    for i in range(parameters.size):
        step = np.zeros(parameters.size)
        step[i] = 1e-6
        above, below = (chain_value(policy, parameters + sign * step) for sign in (1, -1))
        gradient[i] = (above - below) / 2e-6
    return gradient


def estimate(policy, parameters, observations, actions, rewards, weight=1.0):
    """REINFORCE's gradient of the objective from one episode: -sum v_t grad(-log pi)."""
    scratch = np.empty((2, policy.sizes.sum(), networks.padded(len(rewards))), np.float32)
    gradient = np.empty(parameters.size, np.float32)
    returns = (weight * discounted_returns(rewards, 1.0)).astype(np.float32)
    policies.likelihood_gradient(
        policy, parameters, observations, actions, returns, *scratch, gradient
    )
    return -gradient.astype(float)


def test_expected_estimate_is_the_exact_gradient():
    policy, parameters = chain_policy()
    total = np.zeros(parameters.size)
    for probability, states, actions, rewards in chain_trajectories(
        chain_probabilities(policy, parameters.astype(float))
    ):
        observations = Chain.OBSERVATIONS[states].astype(np.float32)
        taken = actions[:, None].astype(np.float32)
        total += estimate(policy, parameters, observations, taken, rewards, probability)
    expected = exact_gradient(policy, parameters.astype(float))
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(total, expected, atol=2e-5)


def test_sampled_estimates_average_to_the_exact_gradient():
    policy, parameters = chain_policy()
    streams, environment = spawn_streams(0), open_environment(Chain)
    environment.seed(streams.environment_seed)
    trajectory = Trajectory(2, 1)
    estimates = []
    for _ in range(4000):
        steps, _ = environment.play(policy, parameters, streams.policy, 100, trajectory)
        estimates.append(estimate(policy, parameters, *trajectory.first(steps)))
    error = np.mean(estimates, axis=0) - exact_gradient(policy, parameters.astype(float))
    assert (np.abs(error) <= 4.5 * np.std(estimates, axis=0) / np.sqrt(4000) + 1e-6).all()


@pytest.mark.parametrize("batch_size", [512, 300, 1000])
def test_one_episode_of_learning_is_adam_on_the_stated_gradient(batch_size):
    """The same weights from torch: autograd, Adam, minibatches in the order drawn."""
    config = dataclasses.replace(
        CONFIGS["Acrobot-v1"], batch_size=batch_size, epochs=2, max_episode_steps=1000
    )
    run = run_of("Acrobot-v1", config, episodes=1, seeds=[1])
    streams = spawn_streams(1)
    environment, policy = (
        open_environment("Acrobot-v1"),
        make_policy(Categorical(), (10, 20), 6, 3, 0),
    )
    environment.seed(streams.environment_seed)
    parameters = policies.initial_parameters(policy, Categorical(), streams.network)
    trajectory = Trajectory(6, 1)
    steps, _ = environment.play(policy, parameters, streams.policy, 1000, trajectory)
    assert steps == 1000
    observations, actions, rewards = map(torch.from_numpy, trajectory.first(steps))
    returns = torch.empty(steps, dtype=torch.float64)
    following = 0.0
    for t in reversed(range(steps)):
        following = returns[t] = rewards[t] + 0.99 * following
    returns = ((returns - returns.mean()) / returns.std(correction=0)).float()
    module = networks.to_torch((6, 10, 20, 3), parameters)
    optimiser = torch.optim.Adam(module.parameters(), lr=config.learning_rate)
    for _ in range(2):
        order = np.arange(steps)
        if batch_size < steps:
            streams.network.shuffle(order)
        for start in range(0, steps, batch_size):
            batch = torch.from_numpy(order[start : start + batch_size])
            logs = torch.log_softmax(module(observations[batch]), 1)
            taken = logs.gather(1, actions[batch].long())[:, 0]
            optimiser.zero_grad()
            (-(taken * returns[batch]).mean()).backward()
            optimiser.step()
    expected = np.concatenate([p.detach().numpy().ravel() for p in module.parameters()])
    layers = {name: array[0] for name, array in run.arrays.items() if "/" not in name}
    _, found = networks.pack(layers)
    moved = np.abs(found - parameters)
    # Where a gradient is next to nothing, Adam makes much of how it was rounded.
    assert np.quantile(np.abs(found - expected), 0.95) < 2e-5
    assert np.abs(found - expected).max() < 0.1 * moved.max()


@pytest.mark.parametrize(
    ("distribution", "biases"),
    [
        (Gaussian(mean="weights", sigma=0.3), False),
        (Gaussian(mean="weights", sigma=0.5, constant_feature=True), False),
        (Gaussian(mean="weights", sigma=1.0, learn_sigma=True), True),
        (Gaussian(mean="direct", sigma=0.5, learn_sigma=True, constant_feature=True), True),
    ],
)
def test_one_episode_of_gaussian_learning_is_adam_on_the_stated_gradient(distribution, biases):
    """The same weights from torch: `Normal.log_prob` of the raw actions, autograd, Adam."""
    name, steps = "MountainCarContinuous-v0", 1000
    config = dataclasses.replace(CONFIGS[name], policy=distribution, biases=biases)
    config = dataclasses.replace(config, max_episode_steps=steps)
    run = run_of(name, config, episodes=1, seeds=[1])
    streams, environment = spawn_streams(1), open_environment(name)
    environment.seed(streams.environment_seed)
    policy = make_policy(distribution, (10, 20), 2, 0, 1)
    parameters = policies.initial_parameters(policy, distribution, streams.network)
    trajectory = Trajectory(2, 1)
    environment.play(policy, parameters, streams.policy, steps, trajectory)
    observations, actions, rewards = trajectory.first(steps)
    returns = discounted_returns(rewards, 0.99)
    weights = torch.from_numpy(returns - returns.mean()).float()
    module = networks.to_torch(tuple(policy.sizes.tolist()), parameters[:-1])
    log_sigma = torch.nn.Parameter(torch.from_numpy(parameters[-1:].copy()))
    learning = [p for p in module.parameters() if biases or p.ndim > 1]
    learning += [log_sigma] if distribution.learn_sigma else []
    optimiser = torch.optim.Adam(learning, lr=config.learning_rate)
    features = torch.from_numpy(observations)
    if distribution.constant_feature:
        features = torch.column_stack([features, torch.ones(steps)])
    order = np.arange(steps)
    streams.network.shuffle(order)
    for batch in map(torch.from_numpy, (order[:512], order[512:])):
        outputs = module(features[batch])
        means = (outputs * features[batch]).sum(1) if distribution.mean == "weights" else outputs
        normal = torch.distributions.Normal(means.reshape(-1, 1), log_sigma.exp())
        taken = normal.log_prob(torch.from_numpy(actions)[batch])[:, 0]
        optimiser.zero_grad()
        (-(taken * weights[batch]).mean()).backward()
        optimiser.step()
    expected = np.concatenate([p.detach().numpy().ravel() for p in module.parameters()])
    last = {name: array[0] for name, array in run.arrays.items() if "/" not in name}
    assert last["log_sigma"] == pytest.approx(log_sigma.detach().numpy(), abs=2e-5)
    assert (last["log_sigma"] != parameters[-1:]).all() == distribution.learn_sigma
    _, found = networks.pack(last)
    moved = np.abs(found - parameters[:-1])
    assert moved.max() > 1e-3
    # The terms of a sum nearly cancel, so that its rounding shows; Adam makes much of that.
    assert np.median(np.abs(found - expected)) < 1e-5
    assert np.quantile(np.abs(found - expected), 0.9) < 0.05 * moved.max()


# What a run promises


@pytest.mark.parametrize("name", TASKS)
def test_same_seed_same_bits_alone_again_and_in_a_stack(name):
    arguments = {"episodes": 4, "snapshots": (2,)}
    seeds = tuple(range(100, 130))
    stack = run_of(name, seeds=seeds, **arguments)
    assert_same(stack, run_of(name, seeds=seeds, **arguments))
    for position in (0, 13, 29):
        alone = run_of(name, seeds=[seeds[position]], **arguments)
        assert_same(only(stack, seeds, position), alone)
    for size in (2, 3, 7, 10):
        part = run_of(name, seeds=seeds[5 : 5 + size], **arguments)
        assert_same(only(part, seeds[5 : 5 + size], size - 1), only(stack, seeds, 4 + size))


@pytest.mark.parametrize("name", TASKS)
def test_training_compiled_and_through_gymnasium_gives_the_same_bits(name):
    def plain():
        return gymnasium.make(name, disable_env_checker=True).unwrapped

    arguments = {"episodes": 5, "seeds": [0, 3], "snapshots": (2,)}
    compiled = run_of(name, **arguments)
    assert_same(compiled, run_of(plain, CONFIGS[name], **arguments))
    assert_same(compiled, run_of(plain(), CONFIGS[name], **arguments))


def test_seeds_differ_in_weights_actions_and_environment():
    name = "Acrobot-v1"
    run = run_of(name, episodes=1, seeds=range(10))
    weights = run.arrays["initial/layer0.weight"].reshape(10, -1)
    assert len(np.unique(weights, axis=0)) == 10
    policy, starts, actions = make_policy(Categorical(), (10, 20), 6, 3, 0), [], []
    parameters = np.zeros(networks.count_parameters((6, 10, 20, 3)), np.float32)
    for seed in range(10):
        streams, environment = spawn_streams(seed), open_environment(name)
        environment.seed(streams.environment_seed)
        trajectory = Trajectory(6, 1)
        environment.play(policy, parameters, streams.policy, 50, trajectory)
        starts.append(trajectory.observations[0].copy())
        actions.append(trajectory.actions[:50, 0].copy())
    assert len(np.unique(starts, axis=0)) == 10
    assert len(np.unique(actions, axis=0)) == 10


def test_global_random_states_are_left_alone():
    before = torch.get_rng_state(), str(np.random.get_state()), random.getstate()  # noqa: NPY002
    threads = torch.get_num_threads()
    run_of("Acrobot-v1", episodes=2, seeds=[0, 1])
    run_of("CartPole-v1", ReinforceConfig(), episodes=2, seeds=[0, 1])
    assert torch.equal(before[0], torch.get_rng_state())
    assert before[1:] == (str(np.random.get_state()), random.getstate())  # noqa: NPY002
    assert torch.get_num_threads() == threads


def test_table_and_arrays_have_the_form_agreed():
    run = run_of("MountainCarContinuous-v0", episodes=3, seeds=[4, 2], snapshots=(0, 2))
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
    shapes = {
        "layer0.weight": (2, 3, 10),
        "layer1.weight": (2, 10, 20),
        "layer2.weight": (2, 20, 3),
        "log_sigma": (2, 1),
    }
    moments = ("", "initial/", "episode2/")
    expected = {m + name: shape for m in moments for name, shape in shapes.items()}
    assert {name: array.shape for name, array in run.arrays.items()} == expected
    assert {array.dtype for array in run.arrays.values()} == {np.dtype(np.float32)}
    np.testing.assert_allclose(run.arrays["log_sigma"], np.log(0.5), rtol=1e-6)


def test_a_snapshot_holds_what_a_shorter_run_ends_with():
    long = run_of("Acrobot-v1", episodes=5, seeds=[0, 1], snapshots=(3,))
    short = run_of("Acrobot-v1", episodes=3, seeds=[0, 1])
    for name in ("layer0.weight", "layer2.bias"):
        np.testing.assert_array_equal(long.arrays[f"episode3/{name}"], short.arrays[name])
        assert not np.array_equal(long.arrays[f"initial/{name}"], short.arrays[name])
        assert not np.array_equal(long.arrays[name], short.arrays[name])


def test_progress_counts_everything_and_changes_nothing():
    seen = []
    arguments = {"episodes": 25, "seeds": [3, 1]}
    config = dataclasses.replace(CONFIGS["Acrobot-v1"], max_env_steps=8000)
    run = run_of("Acrobot-v1", config, **arguments, progress=lambda *event: seen.append(event))
    assert_same(run, run_of("Acrobot-v1", config, **arguments))
    assert seen == sorted(seen)
    assert len(seen) > 2
    assert seen[-1] == (50, run.table.groupby("seed")["env_steps"].max().sum())


def test_a_budget_ends_a_seed_and_a_cap_an_episode():
    config = ReinforceConfig(max_episode_steps=300, max_env_steps=1000)
    table = run_of("MountainCar-v0", config, episodes=20, seeds=[0, 1]).table
    for _, rows in table.groupby("seed"):
        assert rows["steps"].tolist() == [300, 300, 300, 100]
        assert not rows["terminated"].any()
        assert rows["env_steps"].iloc[-1] == 1000


def test_a_time_limit_of_the_environment_counts_as_a_cap():
    config = ReinforceConfig(learn_from_capped=False)
    run = run_of(lambda: gymnasium.make("MountainCar-v0"), config, episodes=2, seeds=[0])
    assert run.table["steps"].tolist() == [200, 200]
    assert not run.table["terminated"].any()
    np.testing.assert_array_equal(run.arrays["layer0.weight"], run.arrays["initial/layer0.weight"])


@pytest.mark.parametrize("learns", [True, False])
def test_learning_from_capped_episodes_is_a_choice(learns):
    config = ReinforceConfig(max_episode_steps=150, learn_from_capped=learns)
    run = run_of("MountainCar-v0", config, episodes=2, seeds=[0])
    assert not run.table["terminated"].any()
    changed = run.arrays["layer1.weight"] != run.arrays["initial/layer1.weight"]
    assert changed.any() == learns


@pytest.mark.parametrize("payment", [np.nan, np.inf, 1e300])
def test_a_seed_that_diverges_is_named_and_the_others_go_on(payment):
    seeds = tuple(range(12))
    broken = [seed for seed in seeds if breaks(spawn_streams(seed).environment_seed)]
    config = ReinforceConfig(hidden=(3,), normalise="none")
    arguments = {"episodes": 8, "seeds": seeds, "snapshots": (6,)}
    run = run_of(lambda: Breaking(payment), config, **arguments)
    healthy = run_of(lambda: Breaking(0.5), config, **arguments)
    assert 0 < len(broken) < 12
    assert [(failure.seed, failure.episode) for failure in run.failures] == [
        (seed, 4) for seed in broken
    ]
    what = "weight" if payment == 1e300 else "return"
    assert all(what in failure.reason for failure in run.failures)
    for position, seed in enumerate(seeds):
        found = only(run, seeds, position)
        if seed in broken:
            assert len(found.table) == 4
        else:
            assert_same(found, only(healthy, seeds, position))


# What is learned


@pytest.mark.parametrize("hidden", [(), (8,)])
def test_a_bandit_with_discrete_actions_is_solved(hidden):
    def bandit():
        return Bandit(spaces.Discrete(3), [0.0, 1.0, 0.2].__getitem__)

    config = ReinforceConfig(hidden=hidden, learning_rate=0.02, epochs=1, normalise="none")
    table = run_of(bandit, config, episodes=1000, seeds=range(5)).table
    last = table[table["episode"] > 900].groupby("seed")["return"].mean()
    assert (last > 0.95).all()


@pytest.mark.parametrize("mean", ["weights", "direct"])
def test_a_bandit_with_a_continuous_action_is_solved(mean):
    def bandit():
        return Bandit(spaces.Box(-1, 1, (1,)), lambda action: 1 - (action[0] - 0.7) ** 2)

    config = ReinforceConfig(
        policy=Gaussian(mean=mean, sigma=0.5, learn_sigma=True),
        hidden=(8,),
        learning_rate=5e-3,
        epochs=1,
        normalise="none",
    )
    run = run_of(bandit, config, episodes=3000, seeds=range(5))
    last = run.table[run.table["episode"] > 2500].groupby("seed")["return"].mean()
    assert (last > 0.9).all()
    assert (np.exp(run.arrays["log_sigma"]) < 0.35).all()


@pytest.mark.parametrize("mean", ["weights", "direct"])
@pytest.mark.parametrize("limit", [1.0, np.inf])
def test_a_bandit_with_two_action_dimensions_is_solved(mean, limit):
    """The optimum is the same with bounds and without: nothing needs them."""
    best = np.array([0.7, -0.6])

    def bandit():
        space = spaces.Box(-limit, limit, (2,))
        return Bandit(space, lambda action: -((action - best) ** 2).sum())

    config = ReinforceConfig(
        policy=Gaussian(mean=mean, sigma=0.3, learn_sigma=False),
        hidden=(8,),
        learning_rate=2e-3,
        epochs=1,
        normalise="none",
    )
    run = run_of(bandit, config, episodes=3000, seeds=range(5))
    for position in range(5):
        weights = weights_of(run.arrays, position)
        found = mean_actions(config, weights, np.ones((1, 1)))[0]
        np.testing.assert_allclose(found, best, atol=0.25)


def test_a_box_of_any_shape_gets_actions_of_that_shape():
    taken = []

    def reward(action):
        taken.append(action)
        return 0.0

    def bandit():
        return Bandit(spaces.Box(-np.inf, np.inf, (2, 3)), reward)

    config = ReinforceConfig(policy=Gaussian(sigma=3.0), epochs=1)
    run = run_of(bandit, config, episodes=50, seeds=[0])
    assert {action.shape for action in taken} == {(2, 3)}
    assert np.abs(taken).max() > 5.0
    assert run.arrays["log_sigma"].shape == (1, 6)


def test_the_reward_is_charged_on_the_unclipped_action():
    config = dataclasses.replace(
        CONFIGS["MountainCarContinuous-v0"], policy=Gaussian(sigma=4.0), max_episode_steps=400
    )
    table = run_of("MountainCarContinuous-v0", config, episodes=1, seeds=range(8)).table
    cost = (table["terminated"] * 100 - table["return"]) / table["steps"]
    assert cost.mean() == pytest.approx(0.1 * 4.0**2, rel=0.1)  # 0.1 at most, were it clipped


@pytest.mark.slow
def test_cart_pole_is_learned_through_the_plain_loop():
    """At least 450 over the last 50 episodes for most seeds.

    The settings were chosen on the seeds 1000 to 1014, of which 13 got there.
    """
    config = ReinforceConfig(gamma=0.995, hidden=(64,), learning_rate=2e-3, epochs=1)
    table = run_of("CartPole-v1", config, episodes=1000, seeds=range(10)).table
    last = table[table["episode"] > 950].groupby("seed")["return"].mean()
    assert (last >= 450).sum() >= 7


# Bad input


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("gamma", -0.1),
        ("gamma", 1.1),
        ("gamma", np.nan),
        ("gamma", True),
        ("gamma", "high"),
        ("hidden", (10, 0)),
        ("hidden", (10, -3)),
        ("hidden", (10.0,)),
        ("hidden", [10]),
        ("hidden", 10),
        ("biases", "no"),
        ("policy", "categorical"),
        ("learning_rate", 0.0),
        ("learning_rate", -1e-3),
        ("learning_rate", np.inf),
        ("learning_rate", np.nan),
        ("learning_rate", True),
        ("batch_size", 0),
        ("batch_size", 1.5),
        ("epochs", 0),
        ("normalise", "both"),
        ("normalise", np.array(["none", "centre"])),
        ("max_episode_steps", 0),
        ("max_env_steps", -1),
        ("learn_from_capped", 1),
    ],
)
def test_a_setting_out_of_range_is_refused(field, value):
    with pytest.raises(ValueError, match=rf"^{field} must be .*, got "):
        ReinforceConfig(**{field: value})


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("seeds", []),
        ("seeds", [1, 1]),
        ("seeds", [-1]),
        ("seeds", [0.5]),
        ("seeds", [True]),
        ("seeds", 5),
        ("seeds", None),
        ("episodes", 0),
        ("episodes", 2.5),
        ("snapshots", (11,)),
        ("snapshots", (-1,)),
        ("snapshots", 5),
        ("snapshots", (2 * n for n in range(9))),
        ("progress", 5),
        ("config", None),
    ],
)
def test_an_argument_out_of_range_is_refused_before_anything_runs(argument, value):
    def refuse():
        raise AssertionError("an environment was made")

    arguments = {"config": ReinforceConfig(), "episodes": 10, "seeds": [0], argument: value}
    with pytest.raises(ValueError, match=rf"^{argument} must be .*, got "):
        reinforce.reinforce(refuse, arguments.pop("config"), **arguments)


@pytest.mark.parametrize(
    ("env", "policy"),
    [("MountainCar-v0", Gaussian()), ("MountainCarContinuous-v0", Categorical())],
)
def test_a_policy_over_other_actions_is_refused(env, policy):
    with pytest.raises(ValueError, match="policy must be"):
        reinforce.reinforce(env, ReinforceConfig(policy=policy), episodes=1, seeds=[0])


@pytest.mark.parametrize("env", ["Pole-v7", "nowhere:Foo-v0", "a b"])
def test_an_unknown_environment_is_refused(env):
    with pytest.raises(ValueError, match=f"env must be an id that Gymnasium knows, got {env!r}"):
        reinforce.reinforce(env, ReinforceConfig(), episodes=1, seeds=[0])


def test_numpys_numbers_are_numbers():
    config = ReinforceConfig(
        gamma=np.float32(0.5), learning_rate=np.float64(1e-3), batch_size=np.int64(7)
    )
    plain = ReinforceConfig(gamma=0.5, learning_rate=1e-3, batch_size=7)
    runs = [reinforce.reinforce("Acrobot-v1", c, episodes=1, seeds=[0]) for c in (config, plain)]
    assert_same(*runs)
    assert provenance.describe(config) == provenance.describe(plain)


def test_a_generator_of_snapshots_is_not_used_up():
    config = ReinforceConfig(max_episode_steps=20)
    every = (n for n in (1, 2))
    run = reinforce.reinforce("Acrobot-v1", config, episodes=2, seeds=[0, 1], snapshots=every)
    assert {"episode1/layer0.weight", "episode2/layer0.weight"} <= set(run.arrays)


def test_a_config_is_plain_data():
    for config in CONFIGS.values():
        assert json.loads(json.dumps(dataclasses.asdict(config)))["gamma"] == 0.99
