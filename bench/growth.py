"""How the cost grows with seeds, episodes, states and cores: every turn, for appendix B.

In processor time, but for the cores. REINFORCE trains on MountainCar, every episode stopped at 500
steps, so that each seed and each episode is the same work; value iteration plans random mazes with
three flags. What an experiment takes on several cores is told by the clock, on a machine left to
itself: the start of the workers and what they wait for included.
"""

import tempfile
import time
from collections.abc import Callable, Iterator

from bench.planning import maze_model
from bench.table import in_turns, processor_seconds
from rl_core.experiments import Arm, run
from rl_core.maze import Maze
from rl_core.planning import value_iteration
from rl_core.reinforce import ReinforceConfig, reinforce

TURNS = 5
SEEDS = (1, 2, 4, 8, 16, 32)  # 50 episodes each
EPISODES = (25, 50, 100, 200, 400, 800)  # of one seed
SIDES = (12, 40, 125, 395, 1250)  # of mazes: about 10³ to 10⁷ states
CORES = (1, 2)
EXPERIMENT = {"seeds": range(30), "episodes": 3_000}
CONFIG = ReinforceConfig(max_episode_steps=500)
FLAGS, GAMMA = 3, 0.99


def train(seeds: int, episodes: int) -> None:
    """Train so many seeds in this process."""
    reinforce("MountainCar-v0", CONFIG, episodes=episodes, seeds=range(1000, 1000 + seeds))


def on_cores(workers: int) -> float:
    """Seconds by the clock that an experiment takes on so many cores, with an empty store."""
    arm = Arm("growth", reinforce, "MountainCar-v0", CONFIG, episodes=EXPERIMENT["episodes"])
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        run([arm], seeds=EXPERIMENT["seeds"], store=folder, workers=workers, progress=False)
        return time.perf_counter() - start


def plan(side: int) -> tuple[int, Callable[[], object]]:
    """Return the number of states of a maze, and what plans it."""
    model = maze_model(side, FLAGS)
    return model.n_states, lambda: value_iteration(model, gamma=GAMMA, progress=False)


def rows() -> list[dict]:
    """Measure: a row a turn, with columns `what`, `size`, `turn` and `seconds`."""
    train(1, 1)  # compiles
    value_iteration(Maze().model(), gamma=GAMMA, progress=False)
    return [row for one in (_seeds, _episodes, _states, _cores) for row in one()]


def _seeds() -> Iterator[dict]:
    ways = {n: lambda _, n=n: processor_seconds(lambda: train(n, 50)) for n in SEEDS}
    yield from _told("seeds", in_turns(ways, "seeds", TURNS))


def _episodes() -> Iterator[dict]:
    ways = {n: lambda _, n=n: processor_seconds(lambda: train(1, n)) for n in EPISODES}
    yield from _told("episodes", in_turns(ways, "episodes", TURNS))


def _states() -> Iterator[dict]:
    """One maze after the other: the largest takes gigabytes."""
    for side in SIDES:
        states, work = plan(side)
        turns = TURNS if states < 5e6 else 3
        ways = {states: lambda _, work=work: processor_seconds(work)}
        yield from _told("states", in_turns(ways, f"{states} states", turns))


def _cores() -> Iterator[dict]:
    ways = {cores: lambda _, cores=cores: on_cores(cores) for cores in CORES}
    yield from _told("cores", in_turns(ways, "cores", TURNS))


def _told(what: str, measured: dict[int, list[float]]) -> Iterator[dict]:
    for size, costs in measured.items():
        for turn, cost in enumerate(costs):
            yield {"what": what, "size": size, "turn": turn, "seconds": float(f"{cost:.4g}")}


if __name__ == "__main__":
    for measured in rows():
        print(measured)
