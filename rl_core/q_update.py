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
from rl_core.kernels.compiled import compiled
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

    Parameters
    ----------
    sizes : tuple of int
        Widths of the network, from the observation's to the number of actions.
    parameters : float32 array of shape (P,)
        theta to begin with (`rl_core.networks`).
    biases, adam : bool
        Whether biases are learned, and whether with Adam or RMSProp.
    batch_size : int
    schedule : float, Decay or HalfWay
        Epsilon.

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

    Examples
    --------
    >>> theta = np.array([1, 5, 2, 0, 0, 0], np.float32)  # one input, three actions, no bias
    >>> s, units = np.ones(1, np.float32), np.empty(4, np.float32)
    >>> epsilon_greedy(np.array([1, 3]), theta, 0.1, s, 0.3, 0.9, units)
    1
    >>> epsilon_greedy(np.array([1, 3]), theta, 0.1, s, 0.05, 0.9, units)  # u < 0.1: at random
    2
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
    """Act as the learner does: epsilon-greedy, a random action being kept for a while.

    Parameters
    ----------
    settings : Settings
        Its `persistence` says for how many steps.
    learner : Learner
        Its `counts` are changed.
    observation, u, v, units
        As for `epsilon_greedy`.

    Examples
    --------
    >>> way = Settings(0.9, 2, 1, 1, 10, 3, 1e-3, True, False)  # persistence 3
    >>> theta = np.array([0, 0, 1, 0, 0, 0], np.float32)
    >>> learner = make_learner((1, 3), theta, biases=False, adam=True, batch_size=2, schedule=0.1)
    >>> s, units = np.ones(1, np.float32), np.empty(4, np.float32)
    >>> [act(way, learner, s, u, 0.0, units) for u in (0.5, 0.05, 0.5, 0.5, 0.5)]
    [2, 0, 0, 0, 2]
    """
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
    """End an episode: no action is kept, and a goal reached lets epsilon fall.

    Parameters
    ----------
    learner : Learner
        Its `counts` and `epsilon` are changed.
    terminated : bool
        Whether the episode reached its end by itself.

    Examples
    --------
    >>> theta, schedule = np.zeros(9, np.float32), epsilon.HalfWay(1.0, 0.0)
    >>> learner = make_learner(
    ...     (2, 3), theta, biases=False, adam=True, batch_size=2, schedule=schedule
    ... )
    >>> after_episode(learner, terminated=True)
    >>> learner.epsilon[epsilon.VALUE]
    np.float64(0.5)
    """
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

    Parameters
    ----------
    settings : Settings
    learner : Learner
        Its `counts` and `epsilon` are changed.
    memory : Memory
        Changed in place.
    shape : compiled function
        `shape(next_observation, reward)`, the reward to learn from (`rl_core.shaping`).
    observation, action, reward, next_observation
        The transition (s, a, r, s').
    terminated : bool
        Whether s' is terminal; false where the episode is only cut short.

    Returns
    -------
    int
        `NOTHING`, `DUE`, or `NOT_A_NUMBER` if that is what the shaped reward is.

    Examples
    --------
    >>> from rl_core.shaping import compiled_shape
    >>> way = Settings(0.9, 2, 2, 1, 10, 1, 1e-3, True, False)  # learning starts after two steps
    >>> theta = np.zeros(9, np.float32)
    >>> learner = make_learner((2, 3), theta, biases=False, adam=True, batch_size=2, schedule=0.1)
    >>> memory, s = replay.make_memory(5, 2), np.ones(2, np.float32)
    >>> shape = compiled_shape("rl_core.shaping:original")
    >>> [remember(way, learner, memory, shape, s, 0, -1.0, s, False) == DUE for _ in range(2)]
    [False, True]
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
    """The target y of the transition in a slot, whose V is up to date.

    Parameters
    ----------
    settings : Settings
        gamma, and whether to bootstrap through the end.
    memory : Memory
    slot : int

    Examples
    --------
    >>> way = Settings(0.9, 2, 1, 1, 10, 1, 1e-3, True, False)
    >>> memory, s = replay.make_memory(5, 2), np.ones(2, np.float32)
    >>> for end in (False, True):
    ...     replay.store(memory, s, 0, -1.0, s, end)
    >>> memory.next_values[:2] = 10.0
    >>> target(way, memory, 0), target(way, memory, 1)
    (8.0, -1.0)
    """
    if memory.ends[slot] and not settings.through_end:
        return float(memory.rewards[slot])
    return float(memory.rewards[slot] + settings.gamma * memory.next_values[slot])


@compiled
def loss_gradient(settings: Settings, learner: Learner, memory: Memory) -> float:
    """L(theta) of the sampled batch; its gradient is left in `learner.gradient`.

    Parameters
    ----------
    settings : Settings
    learner : Learner
        Its `slots` say which transitions; `units`, `deltas` and `gradient` are overwritten.
    memory : Memory
        Its cache of V is brought up to date where it is read.

    Examples
    --------
    >>> way = Settings(0.9, 2, 1, 1, 10, 1, 1e-3, True, False)
    >>> theta = np.zeros(9, np.float32)
    >>> learner = make_learner((2, 3), theta, biases=False, adam=True, batch_size=2, schedule=0.1)
    >>> memory, s = replay.make_memory(5, 2), np.ones(2, np.float32)
    >>> for reward in (-1.0, -3.0):
    ...     replay.store(memory, s, 0, reward, s, False)
    >>> learner.slots[:] = 0, 1
    >>> loss_gradient(way, learner, memory)  # (1 + 9) / 2
    5.0
    >>> learner.gradient[:3]  # of both inputs' weights to action 0: (2 (1) + 2 (3)) / 2
    array([4., 4., 0.], dtype=float32)
    """
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

    Examples
    --------
    >>> way = Settings(0.9, 2, 1, 1, 1, 1, 1e-3, True, False)  # Adam, a copy at each update
    >>> theta = np.zeros(9, np.float32)
    >>> learner = make_learner((2, 3), theta, biases=False, adam=True, batch_size=2, schedule=0.1)
    >>> memory, s = replay.make_memory(5, 2), np.ones(2, np.float32)
    >>> replay.store(memory, s, 0, -1.0, s, False)
    >>> update(way, learner, memory, np.array([0.2, 0.7]))
    True
    >>> learner.parameters[:3].round(4), int(learner.counts[COPIES])
    (array([-0.001, -0.001,  0.   ], dtype=float32), 1)
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
