"""`make bench`: every comparison, one table, and the machine it was measured on.

Each module measures in a process of its own, one after the other, so that none finds the memory
or the threads of another; within a module ours and its rivals take turns.
"""

import json
import os
import platform
import subprocess
import sys
import time
from datetime import date
from pathlib import Path

import pandas as pd

from bench.table import markdown
from rl_core.experiments.provenance import processor

MODULES = ("planning", "q_learning", "reinforce", "dqn")
GROWTH = "growth"
RESULTS = Path(__file__).parent.parent / "results"


def machine() -> str:
    """Processor, cores, memory and Python, in words."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    cores, python = os.cpu_count(), platform.python_version()
    return f"{processor()}, {cores} cores, {memory:.0f} GiB, Python {python}"


def measure(module: str) -> list[dict]:
    """Run one module's measurements in a new process."""
    code = f"import json; from bench.{module} import rows; print('\\n' + json.dumps(rows()))"
    print(f"measuring {module} ...", file=sys.stderr, flush=True)
    start = time.monotonic()
    answer = subprocess.run(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, check=True, text=True
    )
    passed = (time.monotonic() - start) / 60
    print(f"... {module} took {passed:.1f} min", file=sys.stderr, flush=True)
    return json.loads(answer.stdout.splitlines()[-1])


def keep(rows: list[dict], path: Path) -> pd.DataFrame:
    """Write rows with machine and day; return them."""
    table = pd.DataFrame(rows).assign(machine=machine(), date=f"{date.today()}")
    path.parent.mkdir(exist_ok=True)
    table.to_csv(path, index=False)
    return table


def main(modules: list[str]) -> None:
    """Measure; print the comparisons as Markdown; keep all as `results/bench.csv`, `growth.csv`.

    `python -m bench.adopt` makes them what the book and the README show.
    """
    allowed = (*MODULES, GROWTH)
    unknown = sorted(set(modules) - set(allowed))
    if unknown:
        raise SystemExit(f"unknown: {', '.join(unknown)}; allowed: {', '.join(allowed)}")
    chosen = modules or allowed
    rows: list[dict] = []
    for module in (module for module in chosen if module != GROWTH):
        rows += measure(module)
        table = keep(rows, RESULTS / "bench.csv")  # what there is, should a later one fail
    if GROWTH in chosen:
        keep(measure(GROWTH), RESULTS / "growth.csv")
    if rows:
        print(markdown(table))


if __name__ == "__main__":
    main(sys.argv[1:])
