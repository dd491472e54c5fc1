"""The table of the measurements, as `make bench` prints it and the README shows it."""

import pandas as pd

COLUMNS = ("benchmark", "rival", "ours", "ratio", "unit", "note")


def markdown(measured: pd.DataFrame) -> str:
    """Name the machine and the day, and set a row a comparison, in Markdown.

    Parameters
    ----------
    measured : pandas.DataFrame
        `results/bench.csv`: the columns of `COLUMNS`, and `machine` and `date`.

    Examples
    --------
    >>> row = {"benchmark": "a walk", "rival": 6.0, "ours": 2.0, "ratio": 3.0, "unit": "s"}
    >>> where = {"note": "", "machine": "a desk", "date": "2026-11-24"}
    >>> print(markdown(pd.DataFrame([row | where])))
    Measured on 2026-11-24, a desk.
    <BLANKLINE>
    | benchmark | rival | ours | ratio | unit | note |
    | --- | --- | --- | --- | --- | --- |
    | a walk | 6 | 2 | 3 | s |  |
    """
    where = measured.iloc[0]
    lines = [list(COLUMNS), ["---"] * len(COLUMNS)]
    for _, row in measured[list(COLUMNS)].fillna("").iterrows():
        lines.append([f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in row])
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return f"Measured on {where['date']}, {where['machine']}.\n\n{table}"
