"""The same flight with other measurements than the paper's, or with errors that it leaves out."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from navfilters.papers.pogorelsky2020.experiment import Setup, of_case
from navfilters.papers.pogorelsky2020.noise_draws import first_estimate
from navfilters.papers.pogorelsky2020.open_loop import MonteCarlo, monte_carlo, simulate_images
from navfilters.papers.pogorelsky2020.timed_images import (
    TimedImages,
    sweep_speed,
    white_errors,
    with_pointing_noise,
)
from navfilters.papers.pogorelsky2020.true_flight import Truth, truth
from navfilters.runs.loop import run
from navfilters.space import offsets
from navfilters.space.image_sensor import SarPass
from navfilters.space.navigation_state import NavigationState
from navfilters.space.zero_doppler import ZeroDoppler
from navfilters.types import Array, Gaussian

ARCSECOND = np.deg2rad(1 / 3600)
Measured = Literal["antenna", "plane", "both"]
MEASURED: tuple[Measured, ...] = ("antenna", "plane", "both")
OFFSETS = {"azimuth": 2, "delay": 3}
"""Which of an image's five numbers is measured with which constant error."""


@dataclass(frozen=True)
class Trial:
    """What is measured, and with which errors.

    Parameters
    ----------
    measured : {"antenna", "plane", "both"}
        Beside range and speed: the two ratios, the plane of zero Doppler, or all three.
    clock : float
        Deviation of white errors of the images' times, s, of which the filter is told.
    late : float
        An error of all times that the filter is not told of, s.
    pointing : float
        Deviation of white errors of the body's attitude, arcseconds.
    told : bool
        Whether the filter is told of those.
    delay : float
        By how much all distances are measured too long, m; the filter is not told.

    Raises
    ------
    ValueError
        Another measurement.
    """

    measured: Measured = "plane"
    clock: float = 1e-4
    late: float = 0.0
    pointing: float = 0.0
    told: bool = True
    delay: float = 0.0

    def __post_init__(self) -> None:
        if self.measured not in MEASURED:
            raise ValueError(f"measured must be one of {list(MEASURED)}; found {self.measured!r}")


def fly(
    case: str | Setup,
    trials: Sequence[Trial],
    updates: int = 72,
    runs: int | Sequence[int] = 200,
    seed: int = 0,
    *,
    flight: Truth | None = None,
    estimator: Any = None,
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
) -> MonteCarlo:
    """All runs of all trials in one batch; the first estimates and images of ``monte_carlo``.

    Parameters
    ----------
    case, updates, runs, seed, flight, estimator, progress
        As of :func:`~navfilters.papers.pogorelsky2020.open_loop.monte_carlo`.
    trials : sequence of Trial

    Returns
    -------
    MonteCarlo
        With an axis of trials before that of the runs.

    Raises
    ------
    ValueError
        No trials; or as of ``monte_carlo``.
    """
    setup = of_case(case)
    flight = truth(setup, max(updates, setup.shortest)) if flight is None else flight
    found = monte_carlo(
        setup,
        updates,
        _which(runs) * len(trials),
        seed,
        flight=flight,
        measure=_images(setup, trials, runs, seed, flight),
        sensor=_sensor(setup, trials, runs, flight),
        estimator=estimator,
        progress=progress,
    )
    parts = (found.errors, found.covariances, found.innovations, found.S)
    return MonteCarlo(found.times, *(_by_trial(part, len(trials)) for part in parts))


