"""DQN: Q-learning with a deep network, experience replay and fixed targets.

    for each seed:
        draw the initial weights theta; theta- <- theta; the memory is empty
        for each episode: for each step:
            take a, epsilon-greedily on Q(s, .; theta); observe r, s'
            store (s, a, r, s', end) in the memory, in the place of the oldest
            once enough is stored: sample a batch, and one optimiser step on
                L(theta) = 1 / |B| sum (r + gamma max_a' Q(s', a'; theta-) - Q(s, a; theta))^2
            every so many updates: theta- <- theta

`play` is the loop and `TorchLearner` the learner. A terminal s' has no value; a step cut short by a
cap is bootstrapped.

Sources: V. Mnih et al. (2015), Human-level control through deep reinforcement learning; Sutton and
Barto, Reinforcement Learning: An Introduction (2018), sections 6.5 and 16.5.
"""

import math
from collections.abc import Callable, Iterable
from contextlib import closing
from copy import deepcopy
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal, Self

import numpy as np
import torch
from numba.extending import register_jitable

from rl_core import checks, modules
from rl_core.checks import instance, integer, optional
from rl_core.exploration import Epsilon, HalfWay, Linear, check_epsilon, schedule_state
from rl_core.kernels import networks, q_update, replay
from rl_core.kernels.arrays import F32, F64, Arrays
from rl_core.kernels.choices import VALUE, after_copy, after_goal, after_step, greedy_action
from rl_core.kernels.compiled import compiled
from rl_core.kernels.q_update import ACTION, COPIES, KEPT, STEPS, UPDATES, Learner, Settings
from rl_core.kernels.replay import Memory, sample, store
from rl_core.policies import MLP, Network, check_network
from rl_core.training import Progress, Run, Training, spawn_streams
from rl_core.worlds.environments import EnvironmentLike, TaskWorld, World, open_world, step
from rl_core.worlds.shaping import Shaping, shape_for, shaped_reward

WENT_ON, DIVERGED, SHAPED_NAN = range(3)
"""How an episode's learning went: a loss was not finite, or a shaped reward was NaN."""


