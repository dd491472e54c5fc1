"""What a training run returns, whatever the algorithm."""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd


@dataclass(frozen=True)
class Failure:
    """A seed that could not go on.

    Attributes
    ----------
    seed : int
        The seed that stopped.
    episode : int
        The episode (counted from 1) in which it stopped.
    reason : str
        What was found, in words.
    """

    seed: int
    episode: int
    reason: str


@dataclass(frozen=True)
class Run:
    """The outcome of training one or more seeds of one arm.

    Attributes
    ----------
    table : pandas.DataFrame
        One row an episode. Learners write at least the columns `seed`, `episode` (from 1), `steps`,
        `return` (undiscounted), `terminated` (false: stopped by a cap) and `env_steps` (environment
        steps of that seed so far, this episode included).
    arrays : dict of str to numpy.ndarray
        What was learned, for example the weights; the first axis is the seed, in the order of
        the seeds asked for.
    failures : tuple of Failure
        Seeds that diverged. Their rows up to the failure stay in `table`.
    """

    table: pd.DataFrame
    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    failures: tuple[Failure, ...] = ()
