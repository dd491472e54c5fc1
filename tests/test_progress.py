"""Progress is drawn while work goes on, and suits where it is drawn."""

import os
import pty
import re
import select
import subprocess
import sys
import termios
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from toy_learner import ToyConfig, learn

import rl_core
from rl_core.experiments import Arm, progress, run
from rl_core.experiments.progress import Progress

TESTS = Path(__file__).parent
PATH = os.pathsep.join([str(TESTS), str(Path(rl_core.__file__).parents[1])])
LINE = r"a: 2 of 3:  50% of 4 seeds, [\d,]+ steps/s, 00:\d\d left"


def test_a_log_gets_a_line_now_and_then(monkeypatch, capsys):
    monkeypatch.setattr(progress, "LOG_SECONDS", 0.0)
    with Progress({"a": 3, "b": 1}) as shown:
        for _ in range(2):
            shown.done("a", env_steps=1000)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert re.fullmatch(LINE, lines[-1])


def test_a_log_is_not_flooded(capsys):
    with Progress({"a": 1000}) as shown:
        for _ in range(1000):
            shown.done("a", env_steps=1)
    assert len(capsys.readouterr().err.splitlines()) == 1  # that it began; the rest took no time


def test_nothing_is_drawn_when_not_asked_for(capsys):
    with Progress({"a": 1}, show=False) as shown:
        shown.done("a", env_steps=1)
    assert capsys.readouterr().err == ""


def test_nothing_is_drawn_when_all_is_stored(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(progress, "LOG_SECONDS", 0.0)
    arms = [Arm("a", learn, "CartPole-v1", ToyConfig(), 5)]
    run(arms, seeds=range(2), store=tmp_path, workers=1)
    assert "a: 2 of 2" in capsys.readouterr().err
    run(arms, seeds=range(2), store=tmp_path, workers=1)
    assert capsys.readouterr().err == ""


PROGRAM = """
import sys
import rl_core.experiments.progress, toy_experiment
rl_core.experiments.progress.DRAW_SECONDS = 0.0
toy_experiment.main(*sys.argv[1:])
"""


def test_a_terminal_gets_a_bar(tmp_path):
    """The whole program, on a terminal."""
    terminal, end = pty.openpty()
    termios.tcsetwinsize(terminal, (24, 100))
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "toy", str(tmp_path), "1"],
        env={**os.environ, "PYTHONPATH": PATH},
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
    assert re.search(r"step 0.1: 3 of 6:\s+25%\|.*\| 3/12 \[.*<.*steps/s\]", text)
    assert "12/12" in text


NOTEBOOK = """
import rl_core.experiments.progress
rl_core.experiments.progress.DRAW_SECONDS = 0.0
from rl_core.experiments import Arm, run
from toy_learner import ToyConfig, learn
arms = [Arm("a", learn, "CartPole-v1", ToyConfig(seconds=0.01), 30)]
print(len(run(arms, seeds=range(2), store={store!r}, workers=1).table))
"""


def test_a_notebook_shows_it_in_place_and_keeps_none_of_it(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", PATH)
    cell = nbformat.v4.new_code_cell(NOTEBOOK.format(store=str(tmp_path)))
    notebook = nbformat.v4.new_notebook(cells=[cell])
    shown = []

    class Client(NotebookClient):
        def process_message(self, message, *arguments):
            if message["msg_type"] == "update_display_data":
                shown.append(message["content"]["data"])
            return super().process_message(message, *arguments)

    Client(notebook, kernel_name="python3", timeout=60).execute()
    lines = [data["text/plain"] for data in shown]
    assert any(re.match(r"a: 1 of 2:  50% of 2 seeds, .* left", line) for line in lines), lines
    displays = [o for o in cell.outputs if o.output_type == "display_data"]
    assert [dict(output.data) for output in displays] == [{"text/html": "", "text/plain": ""}]
    streams = [(o.name, o.text) for o in cell.outputs if o.output_type == "stream"]
    assert streams == [("stdout", "60\n")]
