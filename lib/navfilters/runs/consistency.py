"""Whether a filter's errors are as large as it believes: tests over Monte Carlo runs.

Errors are (..., n) with their covariances (..., n, n). Of their leading axes the caller names that
of the independent runs, ``runs_axis``, and the others are kept: 1 for a history of ``run``, of
shape (steps + 1, runs, n), 0 for one time of it. Innovations and S may take their place.
Runs that are not finite are left out and counted. For the host: NumPy and scipy.special.
"""

from typing import Any, NamedTuple

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.chi_square import quantile
from navfilters.numerics.small_matrices import cholesky, whitened_square
from navfilters.runs.chi_square import chi_square_band, tail_of


def nees(error: Any, cov: Any) -> np.ndarray:
    """Normalised estimation error squared, e^T P^-1 e.

    Parameters
    ----------
    error : array (..., n)
        Truth minus estimate.
    cov : array (..., n, n)
        The covariance that the filter gave it; only the lower triangle is read.

    Returns
    -------
    ndarray (...)
        Chi-square of n degrees of freedom for a consistent filter: n on average. NaN where either
        is not finite or the covariance is not positive definite.

    Notes
    -----
    e^T P^-1 e = w^T w with L w = e, by the Cholesky factor of P scaled to a unit diagonal, since
    metres stand beside microradians.
    """
    return _square(("error", error), ("cov", cov))


def _square(of: tuple[str, Any], by: tuple[str, Any]) -> np.ndarray:
    """A normalised square, of arguments with the caller's names for them."""
    error = validation.real_array(*of, "n", finite=False)
    cov = validation.real_array(*by, "n, n", finite=False)
    validation.core(by[0], cov, error.shape[-1:] * 2)
    variance = np.diagonal(cov, axis1=-2, axis2=-1)
    scale = 1 / np.sqrt(np.where(variance > 0, variance, np.nan))
    L = cholesky(scale[..., :, None] * cov * scale[..., None, :])
    return whitened_square(L, scale * error)


def nis(innovation: Any, S: Any) -> np.ndarray:
    """Normalised innovation squared, y^T S^-1 y.

    Parameters
    ----------
    innovation : array (..., m)
        Measured minus expected.
    S : array (..., m, m)
        The covariance that the filter gave it; only the lower triangle is read. One that was
        enlarged by underweighting makes the NIS smaller than m on average, even in a consistent
        filter.

    Returns
    -------
    ndarray (...)
        As for :func:`nees`, with m degrees of freedom; NaN where there was no measurement.
    """
    return _square(("innovation", innovation), ("S", S))


class MeanNees(NamedTuple):
    """The average of a normalised square over runs, and the band of a consistent filter.

    Parameters
    ----------
    mean : ndarray (...)
    low, high : ndarray (...)
        The band in which it lies with the stated confidence.
    runs : int ndarray (...)
        How many runs were averaged.
    """

    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray
    runs: np.ndarray


def mean_nees(error: Any, cov: Any, *, runs_axis: int, confidence: float = 0.95) -> MeanNees:
    """NEES averaged over the runs; NIS if given innovations and S.

    Parameters
    ----------
    error, cov : array (..., n), (..., n, n)
    runs_axis : int
        The axis of ``error`` that is averaged; negative ones count from the end.
    confidence : float

    Returns
    -------
    MeanNees

    Raises
    ------
    ValueError
        No finite run, no such axis, a confidence not between 0 and 1, or arrays that do not fit.

    Notes
    -----
    It finds combinations of states that are wrong although each state by itself looks right.
    """
    error, cov = _runs_first(error, cov, runs_axis)
    each = nees(error, cov)
    runs = _counted(np.isfinite(each), 1)
    low, high = chi_square_band(error.shape[-1], runs, confidence)
    return MeanNees(np.nansum(each, axis=0) / runs, low, high, runs)


class SampleDeviation(NamedTuple):
    """The spread of the errors over runs beside the spread that the filter predicts.

    Parameters
    ----------
    mean : ndarray (..., n)
        Average error.
    sample : ndarray (..., n)
        Standard deviation of the errors about their mean.
    low, high : ndarray (..., n)
        Confidence interval of the deviation that the errors were drawn from.
    predicted : ndarray (..., n)
        Root of the average of the filter's variances over the same runs.
    runs : int ndarray (...)
        How many runs were used.
    """

    mean: np.ndarray
    sample: np.ndarray
    low: np.ndarray
    high: np.ndarray
    predicted: np.ndarray
    runs: np.ndarray


