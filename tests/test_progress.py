"""Progress is drawn while work goes on, and suits where it is drawn."""

import io
import json
import os
import pty
import re
import select
import subprocess
import sys
import termios
import time
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient
from toy_learner import ToyConfig, learn

import rl_core
from rl_core import progress
from rl_core.experiments import Arm, run
from rl_core.experiments.progress import ArmProgress, Bars, Log, Reporter, watching

TESTS = Path(__file__).parent


class Recorder:
    """A display that remembers."""

    def __init__(self):
        self.drawn, self.seconds, self.closed = [], [], False

    def draw(self, arms):
        """Remember the state."""
        self.seconds += [arm.seconds for arm in arms]
        self.drawn.append([(arm.name, arm.episodes, arm.total, arm.env_steps) for arm in arms])

    def close(self):
        """Remember that it is over."""
        self.closed = True


@pytest.fixture
def recorder(monkeypatch):
    """Draw on a display that remembers, often."""
    recorder = Recorder()
    monkeypatch.setattr(progress, "display", lambda: recorder)
    monkeypatch.setattr(progress, "DRAW_SECONDS", 0.01)
    monkeypatch.setattr(progress, "WRITE_SECONDS", 0.0)
    return recorder


def test_a_reporter_writes_a_few_times_a_second(tmp_path, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    report = Reporter(tmp_path / "0.json")
    written = []
    for call in range(1000):  # ten seconds
        report(call, 7 * call)
        written.append((tmp_path / "0.json").read_text())
        now[0] += 0.01
    assert written[0] == "[0, 0]"
    assert 30 <= len(set(written)) <= 50
    report.finish(1000, 7000)
    assert json.loads((tmp_path / "0.json").read_text()) == [1000, 7000]
    assert os.listdir(tmp_path) == ["0.json"]


def test_a_reporter_without_a_disk_is_silent(tmp_path):
    Reporter(tmp_path / "gone" / "0.json")(1, 2)


def test_the_files_of_an_arm_are_summed(tmp_path, recorder):
    units = {
        "a": {tmp_path / "0.json": 50, tmp_path / "1.json": 30},
        "b": {tmp_path / "2.json": 10},
    }
    (tmp_path / "9.json").write_text("[1000, 1000]")  # nobody's, left by someone
    with watching(units, tmp_path, show=True):
        time.sleep(0.05)
        Reporter(tmp_path / "0.json")(5, 100)
        time.sleep(0.2)
        Reporter(tmp_path / "1.json")(3, 20)
        (tmp_path / "2.json").write_text("[3,")  # half a file
    assert recorder.closed
    assert recorder.drawn[0] == []
    assert [("a", 5, 80, 100)] in recorder.drawn
    assert recorder.drawn[-1] == [("a", 8, 80, 120)]
    assert recorder.seconds[0] > 0  # it began before it was first seen
    assert recorder.seconds == sorted(recorder.seconds)


def test_nothing_is_drawn_when_not_asked_for(tmp_path, recorder):
    with watching({"a": {tmp_path / "0.json": 5}}, tmp_path, show=False):
        Reporter(tmp_path / "0.json")(5, 100)
    assert recorder.drawn == []


def test_an_error_ends_the_drawing(tmp_path, recorder):
    with pytest.raises(KeyboardInterrupt), watching({}, tmp_path, show=True):
        raise KeyboardInterrupt
    assert recorder.closed


@pytest.mark.parametrize("workers", [1, 2])
def test_an_experiment_is_drawn_while_it_runs(tmp_path, recorder, workers):
    arms = [
        Arm(name, learn, "toy", ToyConfig(seconds=0.005), 40 + i) for i, name in enumerate("ab")
    ]
    run(arms, seeds=range(4), store=tmp_path, workers=workers, block=2)
    states = [state for drawn in recorder.drawn for state in drawn if state[0] == "a"]
    between = {episodes for _, episodes, _, _ in states if 0 < episodes < 160}
    # Workers write several times a second, so that something is seen before a block ends.
    assert len(between - {80}) >= 1
    assert sorted(state[:3] for state in recorder.drawn[-1]) == [("a", 160, 160), ("b", 164, 164)]
    drawn = len(recorder.drawn)
    run(arms, seeds=range(4), store=tmp_path, workers=workers, block=2)
    assert len(recorder.drawn) == drawn  # all was stored: nothing to draw


def test_time_left_and_speed():
    arm = ArmProgress("a", total=100, episodes=20, env_steps=5000, seconds=10.0)
    assert arm.steps_per_second == 500
    assert arm.seconds_left == 40
    assert arm.line() == "a: 20 of 100 episodes, 500 steps/s, 00:40 left"
    assert ArmProgress("a", 100).line() == "a: 0 of 100 episodes, 0 steps/s, ? left"


def test_a_log_gets_a_line_every_half_minute(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    log = Log()
    for tenth in range(1200):  # two minutes
        now[0] = tenth / 10
        log.draw([ArmProgress("a", 100, 20, 5000, 10.0), ArmProgress("done", 5, 5, 9, 1.0)])
    log.close()
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["a: 20 of 100 episodes, 500 steps/s, 00:40 left"] * 3


def test_bars_show_episodes_speed_and_time_left(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    bars = Bars()
    arm = ArmProgress("gamma 0.9", 100, 0, 0, 0.0)
    bars.draw([arm])
    time.sleep(0.15)
    arm.episodes, arm.env_steps, arm.seconds = 25, 5000, 10.0
    bars.draw([arm])
    bars.close()
    last = stream.getvalue().split("\r")[-1]
    assert re.search(
        r"gamma 0.9:  25%\|.*25/100 \[00:00<00:\d\d, .*episodes/s, 500 steps/s\]", last
    )


PROGRAM = """
import sys
import rl_core.experiments.progress
import toy_experiment
rl_core.experiments.progress.DRAW_SECONDS = 0.05
toy_experiment.main(*sys.argv[1:])
"""


def test_a_terminal_gets_bars(tmp_path):
    """The whole program, on a terminal."""
    terminal, end = pty.openpty()
    termios.tcsetwinsize(terminal, (24, 100))
    path = os.pathsep.join([str(TESTS), str(Path(rl_core.__file__).parents[1])])
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "toy", str(tmp_path), "1"],
        env={**os.environ, "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        stderr=end,
    ) as process:
        os.close(end)
        drawn = b""
        while process.poll() is None or select.select([terminal], [], [], 0)[0]:
            try:
                drawn += os.read(terminal, 1000)
            except OSError:  # Linux: the other side was closed
                break
    os.close(terminal)
    assert process.returncode == 0, drawn.decode()
    text = drawn.decode()
    for arm in ("step 0.1", "step 0.5"):
        assert f"{arm}: 100%" in text
        assert re.search(rf"{arm}:\s+[1-9]\d?%", text)  # and on the way
    assert "150/150" in text
    assert "steps/s" in text


NOTEBOOK = """
from pathlib import Path
import rl_core.experiments.progress
rl_core.experiments.progress.DRAW_SECONDS = 0.05
from rl_core.experiments import Arm, run
from toy_learner import ToyConfig, learn
arms = [Arm("a", learn, "toy", ToyConfig(seconds=0.02), 30)]
print(len(run(arms, seeds=range(2), store={store!r}, workers=1, block=1).table))
"""


def test_a_notebook_shows_it_in_place_and_keeps_none_of_it(tmp_path, monkeypatch):
    path = os.pathsep.join([str(TESTS), str(Path(rl_core.__file__).parents[1])])
    monkeypatch.setenv("PYTHONPATH", path)
    cell = nbformat.v4.new_code_cell(NOTEBOOK.format(store=str(tmp_path)))
    notebook = nbformat.v4.new_notebook(cells=[cell])
    shown = []

    class Client(NotebookClient):
        def process_message(self, message, *arguments):
            if message["msg_type"] == "update_display_data":
                shown.append(message["content"]["data"])
            return super().process_message(message, *arguments)

    Client(notebook, kernel_name="python3", timeout=60).execute()
    assert any(re.match(r"a: [1-9]\d* of 60 episodes, .* steps/s, .* left", d["text/plain"])
               for d in shown)  # fmt: skip
    displays = [o for o in cell.outputs if o.output_type == "display_data"]
    assert [dict(output.data) for output in displays] == [{"text/html": "", "text/plain": ""}]
    streams = [(o.name, o.text) for o in cell.outputs if o.output_type == "stream"]
    assert streams == [("stdout", "60\n")]
