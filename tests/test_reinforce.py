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

from rl_core import modules, policies, reinforce
from rl_core.experiments import Arm, run
from rl_core.identity import describe
from rl_core.kernels import likelihood, networks
from rl_core.policies import MLP, Categorical, Gaussian, Module, make_policy
from rl_core.reinforce import ReinforceConfig, TorchLearner, discounted_returns, normalised
from rl_core.training import spawn_streams, weights_of
from rl_core.worlds.environments import open_world
from rl_core.worlds.episodes import Trajectory, play_episode
from studies.policy_maps import mean_actions

TASKS = ("Acrobot-v1", "MountainCar-v0", "MountainCarContinuous-v0")
CONFIGS = {
    "Acrobot-v1": ReinforceConfig(max_episode_steps=700),
    "MountainCar-v0": ReinforceConfig(max_episode_steps=1500),
    "MountainCarContinuous-v0": ReinforceConfig(
        policy=Gaussian(sigma=0.5, constant_feature=True),
        network=MLP(biases=False),
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
    likelihood.likelihood_gradient(
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
    streams, world = spawn_streams(0), open_world(Chain)
    world.seed(streams.environment_seed)
    actor = likelihood.make_actor(policy, parameters)
    trajectory = Trajectory(2, 1)
    estimates = []
    for _ in range(4000):
        steps, _ = play_episode(world, actor, streams.policy, 100, trajectory)
        estimates.append(estimate(policy, parameters, *trajectory.first(steps)))
    error = np.mean(estimates, axis=0) - exact_gradient(policy, parameters.astype(float))
    assert (np.abs(error) <= 4.5 * np.std(estimates, axis=0) / np.sqrt(4000) + 1e-6).all()


# Two learners, one loop

KINDS = {
    "categorical": (Categorical(), 3, 0),
    "weights, fixed sigma": (Gaussian(sigma=0.5, constant_feature=True), 0, 2),
    "weights, learned sigma": (Gaussian(sigma=0.5, learn_sigma=True), 0, 1),
    "direct, fixed sigma": (Gaussian(mean="direct", sigma=0.5), 0, 1),
    "direct, learned sigma": (Gaussian(mean="direct", sigma=0.5, learn_sigma=True), 0, 2),
}


@pytest.fixture
def one_thread():
    """Threads of torch that wait for a core cost more than networks this small."""
    with modules.reproducible():
        yield


class Learners:
    """Both learners of one configuration, with the same weights, and a made-up episode."""

    def __init__(self, kind, biases, hidden, steps=64):
        distribution, n_actions, dimensions = KINDS[kind]
        self.policy = make_policy(distribution, hidden, 4, n_actions, dimensions)
        network = MLP(hidden, biases)
        self.config = ReinforceConfig(network=network, policy=distribution, batch_size=steps)
        rng = np.random.default_rng(0)
        self.compiled = policies.initial_parameters(self.policy, distribution, rng)
        self.mask = policies.trainable(self.policy, distribution, biases)
        self.compiled_learner = likelihood.make_learner(
            self.policy, self.compiled, self.mask, steps, self.config.learning_rate
        )
        self.torchs = self.compiled.copy()
        sizes = self.policy.sizes.tolist()
        self.module = modules.perceptron(sizes, self.torchs, biases)
        start = torch.from_numpy(self.torchs)[networks.count_parameters(sizes) :]
        learns = self.policy.gaussian and distribution.learn_sigma
        self.log_sigma = torch.nn.Parameter(start, requires_grad=learns)
        self.torch_learner = TorchLearner(self.policy, self.module, self.log_sigma, self.config)
        width = self.policy.action_width
        self.actions = (
            rng.normal(size=(steps, width)) if dimensions else rng.integers(3, size=(steps, 1))
        )
        self.episode = (
            rng.normal(size=(steps, 4)).astype(np.float32),
            self.actions.astype(np.float32),
            rng.normal(size=steps),
            np.arange(steps)[None],
        )

    def compiled_gradient(self, parameters):
        """By all parameters, of the loss that both descend."""
        observations, actions, v, _ = self.episode
        scratch = np.empty((2, self.policy.sizes.sum(), networks.padded(len(v))), np.float32)
        gradient = np.empty_like(parameters)
        weights = (v / len(v)).astype(np.float32)
        likelihood.likelihood_gradient(
            self.policy, parameters, observations, actions, weights, *scratch, gradient
        )
        return gradient * self.mask

    def torch_gradient(self):
        """Of the update just made; parameters that do not learn have none."""
        parameters = [*self.module.parameters(), self.log_sigma]
        zeros = (torch.zeros_like(p) if p.grad is None else p.grad for p in parameters)
        return torch.cat([gradient.flatten() for gradient in zeros]).numpy()


@pytest.mark.parametrize("hidden", [(7,), (7, 5)])
@pytest.mark.parametrize("biases", [True, False])
@pytest.mark.parametrize("kind", KINDS)
def test_every_update_is_the_same_compiled_and_in_torch(one_thread, kind, biases, hidden):
    """To 1e-5 of the gradient's norm, and the parameters to 1e-4, which both walk on their own."""
    both = Learners(kind, biases, hidden)
    initial = both.compiled.copy()
    for _ in range(50):
        gradient = both.compiled_gradient(both.torchs)
        both.torch_learner.learn(*both.episode)
        likelihood.learn(both.compiled_learner, *both.episode)
        norm = np.linalg.norm(gradient)
        assert norm > 1e-3
        assert np.linalg.norm(both.torch_gradient() - gradient) <= 1e-5 * norm
        np.testing.assert_allclose(both.torchs, both.compiled, rtol=0, atol=1e-4)
    moved = both.compiled != initial
    assert not moved[both.mask == 0].any()
    assert moved[both.mask == 1].mean() > 0.7  # a unit that is never on does not learn
    np.testing.assert_array_equal(both.torchs != initial, moved)


@pytest.mark.parametrize("kind", ["categorical", "weights, learned sigma", "direct, learned sigma"])
def test_the_gradient_of_the_stated_loss_is_that_of_finite_differences(one_thread, kind):
    both = Learners(kind, True, (7, 5))
    both.module.double()
    log_sigma = torch.nn.Parameter(both.log_sigma.detach().double())
    learner = TorchLearner(both.policy, both.module, log_sigma, both.config)
    tensors = [torch.from_numpy(array).double() for array in both.episode[:3]]
    loss = learner.loss(*tensors)
    loss.backward()
    learned = [*both.module.parameters(), *([log_sigma] if log_sigma.numel() else [])]
    for parameter in learned:
        values, gradient = parameter.data.view(-1), parameter.grad.view(-1)
        for i in range(len(values)):
            around = []
            for step in (1e-6, -1e-6):
                values[i] += step
                around.append(learner.loss(*tensors).item())
                values[i] -= step
            assert gradient[i].item() == pytest.approx((around[0] - around[1]) / 2e-6, abs=1e-7)


def test_the_log_probability_is_torchs():
    y, s = torch.randn(2, 6, 3, generator=torch.Generator().manual_seed(0))
    taken = torch.tensor([[0.0], [2.0], [1.0], [1.0], [0.0], [2.0]])
    found = reinforce.log_probability(make_policy(Categorical(), (), 3, 3, 0), y, s, taken, y)
    expected = torch.distributions.Categorical(logits=y).log_prob(taken[:, 0])
    torch.testing.assert_close(found, expected)
    for mean, mu in [("direct", y), ("weights", (y * s).sum(1, keepdim=True))]:
        policy = make_policy(Gaussian(mean=mean), (), 3, 0, mu.shape[1])
        log_sigma = torch.linspace(-1, 1, mu.shape[1])
        found = reinforce.log_probability(policy, y, s, s[:, : mu.shape[1]], log_sigma)
        normal = torch.distributions.Normal(mu, log_sigma.exp())
        torch.testing.assert_close(found, normal.log_prob(s[:, : mu.shape[1]]).sum(1))


class Remembered(gymnasium.Wrapper):
    """Keeps the actions of every episode where the test can see them."""

    played: list = []  # noqa: RUF012

    def reset(self, **arguments):
        """Begin a list."""
        self.played.append([])
        return self.env.reset(**arguments)

    def step(self, action):
        """Keep the action and what comes of it."""
        following = self.env.step(action)
        self.played[-1].append((np.array(action).tolist(), following[0].tolist(), following[1]))
        return following


@pytest.mark.parametrize("name", ["Acrobot-v1", "MountainCarContinuous-v0"])
def test_both_engines_take_the_same_first_episode_to_the_bit(name, monkeypatch):
    config = dataclasses.replace(CONFIGS[name], max_episode_steps=250)
    played = []
    for engine in ("compiled", "torch"):
        monkeypatch.setattr(Remembered, "played", [])
        of_engine = dataclasses.replace(config, engine=engine)
        found = run_of(
            lambda: Remembered(gymnasium.make(name).unwrapped), of_engine, episodes=2, seeds=[3]
        )
        played.append((Remembered.played[0], found))
    assert len(played[0][0]) == 250
    assert played[0][0] == played[1][0]
    (_, compiled), (_, through_torch) = played
    assert compiled.arrays.keys() == through_torch.arrays.keys()
    for array in (name for name in compiled.arrays if name.startswith("initial/")):
        np.testing.assert_array_equal(compiled.arrays[array], through_torch.arrays[array])


@pytest.mark.parametrize("name", TASKS)
def test_both_engines_end_fifty_updates_of_an_episode_alike(name):
    """Five epochs of ten shuffled minibatches: what a whole run makes of the first episode."""
    config = dataclasses.replace(
        CONFIGS[name], max_episode_steps=400, batch_size=40, epochs=5, learning_rate=1e-3
    )
    compiled, through_torch = (
        run_of(name, dataclasses.replace(config, engine=engine), episodes=1, seeds=[1])
        for engine in ("compiled", "torch")
    )
    assert compiled.table.equals(through_torch.table)
    for array, found in compiled.arrays.items():
        np.testing.assert_allclose(found, through_torch.arrays[array], rtol=0, atol=1e-4)
        moved = np.abs(found - compiled.arrays[f"initial/{array.rpartition('/')[2]}"]).max()
        assert "/" in array or array == "log_sigma" or moved > 5e-3


@pytest.mark.parametrize(
    "network", [MLP(), Module("toy_networks:make"), Module("toy_networks:with_dropout")]
)
def test_the_torch_learner_gives_the_same_bits_twice(network):
    config = ReinforceConfig(network=network, engine="torch", max_episode_steps=60, batch_size=25)
    runs = []
    for threads in (1, 2):
        before = torch.get_num_threads()
        torch.set_num_threads(threads)
        torch.rand(threads)
        runs.append(run_of("Acrobot-v1", config, episodes=4, seeds=[0, 7], snapshots=(2,)))
        torch.set_num_threads(before)
    assert_same(*runs)
    alone = run_of("Acrobot-v1", config, episodes=4, seeds=[7], snapshots=(2,))
    assert_same(only(runs[0], [0, 7], 1), alone)


# Any network


def test_a_module_comes_back_under_its_own_names_and_loads_again():
    network = Module("toy_networks:make")
    config = ReinforceConfig(network=network, policy=Gaussian(mean="direct"), max_episode_steps=50)
    found = run_of("MountainCarContinuous-v0", config, episodes=3, seeds=[0, 1], snapshots=(2,))
    names = {"body.weight", "body.bias", "head.weight", "calls", "log_sigma"}
    moments = ("", "initial/", "episode2/")
    assert set(found.arrays) == {moment + name for moment in moments for name in names}
    assert found.arrays["body.weight"].shape == (2, 8, 2)
    assert (found.arrays["head.weight"] != found.arrays["initial/head.weight"]).all()
    assert found.arrays["initial/calls"].tolist() == [0, 0]
    weights = weights_of(found.arrays, 1)
    del weights["log_sigma"]
    module = modules.make_module(network, 2, 1, np.random.default_rng(9))
    modules.load_arrays(module, weights)
    expected = np.tanh([0.5, 0.1] @ weights["body.weight"].T + weights["body.bias"])
    output = module(torch.tensor([[0.5, 0.1]])).detach().numpy()[0]
    np.testing.assert_allclose(output, expected @ weights["head.weight"].T, rtol=1e-4)


def test_the_reports_network_as_a_module_learns_a_bandit():
    config = ReinforceConfig(
        network=Module("toy_networks:plain"), learning_rate=0.02, epochs=1, normalise="none"
    )

    def bandit():
        return Bandit(spaces.Discrete(3), [0.0, 1.0, 0.2].__getitem__)

    table = run_of(bandit, config, episodes=400, seeds=[0]).table
    assert table["return"].tail(100).mean() > 0.95


def test_a_module_travels_to_workers(tmp_path):
    config = ReinforceConfig(network=Module("toy_networks:make"), max_episode_steps=30)
    arm = Arm("module", reinforce.reinforce, "MountainCar-v0", config, 2)
    results = run([arm], seeds=[0, 1], store=tmp_path, workers=2, progress=False)
    direct = run_of("MountainCar-v0", config, episodes=2, seeds=[0, 1])
    assert results.table.drop(columns="arm").equals(direct.table)
    for name, array in direct.arrays.items():
        np.testing.assert_array_equal(results.arrays("module")[name], array)
    assert config.network.code in results.provenance["config"].iloc[0]


@pytest.mark.parametrize("name", ["one_too_many", "other_inputs", "no_module", "raising"])
def test_a_network_that_does_not_fit_is_refused_before_an_episode_is_played(name):
    class Untouched(Chain):
        def reset(self, **arguments):
            raise AssertionError("an episode was begun")

    config = ReinforceConfig(network=Module(f"toy_networks:{name}"))
    with pytest.raises(ValueError, match=rf"^network must .*toy_networks:{name}"):
        run_of(Untouched, config, episodes=1, seeds=[0])
    with pytest.raises(ValueError, match=rf"^network must .*toy_networks:{name}"):
        reinforce.check_reinforce(Untouched, config)


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
    one = {**arguments, "seeds": [3]}
    assert_same(only(compiled, [0, 3], 1), run_of(plain(), CONFIGS[name], **one))


def test_seeds_differ_in_weights_actions_and_environment():
    name = "Acrobot-v1"
    run = run_of(name, episodes=1, seeds=range(10))
    weights = run.arrays["initial/layer0.weight"].reshape(10, -1)
    assert len(np.unique(weights, axis=0)) == 10
    policy, starts, actions = make_policy(Categorical(), (10, 20), 6, 3, 0), [], []
    actor = likelihood.make_actor(policy, np.zeros(353, np.float32))
    for seed in range(10):
        streams, world, trajectory = spawn_streams(seed), open_world(name), Trajectory(6, 1)
        world.seed(streams.environment_seed)
        play_episode(world, actor, streams.policy, 50, trajectory)
        starts.append(trajectory.observations[0].copy())
        actions.append(trajectory.actions[:50, 0].copy())
    assert len(np.unique(starts, axis=0)) == 10
    assert len(np.unique(actions, axis=0)) == 10


def test_global_random_states_are_left_alone():
    before = torch.get_rng_state(), str(np.random.get_state()), random.getstate()  # noqa: NPY002
    threads = torch.get_num_threads()
    run_of("Acrobot-v1", episodes=2, seeds=[0, 1])
    run_of(lambda: gymnasium.make("CartPole-v1"), ReinforceConfig(), episodes=2, seeds=[0, 1])
    run_of("CartPole-v1", ReinforceConfig(engine="torch"), episodes=2, seeds=[0, 1])
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
    config = ReinforceConfig(network=MLP((3,)), normalise="none")
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

    config = ReinforceConfig(network=MLP(hidden), learning_rate=0.02, epochs=1, normalise="none")
    table = run_of(bandit, config, episodes=1000, seeds=range(5)).table
    last = table[table["episode"] > 900].groupby("seed")["return"].mean()
    assert (last > 0.95).all()


@pytest.mark.parametrize("mean", ["weights", "direct"])
def test_a_bandit_with_a_continuous_action_is_solved(mean):
    def bandit():
        return Bandit(spaces.Box(-1, 1, (1,)), lambda action: 1 - (action[0] - 0.7) ** 2)

    config = ReinforceConfig(
        policy=Gaussian(mean=mean, sigma=0.5, learn_sigma=True),
        network=MLP((8,)),
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
        network=MLP((8,)),
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
def test_cart_pole_is_learned():
    """At least 450 over the last 50 episodes for most seeds.

    The settings were chosen on the seeds 1000 to 1014, of which 13 got there.
    """
    config = ReinforceConfig(gamma=0.995, network=MLP((64,)), learning_rate=2e-3, epochs=1)
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
        ("learning_rate", 0.0),
        ("learning_rate", -1e-3),
        ("learning_rate", np.inf),
        ("learning_rate", np.nan),
        ("batch_size", 0),
        ("epochs", 0),
        ("normalise", "both"),
        ("max_episode_steps", 0),
        ("max_env_steps", -1),
        ("engine", "jax"),
    ],
)
def test_a_setting_out_of_range_is_refused(field, value):
    with pytest.raises(ValueError, match=rf"^{field} must be .*, got "):
        ReinforceConfig(**{field: value})


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("gamma", True),
        ("gamma", "high"),
        ("network", (10, 20)),
        ("network", None),
        ("network", torch.nn.Linear(2, 3)),
        ("network", "toy_networks:make"),
        ("policy", "categorical"),
        ("learning_rate", True),
        ("batch_size", 1.5),
        ("normalise", np.array(["none", "centre"])),
        ("learn_from_capped", 1),
        ("engine", torch),
    ],
)
def test_a_setting_of_another_kind_is_refused(field, value):
    with pytest.raises(TypeError, match=rf"(?s)^{field} must be .*, got "):
        ReinforceConfig(**{field: value})


