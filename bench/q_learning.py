"""Q-learning on the course's Maze: microseconds a step against the usual loop over Gymnasium."""

from collections.abc import Callable

import gymnasium as gym
import numpy as np

from bench.table import comparison, in_turns, processor_seconds
from rl_core.exploration import EpsilonGreedy
from rl_core.maze import Maze
from rl_core.planning import value_iteration
from rl_core.q_learning import QLearningConfig, q_learning

GAMMA, STEP_SIZE, EPSILON = 0.9, 0.2, 0.9  # figure 9
UNIT = "processor µs a step"
RIVALS = {"usual": "usual loop over gym.make(...)", "bare": "usual loop over Maze()"}


def usual_loop(env: gym.Env, episodes: int, seed: int) -> int:
    """Q-learning as it is usually written; returns the number of steps."""
    rng = np.random.default_rng(seed)
    Q = np.zeros((env.observation_space.n, env.action_space.n))
    steps = 0
    s, _ = env.reset(seed=seed)
    for _ in range(episodes):
        terminated = False
        while not terminated:
            if rng.random() < EPSILON:
                a = int(rng.integers(4))
            else:
                a = int(rng.choice(np.flatnonzero(Q[s] == Q[s].max())))
            s_next, r, terminated, _, _ = env.step(a)
            Q[s, a] += STEP_SIZE * (r + GAMMA * Q[s_next].max() * (not terminated) - Q[s, a])
            s = s_next
            steps += 1
        s, _ = env.reset()
    return steps


def ours(env: object, episodes: int, seed: int, Q_star: np.ndarray | None = None) -> int:
    """The same with `q_learning`; returns the number of steps."""
    config = QLearningConfig(gamma=GAMMA, step_size=STEP_SIZE, exploration=EpsilonGreedy(EPSILON))
    run = q_learning(env, config, episodes=episodes, seeds=[seed], Q_star=Q_star)
    return int(run.table["steps"].sum())


def rows() -> list[dict]:
    """Measure; the rivals take turns."""
    model = Maze().model()
    Q_star = value_iteration(model, gamma=GAMMA, tolerance=1e-10, progress=False).Q
    ways = {
        "usual": lambda seed: usual_loop(gym.make("rl_core/Maze-v0"), 200, seed),
        "bare": lambda seed: usual_loop(Maze(), 200, seed),
        "plain": lambda seed: ours(Maze(), 200, seed),
        "compiled": lambda seed: ours(model, 5000, seed),
        "measured": lambda seed: ours(model, 5000, seed, Q_star),
    }
    for way in ways.values():
        way(0)  # compile
    measured = {
        name: lambda turn, way=way: _microseconds(way, turn + 1) for name, way in ways.items()
    }
    costs = in_turns(measured, "Q-learning on the Maze")
    pairs = (
        ("usual", "compiled", "nothing recorded, one core"),
        ("usual", "measured", "the same; ours measures Q against Q* after every episode"),
        ("bare", "compiled", "the rival without Gymnasium's checks"),
        ("bare", "plain", "both in plain Python: q_learning on an environment without a model"),
    )
    return [
        comparison(
            f"Q-learning on the Maze, {mine}", RIVALS[other], costs[other], costs[mine], UNIT, note
        )
        for other, mine, note in pairs
    ]


def _microseconds(way: Callable[[int], int], seed: int) -> float:
    steps = []
    return processor_seconds(lambda: steps.append(way(seed))) / steps[0] * 1e6


if __name__ == "__main__":
    for row in rows():
        print(row)
