"""The finite Markov decision process that planning and tabular learning work on.

Few states follow any one state and action (a grid world: two or three), so a model keeps them in
short rows instead of an S × S matrix per action: at 10⁶ states it takes megabytes, not terabytes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import wrappers
from numpy.typing import ArrayLike, NDArray

from rl_core import checks
from rl_core.kernels.arrays import F64, I32, Bools
from rl_core.kernels.bounds import SUM_TOLERANCE
from rl_core.kernels.model import Model
from rl_core.worlds.environments import EnvironmentLike, opened
from rl_core.worlds.tables import read_table, start_arrays

STATES_AT_ONCE = 2**14  # bounds the memory of checking

TRANSPARENT = (
    wrappers.Autoreset,
    wrappers.HumanRendering,
    wrappers.OrderEnforcing,
    wrappers.PassiveEnvChecker,
    wrappers.RecordEpisodeStatistics,
    wrappers.RecordVideo,
    wrappers.RenderCollection,
    wrappers.TimeLimit,
)
"""Wrappers that leave states, actions and rewards as they are."""


class OwnModel:
    """A base for environments that make their own model, as the Maze does.

    An environment is asked for its model only if it derives from this class: `model` is a common
    word, and what another environment calls so may be anything.
    """

    def model(self) -> MDP:
        """Return the exact model of the environment."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class MDP:
    """A finite Markov decision process with S states, A actions and at most K successors.

    Slot k of state s and action a says: with probability `probability[s, a, k]` the next state is
    s' = `successor[s, a, k]` and the reward is `reward[s, a, k]`; the dynamics are
    p(s', r | s, a) of Sutton & Barto, section 3.1. The discount γ is not part of the model: it is
    an argument of the planner or learner.

    Arrays are checked when the model is made, and kept as read-only views (they are copied only if
    their type has to be converted).

    Attributes
    ----------
    successor : ndarray of int32, shape (S, A, K)
        The states that may follow. Unused slots hold the state itself with probability 0.
    probability : ndarray of float64, shape (S, A, K)
        Rows sum to 1. It may be a broadcast view: a maze has one row for all its states.
    reward : ndarray of float64, shape (S, A, K)
        The reward of each transition.
    terminal : ndarray of bool, shape (S,)
        Terminal states absorb: every successor is the state itself, every reward is 0.
    start_state : ndarray of int32, shape (M,)
        The states an episode may start in.
    start_probability : ndarray of float64, shape (M,)
        Their probabilities, which sum to 1.

    Raises
    ------
    ValueError
        If an array has the wrong shape, probabilities lie outside [0, 1] or do not sum to 1
        (within 1e-9), a state is out of range, a reward is not finite, or a terminal state does not
        absorb. The message names the argument, the state, the action and the value.
    TypeError
        If an array is not of integers, numbers or bools, as said above.

    Notes
    -----
    To sample with one uniform u in [0, 1), take the first k with
    `cumsum(probability[s, a])[k] > u` (the first slot, if rounding leaves none). On a model from
    `from_env` this draws what Gymnasium's toy-text environments draw from the same u.

    Examples
    --------
    One state in which the only action pays 1 and ends the episode with probability 1/2:

    >>> from rl_core.mdp import MDP
    >>> model = MDP(
    ...     successor=[[[0, 1]], [[1, 1]]],
    ...     probability=[[[0.5, 0.5]], [[0.5, 0.5]]],
    ...     reward=[[[1.0, 1.0]], [[0.0, 0.0]]],
    ...     terminal=[False, True],
    ...     start_state=[0],
    ...     start_probability=[1.0],
    ... )
    >>> model.n_states, model.n_actions, model.n_successors
    (2, 1, 2)
    """

    successor: I32
    probability: F64
    reward: F64
    terminal: Bools
    start_state: I32
    start_probability: F64

    def __post_init__(self) -> None:
        for name, dtype, ndim in (
            ("successor", np.int32, 3),
            ("probability", np.float64, 3),
            ("reward", np.float64, 3),
            ("terminal", np.bool_, 1),
            ("start_state", np.int32, 1),
            ("start_probability", np.float64, 1),
        ):
            object.__setattr__(self, name, _as_array(name, getattr(self, name), dtype, ndim))
        self._check_shapes()
        for first in range(0, self.n_states, STATES_AT_ONCE):
            self._check_transitions(first)
        self._check_start()

    @property
    def n_states(self) -> int:
        """The number of states S, terminal ones included."""
        return int(self.successor.shape[0])

    @property
    def n_actions(self) -> int:
        """The number of actions A."""
        return int(self.successor.shape[1])

    @property
    def n_successors(self) -> int:
        """The number of slots K per state and action."""
        return int(self.successor.shape[2])

    def arrays(self) -> Model:
        """Return the arrays as compiled code takes them."""
        return Model(*(getattr(self, name) for name in Model._fields))

    def reachable_states(self) -> Bools:
        """Mark the states some policy can be in: those reached from the start states.

        Returns
        -------
        ndarray of bool, shape (S,)
            True where a path of transitions of positive probability leads.

        Examples
        --------
        >>> from rl_core.mdp import MDP
        >>> MDP.from_env("FrozenLake-v1").reachable_states().all()
        np.True_
        """
        reached = np.zeros(self.n_states, np.bool_)
        front = self.start_state[self.start_probability > 0]
        while len(front):
            reached[front] = True
            following = self.successor[front][self.probability[front] > 0]
            front = np.unique(following[~reached[following]])
        return reached

    def following(self, policy: ArrayLike) -> MDP:
        """Return the model with one action: that of a policy, an array of an action a state.

        Raises
        ------
        TypeError, ValueError
            If `policy` holds no integers, has another shape, or an action is out of range.

        Examples
        --------
        >>> import numpy as np
        >>> from rl_core.mdp import MDP
        >>> MDP.from_env("FrozenLake-v1").following(np.full(16, 2)).successor.shape
        (16, 1, 3)
        """
        taken = np.arange(self.n_states), checked_policy("policy", policy, self)
        names = "successor", "probability", "reward"
        return replace(self, **{name: getattr(self, name)[taken][:, None] for name in names})

    @classmethod
    def from_env(cls, env: EnvironmentLike, start_distribution: ArrayLike | None = None) -> MDP:
        """Read the model of a Gymnasium environment with a transition table.

        The table is `P[s][a] = [(probability, next state, reward, terminated), ...]`, as in
        FrozenLake, CliffWalking and Taxi. The slots keep the order of these rows. An environment
        that makes its own model (`OwnModel`), as the Maze does, is asked for it.

        Gymnasium marks the end of an episode on the transition, an `MDP` on the state entered. A
        state becomes terminal if every transition into it from another state is terminated (and
        no episode starts in it), or if it already absorbs with reward 0. Where a terminated
        transition leads into any other state, one that can also be entered while the episode goes
        on, it is redirected to an extra terminal state appended with index S: so Taxi's 500 states
        become 501. Time limits are truncations, not part of the dynamics; they are ignored.

        Parameters
        ----------
        env : str, Make, gymnasium.Env or callable
            See `rl_core.worlds.environments.opened`. Of wrappers it may have only such as leave
            states, actions and rewards alone (`TRANSPARENT`): time limits, records, pictures.
        start_distribution : array of float, shape (S,), optional
            The probability that an episode starts in each state. By default the environment's
            `initial_state_distrib`, or all on its `start_state_index`.

        Returns
        -------
        MDP
            The model; its first S states are the environment's.

        Raises
        ------
        TypeError
            If `env` is none of these, or `start_distribution` no numbers.
        ValueError
            If the environment cannot be made (the message says why), a wrapper may change
            states, actions or rewards, there is no table, the table is malformed (then the message
            names the state, the action and what is there), the start distribution is missing or of
            the wrong shape, or the model's own checks fail.

        Examples
        --------
        >>> import numpy as np
        >>> from rl_core.mdp import MDP
        >>> lake = MDP.from_env("FrozenLake-v1")
        >>> lake.successor.shape, np.flatnonzero(lake.terminal).tolist()
        ((16, 4, 3), [5, 7, 11, 12, 15])
        """
        made = opened(env)
        try:
            base = _unwrapped(made)
            if not isinstance(base, OwnModel):
                return cls(**read_table(base, start_distribution))
            model = base.model()
            if start_distribution is None:
                return model
            return replace(model, **start_arrays(start_distribution, model.n_states))
        finally:
            if made is not env:
                made.close()

    def _check_shapes(self) -> None:
        shape, starts = self.successor.shape, self.start_state.shape
        checks.require(0 not in shape, "successor", shape, "of a shape without an empty axis")
        checks.require(0 not in starts, "start_state", starts, "of a shape without an empty axis")
        for name, right, like in (
            ("probability", shape, "successor"),
            ("reward", shape, "successor"),
            ("terminal", shape[:1], "the first axis of successor"),
            ("start_probability", starts, "start_state"),
        ):
            found = getattr(self, name).shape
            checks.require(found == right, name, found, f"of the shape of {like}, {right}")

    def _check_transitions(self, first: int) -> None:
        """Check some states, from `first` on."""
        some = slice(first, first + STATES_AT_ONCE)
        successor, probability = self.successor[some], self.probability[some]
        reward, ends = self.reward[some], self.terminal[some, None, None]
        stays = successor == np.arange(first, first + len(successor))[:, None, None]
        last, total = self.n_states - 1, probability.sum(axis=2)
        for name, values, right, allowed in (
            ("probability", probability, _within(probability, 1), "must be from 0 to 1"),
            ("successor", successor, _within(successor, last), f"must be from 0 to {last}"),
            ("reward", reward, np.isfinite(reward), "must be finite"),
            ("successor", successor, stays | ~ends, "of a terminal state must be the state itself"),
            ("reward", reward, (reward == 0) | ~ends, "of a terminal state must be 0"),
            ("probability", total, np.abs(total - 1) <= SUM_TOLERANCE, "must sum to 1"),
        ):
            for index in np.argwhere(~right)[:1]:
                s, a, *k = index.tolist()
                place = f"state {first + s}, action {a}" + "".join(f", slot {i}" for i in k)
                raise ValueError(f"{name} {allowed}, at {place} it is {values[tuple(index)]}")

    def _check_start(self) -> None:
        for name, most in (("start_state", self.n_states - 1), ("start_probability", 1)):
            values = getattr(self, name)
            for i in np.flatnonzero(~_within(values, most))[:1]:
                raise ValueError(f"{name} must be from 0 to {most}, entry {i} is {values[i]}")
        total = float(self.start_probability.sum())
        if abs(total - 1) > SUM_TOLERANCE:
            raise ValueError(f"start_probability must sum to 1, the sum is {total}")


