"""One update of a deep Q-network, compiled: move the network towards its targets.

The network Q(s, a; theta) puts out one value an action. A batch B of remembered transitions has the
targets

    y = r + gamma max_a' Q(s', a'; theta-)        if s' is not terminal,
    y = r                                         if it is,

with the parameters theta- of a fixed network, which are those of theta at the last copy. Then

    L(theta) = 1 / |B| sum_B (y - Q(s, a; theta))^2

is descended by one step of RMSProp or Adam. `through_end` leaves the terminal case out, as the 2018
program did, which kept no terminal flag.

`rl_core.dqn` states the same in torch. Everything here acts on one seed's arrays in place.

Source: V. Mnih et al. (2015), Human-level control through deep reinforcement learning, algorithm 1.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rl_core.kernels import choices, networks
from rl_core.kernels.arrays import F32, F64, I64
from rl_core.kernels.compiled import compiled, compiled_as, uncounted
from rl_core.kernels.replay import Memory, number

STEPS, UPDATES, COPIES, KEPT, ACTION = range(5)
"""Entries of `Learner.counts`; for `KEPT` more steps the random `ACTION` is kept."""


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
    n_actions: int


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
        State of the schedule (`rl_core.kernels.choices`).
    units, deltas : float32 arrays of shape (sum(sizes), padded batch)
    gradient : float32 array of shape (P,)
    slots, stale : int64 arrays of shape (batch,)
        The sampled batch, and scratch space, like the three above and the next.
    one : float32 array of shape (sum(sizes),)
    settings : Settings
    """

    sizes: I64
    parameters: F32
    fixed: F32
    trainable: F32
    first: F32
    second: F32
    counts: I64
    epsilon: F64
    units: F32
    deltas: F32
    gradient: F32
    slots: I64
    stale: I64
    one: F32
    settings: Settings


def make_learner(
    sizes: tuple[int, ...], parameters: F32, settings: Settings, epsilon: F64, *, biases: bool
) -> Learner:
    """Make the learner of one seed; it changes `parameters` in place.

    Parameters
    ----------
    sizes : tuple of int
        Widths of the network, from the observation's to the number of actions.
    parameters : float32 array of shape (P,)
        theta to begin with (`rl_core.networks`).
    settings : Settings
    epsilon : float64 array
        State of the schedule of epsilon.
    biases : bool
        Whether biases are learned.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels import networks
    >>> from rl_core.kernels.q_update import Settings, make_learner
    >>> theta = networks.xavier_uniform((2, 4, 3), np.random.default_rng(0))
    >>> way = Settings(0.9, 512, 1, 1, 10, 1, 1e-3, True, False, 3)
    >>> learner = make_learner((2, 4, 3), theta, way, np.zeros(6), biases=False)
    >>> learner.units.shape
    (9, 512)
    """
    shape = (sum(sizes), networks.padded(settings.batch_size))
    # TensorFlow 1, which the 2018 program ran on, starts the mean squares of RMSProp at one.
    second = np.zeros_like(parameters) if settings.adam else np.ones_like(parameters)
    return Learner(
        np.array(sizes),
        parameters,
        parameters.copy(),
        networks.trainable_mask(sizes, biases),
        np.zeros_like(parameters),
        second,
        np.zeros(5, np.int64),
        epsilon,
        np.zeros(shape, np.float32),
        np.zeros(shape, np.float32),
        np.empty_like(parameters),
        np.empty(settings.batch_size, np.int64),
        np.empty(settings.batch_size, np.int64),
        np.empty(sum(sizes), np.float32),
        settings,
    )


def q_values(learner: Any, observation: F32) -> F64:
    """Q(s, .; theta) of one state, float64 of shape (A,); of any learner, compiled or not.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.q_update import Settings, make_learner, q_values
    >>> way = Settings(0.9, 2, 1, 1, 10, 1, 1e-3, True, False, 3)
    >>> theta = np.array([1, 0, 0, 1, 2, 2, 0, 0, 0], np.float32)
    >>> learner = make_learner((2, 3), theta, way, np.zeros(6), biases=False)
    >>> q_values(learner, np.array([5, 7], np.float32))
    array([ 5.,  7., 24.])
    """
    if isinstance(learner, Learner):
        return _q_values(learner, observation)
    values: F64 = learner.q_values(observation)
    return values


@compiled
def _q_values(learner: Learner, observation: F32) -> F64:
    units = learner.one
    for i in range(observation.size):
        units[i] = observation[i]
    networks.forward_one(learner.sizes, learner.parameters, units)
    return units[units.size - learner.sizes[-1] :].astype(np.float64)


@uncounted
def _next_values(learner: Learner, memory: Memory) -> None:
    """See to it that V = max_a' Q(s', a'; theta-) is up to date in the sampled slots."""
    n_in, n_out = learner.sizes[0], learner.sizes[-1]
    units, count = learner.units, 0
    for slot in learner.slots:
        if memory.stamps[slot] != learner.counts[COPIES]:
            memory.stamps[slot] = learner.counts[COPIES]
            learner.stale[count] = slot
            for i in range(n_in):
                units[i, count] = number(memory.next_observations, slot, i)
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


