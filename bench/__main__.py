"""`make bench`: every comparison, one table, and the machine it was measured on.

Each module measures in a process of its own, one after the other, so that none finds the memory
or the threads of another; within a module ours and its rivals take turns.
"""

import json
import os
import platform
import subprocess
import sys
from datetime import date
from pathlib import Path

import pandas as pd

from bench.table import markdown

MODULES = ("planning", "q_learning", "reinforce", "dqn")
RESULTS = Path(__file__).parent.parent / "results"


def machine() -> str:
    """Processor, cores, memory and Python, in words."""
    processor = platform.processor() or platform.machine()
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            processor = line.partition(":")[2].strip()
            break
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return (
        f"{processor}, {os.cpu_count()} cores, {memory:.0f} GiB, Python {platform.python_version()}"
    )


def measure(module: str) -> list[dict]:
    """Run one module's measurements in a new process."""
    code = f"import json; from bench.{module} import rows; print('\\n' + json.dumps(rows()))"
    answer = subprocess.run(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, check=True, text=True
    )
    return json.loads(answer.stdout.splitlines()[-1])


def main(modules: list[str]) -> None:
    """Measure, print the table as Markdown, keep it as `results/bench.csv`.

    What the book shows is `book/data/bench.csv`: copy a measurement of all modules there, and what
    is printed into the README.
    """
    unknown = sorted(set(modules) - set(MODULES))
    if unknown:
        raise SystemExit(f"unknown: {', '.join(unknown)}; allowed: {', '.join(MODULES)}")
    gathered = []
    for module in modules or MODULES:
        print(f"measuring {module} ...", file=sys.stderr, flush=True)
        gathered += measure(module)
    table = pd.DataFrame(gathered).assign(machine=machine(), date=f"{date.today()}")
    RESULTS.mkdir(exist_ok=True)
    table.to_csv(RESULTS / "bench.csv", index=False)
    print(markdown(table))


if __name__ == "__main__":
    main(sys.argv[1:])
