"""Tables with their captions."""

import html
import re
from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd
from pandas.io.formats.style import Styler
from pandas.io.formats.style_render import CSSDict


def captioned(
    table: pd.DataFrame,
    caption: str,
    *,
    formats: Mapping[str, str] | None = None,
    boldest: Sequence[str] = (),
) -> Styler:
    """Show a table with a caption and without its row numbers; words are set to the left.

    Its address on the page is that of its number: `#T_table-3-1` for "Table 3.1. Steps ...".
    Caption, headings and cells are text: what would be markup in them is shown as it is written.

    Parameters
    ----------
    table : pandas.DataFrame
        What to show.
    caption : str
        The caption, beginning with the table's number and a full stop.
    formats : mapping of str to str, optional
        A format for a column's numbers, such as "{:.2f}"; by default six digits at most.
    boldest : sequence of str
        Columns among which the largest of each row is set in bold.

    Examples
    --------
    >>> numbers = pd.DataFrame({"x": [0.123, 4.5]})
    >>> page = captioned(numbers, "Table 0. Numbers.", formats={"x": "{:.1f}"}).to_html()
    >>> "Table 0. Numbers." in page, "4.5" in page, "0.123" in page
    (True, True, False)
    """
    # A fixed id: the same table gives the same page, and links can lead to it.
    number = re.sub(r"[^\w.]+", " ", caption.partition(". ")[0]).strip(" .")
    styled = table.style.set_uuid(re.sub(r"[ .]", "-", number.lower()))
    styled = styled.set_caption(html.escape(caption, quote=False)).hide(axis="index")
    shown: dict[Any, Any] = dict.fromkeys(table.select_dtypes("float").columns, "{:g}")
    styled = styled.format(shown | dict(formats or {}), escape="html")
    styled = styled.format_index(escape="html", axis=1)
    words = [i for i, kind in enumerate(table.dtypes) if not pd.api.types.is_numeric_dtype(kind)]
    props = {i: f"text-align: left; min-width: {_room(table.iloc[:, i])}" for i in words}
    styled = styled.set_table_styles(
        [CSSDict(selector=f".col{i}", props=text) for i, text in props.items()]
    )
    if boldest:
        styled = styled.highlight_max(subset=list(boldest), axis=1, props="font-weight: bold")
    return styled


def _room(words: pd.Series) -> str:
    """Return the width that a column of words has at least: not every word on a line of its own."""
    longest = max(map(len, words.astype(str)), default=0)
    most, of_window = (20, 60) if longest > 150 else (12 if words.name == "arm" else 6, 30)
    return f"min({longest / 2:g}em, {most}em, {of_window}vw)"
