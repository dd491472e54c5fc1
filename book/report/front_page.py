"""The front page: findings, all claims in one table, the report's figures beside ours.

Nothing here is typed by hand: the verdicts come from `results/claims.csv`, the curves from the data
of the chapters' figures, the times from the provenance of the results. What a table says is text:
it is escaped where it enters the page.
"""

import base64
import html
import io
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from drawings.look import BLUE, GREY
from report import claims as judged
from report.findings import Told
from report.seeds import SEEDS

VERDICTS = {  # in the order of the page: what failed stands first
    "does not hold": "No criterion is met, and at least one is missed by its whole interval.",
    "holds in part": "One part of it is borne out, another is not.",
    "depends on the reading": "The report's words can be read in two ways, with two verdicts.",
    "cannot tell": "The interval holds the bound: more seeds would be needed.",
    "holds": "Every criterion is met by the whole of its interval.",
}
PAGES = {
    1: "01_value_iteration",
    2: "02_q_learning",
    3: "03_reinforce",
    4: "04_dqn",
    5: "05_continuous_reinforce",
    6: "06_evaluation",
}
REPORT_FIGURES = {  # number: chapter, title, file of the published curve, unit, logarithmic
    9: (2, "Q-learning on the Maze", "figure_09_q_learning_rmse", "‖Q − Q*‖", False),
    10: (3, "Acrobot, REINFORCE", "figure_10_acrobot_reinforce", "steps", True),
    11: (3, "MountainCar, REINFORCE", "figure_11_mountaincar_reinforce", "steps", True),
    12: (4, "Acrobot, DQN", "figure_12_acrobot_dqn", "steps", True),
    13: (4, "MountainCar, DQN", "figure_13_mountaincar_dqn", "steps", True),
    14: (
        5,
        "MountainCarContinuous, REINFORCE",
        "figure_14_mountaincarcontinuous_reinforce",
        "steps",
        True,
    ),
}


class IncompleteError(RuntimeError):
    """The results do not have every claim exactly once."""


def claims(results: Path, expected: pd.DataFrame) -> pd.DataFrame:
    """Read the table of claims and check it against the list of what the report claims.

    Parameters
    ----------
    results : Path
        Folder with `claims.csv`, which the chapters write.
    expected : pandas.DataFrame
        The claims of the report, with the column `id`.

    Returns
    -------
    pandas.DataFrame
        One row a claim, in the order of `expected`.

    Raises
    ------
    IncompleteError
        If a claim is missing, there twice, or unknown.
    """
    path = results / "claims.csv"
    found = pd.read_csv(path, dtype={"id": str, "section": str}) if path.exists() else expected[:0]
    counts = found["id"].value_counts()
    wrong = {
        "missing": sorted(set(expected["id"]) - set(counts.index)),
        "more than once": sorted(counts.index[counts > 1]),
        "unknown": sorted(set(counts.index) - set(expected["id"])),
    }
    if any(wrong.values()):
        what = "; ".join(f"{name}: {', '.join(ids)}" for name, ids in wrong.items() if ids)
        raise IncompleteError(f"{path.name} is not the whole table ({what}): run all chapters")
    return found.set_index("id").loc[expected["id"]].reset_index()


def counts(table: pd.DataFrame) -> dict[str, int]:
    """How many claims got each verdict, in the order of the page."""
    return {verdict: int((table["verdict"] == verdict).sum()) for verdict in VERDICTS}


def anchor(label: str) -> str:
    """Return the address, from the front page, of a figure or table of a chapter.

    Examples
    --------
    >>> anchor("Figure 10")
    '03_reinforce.html#figure-10'
    >>> anchor("Figure S2.1"), anchor("Table 4.2")
    ('02_q_learning.html#figure-s2-1', '04_dqn.html#T_table-4-2')
    """
    kind, number = label.split()
    if number.isdecimal():
        chapter = 1 if int(number) < 9 else REPORT_FIGURES[int(number)][0]
    else:
        chapter = int(re.findall(r"\d+", number)[0])
    name = f"{kind}-{number}".lower().replace(".", "-")
    return f"{PAGES[chapter]}.html#{'T_' if kind == 'Table' else ''}{name}"


def linked(text: str) -> str:
    """Turn the names of figures and tables in a text into links.

    Examples
    --------
    >>> linked("Figure 9")
    '<a href="02_q_learning.html#figure-9">Figure 9</a>'
    """
    kind = "Figure"

    def link(match: re.Match) -> str:
        nonlocal kind
        word, number = match[1], match[2]
        if word:
            kind = word.strip().rstrip("s")
        elif number.startswith("S"):
            kind = "Figure"
        return f'<a href="{anchor(f"{kind} {number}")}">{match[0]}</a>'

    return re.sub(r"((?:Figure|Table|Film)s? )?(S?\d+(?:\.\d+)?)", link, html.escape(text))


