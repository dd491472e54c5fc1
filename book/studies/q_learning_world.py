"""Chapter 2: what can be said about the Maze and Q-learning from the model alone, nothing run."""

import numpy as np
import pandas as pd
from scipy.linalg import solve_continuous_lyapunov

from rl_core.maze import Maze
from rl_core.planning import optimal_actions, value_iteration

GAMMA = 0.9
REMEMBERED = 0.01
"""An entry is rarely visited while its starting value still weighs more than this."""


class World:
    """The Maze, its optimal values, and what follows from them without any learning."""

    def __init__(self) -> None:
        self.maze = Maze()
        self.model = self.maze.model()
        self.Q_star = value_iteration(self.model, gamma=GAMMA, tolerance=1e-10, progress=False).Q
        self.optimal = optimal_actions(self.Q_star)
        self.reachable = self.maze.reachable_states()
        self.visitable = self.reachable & ~self.model.terminal
        self.entries = int(self.visitable.sum()) * self.model.n_actions
        self.start_norm = float(np.linalg.norm(self.Q_star))
        self.plateau = float(np.linalg.norm(self.Q_star[~self.reachable]))
        self.optimum = float(self.Q_star[self.maze.state(*self.maze.start)].max())

    def stakes(self) -> np.ndarray:
        """By how much the best action beats the second best, for each visitable state."""
        ordered = np.sort(self.Q_star[self.visitable], axis=1)
        return ordered[:, -1] - ordered[:, -2]

    def wrong(self, Q: np.ndarray) -> np.ndarray:
        """Whether the greedy action of each visitable state is wrong; Q of shape (seeds, S, A)."""
        best = self.optimal[self.visitable]
        values = Q[:, self.visitable]
        greedy = values >= values.max(axis=2, keepdims=True)
        return (greedy & ~best).any(axis=2)

    def unreachable(self) -> pd.DataFrame:
        """Where the plateau comes from: the sum of squares of Q* over the unreachable states."""
        rows = []
        for letter, (row, column) in self.maze.flag_cells.items():
            without = [flags for flags in self.maze.flag_sets if letter not in flags]
            states = [self.maze.state(row, column, flags) for flags in without]
            assert not self.reachable[states].any()
            rows.append(
                {
                    "standing on": f"flag {letter} (row {row}, column {column})",
                    "holding": ", ".join(flags or "none" for flags in without),
                    "states": len(states),
                    "sum of squares": (self.Q_star[states] ** 2).sum(),
                }
            )
        table = pd.DataFrame(rows)
        total = table[["states", "sum of squares"]].sum()
        return pd.concat(
            [table, pd.DataFrame([{"standing on": "all", "holding": "", **total}])],
            ignore_index=True,
        ).astype({"states": int})

    def noise(self, step_size: float, exploitation: float) -> float:
        """Predict the root mean square that a constant step size leaves of ||Q - Q*||.

        For the visitable entries. Near Q* an update moves an entry by a share alpha of its own
        surprise (variance s2, from the model) and of the errors of the entries it looks at, so the
        errors' covariance C settles where

            D (I - gamma P) C + C (I - gamma P)^T D = 2 alpha / (2 - alpha) D diag(s2),

        with P the transitions from entry to greedy entry and D the visits an episode. The answer is
        the root of the trace of C. Exact as alpha goes to 0.
        """
        mdp, pairs = self.model, np.arange(self.Q_star.size).reshape(self.Q_star.shape)
        greedy = self.Q_star.argmax(axis=1)
        targets = mdp.reward + GAMMA * self.Q_star.max(axis=1)[mdp.successor]
        mean = (mdp.probability * targets).sum(axis=2, keepdims=True)
        variance = (mdp.probability * (targets - mean) ** 2).sum(axis=2)
        P = np.zeros((pairs.size, pairs.size))
        following = np.take_along_axis(pairs, greedy[:, None], axis=1)[:, 0][mdp.successor]
        np.add.at(P, (pairs[:, :, None], following), mdp.probability)
        keep = np.repeat(self.visitable, mdp.n_actions)
        P = P[np.ix_(keep, keep)]  # what is left out ends the episode
        rate = self.visits_an_episode(1 - exploitation).ravel()[keep]
        drift = rate[:, None] * (np.eye(len(P)) - GAMMA * P)
        strength = 2 * step_size / (2 - step_size) * rate * variance.ravel()[keep]
        return float(np.sqrt(np.trace(solve_continuous_lyapunov(drift, np.diag(strength)))))

    def visits_an_episode(self, epsilon: float) -> np.ndarray:
        """Expected visits of each entry in an episode, epsilon-greedy on Q*."""
        mdp, states = self.model, np.arange(self.model.n_states)
        policy = np.full(self.Q_star.shape, epsilon / mdp.n_actions)
        policy[states, self.Q_star.argmax(axis=1)] += 1 - epsilon
        moves = np.zeros((mdp.n_states, mdp.n_states))
        np.add.at(
            moves, (states[:, None, None], mdp.successor), policy[:, :, None] * mdp.probability
        )
        moves[mdp.terminal] = 0
        start = np.bincount(mdp.start_state, mdp.start_probability, minlength=mdp.n_states)
        return np.linalg.solve(np.eye(mdp.n_states) - moves.T, start)[:, None] * policy

    def split(self, Q: np.ndarray, visits: np.ndarray, step_size: float) -> dict[str, np.ndarray]:
        """Split ||Q - Q*||^2 by how often an entry was visited; the parts add up exactly.

        Q and visits have shape (..., S, A). An entry counts as rarely visited while its starting
        value 0 still has a weight (1 - alpha)^n above `REMEMBERED`.
        """
        squares = (Q - self.Q_star) ** 2
        enough = np.log(REMEMBERED) / np.log(1 - step_size)
        can = self.visitable[:, None]
        parts = {
            "cannot be visited": ~can & (visits == 0),
            "never visited": can & (visits == 0),
            "rarely visited": can & (visits > 0) & (visits < enough),
            "often visited: noise": can & (visits >= enough),
        }
        return {name: (squares * part).sum(axis=(-2, -1)) for name, part in parts.items()}


def faulty_weights(world: World) -> pd.DataFrame:
    """What the faulty formula makes of some rows of action values."""
    maze, row = world.maze, []
    places = {
        "S, Q = 0": np.zeros(4),
        "S, Q = Q*": world.Q_star[maze.state(*maze.start)],
        "below G, Q = Q*": world.Q_star[maze.state(1, 4, "ABC")],
    }
    for place, q in places.items():
        with np.errstate(divide="ignore"):
            weights = np.exp(q) / q.sum()
        proper = np.exp(q) / np.exp(q).sum()
        for rule, each in (("faulty", weights), ("softmax", proper)):
            shown = dict(zip(("up", "down", "left", "right"), each, strict=True))
            row.append({"state": place, "rule": rule, **shown, "sum": each.sum()})
    return pd.DataFrame(row)
