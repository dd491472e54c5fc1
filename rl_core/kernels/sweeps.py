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
from rl_core.kernels.compiled import compiled

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
            change = abs(q - Q[s, a])
            largest = max(largest, change)
            squares += change * change
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
        change = abs(best - V[s])
        largest = max(largest, change)
        squares += change * change
        changes += policy[s] != chosen
        V[s] = best
        policy[s] = chosen
    return largest, squares, changes


@compiled
def expected_rewards(transitions: Transitions, reward: F64, order: I32, r: F64) -> float:
    """Write r(i, a) = Σ_k p_k r_k of state order[i]; return the largest |r_k|."""
    _, probability, own_rows = transitions
    n_states, n_actions, n_successors = reward.shape
    largest = 0.0
    for i in range(n_states):
        s = order[i]
        for a in range(n_actions):
            mean = 0.0
            for k in range(n_successors):
                largest = max(largest, abs(reward[s, a, k]))
                mean += probability[own_rows * s, a, k] * reward[s, a, k]
            r[i, a] = mean
    return largest


@compiled
def _main_slot(probability: F64, row: int, a: int) -> int:
    """Return the slot of the likeliest successor (of several, the first)."""
    main = 0
    for k in range(1, probability.shape[2]):
        if probability[row, a, k] > probability[row, a, main]:
            main = k
    return main


@compiled
def count_predecessors(transitions: Transitions, first: I64) -> None:
    """Write where each state's list of predecessors will begin: that of s at first[s + 1].

    Filling the list moves first[s + 1] to its end, so that afterwards it is first[s]..first[s + 1].
    """
    successor, probability, own_rows = transitions
    n_states, n_actions, _ = successor.shape
    first[:] = 0
    for s in range(n_states):
        for a in range(n_actions):
            following = successor[s, a, _main_slot(probability, own_rows * s, a)]
            if following != s:
                first[following + 2] += 1
    for s in range(n_states):
        first[s + 2] += first[s + 1]


@compiled
def link_predecessors(transitions: Transitions, first: I64, predecessor: I32, action: Ints) -> None:
    """Fill the lists: for every state, the other states and actions that most likely lead to it."""
    successor, probability, own_rows = transitions
    n_states, n_actions, _ = successor.shape
    for s in range(n_states):
        for a in range(n_actions):
            following = successor[s, a, _main_slot(probability, own_rows * s, a)]
            if following != s:
                j = first[following + 1]
                predecessor[j], action[j] = s, a
                first[following + 1] = j + 1


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
    transitions: Transitions,
    r: F64,
    terminal: Bools,
    gamma: float,
    first: I64,
    predecessor: I32,
    action: Ints,
    V: F64,
    order: I32,
    queue: I32,
    settled: Bools,
) -> None:
    """Estimate V and write the states by falling estimate into `order` (Dijkstra's search).

    The estimate is exact in a model where each action either leads to its likeliest successor s',
    with probability p, or leaves the agent where it is: V(s) = max_a (r(s, a) + γ p V(s')) /
    (1 - γ (1 - p)). Where rewards are rare, values are found in falling order, so a plain queue
    holds nearly all of the waiting states; those out of order go to a heap. States from which no
    source is found keep the estimate 0 and come last.
    """
    _, probability, own_rows = transitions
    n_states = len(r)
    settled[:] = False
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
            before, a = predecessor[j], action[j]
            if settled[before]:
                continue
            p = probability[own_rows * before, a, _main_slot(probability, own_rows * before, a)]
            value = (r[before, a] + gamma * p * V[s]) / (1.0 - gamma * (1.0 - p))
            if value > V[before]:
                V[before] = value
                if tail < n_states and (head == tail or value <= V[queue[tail - 1]]):
                    queue[tail] = before
                    tail += 1
                else:
                    heapq.heappush(heap, (-value, before))
    for s in range(n_states):
        if not settled[s]:
            V[s] = 0.0
            order[n_settled] = s
            n_settled += 1


