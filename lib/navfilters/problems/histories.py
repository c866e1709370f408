"""Error and claim of every pair over its updates: ``python -m navfilters.problems.histories``."""

import argparse
import json
import sys
from collections.abc import Iterable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from navfilters.numerics.extras import at_least, command
from navfilters.problems.catalogue import problems
from navfilters.problems.cures import Cure, UnfitError
from navfilters.problems.later_cures import CURES
from navfilters.problems.problem import Problem
from navfilters.problems.table import FEW
from navfilters.runs import stored_arrays
from navfilters.runs.sweeping import sweep
from navfilters.types import Array

FILE = "every_cure_histories.json"
RUNS = 20
"""Runs of each pair in the stored histories."""

POINTS = 24
"""Updates of each history, at most."""

STEP = 0.02
"""Of the stored decimal logarithms: five per cent."""


_PARTS = "courses", "histories"


class Course(NamedTuple):
    """What the histories of a problem have in common.

    Parameters
    ----------
    problem : str
    updates : tuple of int
        At which error and claim are kept.
    since : int
        First update of the window in which the error is judged.
    reference : float
        Error of the best honest estimate there, in ``unit``.
    unit : str
    """

    problem: str
    updates: tuple[int, ...]
    since: int
    reference: float
    unit: str


class History(NamedTuple):
    """A cure on a problem in the course of its updates.

    Parameters
    ----------
    problem, cure : str
    value : float, optional
        Of the cure's parameter; none where it has none.
    error : tuple of float
        Decimal logarithms of the root mean square over the runs, in the problem's unit, at the
        updates of ``updates``; NaN where half of the runs are no numbers.
    claim : tuple of float
        The same of the deviation that the filter reports.
    """

    problem: str
    cure: str
    value: float | None
    error: tuple[float, ...]
    claim: tuple[float, ...]


def updates(problem: Problem) -> Array:
    """The updates of a history, (at most ``POINTS``,), from 1 to the last.

    Evenly spread where there is motion, and by equal ratios where a point stands still.

    Parameters
    ----------
    problem : Problem

    Returns
    -------
    int array
    """
    spread = np.geomspace if problem.dynamics is None else np.linspace
    return np.unique(np.round(spread(1, problem.steps, POINTS)).astype(int))


def histories(problem: Problem, cure: Cure, runs: int = RUNS, seed: int = 0) -> list[History]:
    """A cure on a problem with its own value, and with every other value that is tried.

    Parameters
    ----------
    problem : Problem
    cure : Cure
    runs : int
        At most ``table.FEW`` are flown where runs share their measurements.
    seed : int

    Returns
    -------
    list of History
        That of the cure's own value first; empty where the cure cannot act.
    """
    runs = min(runs, FEW) if problem.repeated else runs
    values = [cure.value, *(v for v in cure.scanned if v != cure.value)]
    setting = np.array(values)[:, None] if cure.scanned else cure.value
    try:
        told, estimator = cure.apply(problem, setting)
    except UnfitError:
        return []
    front = (slice(None), None) if cure.scanned else (slice(None),)
    draw, at = told.drawn(runs, seed), updates(problem)
    mean, cov = sweep(
        estimator,
        draw.prior,
        draw.z[front],
        told.model,
        dynamics=told.dynamics,
        z_per_step=True,
        record=lambda state: state.estimate,
        workers=1,
        progress=False,
    ).record
    mean, cov, truth = mean[at], cov[at], problem.drawn(runs, seed).truth[front][at]
    judged = list(problem.judged)
    with np.errstate(all="ignore"):  # a run that fails is no number
        error = problem.error(mean if told.back is None else told.back(mean), truth)
        squares = np.sum(error[..., judged] ** 2, axis=-1), _claimed(told, mean, cov, judged)
        logs = [_logarithm(np.broadcast_to(s, mean.shape[:-1])) for s in squares]
    if not cure.scanned:
        return [History(problem.name, cure.name, None, *map(_tuple, logs))]
    return [
        History(problem.name, cure.name, value, *(_tuple(log[:, i]) for log in logs))
        for i, value in enumerate(values)
    ]


