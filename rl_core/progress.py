"""Progress of an experiment: workers write small files, the main process reads and draws them.

Files reach across every kind of worker (processes, Dask on several machines) without a connection
to keep. Each unit of work writes one of its own, a few times a second; the reader sums them up by
arm. Nothing in here can influence a result.
"""

import contextlib
import importlib
import json
import os
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from tqdm import tqdm

WRITE_SECONDS = 0.25
DRAW_SECONDS = 0.5
LOG_SECONDS = 30.0


@dataclass
class Reporter:
    """The `progress` callable a learner gets: keeps a file up to date.

    Attributes
    ----------
    path : Path
        The file. A failing disk is ignored: progress is not worth a result.
    """

    path: Path
    _next_write: float = field(default=0.0, init=False)

    def __call__(self, episodes: int, env_steps: int) -> None:
        """Report the episodes and environment steps of the unit so far, over all its seeds."""
        now = time.monotonic()
        if now >= self._next_write:
            self._next_write = now + WRITE_SECONDS
            self._write(episodes, env_steps)

    def finish(self, episodes: int, env_steps: int) -> None:
        """Report that the unit is done."""
        self._write(episodes, env_steps)

    def _write(self, episodes: int, env_steps: int) -> None:
        partial = self.path.with_suffix(".partial")
        with contextlib.suppress(OSError):
            partial.write_text(json.dumps([int(episodes), int(env_steps)]))
            os.replace(partial, self.path)


@dataclass
class ArmProgress:
    """How far one arm is.

    Attributes
    ----------
    name : str
        The arm.
    total : int
        Episodes to do, over all its seeds.
    episodes, env_steps : int
        Episodes and environment steps done.
    seconds : float
        Time since the arm began.
    begun : float or None
        When it began, by the monotonic clock.
    """

    name: str
    total: int
    episodes: int = 0
    env_steps: int = 0
    seconds: float = 0.0
    begun: float | None = None

    @property
    def steps_per_second(self) -> float:
        """Environment steps per second, over all workers."""
        return self.env_steps / self.seconds if self.seconds > 0 else 0.0

    @property
    def seconds_left(self) -> float:
        """Time left if the remaining episodes take as long as those done; infinite if none is."""
        if self.episodes == 0:
            return float("inf")
        return self.seconds * (self.total - self.episodes) / self.episodes

    def line(self) -> str:
        """Return the state in one line of text.

        >>> ArmProgress("gamma 0.9", 60_000, 15_000, 2_400_000, 10.0).line()
        'gamma 0.9: 15,000 of 60,000 episodes, 240,000 steps/s, 00:30 left'
        """
        left = tqdm.format_interval(self.seconds_left) if self.episodes else "?"
        return (
            f"{self.name}: {self.episodes:,} of {self.total:,} episodes, "
            f"{self.steps_per_second:,.0f} steps/s, {left} left"
        )


class Display(Protocol):
    """Something that shows the arms that have begun."""

    def draw(self, arms: list[ArmProgress]) -> None:
        """Show the present state."""

    def close(self) -> None:
        """Show nothing more."""


class Bars:
    """One bar an arm, for a terminal."""

    def __init__(self) -> None:
        self._bars: dict[str, tqdm[None]] = {}

    def draw(self, arms: list[ArmProgress]) -> None:
        """Move the bars."""
        for arm in arms:
            if arm.name not in self._bars:
                self._bars[arm.name] = tqdm(
                    total=arm.total, desc=arm.name, unit=" episodes", file=sys.stderr, smoothing=0
                )
            bar = self._bars[arm.name]
            bar.set_postfix_str(f"{arm.steps_per_second:,.0f} steps/s", refresh=False)
            bar.update(arm.episodes - bar.n)
            if arm.episodes >= arm.total:
                bar.close()  # stops its clock; does nothing the second time

    def close(self) -> None:
        """Leave the bars as they stand."""
        for bar in self._bars.values():
            bar.close()


class Log:
    """A line an unfinished arm every half minute, for a file or a build's log."""

    def __init__(self) -> None:
        self._next_line = time.monotonic() + LOG_SECONDS

    def draw(self, arms: list[ArmProgress]) -> None:
        """Print the lines if it is time."""
        if time.monotonic() >= self._next_line:
            self._next_line = time.monotonic() + LOG_SECONDS
            for arm in arms:
                if arm.episodes < arm.total:
                    print(arm.line(), file=sys.stderr, flush=True)

    def close(self) -> None:
        """Print nothing more."""


class Cell:
    """A text that changes in place and goes away at the end, for a notebook."""

    def __init__(self) -> None:
        display = importlib.import_module("IPython.display").display
        self._handle = display({"text/plain": ""}, raw=True, display_id=True)

    def draw(self, arms: list[ArmProgress]) -> None:
        """Replace the text."""
        text = "\n".join(arm.line() for arm in arms if arm.episodes < arm.total)
        self._handle.update({"text/plain": text}, raw=True)

    def close(self) -> None:
        """Remove the text, so that a saved notebook does not depend on how long it took."""
        self._handle.update({"text/html": "", "text/plain": ""}, raw=True)


def display() -> Display:
    """Return the display that suits where this process writes."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    if getattr(shell, "kernel", None) is not None:
        return Cell()
    return Bars() if sys.stderr.isatty() else Log()


@contextlib.contextmanager
def watching(units: Mapping[str, Mapping[Path, int]], folder: Path, show: bool) -> Iterator[None]:
    """Draw the progress of `units` while the block runs.

    Parameters
    ----------
    units : mapping of str to (mapping of Path to int)
        For each arm, the files its units report to and the episodes of each.
    folder : Path
        The folder of these files; kept marked as in use.
    show : bool
        Whether to draw at all.
    """
    if not show:
        yield
        return
    screen = display()
    states = [ArmProgress(name, sum(files.values())) for name, files in units.items()]
    over = threading.Event()

    def look() -> None:
        last, looked = False, time.monotonic()
        while not last:
            last = over.wait(DRAW_SECONDS)
            now = time.monotonic()
            for state in states:
                _update(state, units[state.name], looked, now)
            looked = now
            screen.draw([state for state in states if state.begun is not None])
            with contextlib.suppress(OSError):
                os.utime(folder)

    thread = threading.Thread(target=look, name="progress", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        screen.close()


def _update(state: ArmProgress, files: Mapping[Path, int], looked: float, now: float) -> None:
    """Read the arm's files into `state`; `looked` is when this was done before."""
    reports = []
    for path in files:
        with contextlib.suppress(OSError, ValueError):
            reports.append(json.loads(path.read_text()))
    if not reports or state.episodes == state.total:
        return
    if state.begun is None:
        state.begun = looked  # it began between the two looks
    state.seconds = now - state.begun
    state.episodes = sum(episodes for episodes, _ in reports)
    state.env_steps = sum(env_steps for _, env_steps in reports)
