"""Say what `make book` will do and how long it takes: `python announce.py`, with any Python.

It stands alone, so that it can be said before there is an environment.
"""

import csv
import os
from math import ceil
from pathlib import Path

ROOT = Path(__file__).parents[2]
FULL = 30


def minutes(cores: int, serial: float, parallel: float) -> int:
    """Return how long a build takes on so many cores, by Amdahl's law.

    Parameters
    ----------
    cores : int
        The cores that are free to use.
    serial, parallel : float
        Processor time that only one core can take on, and that all can share, in seconds.

    Examples
    --------
    >>> minutes(1, 600, 600), minutes(2, 600, 600), minutes(100, 600, 600)
    (20, 15, 11)
    """
    return ceil((serial + parallel / cores) / 60)


def expected(what: str, cores: int) -> int:
    """How many minutes a build took when it was last timed, for this number of cores."""
    with (ROOT / "book/data/timing.csv").open(encoding="utf-8") as file:
        row = next(row for row in csv.DictReader(file) if row["what"] == what)
    measured, seconds, busy = (float(row[key]) for key in ("cores", "seconds", "processor_seconds"))
    serial = (measured * seconds - busy) / (measured - 1)
    return minutes(cores, serial, busy - serial)


def announce(seeds: int) -> None:
    """Say what comes, how long it takes, and how to see something sooner."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    what = "book" if seeds == FULL else "preview"
    print(
        f"Building the {what}: all notebooks with {seeds} seeds an arm, then the pages. On {cores} "
        f"core{'s' * (cores != 1)} about {expected(what, cores)} minutes from nothing; what is in "
        "results/store is not made again. Ctrl-C is safe: finished runs are kept.",
        flush=True,
    )
    if seeds == FULL:
        print(
            f"A preview takes {expected('preview', cores)} minutes: make book SEEDS=3", flush=True
        )


if __name__ == "__main__":
    announce(int(os.environ.get("SEEDS") or FULL))
