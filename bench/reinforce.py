"""REINFORCE against the usual loop, Stable-Baselines3 and networks stacked in torch.

Measured in microseconds of processor time an environment step.

All learn with the same hyperparameters. Rates are taken over the beginning of training, the first
episodes of a seed up to a budget of steps, because the usual loop would take hours for the rest;
what the whole of our training takes is told beside it.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from unittest import mock

import gymnasium as gym
import numpy as np
import torch
from stable_baselines3 import A2C
from stable_baselines3.common.env_util import make_vec_env
from torch import nn
from torch.distributions import Categorical as TorchCategorical
from torch.distributions import Normal

from bench import stacked
from bench.table import comparison, in_turns, processor_seconds
from rl_core import reinforce
from rl_core.kernels import likelihood, networks
from rl_core.policies import MLP, Categorical, Gaussian, initial_parameters, make_policy
from rl_core.reinforce import ReinforceConfig

SEEDS = range(30)
BEGINNING = {"episodes": 50, "max_env_steps": 20_000}  # of a seed
WHOLE = 2_000  # episodes
UNIT = "processor µs a step"
CONFIGS = {
    "Acrobot-v1": ReinforceConfig(max_episode_steps=5_000, learn_from_capped=False),
    "MountainCar-v0": ReinforceConfig(max_episode_steps=100_000, learn_from_capped=False),
    "MountainCarContinuous-v0": ReinforceConfig(
        policy=Gaussian(mean="weights", sigma=0.5),
        network=MLP(biases=False),
        learning_rate=2e-3,
        epochs=1,
        normalise="centre",
        max_episode_steps=100_000,
        learn_from_capped=False,
    ),
}
BUDGET = 5_000_000  # environment steps a seed, for the whole training
LOCKSTEP = ReinforceConfig(max_episode_steps=200)  # nearly no episode ends before
LOCKSTEP_EPISODES = 30


class UsualAgent:
    """REINFORCE as it is usually written: one Gymnasium environment, one torch network."""

    def __init__(self, name: str, config: ReinforceConfig, seed: int) -> None:
        torch.manual_seed(seed)
        self.config = config
        self.env = gym.make(name, max_episode_steps=config.max_episode_steps)
        self.gaussian = isinstance(config.policy, Gaussian)
        n_in = self.env.observation_space.shape[0]
        n_out = n_in if self.gaussian else self.env.action_space.n
        widths = (n_in, *config.network.hidden, n_out)
        layers = []
        for a, b in pairwise(widths):
            layers += [nn.Linear(a, b, bias=config.network.biases), nn.ReLU()]
        self.network = nn.Sequential(*layers[:-1])
        self.optimiser = torch.optim.Adam(self.network.parameters(), lr=config.learning_rate)

    def distribution(self, states: torch.Tensor) -> torch.distributions.Distribution:
        """pi(.|s), validation switched off as the fastest loops do."""
        outputs = self.network(states)
        if self.gaussian:
            means = (outputs * states).sum(-1, keepdim=True)
            return Normal(means, self.config.policy.sigma, validate_args=False)
        return TorchCategorical(logits=outputs, validate_args=False)

    def act(self, state: np.ndarray) -> int | np.ndarray:
        """Draw an action."""
        with torch.no_grad():
            action = self.distribution(torch.from_numpy(state)).sample()
        return action.numpy() if self.gaussian else int(action)

    def learn(self, states: list, actions: list, rewards: list) -> None:
        """All epochs over one episode."""
        config, v, following = self.config, np.empty(len(rewards)), 0.0
        for t in range(len(rewards) - 1, -1, -1):
            v[t] = following = rewards[t] + config.gamma * following
        v -= v.mean()
        if config.normalise == "standard" and v.std() > 0:
            v /= v.std()
        s = torch.from_numpy(np.array(states))
        a, v = torch.from_numpy(np.array(actions)), torch.from_numpy(v).float()
        for _ in range(config.epochs):
            for batch in torch.randperm(len(v)).split(config.batch_size):
                logs = self.distribution(s[batch]).log_prob(a[batch]).reshape(len(batch))
                loss = -(logs * v[batch]).mean()
                self.optimiser.zero_grad()
                loss.backward()
                self.optimiser.step()

    def train(self, episodes: int, max_env_steps: int, seed: int) -> int:
        """Return the number of environment steps."""
        env_steps = 0
        state, _ = self.env.reset(seed=seed)
        for _ in range(episodes):
            states, actions, rewards, over = [], [], [], False
            while not over and env_steps < max_env_steps:
                states.append(state)
                actions.append(self.act(state))
                state, reward, terminated, truncated, _ = self.env.step(actions[-1])
                rewards.append(reward)
                env_steps += 1
                over = terminated or truncated
            if terminated:
                self.learn(states, actions, rewards)
            if env_steps >= max_env_steps:
                break
            state, _ = self.env.reset()
        return env_steps


def usual_loop(name: str, seed: int) -> int:
    """Train the usual agent for the beginning; return its environment steps."""
    return UsualAgent(name, CONFIGS[name], seed).train(**BEGINNING, seed=seed)


def ours(name: str, seeds: range = SEEDS, **changes: int) -> int:
    """Train all seeds, for the beginning unless told otherwise; return the environment steps."""
    config = replace(CONFIGS[name], max_env_steps=changes.get("budget", BEGINNING["max_env_steps"]))
    episodes = changes.get("episodes", BEGINNING["episodes"])
    table = reinforce.reinforce(name, config, episodes=episodes, seeds=seeds).table
    return int(table["steps"].sum())


def learned_share(name: str) -> float:
    """Share of the steps of `ours`' beginning that are learned from: those of finished episodes."""
    config = replace(CONFIGS[name], max_env_steps=BEGINNING["max_env_steps"])
    episodes = BEGINNING["episodes"]
    table = reinforce.reinforce(name, config, episodes=episodes, seeds=SEEDS).table
    return float(table.loc[table["terminated"], "steps"].sum() / table["steps"].sum())


