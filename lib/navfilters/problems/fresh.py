"""Values chosen in hindsight, tried on draws that had no part in the choice."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

from navfilters.problems.cures import Cure
from navfilters.problems.later_cures import CURES
from navfilters.problems.problem import Problem
from navfilters.problems.reading import best, own
from navfilters.problems.table import Cell, cells
from navfilters.runs import stored_arrays

PLAIN = "EKF"
FRESH = "every_cure_fresh.json"


class Fresh(NamedTuple):
    """The best of all scanned values of a problem, then and again.

    Parameters
    ----------
    problem, cure : str
    value : float
        Of the cure's parameter.
    then : float
        Its error over the EKF's, on the draws by which it was chosen.
    again : tuple of float
        The same on each fresh set of draws.
    """

    problem: str
    cure: str
    value: float
    then: float
    again: tuple[float, ...]


def fresh(
    found: Iterable[Cell],
    patients: Mapping[str, Problem],
    runs: int = 200,
    seeds: Iterable[int] = (1, 2, 3, 4),
) -> list[Fresh]:
    """The scanned value with the smallest error on each problem, on fresh draws.

    Parameters
    ----------
    found : iterable of Cell
        A table, of seed 0.
    patients : mapping
        Those to be tried, by name; all in the table.
    runs : int
        Of each set of draws; fewer where runs share their measurements: see ``cells``.
    seeds : iterable of int

    Returns
    -------
    list of Fresh

    Raises
    ------
    ValueError
        A problem of which the table has no scanned value.
    """
    found, by_name, seeds = list(found), {cure.name: cure for cure in CURES}, list(seeds)
    first, rows = own(found), list[Fresh]()
    for name, problem in patients.items():
        scanned = [c for c in best(found).values() if c.problem == name and c.value is not None]
        if not scanned:
            raise ValueError(f"patients must have scanned values in the table; found {name!r}")
        chosen = min(scanned, key=lambda cell: cell.ratio)
        value = float(chosen.value or 0.0)
        cure = replace(by_name[chosen.cure], value=value)
        rows.append(
            Fresh(
                name,
                chosen.cure,
                value,
                chosen.ratio / first[name, PLAIN].ratio,
                tuple(
                    _error(problem, cure, runs, seed) / _error(problem, by_name[PLAIN], runs, seed)
                    for seed in seeds
                ),
            )
        )
    return rows


def _error(problem: Problem, cure: Cure, runs: int, seed: int) -> float:
    return cells(problem, cure, runs, seed, scan=False)[0].ratio


def write_fresh(path: Any, rows: Iterable[Fresh]) -> None:
    """Store what fresh draws gave, three digits of each number.

    Parameters
    ----------
    path : path
    rows : iterable of Fresh
    """

    def short(x: float) -> float:
        return float(f"{x:.3g}")

    kept = [
        r._replace(then=short(r.then), again=tuple(map(short, r.again)))._asdict() for r in rows
    ]
    stored_arrays.write(Path(path), f"{json.dumps(kept, indent=1)}\n".encode())


def read_fresh(path: Any = None) -> list[Fresh]:
    """What fresh draws gave.

    Parameters
    ----------
    path : path, optional
        By default the library's own, of the stored table.

    Returns
    -------
    list of Fresh
    """
    file = files("navfilters.problems") / FRESH if path is None else Path(path)
    rows = json.loads(file.read_text(encoding="utf-8"))
    return [Fresh(**row | {"again": tuple(row["again"])}) for row in rows]


def fresh_report(rows: Iterable[Fresh]) -> str:
    """A line for each problem.

    Parameters
    ----------
    rows : iterable of Fresh

    Returns
    -------
    str
    """
    lines = [f"{'error over that of the EKF':36}{'chosen by':>10}  on fresh draws"]
    for row in rows:
        again = " ".join(f"{x:9.3g}" for x in row.again)
        what = f"{row.problem}: {row.cure} {row.value:g}"
        lines.append(f"{what:36}{row.then:10.3g}  {again}")
    return "\n".join(lines)
