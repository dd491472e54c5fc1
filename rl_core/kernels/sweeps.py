"""The compiled kernels of planning: the order in which states are swept, and the sweeps.

They stand apart from `rl_core.planning`, which reads as the algorithms' pseudo-code, because they
are about the machine: flat arrays, reused, so that planning takes little memory beside the model.

A sweep that works in place uses, in state s, what it has just computed in the states swept before.
If every state is swept after the states its best action leads to, one sweep carries values
from the rewards back to the start; in an arbitrary order it may carry them a single step. So
the states are ordered first: `best_first` estimates every value with a shortest-path search
backwards from the rewards, and the sweeps visit the states by falling estimate. The arrays
are rearranged in that order, which also keeps neighbours close in memory. The order decides the
speed only: the sweeps converge in any order.
"""

import heapq
from typing import NamedTuple

import numpy as np

from rl_core.kernels.arrays import F64, I32, I64, Bools, Ints
from rl_core.kernels.compiled import compiled, inlined

TIE = 1e-10
"""Actions whose values differ by less than this fraction of the state's largest |Q| are tied: it is
far above what rounding does to equal values, and far below any difference that matters."""


def action_type(n_actions: int) -> type[np.int8] | type[np.int32]:
    """Return the small integer type that actions are kept in."""
    return np.int8 if n_actions <= 128 else np.int32


class Transitions(NamedTuple):
    """Where every state and action lead, without the rewards.

    Attributes
    ----------
    successor : ndarray of int32, shape (S, A, K)
        The states that may follow.
    probability : ndarray of float64, shape (S, A, K) or (1, A, K)
        Their probabilities.
    own_rows : int
        1 if every state has a row of `probability`, 0 if all share the first: state s has row
        `own_rows * s`.
    """

    successor: I32
    probability: F64
    own_rows: int


def transitions(successor: I32, probability: F64) -> Transitions:
    """Return them as the kernels take them: probabilities that all states share are given once."""
    shared = probability.strides[0] == 0 and len(probability) > 1
    rows = np.ascontiguousarray(probability[:1] if shared else probability)
    return Transitions(np.ascontiguousarray(successor), rows, int(not shared))


@inlined
def _noted(largest: float, squares: float, change: float) -> tuple[float, float]:
    """Take one more change into the largest and the sum of squares."""
    return max(largest, change), squares + change * change


@compiled
def lookahead(
    transitions: Transitions, reward: F64, gamma: float, V: F64, Q: F64
) -> tuple[float, float]:
    """Write Q(s, a) = Σ_k p_k (r_k + γ V(s'_k)) over Q; return the change, largest and squared."""
    successor, probability, own_rows = transitions
    n_states, n_actions, n_successors = successor.shape
    largest, squares = 0.0, 0.0
    for s in range(n_states):
        for a in range(n_actions):
            q = 0.0
            for k in range(n_successors):
                q += probability[own_rows * s, a, k] * (
                    reward[s, a, k] + gamma * V[successor[s, a, k]]
                )
            largest, squares = _noted(largest, squares, abs(q - Q[s, a]))
            Q[s, a] = q
    return largest, squares


@compiled
def greedy(Q: F64, V: F64, policy: Ints) -> tuple[float, float, int]:
    """Write V(s) = max_a Q(s, a) and the lowest action that attains it (ties: `TIE`).

    Returns the largest change and the sum of squared changes of V, and the number of states whose
    action changed.
    """
    n_states, n_actions = Q.shape
    largest, squares, changes = 0.0, 0.0, 0
    for s in range(n_states):
        best, scale = -np.inf, 0.0
        for a in range(n_actions):
            best = max(best, Q[s, a])
            scale = max(scale, abs(Q[s, a]))
        chosen = 0
        while Q[s, chosen] < best - TIE * scale:
            chosen += 1
        largest, squares = _noted(largest, squares, abs(best - V[s]))
        changes += policy[s] != chosen
        V[s] = best
        policy[s] = chosen
    return largest, squares, changes


@compiled
def _predecessors(leads_to: I32) -> tuple[I64, I32]:
    """List the pairs s A + a by the state they lead to: those of s' at first[s']..first[s' + 1].

    A counting sort, in which first[s' + 1] moves from the beginning of a list to its end.
    """
    first = np.zeros(len(leads_to) + 2, np.int64)
    for following in leads_to.flat:
        first[following + 2] += 1
    first = np.cumsum(first)
    pairs = np.empty(leads_to.size, np.int32)
    for pair, following in enumerate(leads_to.flat):
        pairs[first[following + 1]] = pair
        first[following + 1] += 1
    return first, pairs


@compiled
def _sources(r: F64, terminal: Bools, V: F64) -> list[tuple[float, np.int32]]:
    """Give states that need no successor to have a value one; return (-value, state) as a heap.

    Terminal states are worth 0; a state with a positive reward at hand at least that reward. The
    estimates of all others start at -∞.
    """
    heap = [(0.0, np.int32(0))]
    heap.pop()
    for s in range(len(V)):
        V[s] = 0.0 if terminal[s] else -np.inf
        for a in range(r.shape[1]):
            if r[s, a] > 0.0:
                V[s] = max(V[s], r[s, a])
        if V[s] > -np.inf:
            heap.append((-V[s], np.int32(s)))
    heapq.heapify(heap)
    return heap


