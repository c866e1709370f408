"""What the book's own filters make of a problem."""

from functools import cache
from typing import NamedTuple

import numpy as np

from navfilters.crash.problem_checks import patients
from navfilters.problems import CURES, Problem, own, read
from navfilters.problems.outcome import History, follow, nees_of
from navfilters.runs.chi_square import chi_square_band
from navfilters.runs.consistency import nis
from navfilters.types import Array


class Course(NamedTuple):
    """A filter's course through the runs of a problem.

    Parameters
    ----------
    error, claimed : array (steps + 1,)
        Medians over the runs: the error, and the deviation that the filter claims for it.
    nees : array (steps + 1,)
        Mean over the runs, over its expectation.
    nis : array (steps + 1,), optional
        The same of the innovations; None of a filter that tells none.
    """

    error: Array
    claimed: Array
    nees: Array
    nis: Array | None


def champion(problem: str) -> str:
    """The cure that is nearest to the bound among those that are honest there.

    Parameters
    ----------
    problem : str

    Returns
    -------
    str
        Its name; empty if there is none, or no such problem.
    """
    there = {cure: c for (p, cure), c in own(read()).items() if p == problem and not c.reason}
    sound = [c for c in there.values() if c.honest <= 0 and c.lost <= 0.05]
    return min(sound, key=lambda c: c.ratio).cure if sound else ""


def beside(problem: str) -> str:
    """In words: the plain EKF, and the best that is honest.

    Parameters
    ----------
    problem : str
        Its name; empty is returned for checks that are none.

    Returns
    -------
    str
    """
    cells = own(read())
    if (problem, "EKF") not in cells:
        return ""
    words = f"of the book's own filters the EKF loses {cells[problem, 'EKF'].lost:.0%}"
    if best := champion(problem):
        ratio = cells[problem, best].ratio
        words += f", and {best} is the best honest one, {ratio:.2g} times the bound"
    return words


@cache
def of_cure(problem: str, cure: str, runs: int) -> Course:
    """A cure's course through a problem.

    Parameters
    ----------
    problem, cure : str
        Names; the cure acts with the value of its text.
    runs : int

    Returns
    -------
    Course
    """
    given, chosen = patients()[problem], next(c for c in CURES if c.name == cure)
    told, estimator = chosen.apply(given, chosen.value)
    return course(given, follow(told, estimator, runs), runs, told)


def course(problem: Problem, history: History, runs: int, told: Problem | None = None) -> Course:
    """A course from what a filter said.

    Parameters
    ----------
    problem : Problem
    history : History
    runs : int
    told : Problem, optional
        What the filter was told, if that is another problem.

    Returns
    -------
    Course
    """
    told = problem if told is None else told
    (mean, cov), innovation, S = history
    judged = list(problem.judged)
    with np.errstate(all="ignore"):  # a run that fails is no number
        back = mean if told.back is None else told.back(mean)
        error = problem.error(back, problem.drawn(runs).truth)
        size = np.linalg.norm(error[..., judged], axis=-1)
        variances = np.diagonal(cov, axis1=-2, axis2=-1)[..., judged]
        square = nees_of(problem, told.error(mean, told.drawn(runs).truth), cov)
    dof = cov.shape[-1] if problem.tested is None else len(problem.tested)
    told_nis = None
    if innovation is not None and S is not None:
        measured = np.isfinite(innovation).sum(axis=-1)
        told_nis = _mean(nis_of(innovation, S), measured)
    claimed = np.sqrt(np.abs(variances.sum(axis=-1)))
    return Course(_median(size), _median(claimed), _mean(square, dof), told_nis)


def nis_of(innovation: Array, S: Array) -> Array:
    """NIS of what was measured: components that were not are left out."""
    gone = np.isnan(innovation)
    either = gone[..., :, None] | gone[..., None, :]
    with np.errstate(all="ignore"):
        square = nis(np.where(gone, 0.0, innovation), np.where(either, np.eye(S.shape[-1]), S))
    return np.where(gone.all(axis=-1), np.nan, square)


def band(dof: int, problem: Problem, runs: int) -> tuple[float, float]:
    """Where 95 % of the means of an honest filter's squares are, over their expectation."""
    low, high = chi_square_band(dof, 1 if problem.repeated else runs)
    return float(low) / dof, float(high) / dof


def _median(values: Array) -> Array:
    whole = np.where(np.isfinite(values), values, np.inf)
    found = np.median(whole, axis=-1)
    return np.where(np.isfinite(found), found, np.nan)


def _mean(values: Array, dof: Array | int) -> Array:
    """Over runs that have a number; NaN at steps where less than half of them have one."""
    good = np.isfinite(values)
    expected = np.where(good, dof, 0).sum(axis=-1)
    total = np.where(good, values, 0.0).sum(axis=-1)
    enough = 2 * good.sum(axis=-1) >= values.shape[-1]
    return np.where(enough & (expected > 0), total / np.maximum(expected, 1), np.nan)
