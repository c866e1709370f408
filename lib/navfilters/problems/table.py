"""Every cure on every problem."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from navfilters.numerics.extras import needed
from navfilters.problems.catalogue import problems
from navfilters.problems.cures import Cure, UnfitError
from navfilters.problems.evaluations import evaluations
from navfilters.problems.later_cures import CURES
from navfilters.problems.outcome import Outcome, treat
from navfilters.problems.problem import Draw, Problem

FEW = 3
"""Runs of a problem whose runs share their measurements."""

TOGETHER = 4
"""Cures of one problem that a process tries in one go."""


SETTLED = 0.2
"""How far an error may move with the last bits of the first estimates and still be one."""


@dataclass(frozen=True)
class Cell:
    """One cure on one problem.

    Parameters
    ----------
    problem, cure : str
    value : float, optional
        Of the cure's parameter; none where it has none.
    ratio, median : float
        Error over the reference: root mean square and median over the runs.
    lost, covered : float
        Shares of the runs.
    honesty : float
        NEES over its expectation.
    honest : int
        -1 too cautious, 0 in the band, 1 over-confident.
    nis : float
        Over its expectation.
    evaluations : int
        States at which models are evaluated in one step.
    settled : bool
        Whether error and ``honest`` come again if the first estimates move by one unit in the last
        place. Where not, or where the error is infinite, they tell only that the filter is lost.
    reason : str
        Why the cure cannot act here; then all else is empty.
    """

    problem: str
    cure: str
    value: float | None = None
    ratio: float = np.nan
    median: float = np.nan
    lost: float = np.nan
    covered: float = np.nan
    honesty: float = np.nan
    honest: int = 0
    nis: float = np.nan
    evaluations: int = 0
    settled: bool = True
    reason: str = ""


def cells(
    problem: Problem, cure: Cure, runs: int, seed: int = 0, *, scan: bool = True
) -> list[Cell]:
    """A cure on a problem with its own value, and with every other value to be tried.

    Parameters
    ----------
    problem : Problem
    cure : Cure
    runs : int
        At most ``FEW`` are flown where runs share their measurements.
    seed : int
    scan : bool
        Whether the other values are tried.

    Returns
    -------
    list of Cell
        That of the cure's own value first.
    """
    runs = min(runs, FEW) if problem.repeated else runs
    try:
        believed, estimator = cure.apply(problem, cure.value)
    except UnfitError as reason:
        return [Cell(problem.name, cure.name, reason=str(reason))]
    cost = evaluations(believed, estimator)
    own = cure.value if cure.scanned else None
    outcome = treat(problem, estimator, runs, seed, believed=believed)
    found = [_cell(problem, cure, own, outcome, (), cost)]
    others = [value for value in cure.scanned if scan and value != cure.value]
    if others:
        believed, estimator = cure.apply(problem, np.array(others)[:, None])
        outcome = treat(problem, estimator, runs, seed, believed=believed, settings=len(others))
        found += [_cell(problem, cure, v, outcome, (i,), cost) for i, v in enumerate(others)]
    return found


def _cell(
    problem: Problem, cure: Cure, value: Any, outcome: Outcome, i: tuple[int, ...], cost: int
) -> Cell:
    names = ("ratio", "lost", "covered", "honesty", "nis")
    numbers: dict[str, Any] = {name: float(np.asarray(getattr(outcome, name))[i]) for name in names}
    numbers["median"] = float(np.asarray(outcome.median)[i]) / outcome.reference
    honest = int(np.asarray(outcome.honest)[i])
    return Cell(problem.name, cure.name, value, honest=honest, evaluations=cost, **numbers)


def table(
    runs: int = 40,
    *,
    patients: Mapping[str, Problem] | None = None,
    cures: Iterable[Cure] = CURES,
    workers: int | None = 1,
    progress: Callable[..., Iterable[Any]] = lambda parts, total=None: parts,
) -> list[Cell]:
    """Every cure on every problem.

    Parameters
    ----------
    runs : int
    patients : mapping, optional
        By default those of ``problems()``.
    cures : iterable of Cure
    workers : int, optional
        Processes; more than one need joblib. By default one, with None one per core.
    progress : callable
        (parts, total=) -> parts: wraps the iterable of parts, a problem with some cures each.

    Returns
    -------
    list of Cell
        Problem by problem, in the order of the cures.
    """
    patients, cures = problems() if patients is None else patients, list(cures)
    size = len(cures) if workers == 1 else TOGETHER  # what they share is made once for each part
    parts = [
        (problem, cures[i : i + size], runs)
        for problem in patients.values()
        for i in range(0, len(cures), size)
    ]
    if workers == 1:
        return [cell for part in progress(parts, total=len(parts)) for cell in _part(*part)]
    joblib = needed("joblib", "navfilters[sweep]", "a table with workers")
    pool = joblib.Parallel(workers or joblib.cpu_count(), batch_size=1, return_as="generator")
    done = pool(joblib.delayed(_part)(*part) for part in parts)
    return [cell for row in progress(done, total=len(parts)) for cell in row]


def _part(problem: Problem, cures: list[Cure], runs: int) -> list[Cell]:
    return [cell for cure in cures for cell in settled(problem, cure, runs)]


def settled(problem: Problem, cure: Cure, runs: int) -> list[Cell]:
    """A cure on a problem as of ``cells``, and whether the last bits decide what becomes of it.

    Parameters
    ----------
    problem : Problem
    cure : Cure
    runs : int

    Returns
    -------
    list of Cell
    """
    both = (cells(p, cure, runs) for p in (problem, nudged(problem)))
    return [
        replace(cell, settled=_close(cell.ratio, other.ratio) and cell.honest == other.honest)
        for cell, other in zip(*both, strict=True)
    ]


def _close(a: float, b: float) -> bool:
    return math.isnan(a) or abs(a - b) <= SETTLED * min(a, b)  # of infinite ones, no


def nudged(problem: Problem) -> Problem:
    """The same problem, each number of its first estimates one unit in the last place larger.

    Parameters
    ----------
    problem : Problem

    Returns
    -------
    Problem
    """
    return replace(problem, draw=partial(_nudged, problem))


def _nudged(problem: Problem, runs: int, seed: int) -> Draw:
    draw = problem.drawn(runs, seed)
    mean = draw.prior.mean
    moved = np.where(mean == 0, mean, np.nextafter(mean, np.inf))
    return draw._replace(prior=draw.prior._replace(mean=moved))