def _measured(words: str) -> str:
    """Estimate and interval on one line; a long one with a digit each, the rest behind the claim.

    >>> _measured("−0.000212 [−0.000938, 0.000181]")
    '<b>−0.0002</b> <small>[−0.0009, 0.0002]</small>'
    """
    if len(words) > 26:
        words = re.sub(r"0\.\d{4,}", lambda long: f"{float(long[0]):.1g}", words)
    estimate, _, interval = words.partition(" ")
    return f"<b>{estimate}</b>" + (f" <small>{interval}</small>" if interval else "")


def _first(figures: str) -> str:
    """Of several figures the first; a range is one.

    Examples
    --------
    >>> _first("Figures 9, S2.1"), _first("Figures 1-8, Table 1.2")
    ('Figure 9', 'Figures 1-8')
    """
    first = figures.split(",")[0]
    return first if "-" in first or "–" in first else first.replace("Figures", "Figure")


def findings_list(findings: Sequence[Told]) -> str:
    """The findings as an ordered list of HTML, each with the figure to look at."""
    items = "".join(f"<li>{one.sentence} {linked(one.figure)}</li>" for one in findings)
    return f'<ol class="findings">{items}</ol>'


def _verdict(verdict: str, count: str = "") -> str:
    name = re.sub(r"\W+", "-", verdict)
    return f'<span class="verdict {name}">{count}{html.escape(verdict)}</span>'


def _decided(row: pd.Series) -> judged.Evidence:
    """What was measured of the criterion that made the verdict."""
    names = ("estimate", "low", "high", "seeds")
    return judged.Evidence(*(row[f"deciding_{name}"] for name in names))


def _rest(row: pd.Series) -> str:
    """What stands behind a click: how the verdict was made, and what else was asked."""
    decided = _decided(row)
    exact = decided.seeds == 0 and decided.low == decided.high
    seeds = "exact" if exact else f"{decided.seeds} seeds"
    bound, distance = judged.number(row["deciding_bound"]), judged.number(abs(row["distance"]))
    side = "missed by" if row["distance"] < 0 else "kept by"
    decides = f"{row['deciding_criterion']}: {decided} ({seeds}), bound {bound}, {side} {distance}"
    lines = {
        "Decides": decides,
        "Criteria": row["criterion"] if row["criterion"] != row["deciding_criterion"] else "",
        "Readings": row["readings"],
        "“About” within": row["about"],
        "Amended": row["amended"],
    }
    shown = [f"{name}: {html.escape(text)}." for name, text in lines.items() if _said(text)]
    return "".join(f"<p>{line}</p>" for line in [*shown, f"See {linked(row['figure'])}."])


def _said(text: object) -> bool:
    """Whether a cell has a text: empty ones are read from a file as NaN."""
    return isinstance(text, str) and bool(text)


def _row(row: pd.Series) -> str:
    decided = _decided(row)
    claim = f"<details><summary>{html.escape(row['claim'])}</summary>{_rest(row)}</details>"
    if row["verdict"] == "depends on the reading":
        claim += f'<div class="readings">{html.escape(row["readings"])}</div>'
    if len(set(re.findall(r": ([^;]+)", str(row["about"])))) > 1:
        claim += f'<div class="readings">“About” within {html.escape(row["about"])}</div>'
    name = html.escape(row["id"])
    cells = {
        "id": f'<a href="{PAGES[int(row["chapter"])]}.html#verdicts">{name}</a>',
        "claim of 2018": claim,
        "verdict": _verdict(row["verdict"]),
        "measured": _measured(str(decided)),
        "see": linked(_first(row["figure"])),
    }
    return "<tr>" + "".join(f'<td data-label="{k}">{v}</td>' for k, v in cells.items()) + "</tr>"


def claims_table(table: pd.DataFrame) -> str:
    """The claims as HTML: grouped by verdict, what failed first; a click on a heading sorts."""
    order = {verdict: place for place, verdict in enumerate(VERDICTS)}
    grouped = table.sort_values("verdict", key=lambda column: column.map(order), kind="stable")
    names = ["id", "claim of 2018", "verdict", "measured", "see"]
    head = "".join(f'<th scope="col"><button type="button">{name}</button></th>' for name in names)
    body = "\n".join(_row(row) for _, row in grouped.iterrows())
    return (
        '<table class="claims sortable"><caption>Every claim of the report, with its verdict. '
        "Measured: the quantity that decides, with its 95% interval. A claim opens to the rest."
        '<span class="sorts"> A click on a heading sorts.</span></caption>'
        f"<thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table>"
    )


