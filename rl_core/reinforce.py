"""REINFORCE: Monte Carlo policy gradient with categorical and Gaussian policies.

After every episode s_0, a_0, r_1, s_1, ..., s_T theta climbs the log-likelihood of its actions,
weighted by what followed them:

    v_t = sum_{k >= t} gamma^(k - t) r_{k + 1},    normalised within the episode,
    theta <- theta + alpha * grad (1 / |B|) sum_{t in B} v_t log pi(a_t | s_t)

for minibatches B of the episode, over several epochs, with Adam in place of the plain step. The
factor gamma^t of the textbook's update is left out, as in the report and in common practice.

    for each seed:
        draw the initial weights
        for each episode:
            play it with the present policy
            compute the returns v_t and normalise them
            for each epoch: for each minibatch of the shuffled steps: one step of Adam

Sources: R. S. Sutton and A. G. Barto, Reinforcement Learning: An Introduction (2018), sections 13.3
(REINFORCE) and 13.7 (continuous actions); R. J. Williams (1992), Simple statistical
gradient-following algorithms for connectionist reinforcement learning.
"""

import math
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal

import numpy as np
import torch

from rl_core import modules, policies
from rl_core.checks import fields, instance, integer, number, one_of, optional, positive, truth
from rl_core.kernels import likelihood
from rl_core.kernels.arrays import F32, F64, I64, Arrays
from rl_core.kernels.compiled import compiled
from rl_core.kernels.likelihood import Actor, Policy
from rl_core.policies import MLP, Categorical, Gaussian, Network
from rl_core.training import Progress, Run, Training, spawn_streams
from rl_core.worlds.environments import EnvironmentLike, World, open_world
from rl_core.worlds.episodes import ModuleActor, Trajectory, play_episode, with_constant


@dataclass(frozen=True)
class ReinforceConfig:
    """What REINFORCE is run with. Defaults: the report's for Acrobot and MountainCar, and a budget.

    Attributes
    ----------
    gamma : float
        Discount, from 0 to 1.
    network : MLP or Module
        From what is observed to the policy's outputs.
    policy : Categorical or Gaussian
        How the outputs of the network become actions.
    learning_rate : float
        Adam's step size alpha, above 0.
    batch_size, epochs : int
        Largest minibatch, in steps, and passes over an episode, each in a new random order.
    normalise : {"standard", "centre", "none"}
        Returns within an episode: shifted to mean 0 and scaled to variance 1, only shifted, or raw.
        Equal returns have no variance to scale by: they become 0.
    max_episode_steps : int or None
        Where to stop an episode that has not ended. None: nowhere.
    max_env_steps : int or None
        Budget of environment steps a seed: where it is used up the last episode is stopped. None:
        no limit. An episode needs about 100 bytes of memory a step.
    learn_from_capped : bool
        Whether to learn from an episode stopped by a cap or the environment's own time limit. Its
        returns leave out what would have followed. The 2018 program did not.
    engine : {"compiled", "torch"} or None
        What learns. None: machine code for an MLP, torch for a Module.

    Raises
    ------
    TypeError, ValueError
        For a value of another kind or out of range.

    Examples
    --------
    >>> from rl_core.policies import MLP
    >>> from rl_core.reinforce import ReinforceConfig
    >>> ReinforceConfig(gamma=0.9, network=MLP((10,))).engine
    'compiled'
    """

    gamma: float = 0.99
    network: Network = field(default_factory=MLP)
    policy: Categorical | Gaussian = field(default_factory=Categorical)
    learning_rate: float = 1e-3
    batch_size: int = 512
    epochs: int = 3
    normalise: Literal["standard", "centre", "none"] = "standard"
    max_episode_steps: int | None = None
    max_env_steps: int | None = 10_000_000
    learn_from_capped: bool = True
    engine: Literal["compiled", "torch"] | None = None

    def __post_init__(self) -> None:
        fields(
            self,
            gamma=(number, 0, 1),
            network=(instance, Network, "MLP(...) or Module('module:function')"),
            policy=(instance, Categorical | Gaussian, "Categorical() or Gaussian(...)"),
            learning_rate=(positive,),
            normalise=(one_of, ("standard", "centre", "none")),
            learn_from_capped=(truth,),
            **dict.fromkeys(("batch_size", "epochs"), (integer, 1)),
            **dict.fromkeys(("max_episode_steps", "max_env_steps"), (optional, integer, 1)),
        )
        object.__setattr__(self, "engine", policies.check_network(self.network, self.engine))


@compiled
def discounted_returns(rewards: F64, gamma: float) -> F64:
    """v_t = r_{t+1} + gamma v_{t+1}, backwards from v_T = 0.

    Parameters
    ----------
    rewards : float64 array of shape (T,)
    gamma : float

    Returns
    -------
    float64 array of shape (T,)

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.reinforce import discounted_returns
    >>> discounted_returns(np.array([1.0, 2.0, 4.0]), 0.5)
    array([3., 4., 4.])
    """
    returns = np.empty(rewards.size)
    following = 0.0
    for t in range(rewards.size - 1, -1, -1):
        following = rewards[t] + gamma * following
        returns[t] = following
    return returns


