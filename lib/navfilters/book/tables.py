"""Results as small tables: HTML for a page, aligned text for a terminal and for comparisons."""

import html
import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import Any

from navfilters.book.claims import Page

_NUMBER = re.compile(r"[<>≤≥~±+-]*\.?\d[\d.,]*(e[+-]?\d+)?\s?[%×]?|nan|[+-]?inf|–")
_BELOW_A_MILLION = re.compile(r"-?\d(?:\.(\d+))?e\+0([1-5])")
_POWER = re.compile(r"(?<=\d)e([+-]?\d+)")


def table(
    rows: Iterable[Sequence[Any]], columns: Sequence[str] | Mapping[str, str], *, caption: str
) -> Page:
    """A table of results: the last line of a cell, or displayed.

    Parameters
    ----------
    rows : iterable of sequences
        The first item of a row is its heading; rows one after another that share it are a group,
        whose heading a page shows once. Booleans become yes and no, None an empty cell.
    columns : sequence of str, or mapping of str to str
        Headings; a mapping gives each a format for its numbers, such as ".1f". A number without
        one is printed as ".4g"; 6.6e+04 becomes 66,000.
    caption : str
        What the table holds, with units.

    Returns
    -------
    Page
        Its plain text is what tests of the notebooks and of their spread compare.

    Raises
    ------
    ValueError
        When there are no rows, or one is not as long as the headings.
    """
    titles = list(columns)
    formats = [columns[t] for t in titles] if isinstance(columns, Mapping) else [""] * len(titles)
    cells = [[_text(item, form) for item, form in _paired(row, formats, titles)] for row in rows]
    if not cells:
        raise ValueError("rows: found none, need at least one")
    numeric = [_numeric(column) for column in zip(*cells, strict=True)]
    return Page(_html(titles, cells, numeric, caption), _plain(titles, cells, numeric, caption))


def _paired(row: Sequence[Any], formats: list[str], titles: list[str]) -> list[tuple[Any, str]]:
    row = list(row)
    if len(row) != len(titles):
        raise ValueError(
            f"rows: found {len(row)} items in {row}, need {len(titles)}, one for each of {titles}"
        )
    return list(zip(row, formats, strict=True))


def _text(item: Any, form: str) -> str:
    if item is None:
        return ""
    if hasattr(item, "item"):  # a number of NumPy's
        item = item.item()
    if isinstance(item, bool):
        return "yes" if item else "no"
    if not isinstance(item, str):
        item = format(item, form or ("d" if isinstance(item, int) else ".4g"))
    if found := _BELOW_A_MILLION.fullmatch(item):
        digits, exponent = len(found[1] or ""), int(found[2])
        return f"{float(item):,.{max(digits - exponent, 0)}f}"
    return item


def _numeric(column: Sequence[str]) -> bool:
    return any(column) and all(_NUMBER.fullmatch(cell) for cell in column if cell)


def _plain(titles: list[str], cells: list[list[str]], numeric: list[bool], caption: str) -> str:
    lines = [titles, *cells]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        [
            caption,
            *(
                "  ".join(
                    cell.rjust(width) if right else cell.ljust(width)
                    for cell, width, right in zip(line, widths, numeric, strict=True)
                ).rstrip()
                for line in lines
            ),
        ]
    )


def _html(titles: list[str], cells: list[list[str]], numeric: list[bool], caption: str) -> str:
    style = [' class="number"' if right else "" for right in numeric]
    head = "".join(
        f'<th scope="col"{kind}>{html.escape(title, quote=False)}</th>'
        for title, kind in zip(titles, style, strict=True)
    )
    groups = [(first, list(rows)) for first, rows in groupby(cells, key=lambda row: row[0])]
    body = ""
    for first, rows in groups:
        scope = f'"rowgroup" rowspan="{len(rows)}"' if len(rows) > 1 else '"row"'
        heading = f"<th scope={scope}{style[0]}>{_rich(first, numeric[0])}</th>"
        for _, *rest in rows:
            line = "".join(
                f"<td{kind}>{_rich(cell, right)}</td>"
                for cell, kind, right in zip(rest, style[1:], numeric[1:], strict=True)
            )
            body, heading = f"{body}<tr>{heading}{line}</tr>", ""
    grouped = ' class="grouped"' if len(groups) < len(cells) else ""
    name = html.escape(caption)
    return (
        f'<div class="results" role="group" aria-label="{name}" tabindex="0"><table{grouped}>'
        f"<caption>{html.escape(caption, quote=False)}</caption>"
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def _rich(cell: str, number: bool) -> str:
    """A cell's HTML; of a number, minus signs and powers of ten as they are written by hand."""
    cell = html.escape(cell, quote=False)
    if not number:
        return cell
    cell = _POWER.sub(lambda found: f"&thinsp;×&thinsp;10<sup>{int(found[1])}</sup>", cell)
    return cell.replace("-", "−")
