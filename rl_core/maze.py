"""The course's Maze: collect the flags, then reach the goal, on a floor that slips.

A maze is text, one letter a cell: `S` start, `G` goal, `F` flag, `W` wall, `O` open floor. `Maze`
is a Gymnasium environment, `Maze.model` its exact model.
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded

from rl_core import checks
from rl_core.kernels.arrays import F64, I32, Bools
from rl_core.mdp import MDP, OwnModel
from rl_core.worlds.maze_layout import COURSE_LAYOUT, draw_maze, find, read_layout

ACTIONS = ("up", "down", "left", "right")
MOVES = ((-1, 0), (1, 0), (0, -1), (0, 1))
"""Change of (row, column) for each action; row 0 is at the top."""
CLOCKWISE = (3, 2, 0, 1)
"""The action a quarter turn clockwise of each action: up → right → down → left → up."""


class Maze(OwnModel, gym.Env[int, int]):
    """A grid maze with flags to collect on the way to the goal.

    **States.** A state is a cell and the set of flags held, numbered `2**n * cell + flag_set` for n
    flags. Cells without a wall are numbered column by column (top to bottom, then the next column).
    Flags are lettered row by row, `A`, `B`, ...; flag sets are numbered by size, then
    alphabetically: none, A, B, C, AB, AC, BC, ABC.

    **Dynamics.** The actions are 0 up, 1 down, 2 left, 3 right. With probability `slip` the move
    goes a quarter turn clockwise of the action, otherwise as intended. A move into a wall leaves
    the agent where it is. A move off the grid stops at the edge, which counts as entering
    the cell again. Entering a flag's cell collects the flag. Entering a goal ends the episode with
    a reward of the number of flags held; every other reward is 0.

    **Episodes** begin at `S` without flags. `reset` draws no random number, since there is only one
    start state. `step` draws one uniform u and takes the first outcome (intended, slipped) whose
    cumulative probability exceeds u, as Gymnasium's toy-text environments do; so whoever samples
    from `model` with the same random stream sees the same episode. There is no time limit.

    Parameters
    ----------
    layout : str or sequence of str
        The rows, as lines of one text or one by one; blanks between letters are ignored. One `S`,
        one or more `G`, up to 16 `F`. Every goal must be reachable from the start without passing
        through another goal. Flags need not be.
    slip : float
        Probability of slipping, in [0, 1].
    render_mode : {None, "rgb_array"}
        What `render` returns: nothing, or a picture (uint8, shape (height, width, 3)).

    Attributes
    ----------
    layout : str
        The rows, each ended by a newline.
    walls : ndarray of bool, shape (rows, columns)
        Where the walls are.
    cells : ndarray of int32, shape (cells, 2)
        (row, column) of each free cell, in the order of their numbers.
    start : tuple of int
        (row, column) of the start.
    goals : tuple of tuple of int
        (row, column) of each goal, row by row.
    flag_cells : dict of str to tuple of int
        (row, column) of each flag by its letter.

    Raises
    ------
    TypeError
        If `layout` is not text or `slip` not a number.
    ValueError
        If a row is ragged, a letter unknown, there is no start or more than one, no goal, a
        goal that cannot be reached, more than 16 flags, 2³¹ states or more, a slip outside [0, 1],
        or an unknown render mode.

    Examples
    --------
    >>> from rl_core.maze import Maze
    >>> env = Maze()
    >>> env.observation_space, env.action_space
    (Discrete(112), Discrete(4))
    >>> env.reset(seed=0)
    (0, {'prob': 1.0, 'row': 0, 'column': 0, 'flags': '', 'slipped': False})
    >>> env.step(1)  # down
    (8, 0.0, False, False, {'prob': 0.9, 'row': 1, 'column': 0, 'flags': '', 'slipped': False})
    >>> env.locate(111)
    (1, 4, 'ABC')
    """

    # Typed as in gymnasium.Env, which ClassVar would contradict.
    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 4}  # noqa: RUF012

    def __init__(
        self,
        layout: str | Sequence[str] = COURSE_LAYOUT,
        slip: float = 0.1,
        render_mode: str | None = None,
    ) -> None:
        letters = read_layout(layout)
        checks.optional("render_mode", render_mode, checks.one_of, self.metadata["render_modes"])
        self.layout = "".join(f"{''.join(row)}\n" for row in letters)
        self.slip = checks.number("slip", slip, 0, 1)
        self.render_mode = render_mode
        self.walls: Bools = letters == "W"
        self.cells: I32 = np.argwhere(~self.walls.T)[:, ::-1].astype(np.int32)
        self.start = find(letters, "S")[0]
        self.goals = tuple(find(letters, "G"))
        self.flag_cells = dict(zip("ABCDEFGHIJKLMNOP", find(letters, "F"), strict=False))
        self._number_states()
        self._tabulate_moves()
        n_states = len(self.cells) * len(self._masks)
        self.observation_space: spaces.Discrete[Any] = spaces.Discrete(n_states)
        self.action_space: spaces.Discrete[Any] = spaces.Discrete(len(ACTIONS))
        # As after `gymnasium.make`: the environment knows how to make another one like it.
        kwargs = {"layout": self.layout, "slip": self.slip, "render_mode": render_mode}
        self.spec = EnvSpec("rl_core/Maze-v0", entry_point="rl_core.maze:Maze", kwargs=kwargs)
        self._outcome_probabilities = np.array([1 - self.slip, self.slip])
        self._cumulative = np.cumsum(self._outcome_probabilities)
        self._state: int | None = None
        self._model: MDP | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[int, dict[str, Any]]:
        """Put the agent on the start without flags; draws no random number.

        Parameters
        ----------
        seed : int, optional
            Seeds the environment's own generator; without it the stream goes on.
        options : dict, optional
            Not used.
        """
        super().reset(seed=checks.optional("seed", seed, checks.integer))
        self._state = self.state(*self.start)
        return self._state, self._info(self._state, probability=1.0, slipped=False)

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        """Move; see the class for the dynamics.

        Returns
        -------
        tuple
            State, reward, terminated, truncated (always false) and info: `prob`, the probability of
            this outcome, `row`, `column`, `flags` held as letters, and whether the move `slipped`.

        Raises
        ------
        ValueError
            If `action` is not one of 0, 1, 2, 3.
        gymnasium.error.ResetNeeded
            If no episode has begun.

        Examples
        --------
        >>> from rl_core.maze import Maze
        >>> env = Maze("SFG", slip=0)
        >>> env.reset()[0], env.step(3)[:3], env.step(3)[:3]  # right, and right again
        (0, (3, 0.0, False), (5, 1.0, True))
        """
        known = not isinstance(action, bool) and self.action_space.contains(action)
        checks.require(known, "action", action, "0, 1, 2 or 3")
        if self._state is None:
            raise ResetNeeded("call reset() before step()")
        outcome = int(np.argmax(self._cumulative > self.np_random.random()))
        direction = CLOCKWISE[action] if outcome else action
        cell, flag_set = divmod(self._state, len(self._masks))
        reward = 0.0
        if not self._is_goal[cell]:  # a goal absorbs
            flag_set = int(self._with_flag[flag_set, self._collects[cell, direction]])
            cell = int(self._landing[cell, direction])
            if self._is_goal[cell]:
                reward = float(self._n_held[flag_set])
        self._state = len(self._masks) * cell + flag_set
        probability = float(self._outcome_probabilities[outcome])
        info = self._info(self._state, probability, slipped=bool(outcome))
        return self._state, reward, bool(self._is_goal[cell]), False, info

    def model(self) -> MDP:
        """Return the exact model: slot 0 is the intended move, slot 1 the clockwise slip.

        It is built on the first call and kept. It takes 97 bytes a state: all states share
        one row of probabilities.

        Examples
        --------
        >>> from rl_core.maze import Maze
        >>> model = Maze().model()
        >>> model.successor[0, 1].tolist(), model.probability[0, 1].tolist()
        ([8, 0], [0.9, 0.1])
        """
        if self._model is None:
            shape = (int(self.observation_space.n), len(ACTIONS), 2)
            successor, reward = self._transitions()
            self._model = MDP(
                successor=successor.reshape(shape),
                probability=np.broadcast_to(self._outcome_probabilities, shape),
                reward=reward.reshape(shape),
                terminal=np.repeat(self._is_goal, len(self._masks)),
                start_state=np.array([self.state(*self.start)], dtype=np.int32),
                start_probability=np.ones(1),
            )
        return self._model

    def reachable_states(self) -> Bools:
        """Mark the states an episode can be in, as bool of shape (S,).

        The others have the agent on a flag's cell without that flag, or in a walled-off part.

        Examples
        --------
        >>> from rl_core.maze import Maze
        >>> Maze().reachable_states().sum()
        np.int64(100)
        """
        return self.model().reachable_states()

    @property
    def flag_sets(self) -> tuple[str, ...]:
        """The sets of flags in the order of their numbers, each as its letters."""
        return tuple(self._flags_held(i) for i in range(len(self._masks)))

    def state(self, row: int, column: int, flags: Sequence[str] | Set[str] = "") -> int:
        """Return the number of the state with the agent on a cell, holding `flags`.

        Parameters
        ----------
        row, column : int
            A cell that is not a wall.
        flags : sequence or set of str
            The letters of the flags held, in any order.

        Raises
        ------
        ValueError, TypeError
            If the cell is a wall or off the grid, a flag unknown, or a type wrong.

        Examples
        --------
        >>> from rl_core.maze import Maze
        >>> Maze().state(1, 4, "CAB")
        111
        """
        last_row, last_column = np.array(self.walls.shape) - 1
        row = checks.integer("row", row, 0, last_row)
        at = row, checks.integer("column", column, 0, last_column)
        checks.require(not self.walls[at], "row, column", at, "a free cell")
        mask = 0
        for flag in checks.instance("flags", flags, Sequence | Set, "letters of flags"):
            known = isinstance(flag, str) and flag in self._bits
            checks.require(known, "flags", flag, f"among {list(self._bits)}")
            mask |= self._bits[flag]
        cell = int(self._cell_number[at])
        return len(self._masks) * cell + int(self._set_number[mask])

    def locate(self, state: int) -> tuple[int, int, str]:
        """Return row, column and the letters of the flags held; the inverse of `state`.

        Raises
        ------
        ValueError, TypeError
            If there is no such state.

        Examples
        --------
        >>> from rl_core.maze import Maze
        >>> Maze().locate(111)
        (1, 4, 'ABC')
        """
        state = checks.integer("state", state, 0, len(self.cells) * len(self._masks) - 1)
        cell, flag_set = divmod(state, len(self._masks))
        row, column = self.cells[cell].tolist()
        return row, column, self._flags_held(flag_set)

    def render(self) -> Any:
        """Return a picture of the current state (`rl_core.worlds.maze_layout.draw_maze`).

        Raises
        ------
        gymnasium.error.ResetNeeded
            If no episode has begun.

        Examples
        --------
        >>> from rl_core.maze import Maze
        >>> env = Maze("SFG", render_mode="rgb_array")
        >>> env.reset()[0], env.render().shape
        (0, (96, 288, 3))
        """
        if self.render_mode is None:
            gym.logger.warn("render() needs a render_mode: gymnasium.make(id, render_mode=...)")
            return None
        if self._state is None:
            raise ResetNeeded("call reset() before render()")
        row, column, held = self.locate(self._state)
        return draw_maze(self.layout.split(), self.flag_cells, held, (row, column))

    def _transitions(self) -> tuple[I32, F64]:
        """Return successors and rewards, of shape (cells, flag sets, actions, outcomes)."""
        n_cells, n_sets = len(self.cells), len(self._masks)
        successor = np.empty((n_cells, n_sets, len(ACTIONS), 2), dtype=np.int32)
        reward = np.zeros(successor.shape)
        for action, turned in enumerate(CLOCKWISE):
            for outcome, direction in enumerate((action, turned)):
                landing, collects = self._landing[:, direction], self._collects[:, direction]
                # Added up in place: to hold both summands would take memory.
                successor[:, :, action, outcome] = self._with_flag[:, collects].T
                successor[:, :, action, outcome] += n_sets * landing[:, None]
                pays = self._is_goal[landing]
                held = self._n_held[self._with_flag[:, collects[pays]]]
                reward[pays, :, action, outcome] = held.T
        goals = np.flatnonzero(self._is_goal)
        stays = n_sets * goals[:, None] + np.arange(n_sets)
        successor[goals], reward[goals] = stays[:, :, None, None], 0
        return successor, reward

    def _info(self, state: int, probability: float, slipped: bool) -> dict[str, Any]:
        place = zip(("row", "column", "flags"), self.locate(state), strict=True)
        return {"prob": probability, **dict(place), "slipped": slipped}

    def _flags_held(self, flag_set: int) -> str:
        mask = self._masks[flag_set]
        return "".join(flag for flag, bit in self._bits.items() if mask & bit)

    def _number_states(self) -> None:
        """Give cells and flag sets their numbers.

        As a mask, a flag set has its first letter in the highest bit; then alphabetical order among
        sets of one size is falling order of the masks.
        """
        n_flags = len(self.flag_cells)
        found = f"{len(self.cells)} free cells and {n_flags} flags"
        allowed = "of fewer than 2**31 states"
        checks.require(len(self.cells) << n_flags < 2**31, "layout", found, allowed)
        self._cell_number = np.full(self.walls.shape, -1, dtype=np.int32)
        self._cell_number[tuple(self.cells.T)] = np.arange(len(self.cells), dtype=np.int32)
        self._bits = {flag: 1 << (n_flags - 1 - i) for i, flag in enumerate(self.flag_cells)}
        masks = np.arange(2**n_flags, dtype=np.int32)
        size = np.bitwise_count(masks)
        self._masks = np.lexsort((-masks, size)).astype(np.int32)
        self._set_number = np.argsort(self._masks).astype(np.int32)
        self._n_held = size[self._masks]
        # Column 0: no flag is added; column 1 + i: flag i is.
        added = np.array([0, *self._bits.values()], dtype=np.int32)
        self._with_flag = self._set_number[self._masks[:, None] | added].astype(np.uint16)

    def _tabulate_moves(self) -> None:
        """For each cell and direction: the cell moved to, and the flag collected (0: none)."""
        self._is_goal = np.zeros(len(self.cells), dtype=np.bool_)
        self._is_goal[[self._cell_number[goal] for goal in self.goals]] = True
        flag_on = np.zeros(len(self.cells), dtype=np.int8)
        for i, cell in enumerate(self.flag_cells.values()):
            flag_on[self._cell_number[cell]] = 1 + i
        own = np.arange(len(self.cells), dtype=np.int32)
        self._landing = np.empty((len(own), len(MOVES)), dtype=np.int32)
        self._collects = np.empty((len(own), len(MOVES)), dtype=np.int8)
        last_row, last_column = np.array(self.walls.shape) - 1
        for direction, (down, right) in enumerate(MOVES):
            row = np.clip(self.cells[:, 0] + down, 0, last_row)
            column = np.clip(self.cells[:, 1] + right, 0, last_column)
            blocked = self.walls[row, column]
            landing = np.where(blocked, own, self._cell_number[row, column])
            self._landing[:, direction] = landing
            self._collects[:, direction] = np.where(blocked, 0, flag_on[landing])