@compiled
def normalised(returns: F64, centre: bool, scale: bool) -> F64:
    """Shift returns to mean 0 if `centre`, and scale them to variance 1 if `scale` as well.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.reinforce import normalised
    >>> normalised(np.array([1.0, 3.0]), True, True)
    array([-1.,  1.])
    """
    if not centre:
        return returns
    deviations: F64 = returns - returns.mean()
    deviation = math.sqrt((deviations * deviations).mean())
    if scale:
        equal = deviation <= 1e-12 * abs(returns.mean())  # up to rounding
        deviations *= 0.0 if equal else 1.0 / deviation
    return deviations


def log_probability(
    policy: Policy,
    outputs: torch.Tensor,
    features: torch.Tensor,
    actions: torch.Tensor,
    log_sigma: torch.Tensor,
) -> torch.Tensor:
    """The logarithm of pi(a|s) for a batch, given the network's outputs for its features.

    Shapes: (batch, outputs), (batch, features), (batch, action_width), of a Gaussian
    (action_width,), and of what is returned (batch,).

    Examples
    --------
    >>> import torch
    >>> from rl_core import policies
    >>> from rl_core.policies import Categorical
    >>> from rl_core.reinforce import log_probability
    >>> policy = policies.make_policy(Categorical(), (), 1, 2, 0)
    >>> y, s, a = torch.zeros(1, 2), torch.ones(1, 1), torch.ones(1, 1)
    >>> round(float(log_probability(policy, y, s, a, torch.zeros(0)).exp()), 3)
    0.5
    """
    if not policy.gaussian:
        return torch.log_softmax(outputs, 1).gather(1, actions.long()).squeeze(1)
    mu = outputs
    if policy.weighted_features:
        mu = (outputs.view(len(outputs), policy.action_width, -1) * features[:, None]).sum(2)
    z = (actions - mu) / log_sigma.exp()
    return (-(z**2) / 2 - log_sigma - math.log(2 * math.pi) / 2).sum(1)


class TorchLearner:
    """REINFORCE as its equation says, for any network from features to outputs."""

    def __init__(
        self,
        policy: Policy,
        module: torch.nn.Module,
        log_sigma: torch.nn.Parameter,
        config: ReinforceConfig,
    ) -> None:
        self.policy, self.module, self.log_sigma = policy, module, log_sigma
        self.batch_size = config.batch_size
        learned = [p for p in (*module.parameters(), log_sigma) if p.requires_grad]
        self.optimiser = modules.Adam(learned, lr=config.learning_rate)

    def loss(self, features: torch.Tensor, actions: torch.Tensor, v: torch.Tensor) -> torch.Tensor:
        """-1 / |B| sum_{t in B} v_t log pi(a_t|s_t): its descent is the climb of the likelihood."""
        log_pi = log_probability(
            self.policy, self.module(features), features, actions, self.log_sigma
        )
        return -(v * log_pi).mean()

    def learn(self, observations: F32, actions: F32, returns: F64, orders: I64) -> None:
        """Learn from an episode: a step of the optimiser a minibatch; see `likelihood.learn`."""
        s = torch.from_numpy(with_constant(self.policy, observations))
        a, v = torch.from_numpy(actions), torch.from_numpy(returns).float()
        for order in torch.from_numpy(orders):
            for batch in order.split(self.batch_size):
                loss = self.loss(s[batch], a[batch], v[batch])
                self.optimiser.zero_grad()
                loss.backward()  # type: ignore[no-untyped-call]
                self.optimiser.step()


def _make_agent(
    config: ReinforceConfig, world: World, rng: np.random.Generator
) -> tuple[Actor | ModuleActor, Callable[..., None], Callable[[], Arrays]]:
    """Draw the initial weights; return who acts, what learns, and what gives them by name."""
    hidden = config.network.hidden if isinstance(config.network, MLP) else ()
    spaces = world.n_observations, world.n_actions, world.action_dimensions
    policy = policies.make_policy(config.policy, hidden, *spaces)
    sigmas = policies.initial_log_sigma(policy, config.policy)
    if not isinstance(config.network, MLP):
        n_inputs, n_outputs = policy.sizes.tolist()
        module = modules.make_module(config.network, n_inputs, n_outputs, rng)
        log_sigma = _log_sigma(config, sigmas)
        learner = TorchLearner(policy, module, log_sigma, config)

        def by_name() -> Arrays:
            sigma = {"log_sigma": log_sigma.detach().numpy()} if policy.gaussian else {}
            return {**modules.as_arrays(module), **sigma}

        actor = ModuleActor(policy, module, log_sigma, np.empty(policy.action_width))
        return actor, learner.learn, by_name
    biases = config.network.biases
    parameters = policies.initial_parameters(policy, config.policy, rng)

    named = likelihood.unpack(policy, parameters)
    layers = {name: array for name, array in named.items() if biases or "bias" not in name}
    learn: Callable[..., None]
    if config.engine == "torch":
        # Actor and module share the memory of the parameters.
        module = modules.perceptron(policy.sizes.tolist(), parameters, biases)
        log_sigma = _log_sigma(config, parameters[len(parameters) - len(sigmas) :])
        learn = TorchLearner(policy, module, log_sigma, config).learn
    else:
        learns = policies.trainable(policy, config.policy, biases)
        rates = config.batch_size, config.learning_rate
        learn = partial(
            likelihood.learn, likelihood.make_learner(policy, parameters, learns, *rates)
        )
    return likelihood.make_actor(policy, parameters), learn, lambda: layers