@compiled
def best_first(
    leads_to: I32, p: F64, r: F64, terminal: Bools, gamma: float, V: F64, order: I32
) -> None:
    """Estimate V and write the states by falling estimate into `order` (Dijkstra's search).

    The estimate is exact in a model where each action either leads to its likeliest successor s',
    with probability p, or leaves the agent where it is: V(s) = max_a (r(s, a) + γ p V(s')) /
    (1 - γ (1 - p)). p has a row for every state, or one for all. Where rewards are rare, values are
    found in falling order, so a plain queue holds nearly all of the waiting states; those out of
    order go to a heap. States from which no source is found keep the estimate 0 and come last.
    """
    n_states, n_actions = r.shape
    first, pairs = _predecessors(leads_to)
    queue, settled = np.empty(n_states, np.int32), np.zeros(n_states, np.bool_)
    heap = _sources(r, terminal, V)
    head, tail, n_settled = 0, 0, 0
    while head < tail or len(heap) > 0:
        if head < tail and (len(heap) == 0 or V[queue[head]] >= -heap[0][0]):
            s = queue[head]
            head += 1
        else:
            s = heapq.heappop(heap)[1]
        if settled[s]:
            continue
        settled[s] = True
        order[n_settled] = s
        n_settled += 1
        for j in range(first[s], first[s + 1]):
            before, a = np.int32(pairs[j] // n_actions), pairs[j] % n_actions
            if settled[before]:
                continue
            chance = p[before if len(p) > 1 else 0, a]
            value = (r[before, a] + gamma * chance * V[s]) / (1.0 - gamma * (1.0 - chance))
            if value > V[before]:
                V[before] = value
                if tail < n_states and (head == tail or value <= V[queue[tail - 1]]):
                    queue[tail] = before
                    tail += 1
                else:
                    heapq.heappush(heap, (-value, before))
    rest = np.flatnonzero(~settled)
    V[rest], order[n_settled:] = 0.0, rest


@compiled
def _renumbered(successor: I32, order: I32) -> I32:
    """Return the successors with i in place of state order[i]."""
    rank, ordered = np.empty_like(order), np.empty_like(successor)
    for i in range(len(order)):
        rank[order[i]] = i
    for i in range(len(order)):
        for a in range(successor.shape[1]):
            for k in range(successor.shape[2]):
                ordered[i, a, k] = rank[successor[order[i], a, k]]
    return ordered


def in_order(
    transitions: Transitions, r: F64, terminal: Bools, gamma: float, order: I32, V: F64
) -> Transitions:
    """Return the transitions in the order of the sweeps, in which i stands for state order[i].

    Writes `order`, and in that order the estimated values into `V` and the rewards into `r`.
    """
    successor, probability, own_rows = transitions
    likeliest = probability.argmax(axis=2)[:, :, None]
    leads_to = np.take_along_axis(successor, likeliest, axis=2)[:, :, 0]
    best_first(leads_to, probability.max(axis=2), r, terminal, gamma, V, order)
    del leads_to
    V[:], r[:] = V[order], r[order]
    ordered = probability[order] if own_rows else probability
    return Transitions(_renumbered(successor, order), ordered, own_rows)


@inlined
def _worth(
    transitions: Transitions, led: I32, r: F64, gamma: float, V: F64, s: int, a: int, i: int
) -> float:
    """Return q = (r + γ Σ_{s' ≠ s} p V(s')) / (1 - γ l), where l is the probability to stay in s.

    That is what taking a until s is left is worth: a wall bumped into need not be swept again and
    again. The states that a may lead to are `led[s, i]`.
    """
    q: float = r[s, a]
    stay = 0.0
    for k in range(led.shape[2]):
        p = transitions.probability[transitions.own_rows * s, a, k]
        following = led[s, i, k]
        if following == s:
            stay += p
        else:
            q += gamma * p * V[following]
    if stay > 0.0:
        q /= 1.0 - gamma * stay
    return q


@compiled
def improvement_sweep(
    transitions: Transitions,
    r: F64,
    gamma: float,
    V: F64,
    policy: Ints,
    chosen: I32,
    backward: bool,
) -> tuple[float, float, int, float]:
    """Set V(s) = max_a q(s, a) in place (`_worth`), and note the action and its successors.

    An action is kept while it ties with the best (`TIE`). `backward` turns the order round.

    Returns the largest change, the sum of squared changes, the number of actions changed, and
    the largest |V|.
    """
    successor = transitions.successor
    n_states, n_actions, n_successors = successor.shape
    largest, squares, changes, magnitude = 0.0, 0.0, 0, 0.0
    for i in range(n_states):
        s = n_states - 1 - i if backward else i
        best, best_action, kept = -np.inf, 0, -np.inf
        for a in range(n_actions):
            q = _worth(transitions, successor, r, gamma, V, s, a, a)
            if q > best:
                best, best_action = q, a
            if a == policy[s]:
                kept = q
        if kept < best - TIE * abs(best):
            changes += 1
            policy[s] = best_action
            for k in range(n_successors):
                chosen[s, k] = successor[s, best_action, k]
        largest, squares = _noted(largest, squares, abs(best - V[s]))
        magnitude = max(magnitude, abs(best))
        V[s] = best
    return largest, squares, changes, magnitude


@compiled
def evaluation_sweep(
    transitions: Transitions, r: F64, gamma: float, V: F64, policy: Ints, chosen: I32
) -> tuple[float, float]:
    """Set V(s) = q(s, policy(s)) in place: `improvement_sweep` for one action a state.

    Returns the largest change and the sum of squared changes.
    """
    n_states, n_successors = chosen.shape
    led = chosen.reshape(n_states, 1, n_successors)
    largest, squares = 0.0, 0.0
    for s in range(n_states):
        q = _worth(transitions, led, r, gamma, V, s, policy[s], 0)
        largest, squares = _noted(largest, squares, abs(q - V[s]))
        V[s] = q
    return largest, squares