def a2c(name: str, seed: int, steps: int = 10_000) -> int:
    """Stable-Baselines3's A2C with 16 environments, network and learning rate the same."""
    model = A2C(
        "MlpPolicy",
        make_vec_env(name, n_envs=16, seed=seed),
        gamma=0.99,
        learning_rate=1e-3,
        use_rms_prop=False,
        policy_kwargs={"net_arch": [10, 20], "activation_fn": nn.ReLU},
        device="cpu",
        seed=seed,
    )
    model.learn(steps)
    return int(model.num_timesteps)


def microseconds(way: Callable[[], int]) -> float:
    """Processor time a step of one call."""
    steps = []
    return processor_seconds(lambda: steps.append(way())) / steps[0] * 1e6


def where_time_goes(name: str) -> str:
    """Shares of episodes, learner and rest, and the time of the whole training of 30 seeds."""
    spent = {"episodes": 0.0, "learner": 0.0}

    def timed(part: str, function: Callable) -> Callable:
        def call(*arguments: object) -> object:
            start = time.perf_counter()
            result = function(*arguments)
            spent[part] += time.perf_counter() - start
            return result

        return call

    play = timed("episodes", reinforce.play_episode)
    learner = timed("learner", likelihood.learn)
    start = time.perf_counter()
    with (
        mock.patch.object(reinforce, "play_episode", play),
        mock.patch.object(likelihood, "learn", learner),
    ):
        steps = ours(name, episodes=WHOLE, budget=BUDGET)
    seconds = time.perf_counter() - start
    shares = {**spent, "rest": seconds - sum(spent.values())}
    parts = ", ".join(f"{part} {share / seconds:.0%}" for part, share in shares.items())
    return (
        f"whole training, {len(SEEDS)} seeds x {WHOLE} episodes: {seconds:.0f} s, "
        f"{steps / 1e6:.0f} million steps, {seconds / steps * 1e6:.2f} µs a step ({parts})"
    )


def stacked_update(n_networks: int, n: int) -> Callable[[], int]:
    """One minibatch of n for each of many networks in torch."""
    networks = stacked.Networks(n_networks, (6, 10, 20, 3), learning_rate=1e-3)
    states = torch.randn(n_networks, n, 6)
    actions, v = torch.randint(0, 3, (n_networks, n, 1)), torch.randn(n_networks, n)

    def update() -> int:
        stacked.learn(networks, states, actions, v)
        return n_networks * n

    return update


