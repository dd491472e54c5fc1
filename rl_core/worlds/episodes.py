"""Whole episodes of a policy: one loop, plain for any world and network, compiled where it can be.

    observe s_0
    until the episode ends:
        draw a_t from pi(.|s_t); observe r_{t+1}, s_{t+1}

Nothing is learned here; REINFORCE and the evaluation of policies play their episodes with it.
"""

from typing import Any, NamedTuple

import numpy as np
import torch
from numba.extending import overload

from rl_core.kernels import likelihood
from rl_core.kernels.arrays import F32, F64
from rl_core.kernels.choices import EPSILON_GREEDY, choose
from rl_core.kernels.compiled import compiled, uncounted
from rl_core.kernels.likelihood import Actor, Policy
from rl_core.worlds.discretise import Grid, cell
from rl_core.worlds.environments import TaskWorld, World, step


def with_constant(policy: Policy, observations: F32) -> F32:
    """Return the network's features: observations, and a constant 1 where the policy has one."""
    if not policy.constant_feature:
        return observations
    return np.column_stack([observations, np.ones(len(observations), np.float32)])


class ModuleActor(NamedTuple):
    """Draws actions from the policy of a torch module; `Actor` is its compiled counterpart.

    `scale` multiplies the preferences for discrete actions: 1 / T of a temperature T.
    """

    policy: Policy
    module: torch.nn.Module
    log_sigma: torch.Tensor
    noise: F64
    scale: np.float32 = np.float32(1.0)
    epsilon: float = 0.0


class TableActor(NamedTuple):
    """Acts epsilon-greedily on a table of action values over the cells of a grid.

    Attributes
    ----------
    policy : Policy
        Of the sizes (d, n_actions): what is seen, and what there is to choose from.
    grid : Grid
    Q : float64 array of shape (n_cells, n_actions)
        Of several largest values, one is drawn.
    actions : float32 array of shape (n_actions, action_width)
        What the environment is given.
    epsilon : float
    noise : float64 array of shape (2,)
    """

    policy: Policy
    grid: Grid
    Q: F64
    actions: F32
    epsilon: float
    noise: F64


AnyActor = Actor | ModuleActor | TableActor


def act(actor: AnyActor, observation: F32, noise: F64, action: F32) -> None:
    """Turn noise into an action drawn from pi(.|s), and write it to `action`.

    Parameters
    ----------
    actor : Actor or ModuleActor or TableActor
    observation : float32 array of shape (n_observations,)
    noise : float64 array of the shape of `actor.noise`
        Uniform for discrete actions, standard normal for a Gaussian policy.
    action : float32 array of shape (action_width,)
        A Gaussian action is written as drawn, not clipped to any bounds.
    """
    if isinstance(actor, Actor):
        likelihood.choose_action(actor, observation, noise, action)
        return
    if isinstance(actor, TableActor):
        _look_up(actor, observation, noise, action)
        return
    if actor.epsilon > 0.0 and likelihood.explores(actor.policy, actor.epsilon, noise, action):
        return
    features = with_constant(actor.policy, observation[None])
    with torch.no_grad():
        outputs = actor.module(torch.from_numpy(features))[0].numpy()
    units = np.concatenate([features[0], outputs * actor.scale])
    likelihood.draw_action(actor.policy, actor.log_sigma.detach().numpy(), units, noise, action)


@compiled
def _look_up(actor: TableActor, observation: F32, noise: F64, action: F32) -> None:
    values = actor.Q[cell(actor.grid, observation)]
    action[:] = actor.actions[choose(EPSILON_GREEDY, actor.epsilon, values, noise[0], noise[1])]


# What it means in compiled code is decided by the type of the actor.
_acts: dict[type, Any] = {
    Actor: lambda actor, observation, noise, action: likelihood.choose_action(
        actor, observation, noise, action
    ),
    TableActor: lambda actor, observation, noise, action: _look_up(
        actor, observation, noise, action
    ),
}
overload(act, inline="always")(
    lambda actor, observation, noise, action: _acts[actor.instance_class]
)


