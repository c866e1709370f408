"""The experiment of Xiong et al. over many seeds."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from navfilters.papers.xiong2009.experiment import ESTIMATORS, VARIANTS, Setup, _named, _variant
from navfilters.papers.xiong2009.true_flight import truth
from navfilters.runs import records
from navfilters.runs.loop import run
from navfilters.space.inertial_orbit import Orbit
from navfilters.space.thrust import COASTING
from navfilters.types import Array

AT_A_TIME = 1000
"""Paths worked on at a time, which fit the cache."""


def noise(seeds: Iterable[int], setup: Setup = VARIANTS["A"]) -> Array:
    """Standard normal noise of each update, seed and star, (updates, seeds, m).

    Parameters
    ----------
    seeds : iterable of int
        Each has its own stream, ``numpy.random.default_rng(seed)``, whatever the others are.
    setup : Setup

    Returns
    -------
    array (updates, seeds, m)
        To be multiplied by ``setup.sigma``.

    Raises
    ------
    ValueError
        No seeds, or something that is not a seed.
    """
    updates, m = setup.duration // setup.interval, len(setup.stars)
    try:
        streams = [np.random.default_rng(seed) for seed in seeds]
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"seeds must be integers of at least 0; found {seeds!r} ({error})"
        ) from None
    if not streams:
        raise ValueError("seeds must be at least one integer; found none")
    return np.stack([stream.standard_normal((updates, m)) for stream in streams], axis=1)


def measurements(setup: Setup = VARIANTS["A"], seeds: Iterable[int] = range(20)) -> Array:
    """What the sensor measures along the true flight.

    Parameters
    ----------
    setup : Setup
    seeds : iterable of int

    Returns
    -------
    array (updates, ..., seeds, m)
        The angles, rad: (38) with ``noise``. The axes between are those of the set-up's noises.
    """
    perfect = setup.sensor.h(truth(setup).states[setup.interval :: setup.interval])
    sigma = setup.sigma[..., None]
    return np.stack([z + sigma * v for z, v in zip(perfect, noise(seeds, setup), strict=True)])


def fly(
    estimator: Any,
    setup: Setup = VARIANTS["A"],
    seeds: Iterable[int] = range(20),
    *,
    knows_thrust: bool = False,
    record: Callable[[Any], Any] = records.estimate,
) -> Any:
    """A filter through the flight, all seeds in one batch.

    Parameters
    ----------
    estimator : Filter
        With any tuning; tuning arrays (..., 1) put their axes in front of the seeds.
    setup : Setup
    seeds : iterable of int
    knows_thrust : bool
        Whether the filter's dynamics have the true thrust.
    record : callable
        What to keep of each state, as of ``run``.

    Returns
    -------
    Gaussian
        mean (updates + 1, ..., seeds, 6), m and m/s, and cov (updates + 1, ..., seeds, 6, 6) after
        each update, the first estimate in front; or as ``record`` returns it. Not finite from where
        a member failed.
    """
    z = measurements(setup, seeds)
    orbit = _orbit(setup, knows_thrust)
    return run(
        estimator, setup.prior, z, setup.sensor, dynamics=orbit, z_per_step=True, record=record
    )


def errors_each_second(
    mean: Array, setup: Setup = VARIANTS["A"], *, knows_thrust: bool = False, since: int = 0
) -> Array:
    """Position errors at every whole second of a flight, from its estimates at the updates.

    Parameters
    ----------
    mean : array (updates + 1, ..., 6)
        Estimates, m and m/s, the first in front: ``fly(...).mean``.
    setup : Setup
    knows_thrust : bool
        As of the flight.
    since : int
        First second to be kept.

    Returns
    -------
    array (duration + 1 - since, ..., 3)
        Truth minus estimate, m: of predictions between the measurements, and of the updated
        estimate at their times.
    """
    first = max(0, -(-since // setup.interval) - 1)  # the interval that since ends or lies in
    starts, every = mean[first:-1], round(1 / setup.step)
    times = setup.interval * np.arange(first, len(mean) - 1.0)
    orbit, batch = _orbit(setup, knows_thrust), mean.shape[1:-1]
    # Components first in memory, as in a path.
    estimate = np.moveaxis(np.empty((3, 1 + len(starts) * setup.interval, *batch)), 0, -1)
    estimate[:1] = starts[:1, ..., :3]
    intervals = estimate[1:].reshape(len(starts), setup.interval, *batch, 3)
    size = max(1, AT_A_TIME // max(1, mean[0, ..., 0].size))
    with np.errstate(all="ignore"):  # a member that fails is not finite in the result
        for first_of in range(0, len(starts), size):
            some = slice(first_of, first_of + size)
            path = orbit.path(starts[some], times[some])[every - 1 :: every, ..., :3]
            intervals[some] = np.swapaxes(path, 0, 1)
    intervals[:, -1] = mean[first + 1 :, ..., :3]
    kept = setup.duration + 1 - since
    true = truth(setup).states[-kept:, :3]
    return true.reshape(kept, *(1,) * (estimate.ndim - 2), 3) - estimate[-kept:]


def errors(
    estimator: Any,
    setup: Setup = VARIANTS["A"],
    seeds: Iterable[int] = range(20),
    *,
    knows_thrust: bool = False,
    since: int = 0,
) -> Array:
    """Position error of a filter at every whole second, all seeds in one batch.

    Parameters
    ----------
    estimator, setup, seeds, knows_thrust
        As of :func:`fly`.
    since : int
        First second to be kept.

    Returns
    -------
    array (duration + 1 - since, ..., seeds, 3)
        As of :func:`errors_each_second`; not finite from where a member failed.
    """
    mean = fly(estimator, setup, seeds, knows_thrust=knows_thrust, record=_mean)
    return errors_each_second(mean, setup, knows_thrust=knows_thrust, since=since)


def _orbit(setup: Setup, knows_thrust: bool) -> Orbit:
    """The filter's dynamics."""
    return setup.orbit(truth(setup).thrust if knows_thrust else COASTING)


