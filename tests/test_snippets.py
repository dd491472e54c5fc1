"""What is shown to be pasted runs as it stands, imports included; docstrings: `conftest.py`."""

import os
import re
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

ROOT = Path(__file__).parent.parent
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(path):
    return BLOCK.findall(path.read_text())


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """An empty folder to work in, from which the package alone is found."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_the_readme_s_snippets_run_one_after_the_other(elsewhere, capsys):
    assert len(blocks(ROOT / "README.md")) >= 3
    for code in blocks(ROOT / "README.md"):
        exec(compile(code, "README.md", "exec"), {"__name__": "__main__"})
    assert (elsewhere / "cartpole.mp4").read_bytes()[4:8] == b"ftyp"
    assert (elsewhere / "cartpole.csv").stat().st_size > 1_000


def test_the_contributors_snippets_run(elsewhere):
    for code in blocks(ROOT / "CONTRIBUTING.md"):
        exec(compile(code, "CONTRIBUTING.md", "exec"), {"__name__": "__main__"})


# What other libraries ask for, held to them where they are installed, else to their shapes


def interval_estimates(scores, aggregate, reps):
    """As `rliable.library.get_interval_estimates` takes it: runs by tasks, for each algorithm."""
    assert all(matrix.ndim == 2 for matrix in scores.values())
    points = {name: aggregate(matrix) for name, matrix in scores.items()}
    return points, {name: np.stack([value, value]) for name, value in points.items()}


class EpisodeBuffer(SimpleNamespace):
    """As `minari.data_collector.EpisodeBuffer` is made: arrays by name."""


def create_dataset(dataset_id, buffer, env):
    """Check an episode as `minari.create_dataset_from_buffers` does: lengths and spaces."""
    assert re.fullmatch(r"(\w+/)*\w+-v\d+", dataset_id)
    for episode in buffer:
        steps = len(episode.rewards)
        assert len(episode.observations) == steps + 1
        assert steps == len(episode.actions) == len(episode.terminations)
        assert steps == len(episode.truncations)
        assert all(one in env.observation_space for one in episode.observations)
        assert all(one in env.action_space for one in episode.actions)
        assert (episode.terminations | episode.truncations).sum() == 1


def stubs():
    rliable, library = ModuleType("rliable"), ModuleType("rliable.library")
    rliable.library, library.get_interval_estimates = library, interval_estimates
    minari, collector = ModuleType("minari"), ModuleType("minari.data_collector")
    minari.create_dataset_from_buffers, collector.EpisodeBuffer = create_dataset, EpisodeBuffer
    return {
        "rliable": rliable,
        "rliable.library": library,
        "minari": minari,
        "minari.data_collector": collector,
    }


def chapter(name):
    """The cells between a heading of chapter 7 and the next one: code, and what is shown only."""
    text = (ROOT / "book/07_take_it_from_here.py").read_text()
    part = text.partition(f"# ## {name}\n")[2].partition("\n# ## ")[0]
    shown = re.sub(r"^# ?", "", part, flags=re.MULTILINE)
    cells = re.findall(r"^# %%\n(.*?)(?=^# %%)", part + "\n# %%", re.MULTILINE | re.DOTALL)
    return cells, BLOCK.findall(shown)


@pytest.mark.filterwarnings("ignore")  # what other libraries say of themselves
@pytest.mark.parametrize("real", ["neither", "rliable", "minari"])
def test_results_travel(real, elsewhere, monkeypatch):
    """To CSV, to rliable's matrices and to a data set of Minari's, in ten lines each."""
    import pandas as pd

    import rl_core.dqn
    from examples.room import Room
    from examples.room_task import FastRoom
    from rl_core.evaluation import rollout
    from rl_core.experiments import Arm, run

    if real != "neither":
        pytest.importorskip(real)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(elsewhere))
    for name, stub in stubs().items():
        if name.partition(".")[0] != real:
            monkeypatch.setitem(sys.modules, name, stub)
    config = rl_core.dqn.DQNConfig(learning_starts=100)
    arms = [Arm(name, rl_core.dqn.dqn, FastRoom, config, 2) for name in ("one", "two")]
    results = run(arms, seeds=[0, 1], store=elsewhere / "store", workers=1, progress=False)
    names = {"np": np, "pd": pd, "Path": Path, "tempfile": __import__("tempfile")}
    names |= {"results": results, "rollout": rollout, "FastRoom": FastRoom, "Room": Room}
    names["trained"] = results.arm("one").agent(0)
    cells, shown = chapter("Taking results elsewhere")
    assert len(cells) == len(shown) == 2
    for cell, block in zip(cells, shown, strict=True):
        assert len(block.strip().splitlines()) <= 10
        exec(cell, names)
        exec(block, names)
    assert set(names["estimates"]) == {"one", "two"}
    assert {matrix.shape for matrix in names["matrices"].values()} == {(2, 1)}
    assert os.listdir(elsewhere)