class Trajectory:
    """Room for one episode, used again for the next and enlarged when an episode needs more.

    Attributes
    ----------
    observations : float32 array of shape (capacity + 1, n_observations)
    actions : float32 array of shape (capacity, action_width)
    rewards : float64 array of shape (capacity,)
    """

    def __init__(self, n_observations: int, action_width: int, capacity: int = 4096) -> None:
        self.observations = np.empty((capacity + 1, n_observations), np.float32)
        self.actions = np.empty((capacity, action_width), np.float32)
        self.rewards = np.empty(capacity)

    def first(self, steps: int) -> tuple[F32, F32, F64]:
        """Observations, actions and rewards of the first steps: views."""
        return self.observations[:steps], self.actions[:steps], self.rewards[:steps]

    def grow(self) -> None:
        """Double the room and keep what it holds."""
        for name in ("observations", "actions", "rewards"):
            held = getattr(self, name)
            larger = np.empty((len(held) + len(self.rewards), *held.shape[1:]), held.dtype)
            larger[: len(held)] = held
            setattr(self, name, larger)


def with_own_scratch(actor: AnyActor) -> AnyActor:
    """Return the same policy with scratch space of its own, for threads that play with one at once.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.likelihood import Policy, make_actor
    >>> from rl_core.worlds.episodes import with_own_scratch
    >>> policy = Policy(np.array([2, 3]), False, False, False, 1)
    >>> actor = make_actor(policy, np.zeros(9, np.float32))
    >>> own = with_own_scratch(actor)
    >>> own.noise is actor.noise, own.parameters is actor.parameters
    (False, True)
    """
    if isinstance(actor, Actor):
        actor = actor._replace(units=np.empty_like(actor.units))
    return actor._replace(noise=np.empty_like(actor.noise))


def play(
    stepper: Any,
    actor: Any,
    rng: np.random.Generator,
    observations: F32,
    actions: F32,
    rewards: F64,
    t: int,
    stop: int,
) -> tuple[int, bool, bool]:
    """Play on from step t, to the end of the episode or to step `stop`.

    Plain Python as it stands, for any world and network; `_play_compiled` is the same text for
    compiled tasks and perceptrons.

    Returns
    -------
    steps : int
        Of the episode so far.
    terminated, truncated : bool
        Neither, if it stopped at `stop`.
    """
    noise = actor.noise
    while t < stop:
        for k in range(noise.size):
            noise[k] = rng.standard_normal() if actor.policy.gaussian else rng.random()
        act(actor, observations[t], noise, actions[t])
        rewards[t], terminated, truncated = step(stepper, actions[t], observations[t + 1])
        t += 1
        if terminated or truncated:
            return t, terminated, truncated
    return t, False, False


_play_uncounted = uncounted(play)
# The generator comes from Python, and would never be released by what does not count.
_play_compiled = compiled(
    lambda stepper, actor, rng, observations, actions, rewards, t, stop: _play_uncounted(
        stepper, actor, rng, observations, actions, rewards, t, stop
    )
)


def play_episode(
    world: World,
    actor: AnyActor,
    rng: np.random.Generator,
    max_steps: int,
    trajectory: Trajectory,
) -> tuple[int, bool]:
    """Play one episode into `trajectory`.

    Parameters
    ----------
    world : World
    actor : Actor or ModuleActor or TableActor
    rng : numpy.random.Generator
        Stream of the policy.
    max_steps : int
        Where to stop an episode that has not ended.
    trajectory : Trajectory
        Its first `steps` rows are written, and the last observation after them.

    Returns
    -------
    steps : int
    terminated : bool
        False if the episode was stopped by `max_steps` or truncated by the environment.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels import likelihood
    >>> from rl_core.kernels.likelihood import Policy
    >>> from rl_core.worlds.episodes import Trajectory, play_episode
    >>> from rl_core.worlds.environments import open_world
    >>> policy = Policy(np.array([2, 3]), False, False, False, 1)
    >>> actor = likelihood.make_actor(policy, np.zeros(9, np.float32))
    >>> world = open_world("MountainCar-v0")
    >>> play_episode(world, actor, np.random.default_rng(0), 100, Trajectory(2, 1))
    (100, False)
    """
    actor = with_own_scratch(actor)
    both = isinstance(world, TaskWorld) and not isinstance(actor, ModuleActor)
    go_on = _play_compiled if both else play
    max_steps = min(max_steps, world.max_episode_steps or max_steps)
    trajectory.observations[0] = world.reset()
    steps, terminated, truncated = 0, False, False
    while True:
        arrays = trajectory.observations, trajectory.actions, trajectory.rewards
        stop = min(max_steps, len(trajectory.rewards))
        steps, terminated, truncated = go_on(world.stepper, actor, rng, *arrays, steps, stop)
        if terminated or truncated or steps == max_steps:
            return steps, terminated
        trajectory.grow()