def _claimed(told: Problem, mean: Array, cov: Array, judged: list[int]) -> Array:
    """The variance that is reported of what is judged."""
    if told.back is None:
        return np.diagonal(cov, axis1=-2, axis2=-1)[..., judged].sum(axis=-1)
    small = 1e-6
    root = np.linalg.cholesky(np.broadcast_to(cov, (*mean.shape, mean.shape[-1])))
    there = told.back(mean[..., None, :] + small * root.mT) - told.back(mean)[..., None, :]
    return np.sum((there[..., judged] / small) ** 2, axis=(-2, -1))


def _logarithm(squares: Array) -> Array:
    """Of the root mean square over the runs, the last axis."""
    finite = np.isfinite(squares)
    mean = np.where(finite, squares, 0.0).sum(axis=-1) / np.maximum(finite.sum(axis=-1), 1)
    return np.where(2 * finite.sum(axis=-1) > squares.shape[-1], np.log10(mean) / 2, np.nan)


def _tuple(logs: Array) -> tuple[float, ...]:
    return tuple(float(x) for x in np.where(np.isfinite(logs), logs, np.nan))


def course(problem: Problem, runs: int = RUNS, seed: int = 0) -> Course:
    """At which updates a history is kept, and what it is to be compared with.

    Parameters
    ----------
    problem : Problem
    runs : int
    seed : int

    Returns
    -------
    Course
    """
    runs = min(runs, FEW) if problem.repeated else runs
    reference = float(f"{problem.reference(runs, seed):.3g}")
    at = tuple(updates(problem).tolist())
    return Course(problem.name, at, problem.since, reference, problem.unit)


def write(path: Any, courses: Iterable[Course], found: Iterable[History]) -> None:
    """Store histories, a line each, in whole steps of ``STEP``.

    Parameters
    ----------
    path : path
    courses : iterable of Course
    found : iterable of History
    """
    heads = [json.dumps(course) for course in courses]
    lines = [json.dumps([*h[:3], _whole(h.error), _whole(h.claim)]) for h in found]
    parts = [
        f'"{name}": [\n' + ",\n".join(rows) + "\n]"
        for name, rows in zip(_PARTS, (heads, lines), strict=True)
    ]
    stored_arrays.write(Path(path), f"{{{', '.join(parts)}}}\n".encode())


def _whole(logs: Iterable[float]) -> list[int | None]:
    return [None if np.isnan(x) else round(x / STEP) for x in logs]


def read(path: Any = None) -> tuple[dict[str, Course], list[History]]:
    """Stored histories.

    Parameters
    ----------
    path : path, optional
        By default the library's own: ``RUNS`` runs of every pair.

    Returns
    -------
    dict of problem to Course, list of History

    Raises
    ------
    ValueError
        A file of something else.
    """
    file = files("navfilters.problems") / FILE if path is None else Path(path)
    stored = json.loads(file.read_text(encoding="utf-8"))
    if not isinstance(stored, dict) or tuple(stored) != _PARTS:
        raise ValueError(f"path must be a file of {' and '.join(_PARTS)}; found other JSON")
    courses = [Course(name, tuple(at), *rest) for name, at, *rest in stored["courses"]]
    found = [
        History(problem, cure, value, _logarithms(error), _logarithms(claim))
        for problem, cure, value, error, claim in stored["histories"]
    ]
    return {course.problem: course for course in courses}, found


def _logarithms(line: Iterable[int | None]) -> tuple[float, ...]:
    return tuple(np.nan if x is None else round(STEP * x, 2) for x in line)


def main(arguments: Sequence[str] | None = None) -> None:
    """Compute the histories of every pair, and store them.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.
    """
    parser = argparse.ArgumentParser(description="Error and claim of every cure on every patient.")
    parser.add_argument("--runs", type=int, default=RUNS, help="of each pair")
    parser.add_argument("--out", default=FILE, help="file of the histories")
    chosen = parser.parse_args(arguments)
    at_least(parser, "--runs", chosen.runs, 1)
    patients, found = problems(full=True).values(), []
    for problem in patients:
        sys.stderr.write(f"{problem.name}\n")
        found += [h for cure in CURES for h in histories(problem, cure, chosen.runs)]
    write(chosen.out, [course(problem, chosen.runs) for problem in patients], found)
    sys.stdout.write(f"{len(found)} histories in {chosen.out}\n")


if __name__ == "__main__":
    command(main)