@dataclass(frozen=True)
class DQNConfig:
    """What DQN is run with. The defaults learn small tasks; `report_2018` are the report's.

    Attributes
    ----------
    gamma : float
        Discount, from 0 to 1.
    network : MLP or Module
        From what is observed to one value an action.
    optimiser : {"rmsprop", "adam"}
        With TensorFlow 1's constants (`rl_core.kernels.networks`).
    learning_rate : float
        The optimiser's step size alpha, above 0.
    batch_size, memory_size : int
        Transitions an update, and transitions kept, at least a batch. As many as a batch: no
        replay, only the latest ones. Observations that are bytes are kept as bytes.
    learning_starts, update_every : int
        Environment steps before the first update, and from one to the next.
    copy_every : int
        Updates between two copies to the fixed network. 1: no fixed target.
    epsilon : float, Linear or HalfWay
        Probability that a run of one random action begins, where none is going on (the report's
        epsilon is 1 minus it). A schedule is by the environment step.
    persistence : int
        Steps p of such a run, at most to the end of the episode. The share of random steps is then
        p epsilon / (p epsilon + 1 - epsilon). 1: the usual epsilon-greedy. (W. Dabney et al. 2021,
        Temporally-extended epsilon-greedy exploration.)
    shaping : Shaping or None
        What is learned from in place of the environment's reward. None: that reward.
    bootstrap_through_end : bool
        Whether terminal states keep the network's value, as in 2018, without a terminal flag.
    max_episode_steps, max_env_steps : int or None
        Where to stop an episode that has not ended, and a whole seed. None: nowhere.
    engine : {"compiled", "torch"} or None
        What learns. None: machine code for an MLP, torch for a Module.

    Raises
    ------
    TypeError, ValueError
        For a value of another kind or out of range.

    Examples
    --------
    >>> from rl_core.dqn import DQNConfig
    >>> DQNConfig(gamma=0.9).optimiser, DQNConfig.report_2018().optimiser
    ('adam', 'rmsprop')
    """

    gamma: float = 0.99
    network: Network = field(default_factory=partial(MLP, (64, 64)))
    optimiser: Literal["rmsprop", "adam"] = "adam"
    learning_rate: float = 1e-3
    batch_size: int = 64
    memory_size: int = 50_000
    learning_starts: int = 1_000
    update_every: int = 1
    copy_every: int = 500
    epsilon: Epsilon = field(default_factory=partial(Linear, 1.0, 0.05, steps=10_000))
    persistence: int = 1
    shaping: Shaping | None = None
    bootstrap_through_end: bool = False
    max_episode_steps: int | None = None
    max_env_steps: int | None = 1_000_000
    engine: Literal["compiled", "torch"] | None = None

    def __post_init__(self) -> None:
        counts = ("batch_size", "learning_starts", "update_every", "copy_every", "persistence")
        checks.fields(
            self,
            gamma=(checks.number, 0, 1),
            network=(instance, Network, "MLP(...) or Module('module:function')"),
            optimiser=(checks.one_of, ("rmsprop", "adam")),
            learning_rate=(checks.positive,),
            epsilon=(check_epsilon,),
            shaping=(optional, instance, Shaping, "Shaping('module:function')"),
            bootstrap_through_end=(checks.truth,),
            **dict.fromkeys(("max_episode_steps", "max_env_steps"), (optional, integer, 1)),
            **dict.fromkeys(counts, (integer, 1)),
        )
        checks.fields(self, memory_size=(integer, self.batch_size))
        object.__setattr__(self, "engine", check_network(self.network, self.engine))

    @classmethod
    def report_2018(cls, **changes: Any) -> Self:
        """Return the report's settings for Acrobot, with a terminal flag; changed as said.

        Epsilon moves with the goals reached: too fast where every episode ends, as on CartPole.
        """
        report: dict[str, Any] = {"network": MLP((10, 20), biases=False), "optimiser": "rmsprop"}
        report |= {"batch_size": 512, "memory_size": 3_000, "learning_starts": 3_000}
        report |= {"copy_every": 300, "epsilon": HalfWay(0.9, 0.1)}
        return cls(**(report | changes))


class TorchLearner:
    """DQN as its equation says, for any network Q(s, .; theta); `Learner` is its compiled form.

    Parameters
    ----------
    network : torch.nn.Module
    settings : Settings
    epsilon : float64 array, the state of its schedule
    """

    def __init__(self, network: torch.nn.Module, settings: Settings, epsilon: F64) -> None:
        self.network, self.fixed = network, deepcopy(network)
        self.settings, self.epsilon = settings, epsilon
        self.counts = np.zeros(5, np.int64)
        self.slots = np.empty(settings.batch_size, np.int64)
        learned = [p for p in network.parameters() if p.requires_grad]
        kind = modules.Adam if settings.adam else modules.RMSProp
        self.optimiser = kind(learned, lr=settings.learning_rate)

    def loss(self, memory: Memory) -> torch.Tensor:
        """1 / |B| sum_B (y - Q(s, a; theta))^2 over the sampled batch B.

        y = r + gamma max_a' Q(s', a'; theta-), or r if s' is terminal.
        """
        s, s_next = (torch.from_numpy(replay.scaled(array[self.slots])) for array in memory[:2])
        a, r, end = (torch.from_numpy(array[self.slots]) for array in memory[2:5])
        with torch.no_grad():
            y = r + self.settings.gamma * self.fixed(s_next).amax(1)
            if not self.settings.through_end:
                y = torch.where(end, r, y)
        q = self.network(s).gather(1, a[:, None]).squeeze(1)
        loss: torch.Tensor = ((y - q) ** 2).mean()
        return loss

    def update(self, memory: Memory) -> bool:
        """Take a step of the optimiser, and copy when it is time; not if the loss is not finite."""
        loss = self.loss(memory)
        if not torch.isfinite(loss):
            return False
        self.optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        self.optimiser.step()
        self.counts[UPDATES] += 1
        if self.counts[UPDATES] % self.settings.copy_every == 0:
            self.fixed.load_state_dict(self.network.state_dict())
            self.counts[COPIES] += 1
            after_copy(self.epsilon)
        return True

    def q_values(self, observation: F32) -> F64:
        """Q(s, .; theta) of one state."""
        with torch.no_grad():
            values: torch.Tensor = self.network(torch.from_numpy(observation)[None])[0]
        return values.numpy().astype(np.float64)


