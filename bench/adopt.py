"""`python -m bench.adopt`: what was measured becomes what the book and the README show."""

import re
import shutil
from pathlib import Path

import pandas as pd

from bench.table import markdown

ROOT = Path(__file__).parent.parent
TABLES = ("bench.csv", "growth.csv", "timing.csv")
SHOWN = re.compile(r"^Measured on .*?(?=\n\n## )", re.DOTALL | re.MULTILINE)


def adopt(root: Path = ROOT) -> list[str]:
    """Copy the tables that are in `results/` to `book/data/`, set the README's anew; name them."""
    found = [name for name in TABLES if (root / "results" / name).exists()]
    for name in found:
        shutil.copy(root / "results" / name, root / "book" / "data" / name)
    readme = root / "README.md"
    table = markdown(pd.read_csv(root / "book" / "data" / "bench.csv"))
    text = readme.read_text(encoding="utf-8")
    readme.write_text(SHOWN.sub(lambda _: table, text), encoding="utf-8")
    return found


if __name__ == "__main__":
    print("adopted:", ", ".join(adopt()) or "nothing: there are no measurements in results/")
