"""A field over a plane, as it changed over time: such as a policy's mean action over the states."""

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from interactive.page import Widget
from rl_core.checks import floats, require


def snapshots(
    grids: Mapping[str, ArrayLike],
    *,
    x: ArrayLike,
    y: ArrayLike,
    still: Any,
    x_label: str = "x",
    y_label: str = "y",
    value_label: str = "value",
    limit: float | None = None,
    mark: float | None = None,
    label: str = "",
) -> Widget:
    """Let the reader go through the snapshots of a field, and read off its values.

    A black line is drawn where the sign changes.

    Parameters
    ----------
    grids : mapping of str to array, shape (len(y), len(x))
        Under the name of each snapshot its values; row i belongs to y[i]. Some 40 x 40 cells are
        enough for the eye and for the page: 9 kB a snapshot.
    x, y : array
        The middles of the grid's cells, in rising order; y is drawn upwards.
    still : matplotlib.figure.Figure or str or object with _repr_html_
        The picture where there are no scripts.
    x_label, y_label, value_label : str
        Names, with units.
    limit : float, optional
        Colours go from -limit (orange) over 0 (white) to limit (purple), as in the still figures;
        what is beyond has the last colour. By default the largest absolute value.
    mark : float, optional
        Where on x a dotted line stands.
    label : str
        What the figure shows.

    Returns
    -------
    Widget
        To be shown by a notebook. Values are kept as float32.

    Raises
    ------
    TypeError, ValueError
        An argument is not as described.

    Examples
    --------
    >>> grids = {"before": np.zeros((2, 3)), "after": np.ones((2, 3))}
    >>> snapshots(grids, x=[0, 1, 2], y=[0, 1], still="<p>no picture</p>").kind
    'snapshots'
    """
    columns, rows = floats("x", x, (None,)), floats("y", y, (None,))
    for name, middles in (("x", columns), ("y", rows)):
        rising = len(middles) > 1 and bool((np.diff(middles) > 0).all())
        require(rising, name, middles, "two or more numbers in rising order")
    require(len(grids) > 0, "grids", grids, "a mapping with one snapshot or more")
    shape = (len(rows), len(columns))
    fields = {name: floats(f"grids[{name!r}]", grid, shape) for name, grid in grids.items()}
    highest = max(float(np.abs(field).max()) for field in fields.values())
    top = (highest or 1.0) if limit is None else float(limit)
    require(top > 0, "limit", limit, "a number above 0")
    data = {
        "x": columns,
        "y": rows,
        "x_label": x_label,
        "y_label": y_label,
        "value_label": value_label,
        "limit": top,
        "mark": mark if mark is None else float(mark),
        "grids": [
            {"name": name, "values": base64.b64encode(field.astype("<f4").tobytes()).decode()}
            for name, field in fields.items()
        ],
    }
    return Widget("snapshots", data, label or f"{value_label}, snapshot by snapshot.", still)
