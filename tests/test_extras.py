"""What the package needs: the extras are not among it."""

import subprocess
import sys

BLOCKED = ("dask", "distributed", "imageio_ffmpeg", "IPython", "matplotlib", "pygame")
TRAIN = """
from rl_core import evaluation, experiments, mdp, planning, q_learning
from rl_core.dqn import DQNConfig
from rl_core.maze import Maze
from rl_core.reinforce import ReinforceConfig, reinforce
planning.value_iteration(Maze().model(), gamma=0.9)
print(len(reinforce("CartPole-v1", ReinforceConfig(), episodes=3, seeds=range(2)).table))
"""


def test_it_trains_without_the_extras():
    code = f"import sys; sys.modules.update(dict.fromkeys({BLOCKED})); {TRAIN}"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "6"