@register_jitable
def act(learner: Any, observation: F32, u: float, v: float) -> int:
    """Act epsilon-greedily; a random action is kept for `persistence` steps.

    Of the uniforms u, v in [0, 1), u decides whether to explore, v picks among random or tied
    actions. `learner.counts` are changed.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.dqn import act
    >>> from rl_core.exploration import schedule_state
    >>> from rl_core.kernels import q_update
    >>> from rl_core.kernels.q_update import Settings
    >>> way = Settings(0.9, 2, 1, 1, 10, 3, 1e-3, True, False, 3)  # persistence 3
    >>> theta = np.array([0, 0, 1, 0, 0, 0], np.float32)
    >>> learner = q_update.make_learner((1, 3), theta, way, schedule_state(0.1), biases=False)
    >>> [act(learner, np.ones(1, np.float32), u, 0.0) for u in (0.5, 0.05, 0.5, 0.5, 0.5)]
    [2, 0, 0, 0, 2]
    """
    counts = learner.counts
    if counts[KEPT] > 0:
        counts[KEPT] -= 1
        return int(counts[ACTION])
    if u >= learner.epsilon[VALUE]:
        return int(greedy_action(q_update.q_values(learner, observation), v))
    counts[KEPT] = learner.settings.persistence - 1
    counts[ACTION] = int(v * learner.settings.n_actions)
    return int(counts[ACTION])


def play(
    stepper: Any,
    learner: Any,
    memory: Memory,
    shape: Any,
    observation: F32,
    policy_rng: np.random.Generator,
    replay_rng: np.random.Generator,
    max_steps: int,
) -> tuple[int, float, bool, int]:
    """Play and learn from one episode; `observation`, its first, is overwritten.

    Plain Python for any world and network; `_play_compiled` is the same text for compiled tasks and
    perceptrons. Returns steps, return, whether it terminated, and how the learning went.
    """
    settings, counts = learner.settings, learner.counts
    following, action = np.empty_like(observation), np.empty(1, np.float32)
    total, terminated, truncated, t = 0.0, False, False, 0
    while t < max_steps and not (terminated or truncated):
        action[0] = act(learner, observation, policy_rng.random(), policy_rng.random())
        reward, terminated, truncated = step(stepper, action, following)
        t += 1
        total += reward
        shaped = shaped_reward(shape, following, reward)
        if math.isnan(shaped):
            return t, total, False, SHAPED_NAN
        store(memory, observation, int(action[0]), shaped, following, terminated)
        counts[STEPS] += 1
        after_step(learner.epsilon, counts[STEPS])
        if counts[STEPS] >= settings.learning_starts and counts[STEPS] % settings.update_every == 0:
            sample(memory, replay_rng.random(settings.batch_size), learner.slots)
            if not q_update.update(learner, memory):
                return t, total, False, DIVERGED
        observation[:] = following
    counts[KEPT] = 0
    if terminated:
        after_goal(learner.epsilon)
    return t, total, terminated, WENT_ON


_play_compiled = compiled(play)


def _make_learner(
    config: DQNConfig, world: World, rng: np.random.Generator
) -> tuple[Learner | TorchLearner, Callable[[], Arrays]]:
    """Draw the initial weights; return who learns them, and what gives them by name."""
    if world.n_actions == 0:
        raise ValueError("env must have a Discrete action space, got a Box")
    replay.check_room("memory_size", config.memory_size, world.n_observations, world.as_bytes)
    same = {name: getattr(config, name) for name in Settings._fields if hasattr(config, name)}
    adam, through_end = config.optimiser == "adam", config.bootstrap_through_end
    settings = Settings(**same, adam=adam, through_end=through_end, n_actions=world.n_actions)
    epsilon = schedule_state(config.epsilon)
    if not isinstance(config.network, MLP):
        module = modules.make_module(config.network, world.n_observations, world.n_actions, rng)
        return TorchLearner(module, settings, epsilon), partial(modules.as_arrays, module)
    sizes = world.n_observations, *config.network.hidden, world.n_actions
    biases = config.network.biases
    parameters = networks.xavier_uniform(sizes, rng)

    named = networks.unpack(sizes, parameters)
    layers = {name: array for name, array in named.items() if biases or "bias" not in name}
    if config.engine == "torch":
        network = modules.perceptron(sizes, parameters, biases)
        return TorchLearner(network, settings, epsilon), lambda: layers
    learner = q_update.make_learner(sizes, parameters, settings, epsilon, biases=biases)
    return learner, lambda: layers