def verdict_bar(table: pd.DataFrame) -> str:
    """The verdicts as one bar of HTML, each part as wide as its share of the claims."""
    parts = "".join(
        _verdict(verdict, f"<b>{count}</b> ").replace(
            "<span", f'<span style="flex-grow:{count}" title="{html.escape(VERDICTS[verdict])}"', 1
        )
        for verdict, count in counts(table).items()
        if count
    )
    return f'<div class="verdict-bar" role="img" aria-label="{_spoken(table)}">{parts}</div>'


def _spoken(table: pd.DataFrame) -> str:
    return ", ".join(f"{count} {verdict}" for verdict, count in counts(table).items())


def curves(path: Path, seeds: range = SEEDS) -> pd.DataFrame:
    """Read a figure's data as one column a seed, with the episode as index.

    It has either columns `episode, seed_0, seed_1, ...` or rows `episode, seed, steps`. Of several
    arms the first is taken, which is the report's. A seed that stopped before the end needs for
    ever from there on, one that has no row at all from the beginning.
    """
    table = pd.read_csv(path)
    if "arm" in table:
        table = table[table["arm"] == table["arm"].iloc[0]]
    if "seed" in table:
        wide = table.pivot(index="episode", columns="seed", values="steps")
        return wide.reindex(columns=list(seeds)).fillna(np.inf)
    return table.set_index("episode").filter(like="seed_")


def _thumbnail(number: int, now: pd.DataFrame, original: pd.DataFrame) -> Figure:
    """The curve of 2018 on the left, ours on the right, on the same axes."""
    *_, unit, logarithmic = REPORT_FIGURES[number]
    figure, (left, right) = plt.subplots(1, 2, figsize=(4.4, 1.9), sharex=True, sharey=True)
    middle = original[["low", "high"]].mean(axis=1)
    left.fill_between(original["episode"], original["low"], original["high"], color="#9a8423")
    left.plot(original["episode"], middle, color="#9a8423", lw=0.6, ls="-")
    finite = now.replace(np.inf, np.nan)
    right.plot(finite.index, finite, color=GREY, lw=0.3, ls="-", alpha=0.6)
    lasting = now.loc[:, np.isfinite(now.iloc[-1])]
    median = lasting.median(axis=1)
    right.plot(median.index, median, color=BLUE, lw=1.4, ls="-")
    left.set_title("2018", fontsize=9)
    all_or_some = "" if lasting.shape == now.shape else f"{lasting.shape[1]} of "
    right.set_title(f"now, {all_or_some}{now.shape[1]} seeds", fontsize=9)
    left.set_ylabel(unit, fontsize=8)
    for axes in (left, right):
        axes.tick_params(labelsize=7)
        axes.set_xlabel("episode", fontsize=8)
        if logarithmic:
            axes.set_yscale("log")
    plt.close(figure)
    return figure


def _picture(figure: Figure) -> str:
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=110)
    return "data:image/png;base64," + base64.b64encode(data.getvalue()).decode()


def _card(number: str, page: str, figure: Figure, title: str, text: str) -> str:
    picture = f'<img loading="lazy" src="{_picture(figure)}" alt="{html.escape(text)}">'
    words = f"<span>{html.escape(number)}. {html.escape(title)}</span>"
    return f'<a class="thumbnail" href="{html.escape(page)}">{picture}{words}</a>'


def thumbnails(results: Path, originals: Path, situation: Figure) -> str:
    """The figures of the report as small pictures that lead to the chapters.

    Parameters
    ----------
    results : Path
        Folder with `figures/figure_9.csv` and so on, as `curves` takes them.
    originals : Path
        Folder with the curves of 2018: `episode, low, high`.
    situation : matplotlib.figure.Figure
        What stands for Figures 1 to 8, of which there is no data of 2018.
    """
    cards = [
        _card(
            "Figures 1 to 8",
            anchor("Figure 1"),
            situation,
            "The Maze's optimal values and policy",
            "Plan of the maze with the optimal value of every cell and an arrow for its action.",
        )
    ]
    for number, (_, title, name, unit, _) in REPORT_FIGURES.items():
        now = curves(results / "figures" / f"figure_{number}.csv")
        original = pd.read_csv(originals / f"{name}.csv")
        text = f"{title}: {unit} against the episode, the curve of 2018 beside ours."
        figure = _thumbnail(number, now, original)
        cards.append(_card(f"Figure {number}", anchor(f"Figure {number}"), figure, title, text))
    return f'<div class="thumbnails">{"".join(cards)}</div>'