@uncounted
def target(reward: float, next_value: float, end: bool, gamma: float, through_end: bool) -> float:
    """The target y of a transition: r + gamma V, or r where it ends and nothing comes after.

    Parameters
    ----------
    reward, next_value : float
        r, and V = max_a' Q(s', a'; theta-).
    end : bool
        Whether s' is terminal.
    gamma : float
    through_end : bool
        Whether to bootstrap through the end.

    Examples
    --------
    >>> from rl_core.kernels.q_update import target
    >>> target(-1.0, 10.0, False, 0.9, False), target(-1.0, 10.0, True, 0.9, False)
    (8.0, -1.0)
    """
    return reward if end and not through_end else reward + gamma * next_value


@uncounted
def loss_gradient(learner: Learner, memory: Memory) -> float:
    """L(theta) of the sampled batch; its gradient is left in `learner.gradient`.

    Parameters
    ----------
    learner : Learner
        Its `slots` say which transitions; `units`, `deltas` and `gradient` are overwritten.
    memory : Memory
        Its cache of V is brought up to date where it is read.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.q_update import Settings, loss_gradient, make_learner
    >>> from rl_core.kernels.replay import make_memory, store
    >>> way = Settings(0.9, 2, 1, 1, 10, 1, 1e-3, True, False, 3)
    >>> theta = np.zeros(9, np.float32)
    >>> learner = make_learner((2, 3), theta, way, np.zeros(6), biases=False)
    >>> memory, s = make_memory(5, 2), np.ones(2, np.float32)
    >>> for reward in (-1.0, -3.0):
    ...     store(memory, s, 0, reward, s, False)
    >>> learner.slots[:] = 0, 1
    >>> loss_gradient(learner, memory)  # (1 + 9) / 2
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
            units[i, k] = number(memory.observations, learner.slots[k], i)
    networks.forward(learner.sizes, learner.parameters, units, n_padded)
    values, delta = units[len(units) - n_out :], deltas[len(units) - n_out :]
    delta[:] = 0.0
    # Taken out of their tuples once: numba would count references to all arrays in them anew.
    slots, actions, rewards = learner.slots, memory.actions, memory.rewards
    ends, next_values = memory.ends, memory.next_values
    gamma, through_end = learner.settings.gamma, learner.settings.through_end
    loss = 0.0
    for k in range(n):
        slot = slots[k]
        action = actions[slot]
        y = target(rewards[slot], next_values[slot], ends[slot], gamma, through_end)
        error = values[action, k] - y
        delta[action, k] = 2.0 / n * error
        loss += error * error / n
    networks.backward(learner.sizes, learner.parameters, units, deltas, learner.gradient, n_padded)
    return loss


def update(learner: Any, memory: Memory) -> bool:
    """Take one step of the optimiser on the sampled batch; copy the network when it is time.

    Parameters
    ----------
    learner : Learner, or what has a method `update(memory)` like `rl_core.dqn.TorchLearner`
        Its `slots` say which transitions.
    memory : Memory

    Returns
    -------
    bool
        False if the loss is not finite; then nothing is changed.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.q_update import COPIES, Settings, make_learner, update
    >>> from rl_core.kernels.replay import make_memory, store
    >>> way = Settings(0.9, 2, 1, 1, 1, 1, 1e-3, True, False, 3)  # Adam, a copy at each update
    >>> theta = np.zeros(9, np.float32)
    >>> learner = make_learner((2, 3), theta, way, np.zeros(6), biases=False)
    >>> memory, s = make_memory(5, 2), np.ones(2, np.float32)
    >>> store(memory, s, 0, -1.0, s, False)
    >>> learner.slots[:] = 0
    >>> update(learner, memory)
    True
    >>> learner.parameters[:3].round(4), int(learner.counts[COPIES])
    (array([-0.001, -0.001,  0.   ], dtype=float32), 1)
    """
    return (
        _update(learner, memory) if isinstance(learner, Learner) else bool(learner.update(memory))
    )


@compiled
def _update(learner: Learner, memory: Memory) -> bool:
    if not math.isfinite(loss_gradient(learner, memory)):
        return False
    counts, gradient, settings = learner.counts, learner.gradient, learner.settings
    rate = settings.learning_rate
    gradient *= learner.trainable
    counts[UPDATES] += 1
    if settings.adam:
        moments = learner.first, learner.second
        networks.adam_step(learner.parameters, gradient, *moments, counts[UPDATES], rate)
    else:
        networks.rmsprop_step(learner.parameters, gradient, learner.second, rate)
    if counts[UPDATES] % settings.copy_every == 0:
        learner.fixed[:] = learner.parameters
        counts[COPIES] += 1
        choices.after_copy(learner.epsilon)
    return True


compiled_as(q_values, _q_values)
compiled_as(update, _update)