def checked_policy(name: str, policy: ArrayLike, mdp: MDP) -> NDArray[np.integer]:
    """Return `policy` as an array; raise unless it has one of the actions for every state.

    Examples
    --------
    >>> from rl_core.mdp import MDP, checked_policy
    >>> checked_policy("policy", [4] * 16, MDP.from_env("FrozenLake-v1"))
    Traceback (most recent call last):
    ValueError: policy must be an array of integers from 0 to 3, in state 0 it is 4
    """
    checks.floats(name, policy, (mdp.n_states,))
    actions = np.asarray(policy)
    allowed = f"an array of integers from 0 to {mdp.n_actions - 1}"
    if actions.dtype.kind not in "iu":
        raise TypeError(f"{name} must be {allowed}, got {actions.dtype}")
    for state in np.flatnonzero((actions < 0) | (actions >= mdp.n_actions))[:1]:
        raise ValueError(f"{name} must be {allowed}, in state {state} it is {actions[state]}")
    return actions


def _unwrapped(env: gym.Env[Any, Any]) -> gym.Env[Any, Any]:
    """Return the environment inside wrappers, none of which may change what the model says."""
    while isinstance(env, gym.Wrapper):
        if type(env) not in TRANSPARENT:
            raise ValueError(
                "env must be without wrappers that may change states, actions or rewards, "
                f"got {type(env).__name__} (in {env})"
            )
        env = env.env
    return env


