"""One step of deep Q-learning: act, remember, and move the network towards its targets.

The network Q(s, a; theta) puts out one value an action. A batch B of remembered transitions has the
targets

    y = r + gamma max_a' Q(s', a'; theta-)        if s' is not terminal,
    y = r                                         if it is,

with the parameters theta- of a fixed network, which are those of theta at the last copy. Then

    L(theta) = 1 / |B| sum_B (y - Q(s, a; theta))^2

is descended by one step of RMSProp or Adam. `through_end` leaves the terminal case out, as the 2018
program did, which kept no terminal flag.

Everything here is compiled and acts on one seed's arrays in place, so that the compiled loop and
the plain one (`rl_core.q_episodes`) go through the same arithmetic.

Source: V. Mnih et al. (2015), Human-level control through deep reinforcement learning, algorithm 1.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rl_core import epsilon, exploration, networks, replay
from rl_core.compiled import compiled
from rl_core.replay import Memory

STEPS, UPDATES, COPIES, KEPT, ACTION = range(5)
"""Entries of `Learner.counts`; for `KEPT` more steps the random `ACTION` is kept."""

NOTHING, DUE, NOT_A_NUMBER = range(3)
"""What `remember` answers."""


class Settings(NamedTuple):
    """The part of the config that the compiled code reads; see `rl_core.dqn.DQNConfig`."""

    gamma: float
    batch_size: int
    learning_starts: int
    update_every: int
    copy_every: int
    persistence: int
    learning_rate: float
    adam: bool
    through_end: bool


class Learner(NamedTuple):
    """What one seed learns, and the room it works in.

    Attributes
    ----------
    sizes : int64 array of shape (L + 1,)
        Widths of the network.
    parameters, fixed : float32 arrays of shape (P,)
        theta and theta-.
    trainable : float32 array of shape (P,)
        Ones where a parameter learns.
    first, second : float32 arrays of shape (P,)
        The optimiser's moments; RMSProp uses `second` only.
    counts : int64 array of shape (5,)
        Environment steps, updates and copies so far, and the random action that is kept.
    epsilon : float64 array
        State of the schedule (`rl_core.epsilon`).
    units, deltas : float32 arrays of shape (sum(sizes), padded batch)
    gradient : float32 array of shape (P,)
    slots, stale : int64 arrays of shape (batch,)
        Scratch space, like the three above.
    """

    sizes: NDArray[np.int64]
    parameters: NDArray[np.float32]
    fixed: NDArray[np.float32]
    trainable: NDArray[np.float32]
    first: NDArray[np.float32]
    second: NDArray[np.float32]
    counts: NDArray[np.int64]
    epsilon: NDArray[np.float64]
    units: NDArray[np.float32]
    deltas: NDArray[np.float32]
    gradient: NDArray[np.float32]
    slots: NDArray[np.int64]
    stale: NDArray[np.int64]


def make_learner(
    sizes: tuple[int, ...],
    parameters: NDArray[np.float32],
    *,
    biases: bool,
    adam: bool,
    batch_size: int,
    schedule: epsilon.Epsilon,
) -> Learner:
    """Make the learner of one seed; it changes `parameters` in place.

    Examples
    --------
    >>> theta = networks.xavier_uniform((2, 4, 3), np.random.default_rng(0))
    >>> learner = make_learner(
    ...     (2, 4, 3), theta, biases=False, adam=False, batch_size=512, schedule=0.1
    ... )
    >>> learner.units.shape
    (9, 512)
    """
    shape = (sum(sizes), networks.padded(batch_size))
    # TensorFlow 1, which the 2018 program ran on, starts the mean squares of RMSProp at one.
    second = np.zeros_like(parameters) if adam else np.ones_like(parameters)
    return Learner(
        np.array(sizes),
        parameters,
        parameters.copy(),
        networks.trainable_mask(sizes, biases),
        np.zeros_like(parameters),
        second,
        np.zeros(5, np.int64),
        epsilon.initial(schedule),
        np.zeros(shape, np.float32),
        np.zeros(shape, np.float32),
        np.empty_like(parameters),
        np.empty(batch_size, np.int64),
        np.empty(batch_size, np.int64),
    )


@compiled
def epsilon_greedy(
    sizes: NDArray[np.int64],
    parameters: NDArray[np.float32],
    probability: float,
    observation: NDArray[np.float32],
    u: float,
    v: float,
    units: NDArray[np.float32],
) -> int:
    """Take a random action with this probability, else the one of largest value.

    Parameters
    ----------
    sizes : int64 array
    parameters : float32 array of shape (P,)
    probability : float
        Epsilon.
    observation : float32 array of shape (n_0,)
    u, v : float
        Uniforms in [0, 1): u decides whether to explore, v picks among random or tied actions.
    units : float32 array of shape (sum(sizes),)
        Scratch space.
    """
    for i in range(observation.size):
        units[i] = observation[i]
    networks.forward_one(sizes, parameters, units)
    q = units[units.size - sizes[-1] :].astype(np.float64)
    return exploration.choose(exploration.EPSILON_GREEDY, probability, q, u, v)


@compiled
def act(
    settings: Settings,
    learner: Learner,
    observation: NDArray[np.float32],
    u: float,
    v: float,
    units: NDArray[np.float32],
) -> int:
    """Act as the learner does: epsilon-greedy, a random action being kept for a while."""
    counts, probability = learner.counts, learner.epsilon[epsilon.VALUE]
    if counts[KEPT] > 0:
        counts[KEPT] -= 1
        return int(counts[ACTION])
    action = epsilon_greedy(
        learner.sizes, learner.parameters, probability, observation, u, v, units
    )
    if u < probability:
        counts[KEPT], counts[ACTION] = settings.persistence - 1, action
    return action


@compiled
def after_episode(learner: Learner, terminated: bool) -> None:
    """End an episode: no action is kept, and a goal reached lets epsilon fall."""
    learner.counts[KEPT] = 0
    if terminated:
        epsilon.after_goal(learner.epsilon)


@compiled
def remember(
    settings: Settings,
    learner: Learner,
    memory: Memory,
    shape: Any,
    observation: NDArray[np.float32],
    action: int,
    reward: float,
    next_observation: NDArray[np.float32],
    terminated: bool,
) -> int:
    """Store a transition with its shaped reward, and say whether an update is due now.

    Returns
    -------
    int
        `NOTHING`, `DUE`, or `NOT_A_NUMBER` if that is what the shaped reward is.
    """
    shaped = shape(next_observation, reward)
    if math.isnan(shaped):
        return NOT_A_NUMBER
    replay.store(memory, observation, action, shaped, next_observation, terminated)
    counts = learner.counts
    counts[STEPS] += 1
    epsilon.after_step(learner.epsilon, counts[STEPS])
    learns = counts[STEPS] >= settings.learning_starts
    return DUE if learns and counts[STEPS] % settings.update_every == 0 else NOTHING


@compiled
def _next_values(learner: Learner, memory: Memory) -> None:
    """See to it that V = max_a' Q(s', a'; theta-) is up to date in the sampled slots."""
    n_in, n_out = learner.sizes[0], learner.sizes[-1]
    units, count = learner.units, 0
    for slot in learner.slots:
        if memory.stamps[slot] != learner.counts[COPIES]:
            memory.stamps[slot] = learner.counts[COPIES]
            learner.stale[count] = slot
            for i in range(n_in):
                units[i, count] = memory.next_observations[slot, i]
            count += 1
    if count == 0:
        return
    networks.forward(learner.sizes, learner.fixed, units, networks.padded(count))
    values = units[len(units) - n_out :]
    for k in range(count):
        highest = values[0, k]
        for a in range(1, n_out):
            highest = max(highest, values[a, k])
        memory.next_values[learner.stale[k]] = highest


