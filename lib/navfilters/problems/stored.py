"""The table at its full size, as it was computed last, beside the library."""

import csv
import io
from collections.abc import Iterable
from dataclasses import asdict, fields
from importlib.resources import files
from pathlib import Path
from typing import Any

from navfilters.problems.table import Cell
from navfilters.runs import stored_arrays

FILE = "every_cure.csv"
RUNS = 200
"""Runs of each pair in the stored table."""


def write(path: Any, found: Iterable[Cell]) -> None:
    """Store a table, all or none; four digits of each number, see ``settled`` for their worth.

    Parameters
    ----------
    path : path
    found : iterable of Cell
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(f.name for f in fields(Cell))
    for cell in found:
        writer.writerow(_text(v) for v in asdict(cell).values())
    stored_arrays.write(Path(path), text.getvalue().encode())


def _text(value: Any) -> Any:
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, float):
        return f"{value:.4g}"
    return "" if value is None else value


def read(path: Any = None) -> list[Cell]:
    """A stored table.

    Parameters
    ----------
    path : path, optional
        By default the library's own: ``RUNS`` runs of every pair.

    Returns
    -------
    list of Cell

    Raises
    ------
    ValueError
        A file with other columns.
    """
    file = files("navfilters.problems") / FILE if path is None else Path(path)
    names = [f.name for f in fields(Cell)]
    head, *rows = csv.reader(file.read_text(encoding="utf-8").splitlines())
    if head != names:
        raise ValueError(f"path must be a table with the columns {names}; found {head}")
    return [Cell(**{n: _value(n, text) for n, text in zip(head, row, strict=True)}) for row in rows]


def _value(name: str, text: str) -> Any:
    if name in ("problem", "cure", "reason"):
        return text
    if name in ("honest", "evaluations"):
        return int(text)
    if name == "settled":
        return text == "1"
    return float(text) if text else None