def compiled_update(n_networks: int, n: int) -> Callable[[], int]:
    """The same with the compiled networks, one after the other."""
    rng = np.random.default_rng(0)
    policy = make_policy(Categorical(), (10, 20), 6, 3, 0)
    stack = [initial_parameters(policy, Categorical(), rng) for _ in range(n_networks)]
    moments = np.zeros((n_networks, 2, stack[0].size), np.float32)
    gradient = np.empty_like(stack[0])
    units, deltas = np.empty((2, policy.sizes.sum(), networks.padded(n)), np.float32)
    states = rng.normal(size=(n, 6)).astype(np.float32)
    actions = rng.integers(3, size=(n, 1)).astype(np.float32)
    v = rng.normal(size=n).astype(np.float32) / n

    def update() -> int:
        for parameters, (first, second) in zip(stack, moments, strict=True):
            likelihood.likelihood_gradient(
                policy, parameters, states, actions, v, units, deltas, gradient
            )
            networks.adam_step(parameters, gradient, first, second, 1, 1e-3)
        return n_networks * n

    return update


def costs_of(ways: dict[str, Callable[[int], int]], name: str) -> dict[str, list[float]]:
    """Compile, then let the ways take turns: the cost a step of each turn."""
    for way in ways.values():
        way(99)
    measured = {
        key: lambda turn, way=way: microseconds(lambda: way(turn)) for key, way in ways.items()
    }
    return in_turns(measured, name)


def training_rows() -> Iterator[dict]:
    """Whole training, learning included."""
    beginning = (
        f"learning included, one core; first {BEGINNING['episodes']} episodes of a seed or "
        f"{BEGINNING['max_env_steps']:,} steps, both"
    )
    for name in CONFIGS:
        ways = {
            "usual": lambda seed, name=name: usual_loop(name, seed),
            "ours": lambda _, name=name: ours(name),
        }
        if name == "Acrobot-v1":
            ways["a2c"] = lambda seed, name=name: a2c(name, seed)
        benchmark = f"REINFORCE on {name}"
        costs = costs_of(ways, benchmark)
        note = (
            f"rival: one network; ours: 30 seeds; {beginning}; {learned_share(name):.0%} of our "
            "steps are in finished episodes, learned from"
        )
        if name != "MountainCarContinuous-v0":
            note += f"; {where_time_goes(name)}"
        usual = "usual loop over Gymnasium and torch"
        yield comparison(benchmark, usual, costs["usual"], costs["ours"], UNIT, note)
        if name == "Acrobot-v1":
            note = f"rival: 16 environments, 10,000 steps; ours: 30 seeds; {beginning}"
            yield comparison(
                benchmark, "Stable-Baselines3 A2C", costs["a2c"], costs["ours"], UNIT, note
            )


def stacked_row() -> dict:
    """Whole training in lockstep: 30 seeds as one stack of networks and one of cars."""
    episodes, steps = LOCKSTEP_EPISODES, LOCKSTEP.max_episode_steps

    def theirs(seed: int) -> int:
        return stacked.train_reinforce(len(SEEDS), LOCKSTEP, episodes, seed)

    def mine(_: int) -> int:
        table = reinforce.reinforce("MountainCar-v0", LOCKSTEP, episodes=episodes, seeds=SEEDS)
        return int(table.table["steps"].sum())

    name = f"REINFORCE on MountainCar-v0, episodes of {steps} steps"
    costs = costs_of({"torch": theirs, "ours": mine}, name)
    note = (
        "both: 30 seeds, learning included, one core; rival: one stack of 30 networks and 30 cars "
        "in lockstep, baddbmm, autograd, fused Adam"
    )
    return comparison(name, stacked.NAME, costs["torch"], costs["ours"], UNIT, note)


def learner_rows() -> Iterator[dict]:
    """The learner alone: why the networks are compiled and not stacked in torch."""
    for n_networks, n in ((1, 150), (30, 150), (30, 512)):
        updates = {"torch": stacked_update(n_networks, n), "ours": compiled_update(n_networks, n)}
        ways = {
            name: lambda _, update=update: sum(update() for _ in range(100))
            for name, update in updates.items()
        }
        stack = "1 network" if n_networks == 1 else f"{n_networks} networks"
        benchmark = f"one update of {stack}, minibatch {n}"
        costs = costs_of(ways, benchmark)
        yield comparison(
            benchmark,
            stacked.NAME,
            costs["torch"],
            costs["ours"],
            "processor µs a sample",
            "baddbmm, autograd, fused Adam, one thread; widths 6-10-20-3; 100 updates a turn",
        )


def rows() -> list[dict]:
    """Measure everything."""
    torch.set_num_threads(1)
    return [*training_rows(), stacked_row(), *learner_rows()]


if __name__ == "__main__":
    for measured in rows():
        print(measured)
