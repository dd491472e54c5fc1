"""One-step actor-critic, an algorithm in one file: policy and value learn at every step.

    delta <- r + gamma v(s') - v(s),    where v(s') = 0 if s' is terminal,
    w <- w + alpha_w delta grad v(s),    theta <- theta + alpha_theta I delta grad log pi(a|s),

with I = 1 at first and I <- gamma I at every step.

Source: R. S. Sutton and A. G. Barto, Reinforcement Learning: An Introduction (2018), section 13.5
"""

from contextlib import closing
from dataclasses import dataclass, field

import numpy as np
import torch

from rl_core.checks import fields, instance, integer, number, optional, positive, require
from rl_core.modules import as_arrays, load_arrays, make_module, train_networks
from rl_core.policies import MLP, Categorical, Network, make_policy
from rl_core.training import spawn_streams
from rl_core.worlds.environments import open_world, step
from rl_core.worlds.episodes import ModuleActor


@dataclass(frozen=True)
class ActorCriticConfig:
    """Discount gamma, networks of policy and value, their step sizes alpha, and caps."""

    gamma: float = 0.99
    policy: Network = field(default_factory=MLP)
    value: Network = field(default_factory=MLP)
    policy_rate: float = 0.01
    value_rate: float = 0.05
    max_episode_steps: int | None = None
    max_env_steps: int | None = 100_000

    def __post_init__(self):
        network = (instance, Network, "MLP(...) or Module('module:function')")
        fields(self, gamma=(number, 0, 1), policy=network, value=network)
        rate, cap = (positive,), (optional, integer, 1)
        fields(self, policy_rate=rate, value_rate=rate, max_episode_steps=cap, max_env_steps=cap)

    def actor(self, weights, observations, actions):
        """Return who acts with the weights of one seed (`rl_core.evaluation.as_learned`)."""
        n_seen = observations.shape[0]
        net = make_module(self.policy, n_seen, int(actions.n), np.random.default_rng(0))
        load_arrays(net, {k[7:]: v for k, v in weights.items() if k.startswith("policy.")})
        kind = make_policy(Categorical(), (), n_seen, int(actions.n), 0)
        return ModuleActor(kind, net, torch.zeros(0), np.empty(1))


def _make_networks(world, config, rng):
    require(world.n_actions > 0, "env", world, "an environment with discrete actions")
    policy = make_module(config.policy, world.n_observations, world.n_actions, rng)
    value = make_module(config.value, world.n_observations, 1, rng)
    return torch.nn.ModuleDict({"policy": policy, "value": value})


def _train(world, config, training):
    streams = spawn_streams(training.seed)
    world.seed(streams.environment_seed)
    networks = _make_networks(world, config, streams.network)
    policy, value = networks["policy"], networks["value"]
    rates = [(policy, config.policy_rate), (value, config.value_rate)]
    optimiser = torch.optim.SGD([{"params": net.parameters(), "lr": rate} for net, rate in rates])
    for _ in training.course(config.max_env_steps, lambda: as_arrays(networks)):
        max_steps = training.max_steps(config.max_episode_steps, world.max_episode_steps)
        state = torch.from_numpy(world.reset())
        steps, total, discount, terminated, truncated = 0, 0.0, 1.0, False, False
        while steps < max_steps and not (terminated or truncated):
            log_pi, following = torch.log_softmax(policy(state), 0), torch.empty_like(state)
            at = np.searchsorted(log_pi.exp().cumsum(0)[:-1].tolist(), streams.policy.random())
            action = np.array([at], np.float32)
            reward, terminated, truncated = step(world.stepper, action, following.numpy())
            v = value(state)
            with torch.no_grad():
                delta = reward + config.gamma * (not terminated) * value(following) - v
            loss = -delta * v - discount * delta * log_pi[at]  # its gradient is both steps
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            state, discount = following, config.gamma * discount
            steps, total = steps + 1, total + reward
        training.add(steps, total, terminated)


def check_actor_critic(env, config):
    """Raise what `actor_critic` would raise for an environment and a configuration."""
    instance("config", config, ActorCriticConfig, "an ActorCriticConfig")
    with closing(open_world(env)) as world:
        _make_networks(world, config, np.random.default_rng(0))


def actor_critic(env, config, *, episodes, seeds, snapshots=(), progress=None):
    """Train a policy and a value a seed; arguments and result are those of `reinforce`."""
    check_actor_critic(env, config)
    arguments = {"episodes": episodes, "snapshots": snapshots, "progress": progress}
    return train_networks(_train, env, config, seeds=seeds, **arguments)