@compiled
def rearrange(transitions: Transitions, order: I32, rank: I32, ordered: Transitions) -> None:
    """Write the transitions with the states renumbered: order[i] becomes i, rank its inverse."""
    successor, probability, own_rows = transitions
    n_states, n_actions, n_successors = successor.shape
    for i in range(n_states):
        rank[order[i]] = i
    for i in range(n_states):
        s = order[i]
        for a in range(n_actions):
            for k in range(n_successors):
                ordered.successor[i, a, k] = rank[successor[s, a, k]]
                ordered.probability[own_rows * i, a, k] = probability[own_rows * s, a, k]


def in_order(
    transitions: Transitions, r: F64, terminal: Bools, gamma: float, order: I32, V: F64
) -> Transitions:
    """Return the transitions in the order of the sweeps, in which i stands for state order[i].

    Writes `order`, and the estimated values, in that order, into `V`.
    """
    n_states, n_actions, _ = transitions.successor.shape
    scratch = np.empty(n_states, dtype=np.int32)
    first = np.empty(n_states + 2, dtype=np.int64)
    count_predecessors(transitions, first)
    predecessor = np.empty(first[-1], dtype=np.int32)
    action = np.empty(first[-1], dtype=action_type(n_actions))
    link_predecessors(transitions, first, predecessor, action)
    settled = np.empty(n_states, dtype=np.bool_)
    best_first(
        transitions, r, terminal, gamma, first, predecessor, action, V, order, scratch, settled
    )
    del first, predecessor, action, settled
    ordered = Transitions(
        np.empty_like(transitions.successor),
        np.empty_like(transitions.probability),
        transitions.own_rows,
    )
    rearrange(transitions, order, scratch, ordered)
    del scratch
    V[:] = V[order]
    return ordered


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
    """Set V(s) = max_a q(s, a) in place, state after state, and note the action and successors.

    With l the probability of staying in s, q = (r + γ Σ_{s' ≠ s} p V(s')) / (1 - γ l) is what
    taking a until s is left is worth: a wall bumped into need not be swept again and again.
    An action is kept while it ties with the best (`TIE`). `backward` turns the order round.

    Returns the largest change, the sum of squared changes, the number of actions changed, and
    the largest |V|.
    """
    successor, probability, own_rows = transitions
    n_states, n_actions, n_successors = successor.shape
    largest, squares, changes, magnitude = 0.0, 0.0, 0, 0.0
    for i in range(n_states):
        s = n_states - 1 - i if backward else i
        best, best_action, kept = -np.inf, 0, -np.inf
        for a in range(n_actions):
            q, stay = r[s, a], 0.0
            for k in range(n_successors):
                p = probability[own_rows * s, a, k]
                following = successor[s, a, k]
                if following == s:
                    stay += p
                else:
                    q += gamma * p * V[following]
            if stay > 0.0:
                q /= 1.0 - gamma * stay
            if q > best:
                best, best_action = q, a
            if a == policy[s]:
                kept = q
        if kept < best - TIE * abs(best):
            changes += 1
            policy[s] = best_action
            for k in range(n_successors):
                chosen[s, k] = successor[s, best_action, k]
        change = abs(best - V[s])
        largest = max(largest, change)
        squares += change * change
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
    _, probability, own_rows = transitions
    n_states, n_successors = chosen.shape
    largest, squares = 0.0, 0.0
    for s in range(n_states):
        a = policy[s]
        q, stay = r[s, a], 0.0
        for k in range(n_successors):
            p = probability[own_rows * s, a, k]
            following = chosen[s, k]
            if following == s:
                stay += p
            else:
                q += gamma * p * V[following]
        if stay > 0.0:
            q /= 1.0 - gamma * stay
        change = abs(q - V[s])
        largest = max(largest, change)
        squares += change * change
        V[s] = q
    return largest, squares
