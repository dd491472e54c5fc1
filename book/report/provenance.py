"""Where the results of the book come from: a table a chapter, kept beside the other results."""

from pathlib import Path

import pandas as pd

from rl_core.checks import integer
from rl_core.experiments import Results
from rl_core.experiments.provenance import LIBRARIES


def keep(results: Results, folder: Path, *, chapter: int) -> None:
    """Write a chapter's provenance, a row an arm and seed, as `provenance/<chapter>.csv`."""
    path = folder / "provenance" / f"{integer('chapter', chapter, 1)}.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    results.provenance.assign(chapter=chapter).to_csv(path, index=False)


def read(folder: Path) -> pd.DataFrame:
    """Return what the chapters wrote, a row an arm and seed."""
    paths = sorted((folder / "provenance").glob("*.csv"))
    return pd.concat([pd.read_csv(path) for path in paths], ignore_index=True)


def by_chapter(made: pd.DataFrame) -> pd.DataFrame:
    """Arms, runs and core-minutes of each chapter, and of all; equal results count once."""
    once = made.drop_duplicates("digest")
    rows = [_totals(f"{chapter}", rows) for chapter, rows in once.groupby("chapter")]
    return pd.DataFrame([*rows, _totals("all", once)])


def _totals(name: str, made: pd.DataFrame) -> dict[str, object]:
    return {
        "chapter": name,
        "arms": made.groupby("chapter")["arm"].nunique().sum(),
        "runs": len(made),
        "one core (min)": made["seconds"].sum() / 60,
    }


def versions(made: pd.DataFrame) -> pd.DataFrame:
    """The versions of Python and the libraries that stand beside the results."""
    names = ["python", *LIBRARIES]
    return pd.DataFrame(
        {"name": names, "version": [", ".join(sorted(set(made[name]))) for name in names]}
    )


def by_arm(made: pd.DataFrame) -> pd.DataFrame:
    """What made each arm's results; the digest is that of its first seed."""
    groups = made.groupby(["chapter", "arm"], sort=False)
    return groups.agg(
        algorithm=("algorithm", "first"),
        environment=("env", "first"),
        episodes=("episodes", "first"),
        seeds=("seed", "nunique"),
        seconds=("seconds", "sum"),
        digest=("digest", lambda digests: digests.iloc[0][:12]),
        config=("config", "first"),
    ).reset_index()