def _log_sigma(config: ReinforceConfig, start: F32) -> torch.nn.Parameter:
    learns = isinstance(config.policy, Gaussian) and config.policy.learn_sigma
    return torch.nn.Parameter(torch.from_numpy(start), requires_grad=learns)


def _orders(config: ReinforceConfig, steps: int, rng: np.random.Generator) -> I64:
    """Draw the order of the steps in each epoch; where one batch takes all it is of no account."""
    orders = np.tile(np.arange(steps), (config.epochs, 1))
    if steps > config.batch_size:
        for order in orders:
            rng.shuffle(order)
    return orders


def _train(world: World, config: ReinforceConfig, training: Training) -> None:
    """Train one seed."""
    streams = spawn_streams(training.seed)
    world.seed(streams.environment_seed)
    actor, learn, arrays = _make_agent(config, world, streams.network)
    trajectory = Trajectory(world.n_observations, actor.policy.action_width)
    centre, scale = config.normalise != "none", config.normalise == "standard"
    for _ in training.course(config.max_env_steps, arrays):
        max_steps = training.max_steps(config.max_episode_steps)
        steps, terminated = play_episode(world, actor, streams.policy, max_steps, trajectory)
        observations, actions, rewards = trajectory.first(steps)
        with np.errstate(invalid="ignore", over="ignore"):
            training.add(steps, float(rewards.sum()), terminated)
        if training.failure is None and (terminated or config.learn_from_capped):
            v = normalised(discounted_returns(rewards, config.gamma), centre, scale)
            learn(observations, actions, v, _orders(config, steps, streams.network))


def check_reinforce(env: EnvironmentLike, config: ReinforceConfig) -> None:
    """Raise what `reinforce` would raise for an environment and a configuration; run nothing.

    Raises
    ------
    ValueError, TypeError
        If `config` is no ReinforceConfig, the environment unknown, its spaces of another kind, or
        the network's output of another shape.

    Examples
    --------
    >>> from rl_core.reinforce import ReinforceConfig, check_reinforce
    >>> check_reinforce("MountainCar-v0", ReinforceConfig())
    """
    instance("config", config, ReinforceConfig, "a ReinforceConfig")
    with closing(open_world(env)) as world:
        _make_agent(config, world, np.random.default_rng(0))


def reinforce(
    env: EnvironmentLike,
    config: ReinforceConfig,
    *,
    episodes: int,
    seeds: Iterable[int],
    snapshots: Iterable[int] = (),
    progress: Progress | None = None,
) -> Run:
    """Train one policy a seed with REINFORCE.

    Parameters
    ----------
    env : str, Make, Task, gymnasium.Env or callable
        See `rl_core.worlds.environments.open_world`. Acrobot-v1, MountainCar-v0 and
        MountainCarContinuous-v0 are played compiled and without time limit. An environment that is
        given ready made is for one seed only, as what it remembers would go from seed to seed.
    config : ReinforceConfig
    episodes, seeds, snapshots, progress
        See `rl_core.training.train_seeds`. The initial weights are kept in any case.

    Returns
    -------
    Run
        Its arrays hold the last weights, those of an MLP as `layer0.weight` of shape (seeds,
        inputs, outputs), `layer0.bias` and so on, those of a module under its own names,
        `log_sigma` for a Gaussian, and copies under `initial/...` and `episode1000/...`.

    Raises
    ------
    ValueError, TypeError
        If an argument is out of range, the environment unknown, or its spaces not the policy's.

    Examples
    --------
    >>> from rl_core.policies import MLP
    >>> from rl_core.reinforce import ReinforceConfig, reinforce
    >>> config = ReinforceConfig(network=MLP((4,)), max_episode_steps=200)
    >>> run = reinforce("Acrobot-v1", config, episodes=2, seeds=[0, 1])
    >>> run.table["episode"].tolist(), run.arrays["layer0.weight"].shape
    ([1, 2, 1, 2], (2, 6, 4))
    """
    instance("config", config, ReinforceConfig, "a ReinforceConfig")
    told: Any = {"episodes": episodes, "snapshots": snapshots, "progress": progress}
    return modules.train_networks(_train, env, config, seeds=seeds, **told)