def fly_with_offsets(
    case: str | Setup,
    trials: Sequence[Trial],
    sigma: dict[str, Array],
    runs: int | Sequence[int] = 200,
    seed: int = 0,
    *,
    estimator: Any = None,
) -> tuple[Array, Array]:
    """The same by a filter that has constant errors of range or time among its states.

    Parameters
    ----------
    case, runs, seed, estimator
        As of :func:`fly`.
    trials : sequence of Trial
        Their ``delay`` and ``late`` are the true values; the first estimates are zero.
    sigma : dict
        First deviations, m, of "delay", "azimuth" or both: a number, or one for each trial.

    Returns
    -------
    array (73, trials, runs, 9 + m)
        Errors, truth minus estimate, at the start and after each image.
    array (73, trials, runs, 9 + m, 9 + m)
        What the filter believed of them.

    Raises
    ------
    ValueError
        Another name than the two.
    """
    setup, count = of_case(case), len(trials)
    flight = truth(setup)
    if unknown := set(sigma) - set(OFFSETS):
        raise ValueError(f"sigma must be of {sorted(OFFSETS)}; found {sorted(unknown)}")
    sweep = sweep_speed(setup, flight).mean()
    values = {
        "azimuth": _of(trials, "late", runs) * -sweep,
        "delay": _of(trials, "delay", runs),
    }
    images = _images(setup, trials, runs, seed, flight)
    size = len(_which(runs))
    spread = [np.repeat(np.broadcast_to(sigma[name], count), size) for name in sigma]
    first = first_estimate(setup, images.images.true_state(0), images.images.noise.first)
    m = len(sigma)
    P = np.zeros((count * size, 9 + m, 9 + m))
    P[:, :9, :9] = first.cov
    for i, deviation in enumerate(spread):
        P[:, 9 + i, 9 + i] = deviation**2

    def image(k: int, state: Any) -> Array:
        return images(k + 1, NavigationState.of(state.estimate.mean[..., :10])).z

    found = run(
        setup.mekf if estimator is None else estimator,
        Gaussian(np.concatenate([first.mean, np.zeros((count * size, m))], axis=-1), P),
        image,
        offsets.OffsetImages(
            _sensor(setup, trials, runs, flight), tuple(OFFSETS[name] for name in sigma)
        ),
        len(flight.times) - 1,
        dynamics=offsets.OffsetNavigation(setup.dynamics, m),
    )
    true_offsets = np.stack([values[name] for name in sigma], axis=-1)
    true = np.stack(
        [
            np.concatenate([images.images.true_state(k).x, true_offsets], axis=-1)
            for k in range(len(flight.times))
        ]
    )
    errors = offsets.difference(true, found.mean)
    return _by_trial(errors, count), _by_trial(found.cov, count)


def _which(runs: int | Sequence[int]) -> list[int]:
    return list(range(runs)) if isinstance(runs, int) else list(runs)


def _of(trials: Sequence[Trial], name: str, runs: int | Sequence[int]) -> Array:
    """A field of the trials, for each run, (trials * runs,)."""
    return np.repeat([getattr(trial, name) for trial in trials], len(_which(runs)))


def _by_trial(part: Array, count: int) -> Array:
    return part.reshape(len(part), count, -1, *part.shape[2:])


def _images(
    setup: Setup,
    trials: Sequence[Trial],
    runs: int | Sequence[int],
    seed: int,
    flight: Truth,
) -> TimedImages:
    if not trials:
        raise ValueError("trials must be at least one; found none")
    which, intervals = _which(runs) * len(trials), len(flight.times) - 1
    white = white_errors(which, intervals, 4, seed)
    images = simulate_images(setup, which, seed, flight=flight)
    images = with_pointing_noise(
        images, _of(trials, "pointing", runs)[:, None, None] * white[..., 1:]
    )
    late = _of(trials, "late", runs)[:, None] + _of(trials, "clock", runs)[:, None] * white[..., 0]
    measured = _of(trials, "measured", runs)
    return TimedImages(
        images,
        sweep_speed(setup, flight)[1:] * late,
        _of(trials, "delay", runs),
        measured != "plane",
        measured != "antenna",
    )


def _sensor(
    setup: Setup, trials: Sequence[Trial], runs: int | Sequence[int], flight: Truth
) -> ZeroDoppler:
    return ZeroDoppler(
        SarPass(setup.geometry, flight.T_e_b[1:]),
        sweep_speed(setup, flight).mean() * _of(trials, "clock", runs),
        ARCSECOND * _of(trials, "pointing", runs) * _of(trials, "told", runs),
    )