def test_a_module_is_not_compiled():
    with pytest.raises(ValueError, match=r"^engine must be 'torch' for a Module, got 'compiled'"):
        ReinforceConfig(network=Module("toy_networks:make"), engine="compiled")
    assert ReinforceConfig(network=Module("toy_networks:make")).engine == "torch"


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("seeds", []),
        ("seeds", None),
        ("episodes", 0),
        ("snapshots", (11,)),
        ("progress", 5),
        ("config", None),
        ("config", {"gamma": 0.9}),
    ],
)
def test_an_argument_out_of_range_is_refused_before_anything_runs(argument, value):
    def refuse():
        raise AssertionError("an environment was made")

    arguments = {"config": ReinforceConfig(), "episodes": 10, "seeds": [0], argument: value}
    with pytest.raises((TypeError, ValueError), match=rf"^{argument} must be .*, got "):
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
    with pytest.raises(ValueError, match=f"^env must .*, got {env!r}"):
        reinforce.reinforce(env, ReinforceConfig(), episodes=1, seeds=[0])


def test_numpys_numbers_are_numbers():
    config = ReinforceConfig(
        gamma=np.float32(0.5), learning_rate=np.float64(1e-3), batch_size=np.int64(7)
    )
    plain = ReinforceConfig(gamma=0.5, learning_rate=1e-3, batch_size=7)
    assert describe(config) == describe(plain)


def test_a_config_is_plain_data():
    for config in CONFIGS.values():
        assert json.loads(json.dumps(dataclasses.asdict(config)))["gamma"] == 0.99
