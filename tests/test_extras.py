"""What the package needs: the extras are not among it."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

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


def test_what_is_imported_is_a_dependency():
    """Or an extra, imported where it is needed only."""
    root = Path(__file__).parent.parent
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    declared = {re.match(r"[\w-]+", one)[0].replace("-", "_") for one in project["dependencies"]}
    imported = set()
    for path in (root / "rl_core").rglob("*.py"):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.Import):
                imported |= {name.name.partition(".")[0] for name in node.names}
            elif isinstance(node, ast.ImportFrom):
                imported.add(node.module.partition(".")[0])
    others = imported - set(sys.stdlib_module_names) - {"rl_core"}
    assert {{"PIL": "pillow"}.get(name, name) for name in others} <= declared