def _mean(state: Any) -> Array:
    return state.estimate.mean


def root_mean_square(error: Array) -> Array:
    """sigma_x, sigma_y, sigma_z and their root sum of squares over time, m.

    Parameters
    ----------
    error : array (n + 1, ..., 3)
        Errors at each second of the window, m; or standard deviations, for a bound.

    Returns
    -------
    array (..., 4)

    References
    ----------
    xiong2009, Eqs. (42), (43): n + 1 terms, divided by n - 1 as printed.
    """
    squares = np.sum(error**2, axis=0) / (len(error) - 2)
    total = np.sum(squares, axis=-1, keepdims=True)
    return np.sqrt(np.concatenate([squares, total], axis=-1))


def rms_error(filter_name: str, variant: str = "A", seeds: Iterable[int] = range(20)) -> Array:
    """RMS position errors of one filter over the last 2000 s, a row of Table 1 for each seed.

    Parameters
    ----------
    filter_name : str
        A key of ``ESTIMATORS``.
    variant : {"A", "B", "C", "D"}
        The reading of the noise, a key of ``VARIANTS``.
    seeds : iterable of int
        One run each.

    Returns
    -------
    array (seeds, 4)
        sigma_x, sigma_y, sigma_z and sigma_p, m.

    Raises
    ------
    ValueError
        A name that is not known, or bad seeds.

    References
    ----------
    xiong2009, Table 1 and Eqs. (42), (43).
    """
    estimator, setup = _named("filter_name", filter_name, ESTIMATORS), _variant(variant)
    error = errors(
        estimator.filter,
        setup,
        seeds,
        knows_thrust=estimator.knows_thrust,
        since=setup.duration - setup.window,
    )
    with np.errstate(all="ignore"):
        return root_mean_square(error)


def position_errors(
    filter_name: str, variant: str = "A", seeds: Iterable[int] = range(20)
) -> Array:
    """Distance between truth and estimate at every whole second, for Figs. 2 to 5.

    Parameters
    ----------
    filter_name : str
        A key of ``ESTIMATORS``.
    variant : {"A", "B", "C", "D"}
        A key of ``VARIANTS``.
    seeds : iterable of int

    Returns
    -------
    array (seeds, duration + 1)
        Metres; the updated estimate's at measurement times.

    Raises
    ------
    ValueError
        A name that is not known, or bad seeds.
    """
    estimator, setup = _named("filter_name", filter_name, ESTIMATORS), _variant(variant)
    error = errors(estimator.filter, setup, seeds, knows_thrust=estimator.knows_thrust)
    with np.errstate(all="ignore"):
        return np.linalg.norm(error, axis=-1).T
