"""A filter tried on a problem, and what became of it."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from navfilters.problems.problem import LOST, Problem
from navfilters.runs.chi_square import chi_square_band
from navfilters.runs.consistency import nees, nis
from navfilters.runs.sweeping import sweep
from navfilters.types import Array, Gaussian

CONFIDENCE = 0.999
"""Of the band in which an honest filter's mean NEES lies: a table has some 300 of them."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of a problem under a filter; an axis (...) is that of its settings.

    Parameters
    ----------
    rms, median : float array (...)
        Over the runs, of each run's root mean square error in the window; in the problem's unit.
    reference : float
        Of the best honest estimate.
    lost : float array (...)
        Share of the runs: see ``LOST``.
    nees : float array (...)
        At the end, mean over the runs that have one; infinite if half of them have none.
    dof : int
        What it is for an honest filter: the size of the error.
    band : tuple of float
        Where an honest filter's mean lies.
    nis : float array (...)
        Mean over all updates and runs, over the number of measurements: 1 if honest; NaN of a
        filter that tells no innovations.
    covered : float array (...)
        Share of the runs whose NEES is within the 95 % quantile.
    """

    rms: Array
    median: Array
    reference: float
    lost: Array
    nees: Array
    dof: int
    band: tuple[float, float]
    nis: Array
    covered: Array

    @property
    def ratio(self) -> Array:
        """The error over that of the best honest estimate, (...)."""
        return self.rms / self.reference

    @property
    def honesty(self) -> Array:
        """NEES over its expectation, (...): above 1 is over-confident."""
        return self.nees / self.dof

    @property
    def honest(self) -> Array:
        """-1 too cautious, 0 in the band, 1 over-confident or without a NEES, (...)."""
        low, high = self.band
        return np.where(self.nees < low, -1, np.where(self.nees <= high, 0, 1))


class History(NamedTuple):
    """What a filter said after every step of its runs.

    Parameters
    ----------
    estimate : Gaussian
        mean (steps + 1, ..., n) and cov (steps + 1, ..., n, n), the prior first.
    innovation, S : array (steps + 1, ..., m), (steps + 1, ..., m, m), optional
        NaN at the prior; None of a filter that tells no innovations.
    """

    estimate: Gaussian
    innovation: Array | None
    S: Array | None


def treat(
    problem: Problem,
    estimator: Any,
    runs: int = 100,
    seed: int = 0,
    *,
    believed: Problem | None = None,
    settings: int | None = None,
) -> Outcome:
    """Try a filter on some runs of a problem.

    Parameters
    ----------
    problem : Problem
    estimator : Filter
    runs : int
    seed : int
    believed : Problem, optional
        The same, with what the filter is told of model and dynamics in the place of the problem's
        own; the truth and the reference stay.
    settings : int, optional
        How many settings are tried side by side: options of the filter, or of the dynamics, that
        are arrays (settings, 1).

    Returns
    -------
    Outcome
        Of arrays (settings,), or of numbers without ``settings``.

    Raises
    ------
    ValueError, TypeError, SweepError
        As of ``sweep``: a filter that does not fit the problem.
    """
    told = problem if believed is None else believed
    history = follow(told, estimator, runs, seed, settings=settings)
    return judge(problem, history, runs, seed, believed=believed, settings=settings)


def follow(
    problem: Problem,
    estimator: Any,
    runs: int,
    seed: int = 0,
    *,
    settings: int | None = None,
    **place: Any,
) -> History:
    """Run a filter on a problem.

    Parameters
    ----------
    problem, estimator, runs, seed, settings
        As of :func:`treat`.
    **place
        ``workers``, ``chunk`` and ``progress`` of ``sweep``; here and silently by default.

    Returns
    -------
    History
    """
    draw = problem.drawn(runs, seed)
    kept = sweep(
        estimator,
        draw.prior,
        draw.z if settings is None else draw.z[:, None],
        problem.model,
        dynamics=problem.dynamics,
        z_per_step=True,
        record=_kept,
        **{"workers": 1, "progress": False} | place,
    ).record
    return History(*kept)


def judge(
    problem: Problem,
    history: History,
    runs: int,
    seed: int = 0,
    *,
    believed: Problem | None = None,
    settings: int | None = None,
) -> Outcome:
    """What became of a problem.

    Parameters
    ----------
    problem, runs, seed, believed, settings
        As of :func:`treat`.
    history : History
        Of the runs with that seed.

    Returns
    -------
    Outcome
    """
    told = problem if believed is None else believed
    draw = told.drawn(runs, seed)
    batch = (runs,) if settings is None else (settings, runs)
    front = (slice(None),) if settings is None else (slice(None), None)
    (mean, cov), innovation, S = history
    window = slice(problem.since, None)
    truth, seen = (
        problem.drawn(runs, seed).truth[front],
        mean if told.back is None else told.back(mean),
    )
    with np.errstate(all="ignore"):  # a run that fails is no number, and lost
        error = problem.error(seen[window], truth[window])
        square = np.mean(np.sum(error[..., list(problem.judged)] ** 2, axis=-1), axis=0)
        each = np.sqrt(np.broadcast_to(square, batch))
        last = nees_of(problem, told.error(mean[-1], draw.truth[front][-1]), cov[-1])
    each, last = np.where(np.isfinite(each), each, np.inf), np.broadcast_to(last, batch)
    reference = problem.reference(runs, seed)
    dof = cov.shape[-1] if problem.tested is None else len(problem.tested)
    counted = np.isfinite(last)
    total, count = np.where(counted, last, 0.0).sum(axis=-1), counted.sum(axis=-1)
    low, high = chi_square_band(dof, 1 if problem.repeated else runs, CONFIDENCE)
    quantile = chi_square_band(dof, 1, 0.9)[1]  # 95 % are below it
    return Outcome(
        rms=np.sqrt(np.mean(each**2, axis=-1)),
        median=np.median(each, axis=-1),
        reference=reference,
        lost=np.mean(~(each <= LOST * reference), axis=-1),
        nees=np.where(2 * count >= runs, total / np.maximum(count, 1), np.inf),
        dof=dof,
        band=(float(low), float(high)),
        nis=_mean_nis(innovation, S),
        covered=np.mean(counted & (last <= quantile), axis=-1),
    )


def _mean_nis(innovation: Array | None, S: Array | None) -> Array:
    """Over updates and runs, over the number of measurements; NaN of a filter that has none."""
    if innovation is None or S is None:
        return np.array(np.nan)
    with np.errstate(all="ignore"):
        return np.nanmean(nis(innovation[1:], S[1:]), axis=(0, -1)) / S.shape[-1]


def nees_of(problem: Problem, error: Array, cov: Array) -> Array:
    """NEES of the components that a problem tests.

    Parameters
    ----------
    problem : Problem
    error, cov : array (..., n), (..., n, n)

    Returns
    -------
    array (...)
    """
    if problem.tested is None:
        return nees(error, cov)
    kept = np.array(problem.tested)
    return nees(error[..., kept], cov[..., kept[:, None], kept])


def _kept(state: Any) -> Any:
    return state.estimate, state.innovation, state.S