def sample_deviation(
    error: Any, cov: Any, *, runs_axis: int, confidence: float = 0.95
) -> SampleDeviation:
    """Sample against predicted deviation of each component.

    Parameters
    ----------
    error, cov : array (..., n), (..., n, n)
    runs_axis, confidence : int, float
        As for :func:`mean_nees`; of each interval by itself: (k - 1) s^2 / sigma^2 is chi-square of
        k - 1 degrees of freedom.

    Returns
    -------
    SampleDeviation

    Raises
    ------
    ValueError
        As for :func:`mean_nees`; fewer than two finite runs.
    """
    tail = tail_of(confidence)
    error, cov = _runs_first(error, cov, runs_axis)
    used = np.isfinite(error).all(-1) & np.isfinite(cov).all((-2, -1))
    runs = _counted(used, 2)
    k, keep = runs[..., None], used[..., None]
    mean = np.sum(np.where(keep, error, 0.0), axis=0) / k
    sample = np.sqrt(np.sum(np.where(keep, error - mean, 0.0) ** 2, axis=0) / (k - 1))
    variance = np.where(keep, np.diagonal(cov, axis1=-2, axis2=-1), 0.0)
    low, high = (sample * np.sqrt((k - 1) / quantile(p, k - 1)) for p in (1 - tail, tail))
    return SampleDeviation(mean, sample, low, high, np.sqrt(np.sum(variance, axis=0) / k), runs)


class Coverage(NamedTuple):
    """How many runs lie within k predicted deviations.

    Parameters
    ----------
    fraction : ndarray (..., n)
    low, high : ndarray (..., n)
        Confidence interval of the probability behind it.
    expected : float
        That of a consistent, Gaussian error.
    runs : int ndarray (...)
        How many runs were used.
    """

    fraction: np.ndarray
    low: np.ndarray
    high: np.ndarray
    expected: float
    runs: np.ndarray


def coverage(
    error: Any, cov: Any, k: float = 3.0, *, runs_axis: int, confidence: float = 0.95
) -> Coverage:
    """Fraction of runs in which each component is within k predicted deviations.

    Parameters
    ----------
    error, cov : array (..., n), (..., n, n)
    k : float
        How many deviations.
    runs_axis, confidence : int, float
        As for :func:`mean_nees`; of each interval by itself, at least, after Clopper and Pearson.

    Returns
    -------
    Coverage

    Raises
    ------
    ValueError
        As for :func:`mean_nees`; a k that is not positive.
    """
    tail = tail_of(confidence)
    k = validation.number("k", k)
    if k <= 0:
        raise ValueError(f"k must be a positive number of deviations; found {k}")
    error, cov = _runs_first(error, cov, runs_axis)
    used = np.isfinite(error).all(-1) & np.isfinite(cov).all((-2, -1))
    runs = _counted(used, 1)
    n = runs[..., None]
    variance = np.diagonal(cov, axis1=-2, axis2=-1)
    hits = np.sum(used[..., None] & (error**2 <= k * k * variance), axis=0)
    from scipy.special import betaincinv, chdtr  # see quantile

    low = np.where(hits > 0, betaincinv(np.maximum(hits, 1), n - hits + 1, tail), 0.0)
    high = np.where(hits < n, betaincinv(hits + 1, np.maximum(n - hits, 1), 1 - tail), 1.0)
    expected = float(chdtr(1, k * k))
    return Coverage(hits / n, low, high, expected, runs)


def _runs_first(error: Any, cov: Any, runs_axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Errors and covariances with the same leading axes, that of the runs moved to the front."""
    error = validation.real_array("error", error, "", finite=False)
    cov = validation.real_array("cov", cov, "", finite=False)
    n = error.shape[-1] if error.ndim else 0
    if error.ndim < 2 or cov.shape[-2:] != (n, n):
        raise ValueError(
            "error and cov must have shapes (..., n) and (..., n, n), with an axis of runs; "
            f"found {error.shape} and {cov.shape}"
        )
    whole = isinstance(runs_axis, int | np.integer) and not isinstance(runs_axis, bool)
    axis = runs_axis - error.ndim if whole and runs_axis >= 0 else runs_axis  # arrays align there
    if not whole or not -error.ndim <= axis < -1:
        raise ValueError(
            f"runs_axis must name an axis of error before its last, 0 to {error.ndim - 2}; "
            f"found {runs_axis}, and error of shape {error.shape}"
        )
    batch = validation.batch(error=error.shape[:-1], cov=cov.shape[:-2])
    error, cov = np.broadcast_to(error, (*batch, n)), np.broadcast_to(cov, (*batch, n, n))
    return np.moveaxis(error, axis, 0), np.moveaxis(cov, axis - 1, 0)


def _counted(used: np.ndarray, needed: int) -> np.ndarray:
    runs = np.sum(used, axis=0)
    if np.any(runs < needed):
        raise ValueError(
            f"error and cov must hold at least {needed} finite runs; found {np.min(runs)}"
        )
    return runs
