"""Experiments: arms x seeds -> one tidy table, through a store of results.

arms = [Arm(name, algorithm, env, config, episodes), ...]
results = run(arms, seeds=range(30), store=folder)
results.table, results.arrays(name), results.failures, results.provenance
"""

from rl_core.experiments.arms import Arm
from rl_core.experiments.runner import DamagedResultWarning, Results, run

__all__ = ["Arm", "DamagedResultWarning", "Results", "run"]
