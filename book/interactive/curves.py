"""Learning curves that answer: every seed of an arm, and the arms of one knob."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from interactive.page import Widget, as_html, significant
from rl_core.checks import instance, integer, require
from rl_core.statistics import bootstrap_interval

CURVE = ("seed", "episode", "steps")
FATE = ("seed", "fate", "steps_at_end", "env_steps")
MIDDLES = {"all": "median of all, 95% interval", "learned": "median of those that learned, 95%"}


def seed_curves(
    curves: pd.DataFrame,
    fates: pd.DataFrame,
    original: pd.DataFrame | None = None,
    *,
    still: Any,
    films: Mapping[str, Any] | None = None,
    label: str = "Learning curves of every seed.",
    title: str = "",
    y_label: str = "steps to the goal",
    log: bool = True,
    learned: str = "learned",
    median: str = "all",
    points: int = 150,
) -> Widget:
    """Let the reader look at every seed: its curve, its fate, its rows, its film.

    Parameters
    ----------
    curves : pandas.DataFrame
        Columns `seed`, `episode`, `steps`, as they shall be drawn (smoothed or not). NaN where a
        seed had stopped; of its episodes at most `points` are kept, evenly spaced, and four digits.
        A column `stopped` marks episodes that were cut off.
    fates : pandas.DataFrame
        A row a seed: `seed`, `fate` in words ("learned", "not learned", "out of budget", ...),
        `steps_at_end`, and `env_steps`, the budget used.
    original : pandas.DataFrame, optional
        The curve of 2018: `episode`, `low`, `high`.
    still : matplotlib.figure.Figure or str or object with _repr_html_
        The picture where there are no scripts.
    films : mapping, optional
        Under names such as "best seed" films, as HTML or as objects with `_repr_html_`; or pairs of
        a seed and its film, which then can be picked together with the seed.
    label, title, y_label : str
        What the figure shows, what stands above it, and the name of its vertical axis.
    log : bool
        A logarithmic vertical axis.
    learned : str
        The one fate that is no failure.
    median : str
        Over which seeds the median is drawn, with its 95% bootstrap interval: "all", where one that
        had stopped counts as needing for ever, or "learned".
    points : int
        The most points a curve has.

    Returns
    -------
    Widget
        To be shown by a notebook.

    Raises
    ------
    TypeError, ValueError
        An argument is not as described.

    Examples
    --------
    >>> curves = pd.DataFrame({"seed": [0, 0, 1, 1], "episode": [1, 2] * 2, "steps": [9, 5, 9, 8]})
    >>> fates = pd.DataFrame({"seed": [0, 1], "fate": ["learned", "not learned"],
    ...                       "steps_at_end": [5, 8], "env_steps": [14, 17]})
    >>> seed_curves(curves, fates, still="<p>no picture</p>").kind
    'seeds'
    """
    for name, table, columns in (("curves", curves, CURVE), ("fates", fates, FATE)):
        _columns(name, table, columns)
    seeds = fates["seed"].tolist()
    require(len(set(seeds)) == len(seeds), "fates", seeds, "a table with one row a seed")
    wide = curves.pivot(index="episode", columns="seed", values="steps").sort_index()
    require(set(wide.columns) == set(seeds), "curves", list(wide.columns), f"of the seeds {seeds}")
    integer("points", points, least=2)
    require(median in MIDDLES, "median", median, f"one of {list(MIDDLES)}")
    kept = np.unique(np.linspace(0, len(wide) - 1, min(points, len(wide))).round().astype(int))
    wide = wide.iloc[kept]
    cut = _marked(curves, wide)
    lost = fates["fate"] != learned
    order = fates.assign(lost=lost).sort_values(
        ["lost", "steps_at_end", "seed"], na_position="last"
    )
    shelf = _shelf(films or {}, seeds)
    data = {
        "title": title,
        "y_label": y_label + (" (logarithmic)" if log else ""),
        "log": bool(log),
        "episode": wide.index.to_numpy(),
        "rows_in_all": int(curves["episode"].nunique()),
        "original": None if original is None else _band(original),
        "middle": _middle(wide if median == "all" else wide[fates.loc[~lost, "seed"]]),
        "middle_name": MIDDLES[median],
        "seeds": [
            {
                "seed": row.seed,
                "fate": row.fate,
                "failed": bool(row.lost),
                "steps_at_end": significant([row.steps_at_end])[0],
                "env_steps": row.env_steps,
                "steps": significant(wide[row.seed]),
                "cut": np.flatnonzero(cut[row.seed]),
            }
            for row in order.itertuples()
        ],
        "films": [{"name": name, "seed": seed} for name, seed, _ in shelf],
    }
    below = "".join(
        f'<details class="play-film"><summary>Film: {name}</summary>{as_html(film, name)}</details>'
        for name, _, film in shelf
    )
    return Widget(
        "seeds", data, label, still, f'<div class="play-films">{below}</div>' * bool(below)
    )


def _marked(curves: pd.DataFrame, wide: pd.DataFrame) -> pd.DataFrame:
    """Return which of the points drawn are episodes that were cut off."""
    if "stopped" not in curves:
        return wide.isna() & False
    marks = curves.pivot(index="episode", columns="seed", values="stopped")
    return marks.reindex_like(wide).fillna(value=False).astype(bool)


def _middle(wide: pd.DataFrame) -> dict[str, Any]:
    """Return the median over seeds and its interval, which ends at the largest value."""
    if wide.empty or not wide.columns.size:
        return {"median": [], "low": [], "high": []}
    rng = np.random.default_rng(np.random.SeedSequence(2020))
    found = bootstrap_interval(wide.T.fillna(np.inf).to_numpy(), rng=rng, resamples=2_000)
    top = np.where(np.isfinite(found.low), np.nanmax(wide), np.nan)
    high = np.where(np.isinf(found.high), top, found.high)
    return {
        "median": significant(found.estimate),
        "low": significant(found.low),
        "high": significant(high),
    }


def _shelf(films: Mapping[str, Any], seeds: Sequence[Any]) -> list[tuple[str, Any, Any]]:
    """Return name, seed (None if it was not told) and film of each."""
    shelf = []
    for name, value in films.items():
        seed, film = value if isinstance(value, tuple) else (None, value)
        require(seed is None or seed in seeds, f"films[{name!r}]", seed, f"of one of {seeds}")
        shelf.append((name, seed, film))
    return shelf


def knob(
    name: str,
    values: Sequence[float],
    curves_by_value: Mapping[float, pd.DataFrame],
    table: pd.DataFrame,
    *,
    still: Any,
    seeds: Mapping[str, ArrayLike] | None = None,
    label: str = "",
    y_label: str = "error",
    log: bool = True,
    points: int = 150,
) -> Widget:
    """Let the reader turn one knob: the curve and what came of it move together.

    Parameters
    ----------
    name : str
        What is turned, such as "step size α".
    values : sequence of float
        The values that were run, in rising order.
    curves_by_value : mapping of float to pandas.DataFrame
        For each value the columns `episode`, `median` and, if there is a band, `low` and `high`.
    table : pandas.DataFrame
        A row a value, in the order of `values`; each column is a measure, such as "error at the
        end" or "share that learned", and is drawn against the knob.
    still : matplotlib.figure.Figure or str or object with _repr_html_
        The picture where there are no scripts.
    seeds : mapping of str to array of shape (values, seeds), optional
        For some of the measures what each seed has: its dots, and the 95% bootstrap interval of
        their median as a band.
    label, y_label : str
        What the figure shows, and the name of the curves' vertical axis.
    log : bool
        A logarithmic vertical axis for the curves.
    points : int
        The most points a curve has.

    Returns
    -------
    Widget
        To be shown by a notebook.

    Raises
    ------
    TypeError, ValueError
        An argument is not as described.

    Examples
    --------
    >>> curve = pd.DataFrame({"episode": [1, 2], "median": [2.0, 1.0]})
    >>> table = pd.DataFrame({"error at the end": [1.0, 1.0], "share that learned": [0.5, 1.0]})
    >>> knob("sigma", [0.3, 1], {0.3: curve, 1: curve}, table, still="<p>no picture</p>").kind
    'knob'
    """
    values = list(values)
    require(
        values and values == sorted(set(values)), "values", values, "in rising order, each once"
    )
    instance("table", table, pd.DataFrame, "a pandas.DataFrame")
    require(len(table) == len(values), "table", len(table), f"a table of {len(values)} rows")
    require(
        set(curves_by_value) == set(values),
        "curves_by_value",
        list(curves_by_value),
        f"a mapping from {values}",
    )
    integer("points", points, least=2)
    dots = {it: np.asarray(each, dtype=float) for it, each in (seeds or {}).items()}
    for it, each in dots.items():
        fits = it in table and each.ndim == 2 and len(each) == len(values)
        require(fits, f"seeds[{it!r}]", each.shape, f"for a measure, of shape ({len(values)}, n)")
    curves = []
    for value in values:
        curve = curves_by_value[value]
        _columns(f"curves_by_value[{value}]", curve, ("episode", "median"))
        kept = np.unique(
            np.linspace(0, len(curve) - 1, min(points, len(curve))).round().astype(int)
        )
        curve = curve.iloc[kept]
        drawn = [it for it in ("median", "low", "high") if it in curve]
        curves.append(
            {"episode": curve["episode"].to_numpy(), **{it: significant(curve[it]) for it in drawn}}
        )
    data = {
        "name": name,
        "values": values,
        "y_label": y_label + (" (logarithmic)" if log else ""),
        "log": bool(log),
        "curves": curves,
        "measures": [
            {"name": str(it), "values": significant(table[it]), **_spread(dots.get(it))}
            for it in table.columns
        ],
    }
    return Widget("knob", data, label or f"What {name} does.", still)


def _spread(seeds: NDArray[np.float64] | None) -> dict[str, Any]:
    """Return each seed's value, and the ends of the interval of their median."""
    if seeds is None:
        return {}
    _, low, high = bootstrap_interval(seeds.T, rng=np.random.default_rng(2018))
    ends = {"low": significant(low), "high": significant(high)}
    return {"seeds": [significant(each, 3) for each in seeds], **ends}


def _columns(name: str, table: object, columns: Sequence[str]) -> None:
    """Require a table with certain columns."""
    instance(name, table, pd.DataFrame, "a pandas.DataFrame")
    there = list(table.columns)
    require(set(columns) <= set(there), name, there, f"a table with the columns {list(columns)}")


def _band(original: pd.DataFrame) -> dict[str, Any]:
    _columns("original", original, ("episode", "low", "high"))
    return {it: significant(original[it]) for it in ("episode", "low", "high")}
