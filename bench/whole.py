"""`make timing`: what building and testing the whole takes, on a clean clone of the last commit.

Each step is a command of the Makefile, timed by the wall clock and by processor time. A step that
is done is kept in `results/timing/timing.csv`; after an interruption the same call goes on with the
next one. What the steps say goes to `results/timing/<step>.log`. It takes an hour or two; when all
is done the clone is removed and the table is `results/timing.csv`. `python -m bench.adopt` makes it
what the book shows and `make book` announces.
"""

import csv
import os
import resource
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from bench.__main__ import machine

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "results" / "timing"
COLUMNS = ("what", "cores", "seconds", "processor_seconds", "how", "machine", "date")
MINUTE = 60.0  # seconds between two signs of life


@dataclass(frozen=True)
class Step:
    """What is timed: a target of make, what is removed before, and how that is said."""

    what: str
    command: str
    how: str
    removed: tuple[str, ...] = ()  # of the clone; "kernels" is the machine code
    touched: bool = False  # whether all files get a new time


NOTHING = ("_build", "results", "kernels")
STEPS = (
    Step("setup", "make setup", "the environment, with its downloads", (".venv",)),
    Step("preview", "make book SEEDS=3", "nothing stored or compiled", NOTHING),
    Step("book", "make book", "nothing stored or compiled", NOTHING),
    Step("book, stored", "make book", "all runs stored", ("_build",)),
    Step("pdf", "make pdf", "the site is built"),
    Step("book, unchanged", "make book", "nothing changed but the files' times", touched=True),
    Step("pdf, unchanged", "make pdf", "nothing changed but the files' times", touched=True),
    Step("notebooks, stored", "make notebooks", "all runs stored"),
    Step("unit", "make unit", "all compiled"),
    Step("test", "make test", "nothing stored or compiled", NOTHING),
)


def clone() -> Path:
    """Return a clone of the last commit: the one that is there, or else a new one."""
    target, commit = FOLDER / "clone", _git("rev-parse", "HEAD")
    if _git("status", "--porcelain"):
        print("Measured is the last commit, without the changes that are not in it.", flush=True)
    if not target.exists() or _git("-C", str(target), "rev-parse", "HEAD") != commit:
        shutil.rmtree(FOLDER, ignore_errors=True)
        FOLDER.mkdir(parents=True)
        _git("clone", "--quiet", str(ROOT), str(target))
        _git("-C", str(target), "checkout", "--quiet", commit)
    return target


def _git(*arguments: str) -> str:
    command = ["git", *arguments]
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return done.stdout.strip()


def prepare(step: Step, folder: Path) -> None:
    """Remove what the step is to make anew, or give every file a new time."""
    for name in step.removed:
        place = FOLDER / name if name == "kernels" else folder / name
        shutil.rmtree(place, ignore_errors=True)
    if step.touched:
        for path in _git("-C", str(folder), "ls-files", "-z").split("\0")[:-1]:
            (folder / path).touch()


def timed(step: Step, folder: Path) -> dict[str, object] | None:
    """Run a step, with a sign of life every minute; return its row, or None if it failed."""
    unwanted = ("SEEDS", "MAKEFLAGS", "MAKELEVEL", "MFLAGS", "PYTHONPATH", "VIRTUAL_ENV")
    kept = {name: text for name, text in os.environ.items() if name not in unwanted}
    kept["NUMBA_CACHE_DIR"] = str(FOLDER / "kernels")
    kept["PYTHON"] = os.path.realpath(sys.executable)  # the one that this .venv was made with
    log = FOLDER / f"{step.what.replace(', ', '-')}.log"
    before, start = _processor_seconds(), time.monotonic()
    with log.open("w") as out:
        process = subprocess.Popen(
            step.command.split(), cwd=folder, env=kept, stdout=out, stderr=subprocess.STDOUT
        )
        code = None
        while code is None:
            try:
                code = process.wait(MINUTE)
            except subprocess.TimeoutExpired:
                passed = (time.monotonic() - start) / 60
                print(f"  after {passed:.0f} min: {_last_line(log)}", flush=True)
            except BaseException:
                process.wait()  # an interruption reached it too
                raise
    seconds, busy = time.monotonic() - start, _processor_seconds() - before
    if code:
        print(f"{log.read_text(errors='replace')[-2_000:]}\n  failed; see {log}", flush=True)
        return None
    cores = len(os.sched_getaffinity(0))
    how = f"{step.command}: {step.how}"
    values = (step.what, cores, round(seconds, 1), round(busy, 1), how, machine(), date.today())
    return dict(zip(COLUMNS, values, strict=True))


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _last_line(log: Path) -> str:
    lines = log.read_text(errors="replace").replace("\r", "\n").split("\n")
    return next((line.strip() for line in reversed(lines) if line.strip()), "")[-150:]


def main(steps: tuple[Step, ...] = STEPS) -> int:
    """Time all steps that are not timed yet; return how many failed."""
    folder, table = clone(), FOLDER / "timing.csv"
    if not table.exists():
        table.write_text(",".join(COLUMNS) + "\n")
    with table.open(newline="") as file:
        done = {row["what"] for row in csv.DictReader(file)}
    failed = 0
    for number, step in enumerate(steps, 1):
        print(f"{number} of {len(steps)}: {step.command} ({step.how})", flush=True)
        if step.what in done:
            print("  done before", flush=True)
            continue
        prepare(step, folder)
        row = timed(step, folder)
        if row is None:
            failed += 1
            continue
        with table.open("a", newline="") as file:
            csv.DictWriter(file, COLUMNS, lineterminator="\n").writerow(row)
        seconds, busy = row["seconds"], row["processor_seconds"]
        print(f"  {seconds} s, of which {busy} s of processor time", flush=True)
    if not failed:
        shutil.copy(table, FOLDER.parent / "timing.csv")
        shutil.rmtree(FOLDER)
        print(f"The table is {FOLDER.parent / 'timing.csv'}; next: python -m bench.adopt")
    return failed


if __name__ == "__main__":
    sys.exit(main())
