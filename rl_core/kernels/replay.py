"""Experience replay: a memory of the latest N transitions, sampled uniformly.

Transition number i (from 0) goes to slot i mod N, so that the newest overwrites the oldest. A batch
is drawn with replacement, each from all transitions held with the same probability.

Beside each transition stands a cache: V = max_a' Q(s', a') under a fixed network, which changes
only when the network is copied. So V is computed when a transition is first sampled after a copy,
and read from then on (`rl_core.kernels.q_update`). That gives the same numbers for less work.

Source: L.-J. Lin (1992), Self-improving reactive agents based on reinforcement learning, planning
and teaching.
"""

from typing import Any, NamedTuple

import numpy as np
from numba.core.types import uint8
from numba.extending import overload
from numpy.typing import NDArray

from rl_core.checks import in_memory
from rl_core.kernels.arrays import BYTE, F32, F64, I64, Bools, Bytes
from rl_core.kernels.compiled import compiled

NEVER = -1
"""The stamp of a transition whose V has not been computed."""


class Memory(NamedTuple):
    """The latest transitions (s, a, r, s', end) of one seed, one a slot.

    Attributes
    ----------
    observations, next_observations : float32 or uint8 arrays of shape (N, n_observations)
        s and s'. Bytes stand for 0..1 in steps of 1 / 255.
    actions : int64 array of shape (N,)
    rewards : float64 array of shape (N,)
        What is learned from: the shaped rewards, where rewards are shaped.
    ends : bool array of shape (N,)
        The terminal flag: whether s' is terminal. A step cut short by a cap is not terminal.
    next_values : float32 array of shape (N,)
        The cache of V.
    stamps : int64 array of shape (N,)
        How many copies the fixed network had seen when V was computed.
    stored : int64 array of shape (1,)
        Transitions stored so far, the overwritten ones included.
    """

    observations: F32 | Bytes
    next_observations: F32 | Bytes
    actions: I64
    rewards: F64
    ends: Bools
    next_values: F32
    stamps: I64
    stored: I64


def check_room(name: str, capacity: int, n_observations: int, as_bytes: bool) -> None:
    """Raise if the machine cannot hold such a memory, whose zeros take no room at first.

    Examples
    --------
    >>> from rl_core.kernels.replay import check_room
    >>> check_room("memory_size", 3000, 6, False)
    """
    *one, _ = make_memory(1, n_observations, as_bytes=as_bytes)
    in_memory(name, capacity, capacity * sum(array.nbytes for array in one))


def make_memory(capacity: int, n_observations: int, *, as_bytes: bool = False) -> Memory:
    """Make an empty memory.

    Parameters
    ----------
    capacity : int
        N, the transitions that it keeps, at least 1.
    n_observations : int
        Numbers in an observation.
    as_bytes : bool
        Whether they are bytes, scaled to 0..1, and to be kept as such.

    Examples
    --------
    >>> from rl_core.kernels.replay import held, make_memory
    >>> memory = make_memory(3000, 6)
    >>> memory.observations.shape, held(memory)
    ((3000, 6), 0)
    """
    kind: Any = np.uint8 if as_bytes else np.float32
    return Memory(
        np.zeros((capacity, n_observations), kind),
        np.zeros((capacity, n_observations), kind),
        np.zeros(capacity, np.int64),
        np.zeros(capacity),
        np.zeros(capacity, np.bool_),
        np.zeros(capacity, np.float32),
        np.full(capacity, NEVER, np.int64),
        np.zeros(1, np.int64),
    )


def keep(room: NDArray[Any], observation: F32) -> None:
    """Write an observation into the memory's row for it, as floats or as bytes.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.replay import keep, scaled
    >>> row = np.zeros(2, np.uint8)
    >>> keep(row, np.array([0.2, 1.0], np.float32))
    >>> row, scaled(row).round(3)
    (array([ 51, 255], dtype=uint8), array([0.2, 1. ], dtype=float32))
    """
    room[:] = observation if room.dtype != np.uint8 else np.rint(observation / BYTE)


def scaled(kept: NDArray[Any]) -> F32:
    """Return what was kept as floats; see `keep`."""
    return kept if kept.dtype != np.uint8 else kept * BYTE


def _keep_floats(room: NDArray[Any], observation: F32) -> None:
    for i in range(observation.size):
        room[i] = observation[i]


def _keep_bytes(room: NDArray[Any], observation: F32) -> None:
    for i in range(observation.size):
        room[i] = np.uint8(observation[i] / BYTE + np.float32(0.5))


def number(kept: Any, slot: int, i: int) -> float:
    """Return one number of an observation that is kept; see `keep`."""
    return float(scaled(kept[slot, i : i + 1])[0])


def _float(kept: Any, slot: int, i: int) -> Any:
    return kept[slot, i]


def _byte(kept: Any, slot: int, i: int) -> Any:
    return kept[slot, i] * BYTE


# What they mean in compiled code is decided by the type of what is kept.
overload(keep, strict=False)(
    lambda room, observation: _keep_bytes if room.dtype is uint8 else _keep_floats
)
overload(number, strict=False)(lambda kept, slot, i: _byte if kept.dtype is uint8 else _float)


@compiled
def held(memory: Memory) -> int:
    """Number of transitions that can be sampled: all stored so far, at most N.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.replay import held, make_memory, store
    >>> memory, s = make_memory(2, 1), np.ones(1, np.float32)
    >>> for _ in range(3):
    ...     store(memory, s, 0, -1.0, s, False)
    >>> held(memory)
    2
    """
    return min(int(memory.stored[0]), memory.actions.size)


@compiled
def store(
    memory: Memory, observation: F32, action: int, reward: float, next_observation: F32, end: bool
) -> None:
    """Store a transition in the place of the oldest.

    Parameters
    ----------
    memory : Memory
        Changed in place.
    observation, next_observation : float32 arrays of shape (n_observations,)
        s and s', which are copied.
    action : int
    reward : float
    end : bool
        Whether s' is terminal.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.replay import make_memory, store
    >>> memory, s = make_memory(2, 1), np.ones(1, np.float32)
    >>> for reward in (-1.0, -2.0, -3.0):
    ...     store(memory, s, 0, reward, s, False)
    >>> memory.rewards
    array([-3., -2.])
    """
    slot = memory.stored[0] % memory.actions.size
    keep(memory.observations[slot], observation)
    keep(memory.next_observations[slot], next_observation)
    memory.actions[slot] = action
    memory.rewards[slot] = reward
    memory.ends[slot] = end
    memory.stamps[slot] = NEVER
    memory.stored[0] += 1


@compiled
def sample(memory: Memory, uniforms: F64, slots: I64) -> None:
    """Turn uniforms in [0, 1) into slots, one each.

    Parameters
    ----------
    memory : Memory
        Not empty.
    uniforms : float64 array of shape (n,)
    slots : int64 array of shape (n,)
        Overwritten.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.replay import make_memory, sample, store
    >>> memory, s = make_memory(10, 1), np.ones(1, np.float32)
    >>> for _ in range(4):
    ...     store(memory, s, 0, -1.0, s, False)
    >>> slots = np.empty(3, np.int64)
    >>> sample(memory, np.array([0.0, 0.3, 0.99]), slots)
    >>> slots
    array([0, 1, 3])
    """
    count = held(memory)
    for k in range(uniforms.size):
        slots[k] = int(uniforms[k] * count)
