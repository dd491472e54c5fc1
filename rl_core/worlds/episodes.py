"""Whole episodes of a policy: one loop, plain for any world and network, compiled where it can be.

    observe s_0
    until the episode ends:
        draw a_t from pi(.|s_t); observe r_{t+1}, s_{t+1}

Nothing is learned here; REINFORCE and the evaluation of policies play their episodes with it.
"""

from typing import Any, NamedTuple

import numpy as np
import torch

from rl_core.kernels import likelihood
from rl_core.kernels.arrays import F32, F64
from rl_core.kernels.compiled import compiled, compiled_as
from rl_core.kernels.likelihood import Actor, Policy
from rl_core.worlds.environments import TaskWorld, World, step


def with_constant(policy: Policy, observations: F32) -> F32:
    """Return the network's features: observations, and a constant 1 where the policy has one."""
    if not policy.constant_feature:
        return observations
    return np.column_stack([observations, np.ones(len(observations), np.float32)])


class ModuleActor(NamedTuple):
    """Draws actions from the policy of a torch module; `Actor` is its compiled counterpart."""

    policy: Policy
    module: torch.nn.Module
    log_sigma: torch.Tensor


def act(actor: Actor | ModuleActor, observation: F32, noise: F64, action: F32) -> None:
    """Turn noise into an action drawn from pi(.|s), and write it to `action`.

    Parameters
    ----------
    actor : Actor or ModuleActor
    observation : float32 array of shape (n_observations,)
    noise : float64 array of shape (action_width,)
        Uniform for a categorical policy, standard normal for a Gaussian one.
    action : float32 array of shape (action_width,)
        A Gaussian action is written as drawn, not clipped to any bounds.
    """
    if isinstance(actor, Actor):
        likelihood.choose_action(actor, observation, noise, action)
        return
    features = with_constant(actor.policy, observation[None])
    with torch.no_grad():
        outputs = actor.module(torch.from_numpy(features))[0].numpy()
    units = np.concatenate([features[0], outputs])
    likelihood.draw_action(actor.policy, actor.log_sigma.detach().numpy(), units, noise, action)


compiled_as(act, likelihood.choose_action)


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
    noise = np.empty(actions.shape[1])
    while t < stop:
        for k in range(noise.size):
            noise[k] = rng.standard_normal() if actor.policy.gaussian else rng.random()
        act(actor, observations[t], noise, actions[t])
        rewards[t], terminated, truncated = step(stepper, actions[t], observations[t + 1])
        t += 1
        if terminated or truncated:
            return t, terminated, truncated
    return t, False, False


_play_compiled = compiled(play)


def play_episode(
    world: World,
    actor: Actor | ModuleActor,
    rng: np.random.Generator,
    max_steps: int,
    trajectory: Trajectory,
) -> tuple[int, bool]:
    """Play one episode into `trajectory`.

    Parameters
    ----------
    world : World
    actor : Actor or ModuleActor
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
    >>> from rl_core.worlds.environments import open_world
    >>> policy = Policy(np.array([2, 3]), False, False, False, 1)
    >>> actor = likelihood.make_actor(policy, np.zeros(9, np.float32))
    >>> world = open_world("MountainCar-v0")
    >>> play_episode(world, actor, np.random.default_rng(0), 100, Trajectory(2, 1))
    (100, False)
    """
    both = isinstance(world, TaskWorld) and isinstance(actor, Actor)
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
