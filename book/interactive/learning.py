"""Chapter 2: tabular Q-learning on the Maze, one step at a time.

The log is no second implementation: it is `rl_core.q_learning` itself, playing in the environment
through a wrapper that notes every move. From the moves alone the page computes every table again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from string import ascii_letters, digits
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from interactive.maze import world_data
from interactive.page import Widget, doubles, significant
from rl_core.checks import floats, instance, integer, integers, require
from rl_core.exploration import Trials
from rl_core.maze import Maze
from rl_core.q_learning import QLearningConfig, q_learning

SNAPSHOTS = (500, 750, 1000, 1500, 2000, 3000, 4000, 5000)
DIGITS = ascii_letters + digits + "+/"
"""64 letters: one tells two moves."""


@dataclass(frozen=True)
class LearningLog:
    """What happened in a run.

    Attributes
    ----------
    gamma, step_size : float
        Of the run.
    seed : int
        Of the run.
    moves : ndarray of int, shape (steps,)
        Each step of the first episodes: twice its action, and one more if it slipped.
    lengths : ndarray of int, shape (episodes,)
        The steps of each of these episodes.
    snapshots : dict of int to ndarray of float64, shape (S, A)
        Q after further episodes.
    errors : ndarray of float64
        The Frobenius norm of Q - Q* after each episode, the logged and the others.
    """

    gamma: float
    step_size: float
    seed: int
    moves: NDArray[np.int64]
    lengths: NDArray[np.int64]
    snapshots: dict[int, NDArray[np.float64]]
    errors: NDArray[np.float64]

    def replay(self, maze: Maze, steps: int | None = None) -> NDArray[np.float64]:
        """Return Q after so many steps, computed from the moves: as the page does it.

        Examples
        --------
        >>> from rl_core.maze import Maze
        >>> log = learning_log(Maze(), QLearningConfig(), np.zeros((112, 4)), 2, snapshots=())
        >>> log.replay(Maze(), 0).any()
        np.False_
        """
        model = maze.model()
        Q = np.zeros((model.n_states, model.n_actions))
        starts = set(np.cumsum(self.lengths).tolist())
        start = s = int(model.start_state[0])
        for number, move in enumerate(self.moves[:steps].tolist(), start=1):
            a, slipped = divmod(move, 2)
            s_next = int(model.successor[s, a, slipped])
            target = float(model.reward[s, a, slipped])
            if not model.terminal[s_next]:
                target += self.gamma * float(Q[s_next].max())
            Q[s, a] += self.step_size * (target - Q[s, a])
            s = start if number in starts else s_next
        return Q


class _Recorder(gym.Wrapper[Any, Any, Any, Any]):
    """Notes every move in the Maze."""

    def __init__(self, env: Maze) -> None:
        super().__init__(env)
        self.moves: list[int] = []

    def step(self, action: int) -> tuple[Any, ...]:
        """Move, and note it."""
        outcome = super().step(action)
        self.moves.append(2 * int(action) + int(outcome[4]["slipped"]))
        return outcome


def learning_log(
    maze: Maze,
    config: QLearningConfig,
    Q_star: ArrayLike,
    episodes: int = 400,
    snapshots: Sequence[int] = SNAPSHOTS,
    seed: int = 0,
) -> LearningLog:
    """Run `rl_core.q_learning` and log it: first step by step, then by snapshots.

    Parameters
    ----------
    maze : Maze
        The world; one start state.
    config : QLearningConfig
        The settings; a constant step size and no `max_steps`.
    Q_star : array, shape (S, A)
        What errors are measured against.
    episodes : int
        How many episodes are logged step by step.
    snapshots : sequence of int
        After which later episodes Q is kept, in rising order.
    seed : int
        Of the run.

    Returns
    -------
    LearningLog
        The run.

    Raises
    ------
    TypeError, ValueError
        An argument is not as described.
    RuntimeError
        If the tables that follow from the moves are not, to the bit, those that were learned.

    Examples
    --------
    >>> from rl_core.maze import Maze
    >>> log = learning_log(Maze(), QLearningConfig(), np.zeros((112, 4)), 3, snapshots=[5])
    >>> len(log.lengths), sorted(log.snapshots), log.lengths.sum() == len(log.moves)
    (3, [5], np.True_)
    """
    instance("config", config, QLearningConfig, "a QLearningConfig")
    allowed = "a QLearningConfig with a constant step size and no max_steps"
    constant = isinstance(config.step_size, float | int) and config.max_steps is None
    require(constant, "config", config, allowed)
    best = floats("Q_star", Q_star, (maze.model().n_states, maze.model().n_actions))
    episodes = integer("episodes", episodes, least=1)
    later = integers("snapshots", snapshots, least=episodes + 1)
    require(sorted(set(later)) == list(later), "snapshots", later, "in rising order")
    last = max([episodes, *later])
    config = replace(config, evaluation=Trials(every=last + 1))  # has streams of its own
    recorder = _Recorder(Maze(maze.layout, slip=maze.slip))
    played = q_learning(recorder, config, episodes=episodes, seeds=[seed], Q_star=best)
    whole = q_learning(
        *(maze.model(), config),
        **{"episodes": last, "seeds": [seed], "Q_star": best, "snapshots": [episodes, *later]},
    )
    log = LearningLog(
        gamma=float(config.gamma),
        step_size=float(config.step_size),
        seed=seed,
        moves=np.array(recorder.moves),
        lengths=played.table["steps"].to_numpy(dtype=np.int64),
        snapshots=dict(zip(later, whole.arrays["Q_snapshots"][0, 1:], strict=True)),
        errors=whole.table["error_norm"].to_numpy(),
    )
    Q = log.replay(maze)
    for learned in (played.arrays["Q"][0], whole.arrays["Q_snapshots"][0, 0]):
        if not np.array_equal(Q, learned):
            raise RuntimeError("the moves that were logged do not lead to the table learned")
    return log


def learning_widget(maze: Maze, log: LearningLog, Q_star: ArrayLike, *, still: Any) -> Widget:
    """Let the reader follow a run step by step, by episodes, or from reward to reward.

    Shown are the update with its numbers, the table's error with a cursor on its curve, and where
    in the table the error is: the states that cannot be reached are marked.

    Parameters
    ----------
    maze : Maze
        The world.
    log : LearningLog
        What `learning_log` noted of a run in it.
    Q_star : array, shape (S, A)
        What errors are measured against.
    still : matplotlib.figure.Figure or str or object with _repr_html_
        The picture where there are no scripts, such as figure 9.

    Returns
    -------
    Widget
        To be shown by a notebook.

    Examples
    --------
    >>> from rl_core.maze import Maze
    >>> zeros = np.zeros((112, 4))
    >>> log = learning_log(Maze(), QLearningConfig(), zeros, 3, snapshots=[5])
    >>> learning_widget(Maze(), log, zeros, still="<p>no picture</p>").kind
    'learning'
    """
    best = floats("Q_star", Q_star, (maze.model().n_states, maze.model().n_actions))
    n = len(log.errors)
    logged = len(log.lengths)
    shown = np.unique(np.concatenate([np.geomspace(1, n, 160).round(), [logged]]).astype(int))
    pairs = np.append(log.moves, 0)[: 2 * ((len(log.moves) + 1) // 2)].reshape(-1, 2)
    data = {
        "world": {**world_data(maze), "top": float(best.max())},
        "gamma": log.gamma,
        "step_size": log.step_size,
        "seed": log.seed,
        "moves": "".join(DIGITS[8 * one + other] for one, other in pairs.tolist()),
        "digits": DIGITS,
        "lengths": log.lengths,
        "snapshots": [{"episode": k, "Q": doubles(Q)} for k, Q in log.snapshots.items()],
        "Q_star": doubles(best),
        "curve": {
            "episode": [0, *shown],
            "error": significant([np.linalg.norm(best), *log.errors[shown - 1]], 6),
        },
    }
    label = f"Q-learning in the Maze, step by step: seed {log.seed}."
    return Widget("learning", data, label, still)
