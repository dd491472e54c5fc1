"""The table of the measurements: its rows, and how `make bench` prints and the README shows it."""

import pandas as pd

COLUMNS = ("benchmark", "against", "rival", "ours", "ratio", "unit", "note")


def comparison(
    benchmark: str, against: str, rival: float, ours: float, unit: str, note: str
) -> dict[str, object]:
    """Return a row: what was compared, against whom, the cost of each, and their ratio.

    Examples
    --------
    >>> comparison("a walk", "a run", rival=1.0, ours=3.0, unit="s", note="uphill")["ratio"]
    0.333
    """
    ratio = float(f"{rival / ours:.3g}")
    return dict(
        zip(
            COLUMNS,
            (benchmark, against, round(rival, 4), round(ours, 4), ratio, unit, note),
            strict=True,
        )
    )


def markdown(measured: pd.DataFrame) -> str:
    """Name the machine and the day, and set a row a comparison, in Markdown.

    Parameters
    ----------
    measured : pandas.DataFrame
        `results/bench.csv`: the columns of `COLUMNS`, and `machine` and `date`.

    Examples
    --------
    >>> row = comparison("a walk", "a run", rival=6.0, ours=2.0, unit="s", note="")
    >>> where = {"machine": "a desk", "date": "2026-11-24"}
    >>> print(markdown(pd.DataFrame([row | where])))
    Measured on 2026-11-24, a desk.
    <BLANKLINE>
    | benchmark | against | rival | ours | ratio | unit | note |
    | --- | --- | --- | --- | --- | --- | --- |
    | a walk | a run | 6 | 2 | 3 | s |  |
    """
    where = measured.iloc[0]
    lines = [list(COLUMNS), ["---"] * len(COLUMNS)]
    for _, row in measured[list(COLUMNS)].fillna("").iterrows():
        lines.append([f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in row])
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return f"Measured on {where['date']}, {where['machine']}.\n\n{table}"
