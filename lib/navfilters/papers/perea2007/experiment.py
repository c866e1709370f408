"""Perea, How, Breger and Elosegui (2007): range and bearing of a fixed point."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from navfilters.estimators import catalogue
from navfilters.estimators.filter import Filter
from navfilters.models import RangeBearing
from navfilters.numerics import validation
from navfilters.numerics.doors import takes
from navfilters.types import Array, Gaussian

FILTERS: dict[str, Filter] = {
    name: replace(f, form="short") for name, f in catalogue.FILTERS.items()
}
"""The ten filters as the paper has them: with the update of Eqs. (5)-(7) as it is printed."""


@dataclass(frozen=True)
class Setup:
    """The static experiment; change a field with ``dataclasses.replace`` and run again.

    Parameters
    ----------
    x_true : tuple of float
        The fixed position, units.
    x0 : tuple of float
        First estimate, units.
    sigma : float
        Deviation of the first estimate in each direction, units: P0 = sigma^2 I.
    range_variance : float
        sigma_r^2, units squared.
    bearing_variance : float
        sigma_theta^2, radians squared.
    steps : int
        Number of updates.

    References
    ----------
    perea2007, section III.
    """

    x_true: tuple[float, float] = (100.0, 100.0)
    x0: tuple[float, float] = (20.0, 80.0)
    sigma: float = 100.0
    range_variance: float = 2.5e-5
    bearing_variance: float = 6e-3
    steps: int = 1000

    @property
    def model(self) -> RangeBearing:
        """Range and bearing with this set-up's noise; bearings are not wrapped."""
        R = np.diag([self.range_variance, self.bearing_variance])
        return RangeBearing(R, wrap=False)

    @property
    def z(self) -> Array:
        """The perfect measurement h(x_true), (2,), taken at every step."""
        return self.model.h(np.array(self.x_true))

    @property
    def prior(self) -> Gaussian:
        """First estimate and P0 = sigma^2 I."""
        return isotropic(self.x0, self.sigma)


@takes(mean="n", sigma="")
def isotropic(mean: Any, sigma: Any) -> Gaussian:
    """A Gaussian that is equally uncertain in every direction.

    Parameters
    ----------
    mean : array-like (..., n)
        Units.
    sigma : array-like (...)
        Deviation, units.

    Returns
    -------
    Gaussian
        cov = sigma^2 I, (..., n, n).
    """
    variance = sigma[..., None, None] ** 2
    return Gaussian(mean, variance * np.eye(mean.shape[-1]))


@takes(x="n", x_true="n")
def position_error(x: Any, x_true: Any) -> Array:
    """Distance between an estimate and the truth, units.

    Parameters
    ----------
    x : array-like (..., n)
    x_true : array-like (..., n)

    Returns
    -------
    array (...)
    """
    return np.linalg.norm(x - x_true, axis=-1)


@takes(x_true="n")
def deviations(estimate: Gaussian, x_true: Any) -> Array:
    """How many of an estimate's own deviations the truth is away from it.

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n).
    x_true : array-like (..., n)

    Returns
    -------
    array (...)
        The Mahalanobis distance; of an indefinite covariance, the root of the square's size.
    """
    n = x_true.shape[-1:]
    mean, cov = (
        np.asarray(validation.given(f"estimate.{k}", part))
        for k, part in zip(("mean", "cov"), estimate, strict=True)
    )
    away = x_true - validation.core("estimate.mean", mean, n)
    weighed = np.linalg.solve(validation.core("estimate.cov", cov, 2 * n), away[..., None])[..., 0]
    return np.sqrt(np.abs((away * weighed).sum(axis=-1)))


def improvement(history: Gaussian, x_true: Any) -> Array:
    """The indicator I: the last error over the first.

    Parameters
    ----------
    history : Gaussian
        mean (steps + 1, ..., n).
    x_true : array-like (..., n)

    Returns
    -------
    array (...)
        Below 1 where the filter improved on its first estimate; NaN where it failed.

    References
    ----------
    perea2007, Eq. (27).
    """
    error = position_error(history.mean[[0, -1]], x_true)
    return error[1] / error[0]
