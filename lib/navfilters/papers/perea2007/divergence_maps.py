"""Where the filters of Perea et al. fail: I of Eq. (27) over first estimates and over noises."""

from typing import Any, Literal, NamedTuple

import numpy as np

from navfilters.models import RangeBearing
from navfilters.papers.perea2007.experiment import Setup, isotropic, position_error
from navfilters.runs.sweeping import sweep
from navfilters.types import Array, Gaussian

WINDOW = (-200.0, 400.0)
"""First estimates, units, in both directions: within 300 units of the truth, or 3 sigma."""

DEVIATIONS = (1.0, 1e6)
"""sigma of the first estimate, units."""

RATIOS = (1e-3, 1e4)
"""sigma_r / sigma_theta, units per radian; the bearing's noise is the paper's."""


def starts(size: int) -> Array:
    """First estimates on a square lattice around the truth.

    Parameters
    ----------
    size : int
        Points in each direction.

    Returns
    -------
    array (size, size, 2)
        Rows are x2, columns x1. The two are offset by a quarter of a cell, so that no point lies on
        the line of sight to the truth, x1 = x2, or on the jump of the bearing, x2 = 0: lines
        without width, which a lattice must not paint one cell wide.
    """
    low, high = WINDOW
    cell = (high - low) / size
    x1, x2 = (low + cell * (np.arange(size) + offset) for offset in (0.5, 0.25))
    return np.stack(np.meshgrid(x1, x2), axis=-1)


def noises(size: int) -> tuple[Array, Array]:
    """Deviations of the first estimate and noise ratios, both in geometric steps.

    Parameters
    ----------
    size : int
        Points in each direction.

    Returns
    -------
    tuple of array (size,)
        sigma, units, and sigma_r / sigma_theta, units per radian.
    """
    return np.geomspace(*DEVIATIONS, size), np.geomspace(*RATIOS, size)


def next_bit(mean: Any) -> Array:
    """The next larger floating-point number, in every component.

    Parameters
    ----------
    mean : array-like (..., n)

    Returns
    -------
    array (..., n)
    """
    return np.nextafter(np.asarray(mean, float), np.inf)


def indicator(
    estimator: Any,
    mean: Any,
    sigma: Any = Setup.sigma,
    R: Any = None,
    steps: int = Setup.steps,
    *,
    engine: Literal["numpy", "jax"] = "numpy",
    workers: int | None = 1,
    progress: bool = False,
) -> Array:
    """I of a filter: the last error over the first.

    Parameters
    ----------
    estimator : Filter, or whatever ``navfilters.sweep`` takes
    mean : array-like (..., 2)
        First estimate, units.
    sigma : array-like (...)
        Its deviation in each direction, units.
    R : array (..., 2, 2), optional
        Covariance of the noise; the paper's by default.
    steps : int
    engine, workers, progress
        Those of ``navfilters.sweep``.

    Returns
    -------
    array (...)
        NaN where the filter cannot go on.

    References
    ----------
    perea2007, Eq. (27).
    """
    setup, mean = Setup(), np.asarray(mean, float)
    shape = np.broadcast_shapes(mean.shape[:-1], np.shape(sigma))
    priors = isotropic(np.broadcast_to(mean, (*shape, 2)), np.broadcast_to(sigma, shape))
    end: Gaussian = sweep(
        estimator,
        priors,
        setup.z,
        setup.model if R is None else RangeBearing(R, wrap=False),
        steps,
        engine=engine,
        workers=workers,
        progress=progress,
    ).final
    return position_error(end.mean, setup.x_true) / position_error(mean, setup.x_true)


def over_starts(estimator: Any, size: int, *, changed: bool = False, **options: Any) -> Array:
    """I over the plane of first estimates.

    Parameters
    ----------
    estimator : Filter
    size : int
    changed : bool
        Whether the first estimates are changed in their last bit.
    **options
        Those of ``indicator``.

    Returns
    -------
    array (size, size)
    """
    mean = starts(size)
    return indicator(estimator, next_bit(mean) if changed else mean, **options)


def over_noises(estimator: Any, size: int, *, changed: bool = False, **options: Any) -> Array:
    """I from the paper's first estimate, over its deviation and the ratio of the noises.

    Parameters
    ----------
    estimator : Filter
    size : int
    changed : bool
        Whether the first estimate is changed in its last bit.
    **options
        Those of ``indicator``.

    Returns
    -------
    array (size, size)
        Rows are ratios, columns deviations.
    """
    mean = np.asarray(Setup.x0)
    sigma, R = _of_noises(size)
    return indicator(estimator, next_bit(mean) if changed else mean, sigma, R, **options)


def _of_noises(size: int) -> tuple[Array, Array]:
    """sigma (size,) and R (size, 1, 2, 2) of a map of noises."""
    variance, (sigma, ratio) = Setup().bearing_variance, noises(size)
    R = np.zeros((size, 1, 2, 2))
    R[..., 1, 1] = variance
    R[:, 0, 0, 0] = variance * ratio**2
    return sigma, R


class Maps(NamedTuple):
    """I of Eq. (27), a ratio without unit, of one filter.

    Parameters
    ----------
    starts, changed : array (size, size)
        Over the plane of first estimates, as they are and changed in their last bit.
    noises : array (few, few)
        Over the noises.
    """

    starts: Array
    changed: Array
    noises: Array


def over_both(estimator: Any, size: int, few: int) -> Maps:
    """Small maps in one sweep: a step of some thousand members costs little more than of one.

    Parameters
    ----------
    estimator : Filter
    size, few : int
        Points in each direction, of the maps of first estimates and of that of noises.

    Returns
    -------
    Maps
        To the last bit those of ``over_starts`` and ``over_noises``.
    """
    setup, mean, (sigma, R) = Setup(), starts(size), _of_noises(few)
    n, m = size**2, few**2
    plane = mean.reshape(n, 2)
    I = indicator(
        estimator,
        np.concatenate([plane, next_bit(plane), np.broadcast_to(setup.x0, (m, 2))]),
        np.concatenate([np.full(2 * n, setup.sigma), np.tile(sigma, few)]),
        np.concatenate([np.tile(setup.model.R, (2 * n, 1, 1)), np.repeat(R[:, 0], few, axis=0)]),
    )
    first, changed, noise = np.split(I, [n, 2 * n])
    return Maps(first.reshape(size, size), changed.reshape(size, size), noise.reshape(few, few))


def relative_change(I: Any, changed: Any) -> Array:
    """Relative change of I, at least one unit of the last place; NaN where either is.

    Parameters
    ----------
    I, changed : array-like (...)

    Returns
    -------
    array (...)
    """
    I, changed = np.asarray(I, float), np.asarray(changed, float)
    floor = np.finfo(float).tiny
    return np.maximum(np.abs(changed - I) / np.maximum(I, floor), np.finfo(float).eps)


AXES = {
    "starts": ("first estimate, $x_1$ (units)", "first estimate, $x_2$ (units)"),
    "noises": (
        "deviation of the first estimate (units)",
        r"$\sigma_r / \sigma_\theta$ (units per radian)",
    ),
}
"""What the axes of a map of first estimates, and of one of noises, say."""
