"""Odd arguments for all that is public: each is taken, or refused by name, and nothing hangs.

One argument at a time is replaced in a call that works (`campaign.py`). Two processes share the
calls; each tells what it is about to do, so that a hang and an abort have a name.
"""

import json
import os
import queue
import subprocess
import sys
import threading
from pathlib import Path

import campaign
import pytest

ROOT = Path(__file__).parent.parent
PROCESSES = 2
LEAST = 3_000
NAMELESS = 0.01  # share of the refusals that need not name the argument
COLD, PATIENCE = 600, 60  # seconds for a call that may compile, and for one that takes some ms
WORST = 3  # processes lost to hangs and aborts before a share is given up


def test_all_that_is_public_is_called_or_said_why_not():
    names = set(campaign.public())
    wanting = [
        name
        for name in sorted(names - set(campaign.CALLS))
        if not campaign.inside(name) and not campaign.takes_nothing(name)
    ]
    assert wanting == [], "give each a call that works in campaign.CALLS"
    assert set(campaign.CALLS) <= names
    assert not [name for name in campaign.CALLS if campaign.inside(name)]
    gone = [
        listed
        for listed in campaign.INSIDE
        if not any(f"{name}.".startswith(f"{listed}.") for name in names)
    ]
    assert gone == []


def test_every_argument_is_in_the_calls():
    for name, valid in campaign.CALLS.items():
        assert set(valid()) >= set(campaign.arguments(name)), name


class Share:
    """One process after the other, until all calls of a share are made."""

    def __init__(self, share: int, folder: Path, warm: threading.Event) -> None:
        self.share, self.folder = share, folder
        self.warm = warm  # the first compiles, the others find it done
        self.found: dict[int, str] = {}

    def work(self) -> None:
        """Make all calls of the share, in as many processes as it takes."""
        if self.share:
            self.warm.wait()
        first = 0
        try:
            for _ in range(WORST + 1):
                lost = self.go_on(first)
                if lost is None:
                    break
                first = lost + 1
        finally:
            self.warm.set()

    def go_on(self, first: int) -> int | None:
        """Make the calls from `first` on; return the one that ended it, None if all were made."""
        arguments = [str(self.share), str(PROCESSES), str(first)]
        errors = self.folder / f"errors{self.share}"
        with (
            errors.open("ab") as file,
            subprocess.Popen(
                [sys.executable, campaign.__file__, *arguments],
                stdout=subprocess.PIPE, stderr=file, cwd=self.folder,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (ROOT, ROOT / "tests")))},
            ) as process,
        ):  # fmt: skip
            lines: queue.Queue[bytes] = queue.Queue()
            threading.Thread(target=self.read, args=(process, lines), daemon=True).start()
            now, patience = -1, COLD
            while True:
                try:
                    line = lines.get(timeout=patience)
                except queue.Empty:
                    process.kill()
                    self.found[now] = "hangs"
                    return now
                if not line:
                    break
                if line == b"warmer\n":
                    continue
                patience = PATIENCE
                if line == b"warm\n":
                    self.warm.set()
                else:
                    now, *told = json.loads(line)
                    self.found[now] = told[0] if told else "the process ends"
        return now if self.found.get(now, "") == "the process ends" or process.returncode else None

    @staticmethod
    def read(process: "subprocess.Popen[bytes]", lines: "queue.Queue[bytes]") -> None:
        """Put the lines of a process into a queue, which can be waited for with a deadline."""
        for line in process.stdout:
            lines.put(line)
        lines.put(b"")


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory):
    """What came of every call, by what was called."""
    warm = threading.Event()
    shares = [Share(i, tmp_path_factory.mktemp(f"share{i}"), warm) for i in range(PROCESSES)]
    threads = [threading.Thread(target=share.work) for share in shares]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    found = {number: told for share in shares for number, told in share.found.items()}
    return {
        "{}({}={})".format(*call): found.get(number, "was not called")
        for number, call in enumerate(campaign.plan())
    }


def shown(lines):
    return "\n".join([f"{len(lines)} of them", *lines[:80]])


def test_nothing_hangs_aborts_or_raises_something_unrelated(outcomes):
    assert len(outcomes) >= LEAST
    bad = [
        f"{call}: {told}"
        for call, told in outcomes.items()
        if told not in ("taken", "named") and not told.startswith("nameless")
    ]
    assert not bad, shown(bad)


def test_refusals_name_the_argument(outcomes):
    nameless = [f"{call}: {told}" for call, told in outcomes.items() if told.startswith("nameless")]
    refused = sum(told == "named" for told in outcomes.values()) + len(nameless)
    assert refused >= LEAST / 2
    assert len(nameless) <= NAMELESS * refused, shown(nameless)