def _train(world: World, config: DQNConfig, training: Training) -> None:
    """Train one seed."""
    streams = spawn_streams(training.seed)
    world.seed(streams.environment_seed)
    learner, arrays = _make_learner(config, world, streams.network)
    memory = replay.make_memory(config.memory_size, world.n_observations, as_bytes=world.as_bytes)
    shape = shape_for(config.shaping, world.n_observations)
    rngs = streams.policy, streams.replay
    both = isinstance(world, TaskWorld) and isinstance(learner, Learner)
    play_episode = _play_compiled if both else play
    for episode in training.course(config.max_env_steps, arrays):
        max_steps = training.max_steps(config.max_episode_steps, world.max_episode_steps)
        first = world.reset()
        steps, total, terminated, outcome = play_episode(
            world.stepper, learner, memory, shape, first, *rngs, max_steps
        )
        if outcome == SHAPED_NAN and config.shaping is not None:
            raise ValueError(
                f"shaping must return numbers, {config.shaping.function!r} returned NaN at step "
                f"{steps} of episode {episode}, seed {training.seed}"
            )
        training.add(steps, total, terminated)
        if outcome == DIVERGED:
            training.fail("the loss is not finite")


def check_dqn(env: EnvironmentLike, config: DQNConfig) -> None:
    """Raise what `dqn` would raise for an environment and a configuration; run nothing.

    Examples
    --------
    >>> from rl_core.dqn import DQNConfig, check_dqn
    >>> check_dqn("MountainCar-v0", DQNConfig())
    """
    instance("config", config, DQNConfig, "a DQNConfig")
    with closing(open_world(env)) as world:
        _make_learner(config, world, np.random.default_rng(0))
        shape_for(config.shaping, world.n_observations)


def dqn(
    env: EnvironmentLike,
    config: DQNConfig,
    *,
    episodes: int,
    seeds: Iterable[int],
    snapshots: Iterable[int] = (),
    progress: Progress | None = None,
) -> Run:
    """Train one network a seed with DQN.

    Parameters
    ----------
    env : str, Make, Task, gymnasium.Env or callable
        With Box observations and Discrete actions; see `rl_core.worlds.environments.open_world`.
        One that is given ready made is for one seed only, as what it remembers would go from seed
        to seed.
    config : DQNConfig
    episodes, seeds, snapshots, progress
        See `rl_core.training.train_seeds`. The initial weights are kept in any case.

    Returns
    -------
    Run
        Returns are of the environment's own rewards also where they are shaped. The arrays hold the
        last weights, those of an MLP as `layer0.weight` of shape (seeds, inputs, outputs),
        `layer0.bias` and so on, those of a module under its own names, and copies under
        `initial/...` and `episode20/...`.

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described, the environment unknown or of other spaces, the
        network's output of another shape, a shaping not for what is observed or NaN, or the memory
        more than the machine has.

    Examples
    --------
    >>> from rl_core.dqn import DQNConfig, dqn
    >>> config = DQNConfig(batch_size=32, learning_starts=100, max_episode_steps=200)
    >>> run = dqn("MountainCar-v0", config, episodes=2, seeds=[0, 1])
    >>> run.table["steps"].tolist(), run.arrays["layer0.weight"].shape
    ([200, 200, 200, 200], (2, 2, 64))
    """
    instance("config", config, DQNConfig, "a DQNConfig")
    told: Any = {"episodes": episodes, "snapshots": snapshots, "progress": progress}
    return modules.train_networks(_train, env, config, seeds=seeds, **told)
