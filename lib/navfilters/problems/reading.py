"""How a table is read: pairs, values chosen in hindsight, rows."""

import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import NamedTuple

from navfilters.book.printing import MARKS, compact
from navfilters.problems.table import Cell

HINDSIGHT = " *"
"""Behind the name of a cure whose parameter is the best of those tried, problem by problem."""

BY_HAND = ("more Q", "timed Q")
"""Cures whose value no text gives."""


class Row(NamedTuple):
    """A row of the table.

    Parameters
    ----------
    label : str
    cells : tuple of Cell
        One for each problem.
    """

    label: str
    cells: tuple[Cell, ...]


def own(found: Iterable[Cell]) -> dict[tuple[str, str], Cell]:
    """The cell of each pair with the value that the cure's text gives.

    Parameters
    ----------
    found : iterable of Cell

    Returns
    -------
    dict of (problem, cure) to Cell
    """
    first: dict[tuple[str, str], Cell] = {}
    for cell in found:
        first.setdefault((cell.problem, cell.cure), cell)
    return first


def best(found: Iterable[Cell]) -> dict[tuple[str, str], Cell]:
    """The cell of each pair with the smallest error among the values that were tried.

    One that rounding decides is no better than any other.

    Parameters
    ----------
    found : iterable of Cell

    Returns
    -------
    dict of (problem, cure) to Cell
    """
    chosen: dict[tuple[str, str], Cell] = {}
    for cell in found:
        key = cell.problem, cell.cure
        if key not in chosen or _order(cell) < _order(chosen[key]):
            chosen[key] = cell
    return chosen


def _order(cell: Cell) -> float:
    return cell.ratio if cell.settled else math.inf


def elsewhere(found: Sequence[Cell], cell: Cell, problem: str) -> Cell:
    """The cell of the same cure, with the same value, on another problem.

    Parameters
    ----------
    found : sequence of Cell
    cell : Cell
    problem : str

    Returns
    -------
    Cell

    Raises
    ------
    ValueError
        No such cell in the table.
    """
    key = problem, cell.cure
    for other in found:
        same = other.value == cell.value or bool(other.reason)
        if (other.problem, other.cure) == key and same:
            return other
    raise ValueError(f"problem and cure must be in the table; found {key}")


def rows(found: Sequence[Cell]) -> list[Row]:
    """The table row by row: each cure as its text has it, and with the best of its values.

    Parameters
    ----------
    found : sequence of Cell

    Returns
    -------
    list of Row
    """
    problems = list(dict.fromkeys(cell.problem for cell in found))
    cures = list(dict.fromkeys(cell.cure for cell in found))
    scanned = {cell.cure for cell in found if cell.value is not None}
    first, chosen = own(found), best(found)

    def row(label: str, cells: Mapping[tuple[str, str], Cell], cure: str) -> Row:
        return Row(label, tuple(cells[problem, cure] for problem in problems))

    made = []
    for cure in cures:
        if cure not in BY_HAND:
            made.append(row(cure, first, cure))
        if cure in scanned:
            made.append(row(cure + HINDSIGHT, chosen, cure))
    return made


def reasons(found: Iterable[Cell]) -> dict[str, dict[str, list[str]]]:
    """Why a cure cannot act, and on which problems.

    Parameters
    ----------
    found : iterable of Cell

    Returns
    -------
    dict of cure to dict of reason to problems
    """
    why: dict[str, dict[str, list[str]]] = {}
    for cell in found:
        if cell.reason:
            why.setdefault(cell.cure, {}).setdefault(cell.reason, []).append(cell.problem)
    return why


def listing(found: Sequence[Row]) -> str:
    """The table as one of HTML, for links, for readers of text and where nothing is computed.

    Parameters
    ----------
    found : sequence of Row

    Returns
    -------
    str
        The row of "B-EKF 1", say, has the id "cure-b-ekf-1"; in its cells stand error over the
        reference and the mark of honesty, or "lost" where rounding decides both.
    """
    heads = "".join(f'<th scope="col">{escape(cell.problem)}</th>' for cell in found[0].cells)
    lines = [
        f'<tr id="{anchor(row.label)}"><th scope="row">{escape(row.label)}</th>'
        + "".join(f"<td>{_pair(cell)}</td>" for cell in row.cells)
        + "</tr>"
        for row in found
    ]
    return (
        f'<table class="cures"><thead><tr><th scope="col">cure</th>{heads}</tr></thead>\n<tbody>'
        + "\n".join(lines)
        + "</tbody></table>"
    )


def anchor(label: str) -> str:
    """The id of a row.

    Parameters
    ----------
    label : str

    Returns
    -------
    str
    """
    return "cure-" + label.replace(HINDSIGHT, " best").lower().replace(" ", "-")


def _pair(cell: Cell) -> str:
    if cell.reason:
        return "–"
    if not cell.settled:
        return "lost"
    return f"<span>{escape(compact(cell.ratio))}</span> {MARKS[cell.honest]}"