def _as_array(name: str, values: ArrayLike, dtype: type[np.generic], ndim: int) -> NDArray[Any]:
    """Return a read-only view of `values`; convert its type only if no value changes by it."""
    kind = np.dtype(dtype).kind
    kinds = {"i": "iu", "f": "iuf", "b": "b"}[kind]
    what = {"i": "integers", "f": "numbers", "b": "bools"}[kind]
    allowed = f"an array of {what} with {ndim} axes"
    try:
        given = np.asarray(values)
    except (RuntimeError, TypeError, ValueError):  # ragged nesting, or what its own code raises
        raise ValueError(f"{name} must be {allowed}, got ragged lists") from None
    if given.dtype == np.object_ and dtype is np.float64:  # fractions
        given = checks.floats(name, values, (None,) * ndim)
    checks.require(given.ndim == ndim, name, values, allowed)
    if given.size and given.dtype.kind not in kinds:  # an empty list has no type of its own
        raise TypeError(f"{name} must be {allowed}, got {given.dtype}")
    array = given.astype(dtype, copy=False)
    if dtype is np.int32 and array is not given and not np.array_equal(array, given):
        wrong = int(given[array != given][0])
        checks.require(False, name, wrong, "states, integers from 0 below 2**31")
    view = array.view()
    view.setflags(write=False)
    return view


def _within(values: NDArray[Any], most: int) -> Bools:
    """Mark what lies from 0 to `most`, which NaN does not."""
    within: Bools = (values >= 0) & (values <= most)
    return within
