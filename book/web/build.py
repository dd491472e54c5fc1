"""Build the site into `_build`: `python build.py`, with fewer seeds if `SEEDS` is set.

`python build.py --only 03_reinforce ...` executes and builds a few pages alone.
"""

import argparse
import csv
import os
import shutil
import sys
from math import ceil
from pathlib import Path

import pictures
from stamp import run

ROOT = Path(__file__).parents[2]
FULL = 30
STRICT = ("--warningiserror", "--nitpick", "--keep-going")


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


def copied(folder: Path, *, preview: bool, only: list[str]) -> Path:
    """Copy the sources, perhaps only a few pages of them, beside a link to the results.

    The tables that a preview writes stay with it; what it runs is kept in the one store, where the
    book finds it again.
    """
    shutil.rmtree(folder, ignore_errors=True)
    for name in ("_config.yml", "_toc.yml"):
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder)
    shutil.copytree(ROOT / "book", folder / "book")
    if only:
        root, *others = only
        chapters = ["chapters:"] * bool(others) + [f"  - file: book/{name}" for name in others]
        toc = "\n".join(["format: jb-book", f"root: book/{root}", *chapters])
        (folder / "_toc.yml").write_text(toc, encoding="utf-8")
    part = Path("results/store") if preview else Path("results")
    (ROOT / part).mkdir(parents=True, exist_ok=True)
    (folder / part).parent.mkdir(exist_ok=True)
    (folder / part).symlink_to(ROOT / part, target_is_directory=True)
    return folder


def build(seeds: int, only: list[str]) -> int:
    """Execute and build; return an exit code.

    Always from nothing: an incremental build passes over warnings in pages that it does not read
    again. Pages built alone may have links that lead nowhere, so warnings are let pass there.
    """
    source = target = ROOT
    if only:
        target = ROOT / "_build" / "chapter"
        shutil.rmtree(target, ignore_errors=True)
    else:
        announce(seeds)
        shutil.rmtree(ROOT / "_build", ignore_errors=True)
    if only or seeds != FULL:
        source = copied(target / "_build" / "source", preview=seeds != FULL, only=only)
    command = ["jupyter-book", "build", str(source), "--path-output", str(target)]
    code = run(command if only else [*command, *STRICT])
    lost = [] if code else pictures.missing(source / "book", target / "_build" / "html" / "book")
    print("\n".join(lost), file=sys.stderr)
    if only and not code:
        print(f"The page is at file://{target}/_build/html/book/{only[0]}.html")
    return code or len(lost)


def main() -> int:
    """Read the command line and build."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", default=[], help="pages, such as 03_reinforce")
    only = parser.parse_args().only
    try:
        return build(int(os.environ.get("SEEDS") or FULL), only)
    except KeyboardInterrupt:
        print("Interrupted; what is finished is kept. A first look: make book SEEDS=3", flush=True)
        return 130


if __name__ == "__main__":
    sys.exit(main())
