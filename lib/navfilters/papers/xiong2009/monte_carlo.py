"""The experiment of Xiong et al. over many seeds."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from navfilters.numerics.allocator import keep_freed_memory
from navfilters.papers.xiong2009.experiment import ESTIMATORS, VARIANTS, Setup, _named, _variant
from navfilters.papers.xiong2009.true_flight import truth
from navfilters.space.thrust import COASTING
from navfilters.types import Array


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


def errors(
    estimator: Any,
    setup: Setup = VARIANTS["A"],
    seeds: Iterable[int] = range(20),
    *,
    knows_thrust: bool = False,
    since: int = 0,
    progress: Callable[[Iterable], Iterable] = iter,
) -> Array:
    """Position error of a filter at every whole second, all seeds in one batch.

    Parameters
    ----------
    estimator : ExtendedKalman, RobustEKF, AdaptiveEKF or AdaptiveRobustEKF
        With any tuning; tuning arrays (..., 1) put their axes in front of the seeds.
    setup : Setup
    seeds : iterable of int
    knows_thrust : bool
        Whether the filter's dynamics have the true thrust.
    since : int
        First second to be kept.
    progress : callable
        Wraps the iterable of updates.

    Returns
    -------
    array (duration + 1 - since, ..., seeds, 3)
        Truth minus estimate, m: of predictions between the measurements, and of the updated
        estimate at their times. Not finite from where a member failed.
    """
    keep_freed_memory()
    flight, sensor, every = truth(setup), setup.sensor, round(1 / setup.step)
    orbit = setup.orbit(flight.thrust if knows_thrust else COASTING)
    v, sigma = noise(seeds, setup), setup.sigma[..., None]
    perfect = sensor.h(flight.states[setup.interval :: setup.interval])
    state = estimator.init(setup.prior)
    path = [state.estimate.mean[None, :3]]
    with np.errstate(all="ignore"):  # a member that fails is not finite in the result
        for k in progress(range(len(perfect))):
            t = k * setup.interval
            interval = orbit.interval(state.estimate.mean, float(t))
            state = estimator.step(state, perfect[k] + sigma * v[k], interval, sensor)
            if t + setup.interval >= since:
                seconds = interval.path[every - 1 :: every, ..., :3]
                path += [seconds[:-1], state.estimate.mean[None, ..., :3]]
    batch = state.estimate.mean.shape[:-1]
    kept = setup.duration + 1 - since
    estimate = np.concatenate([_in_batch(p, batch) for p in path])[-kept:]
    return _in_batch(flight.states[-kept:, :3], batch) - estimate


def _in_batch(path: Array, batch: tuple[int, ...]) -> Array:
    """A path (t, ..., 3) with all batch axes behind that of time."""
    missing = len(batch) + 2 - path.ndim
    path = path.reshape(len(path), *(1,) * missing, *path.shape[1:])
    return np.broadcast_to(path, (len(path), *batch, 3))


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


def rms_error(
    filter_name: str,
    variant: str = "A",
    seeds: Iterable[int] = range(20),
    *,
    progress: Callable[[Iterable], Iterable] = iter,
) -> Array:
    """RMS position errors of one filter over the last 2000 s, a row of Table 1 for each seed.

    Parameters
    ----------
    filter_name : str
        A key of ``ESTIMATORS``.
    variant : {"A", "B", "C"}
        The reading of the noise, a key of ``VARIANTS``.
    seeds : iterable of int
        One run each.
    progress : callable
        Wraps the iterable of updates.

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
        progress=progress,
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
    variant : {"A", "B", "C"}
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
