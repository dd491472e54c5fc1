"""A tabular model as compiled code takes it."""

from typing import NamedTuple

import numpy as np

from rl_core.kernels.arrays import F64, I32, Bools


class Model(NamedTuple):
    """The arrays of an `rl_core.mdp.MDP`, described there; made by `MDP.arrays`."""

    successor: I32
    probability: F64
    reward: F64
    terminal: Bools
    start_state: I32
    start_probability: F64


NO_MODEL = Model(
    *(np.empty((0, 0, 0), np.int32), np.empty((0, 0, 0)), np.empty((0, 0, 0))),
    *(np.empty(0, np.bool_), np.empty(0, np.int32), np.empty(0)),
)
"""Stands for a model that is not known."""
