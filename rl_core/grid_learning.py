"""Q-learning on a continuous world through a grid, as one algorithm to compare with the networks.

It is `rl_core.q_learning` on `rl_core.discretise`, nothing else:

    Q(c, a) <- 0 for all cells c and actions a
    c <- cell of the observed state; from here on as in a discrete world
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from rl_core import dynamics
from rl_core.discretise import Binned, Discretised, binned
from rl_core.policies import is_integer, require
from rl_core.q_learning import QLearningConfig, q_learning
from rl_core.training import Run


@dataclass(frozen=True)
class GridConfig:
    """What tabular Q-learning on a continuous world is run with.

    Attributes
    ----------
    bins : int or tuple of int
        Bins of every observed number, or of each.
    levels : int or None
        Levels of each component of a continuous action; None where actions are discrete.
    learning : QLearningConfig
        Everything else.

    Raises
    ------
    TypeError, ValueError
        An attribute is not as described.

    Examples
    --------
    >>> GridConfig(bins=20).levels is None
    True
    """

    bins: int | tuple[int, ...]
    levels: int | None = None
    learning: QLearningConfig = field(default_factory=QLearningConfig)

    def __post_init__(self) -> None:
        numbers = self.bins if isinstance(self.bins, tuple) else (self.bins,)
        valid = len(numbers) > 0 and all(is_integer(n, 1) for n in numbers)
        require(valid, "bins", self.bins, "a positive integer or a tuple of them")
        valid = self.levels is None or is_integer(self.levels, 2)
        require(valid, "levels", self.levels, "an integer from 2, or None")
        if not isinstance(self.learning, QLearningConfig):
            raise TypeError(f"learning is {self.learning!r}; allowed is a QLearningConfig")


def check_q_learning_on_grid(env: str, config: GridConfig) -> None:
    """Raise what `q_learning_on_grid` would raise for a world and a configuration; run nothing.

    `rl_core.experiments.run` calls it for every arm before it begins with any.

    Raises
    ------
    TypeError, ValueError
        If `config` is no GridConfig, the environment unknown, or bins or levels not for its spaces.

    Examples
    --------
    >>> check_q_learning_on_grid("MountainCar-v0", GridConfig(bins=10))
    """
    world = _open(env, config)
    if isinstance(world, Discretised):
        world.close()


def q_learning_on_grid(
    env: str,
    config: GridConfig,
    *,
    episodes: int,
    seeds: Sequence[int],
    snapshots: Sequence[int] = (),
    progress: Callable[[int, int], None] | None = None,
) -> Run:
    """Learn a table of action values for the cells of a continuous world.

    Parameters
    ----------
    env : str
        A Gymnasium id. The tasks of `rl_core.dynamics` are played compiled and without time limit;
        any other goes through Gymnasium, with the limit it is registered with.
    config : GridConfig
    episodes, seeds, snapshots, progress
        As for `rl_core.q_learning.q_learning`.

    Returns
    -------
    Run
        As `q_learning` returns it; what needs the optimal values is NaN.

    Raises
    ------
    TypeError, ValueError
        An argument is not as described.

    Examples
    --------
    >>> config = GridConfig(bins=10, learning=QLearningConfig(gamma=0.99, max_steps=500))
    >>> q_learning_on_grid("MountainCar-v0", config, episodes=3, seeds=[0]).arrays["Q"].shape
    (1, 100, 3)
    """
    world = _open(env, config)
    try:
        return q_learning(
            world,
            config.learning,
            episodes=episodes,
            seeds=seeds,
            snapshots=snapshots,
            progress=progress,
        )
    finally:
        if isinstance(world, Discretised):
            world.close()


def _open(env: str, config: GridConfig) -> Binned | Discretised:
    """Make the world seen through the grid: compiled if it can be."""
    require(isinstance(env, str), "env", env, "a Gymnasium id")
    require(isinstance(config, GridConfig), "config", config, "a GridConfig")
    make = binned if env in dynamics.TASKS else Discretised
    return make(env, config.bins, levels=config.levels)