@compiled
def target(settings: Settings, memory: Memory, slot: int) -> float:
    """The target y of the transition in a slot, whose V is up to date."""
    if memory.ends[slot] and not settings.through_end:
        return float(memory.rewards[slot])
    return float(memory.rewards[slot] + settings.gamma * memory.next_values[slot])


@compiled
def loss_gradient(settings: Settings, learner: Learner, memory: Memory) -> float:
    """L(theta) of the sampled batch; its gradient is left in `learner.gradient`."""
    n, n_padded = learner.slots.size, networks.padded(learner.slots.size)
    n_in, n_out = learner.sizes[0], learner.sizes[-1]
    units, deltas = learner.units, learner.deltas
    _next_values(learner, memory)
    for k in range(n):
        for i in range(n_in):
            units[i, k] = memory.observations[learner.slots[k], i]
    networks.forward(learner.sizes, learner.parameters, units, n_padded)
    values, delta = units[len(units) - n_out :], deltas[len(units) - n_out :]
    delta[:] = 0.0
    loss = 0.0
    for k in range(n):
        slot = learner.slots[k]
        action = memory.actions[slot]
        error = values[action, k] - target(settings, memory, slot)
        delta[action, k] = 2.0 / n * error
        loss += error * error / n
    networks.backward(learner.sizes, learner.parameters, units, deltas, learner.gradient, n_padded)
    return loss


@compiled
def update(
    settings: Settings, learner: Learner, memory: Memory, uniforms: NDArray[np.float64]
) -> bool:
    """Sample a batch and take one step of the optimiser; copy the network when it is time.

    Parameters
    ----------
    settings : Settings
    learner : Learner
    memory : Memory
    uniforms : float64 array of shape (batch,)
        From the replay's stream.

    Returns
    -------
    bool
        False if the loss is not finite; then nothing is changed.
    """
    replay.sample(memory, uniforms, learner.slots)
    loss = loss_gradient(settings, learner, memory)
    if not math.isfinite(loss):
        return False
    counts, gradient = learner.counts, learner.gradient
    gradient *= learner.trainable
    counts[UPDATES] += 1
    if settings.adam:
        networks.adam_step(
            learner.parameters,
            gradient,
            learner.first,
            learner.second,
            counts[UPDATES],
            settings.learning_rate,
        )
    else:
        networks.rmsprop_step(learner.parameters, gradient, learner.second, settings.learning_rate)
    if counts[UPDATES] % settings.copy_every == 0:
        learner.fixed[:] = learner.parameters
        counts[COPIES] += 1
        epsilon.after_copy(learner.epsilon)
    return True
