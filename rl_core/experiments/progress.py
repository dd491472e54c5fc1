"""Progress of an experiment: one line, redrawn whenever a seed is done.

It goes where this process writes: a bar on a terminal, a text that changes in place in a notebook,
a line every half minute in a log. Nothing in here can influence a result.
"""

import importlib
import sys
from collections import Counter
from collections.abc import Mapping
from contextlib import AbstractContextManager

from tqdm import tqdm

DRAW_SECONDS = 0.5
LOG_SECONDS = 30.0
FORMAT = "{desc}{percentage:3.0f}% of {total_fmt} seeds{postfix}, {remaining} left"


class Progress(AbstractContextManager["Progress"]):
    """Counts finished seeds and shows them.

    Parameters
    ----------
    seeds : mapping of str to int
        For each arm, how many seeds there are to do.
    show : bool
        Whether to draw at all.

    Examples
    --------
    >>> from rl_core.experiments.progress import Progress
    >>> with Progress({"plain": 30}, show=False) as progress:
    ...     progress.done("plain", env_steps=12_000)
    >>> progress.finished
    Counter({'plain': 1})
    """

    def __init__(self, seeds: Mapping[str, int], show: bool = True) -> None:
        self.finished: Counter[str] = Counter()
        self._seeds = dict(seeds)
        self._env_steps = 0
        self._screen = _screen() if show else None
        self._bar = tqdm(
            total=sum(seeds.values()),
            disable=not show,
            file=self._screen,
            mininterval=LOG_SECONDS if type(self._screen) is _Log else DRAW_SECONDS,
            bar_format=FORMAT if self._screen else None,
            dynamic_ncols=self._screen is None,
            leave=self._screen is None,
        )

    def done(self, arm: str, env_steps: int) -> None:
        """Count one more seed of `arm`, which took so many steps of the environment."""
        self.finished[arm] += 1
        self._env_steps += env_steps
        if self._bar.disable:
            return
        state = f"{arm}: {self.finished[arm]} of {self._seeds[arm]}"
        seconds = self._bar.format_dict["elapsed"]
        self._bar.set_description(state, refresh=False)
        self._bar.set_postfix_str(f"{self._env_steps / seconds:,.0f} steps/s", refresh=False)
        self._bar.update()

    def __exit__(self, *_: object) -> None:
        self._bar.close()
        if isinstance(self._screen, _Cell):
            self._screen.show("")  # a saved notebook does not depend on how long it took


class _Log:
    """Takes what tqdm draws and prints it as lines."""

    def write(self, text: str) -> None:
        if line := text.strip():
            self.show(line)

    def flush(self) -> None:
        """Lines are flushed as they are printed."""

    def show(self, line: str) -> None:
        print(line, file=sys.stderr, flush=True)


class _Cell(_Log):
    """Takes what tqdm draws and shows it in place in a notebook."""

    def __init__(self) -> None:
        display = importlib.import_module("IPython.display").display
        self._handle = display({"text/plain": ""}, raw=True, display_id=True)

    def show(self, line: str) -> None:
        shown = {"text/plain": line} if line else {"text/html": "", "text/plain": ""}
        self._handle.update(shown, raw=True)


def _screen() -> _Log | None:
    """Return what suits where this process writes; None: a terminal, which tqdm knows."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    if getattr(shell, "kernel", None) is not None:
        return _Cell()
    return None if sys.stderr.isatty() else _Log()
