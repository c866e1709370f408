"""The open loop of Pogorelsky et al.: measurements with simulated errors."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from navfilters.estimators.state import FilterState
from navfilters.numerics import validation
from navfilters.papers.pogorelsky2020.experiment import PAPER, Setup, of_case
from navfilters.papers.pogorelsky2020.noise_draws import Noise, first_estimate, misalignment, noise
from navfilters.papers.pogorelsky2020.true_flight import Truth, truth
from navfilters.runs.consistency import SampleDeviation, mean_nees, sample_deviation
from navfilters.runs.loop import run
from navfilters.space.frames import east_north_up, ellipsoid_intersection
from navfilters.space.image_measurement import Measurement
from navfilters.space.image_sensor import SarPass
from navfilters.space.navigation_state import NavigationState
from navfilters.space.pose import difference
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class SimulatedImages:
    """Measurements with simulated errors: what stands in for images in the open loop.

    Parameters
    ----------
    setup : Setup
    flight : Truth
    q_mu : array (runs, k + 1, 4)
        True misalignment.
    noise : Noise

    References
    ----------
    pogorelsky2020, section "Open-loop trajectory".
    """

    setup: Setup
    flight: Truth
    q_mu: Array
    noise: Noise

    def __call__(self, k: int, state: NavigationState) -> Measurement:
        """The image after interval k; it does not depend on the state, a focused one would.

        Parameters
        ----------
        k : int
            From 1.
        state : NavigationState
            What the filter predicts.

        Returns
        -------
        Measurement
            r_f (runs, 3), slant_range (runs,), speed (runs,).
        """
        setup, x, r_f = self.setup, self.flight.x[k], self.centre(k)
        slant_range = np.linalg.norm(r_f - x[:3], axis=-1)
        local = np.asarray(setup.pixel) * self.noise.pixel[:, k - 1]
        # one product per row, not one of matrices: a run's digits must not depend on the batch
        shift = np.sum(local[:, :, None] * east_north_up(*setup.target), axis=1)
        return Measurement(
            r_f + shift,
            slant_range + setup.sigma_range * self.noise.slant_range[:, k - 1],
            np.linalg.norm(x[3:]) + setup.sigma_speed * self.noise.speed[:, k - 1],
        )

    def centre(self, k: int) -> Array:
        """Where the beam meets the ground at the end of interval k, (runs, 3), m.

        Parameters
        ----------
        k : int
            From 0.

        Returns
        -------
        array (runs, 3)
        """
        beam = self._pass.at(k).boresight(self.q_mu[:, k])
        return ellipsoid_intersection(self.flight.x[k, :3], beam)

    @cached_property
    def _pass(self) -> SarPass:
        attitudes = self.flight.T_e_b
        return SarPass(replace(self.setup.geometry, T_e_b=attitudes), attitudes)  # once checked

    def true_state(self, k: int) -> NavigationState:
        """The state at the start, or that the image after interval k is made at.

        Parameters
        ----------
        k : int
            From 0.

        Returns
        -------
        NavigationState
        """
        x = self.flight.x[k]
        return NavigationState(x[:3], x[3:], self.q_mu[:, k])


def simulate_images(
    case: str | Setup = "TC-1",
    runs: int | Sequence[int] = 100,
    seed: int = 0,
    *,
    flight: Truth | None = None,
) -> SimulatedImages:
    """The images that ``monte_carlo`` measures by default: the same draws for the same arguments.

    Parameters
    ----------
    case, runs, seed, flight
        As for :func:`monte_carlo`; a flight of 72 intervals by default.

    Returns
    -------
    SimulatedImages
    """
    setup = of_case(case)
    flight = truth(setup) if flight is None else flight
    drawn = noise(runs, len(flight.times) - 1, seed)
    return SimulatedImages(setup, flight, misalignment(setup, drawn.walk), drawn)


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """What the runs of one case gave.

    Parameters
    ----------
    times : array (t,)
        0, after each update, and the end of a coast, s.
    errors : array (t, runs, 9)
        Truth minus estimate: position, m, velocity, m/s, misalignment as a rotation vector, rad.
    covariances : array (t, runs, 9, 9)
        What the filter believed of them.
    innovations : array (updates, runs, 4)
        Measured minus expected; NaN where there was no measurement.
    S : array (updates, runs, 4, 4)
        What the filter believed of them, underweighting included.
    """

    times: Array
    errors: Array
    covariances: Array
    innovations: Array
    S: Array

    def spread(self, confidence: float = 0.95) -> SampleDeviation:
        """Sample and predicted deviations over the runs, at each time: (t, 9).

        Parameters
        ----------
        confidence : float

        Returns
        -------
        SampleDeviation
        """
        return sample_deviation(self.errors, self.covariances, runs_axis=1, confidence=confidence)


def monte_carlo(
    case: str | Setup = "TC-1",
    updates: int = 72,
    runs: int | Sequence[int] = 100,
    seed: int = 0,
    *,
    flight: Truth | None = None,
    measure: Callable[[int, NavigationState], Any] | None = None,
    estimator: Any = None,
    sensor: Any = None,
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
) -> MonteCarlo:
    """All runs of a test case in one batch.

    The true flight is the same in every run and its antenna starts without misalignment; drawn are
    the first *estimates*, so that all runs see the same ground, the measurements' errors, and the
    small random walk of the true misalignment.

    Parameters
    ----------
    case : {"TC-1", "TC-2"} or Setup
        A key of ``CASES``, or any set-up.
    updates : int
        72 for 600 s; with 3, at 8.33, 16.67 and 25 s, the filter coasts until 41.67 s.
    runs : int or sequence of int
        How many, or which: see ``noise``.
    seed : int
    flight : Truth, optional
        Another than that of the set-up, which is the default: of as many intervals, at least
        ``updates``, as it is to last.
    measure : callable, optional
        (k, predicted state) -> Measurement of update k, from 1; by default ``SimulatedImages``. A
        NaN in it is an image that was not matched.
    estimator : Filter, optional
        With ``init``, ``predict`` and ``update``; the set-up's ``mekf`` by default.
    sensor : MeasurementModel, optional
        What the filter is told of ``measure``; the set-up's geometry by default.
    progress : callable
        Wraps the iterable of intervals.

    Returns
    -------
    MonteCarlo

    Raises
    ------
    ValueError
        An unknown case, bad counts, a flight of fewer intervals than updates, or a set-up whose
        beam leaves the Earth.

    References
    ----------
    pogorelsky2020, Figs. 8 to 11.
    """
    setup = of_case(case)
    validation.whole_number("updates", updates, 1)
    if flight is None:
        flight = truth(setup, max(updates, setup.shortest))
    intervals = len(flight.times) - 1
    if intervals < updates:
        raise ValueError(f"flight must last {updates} intervals, one an update; found {intervals}")
    images = simulate_images(setup, runs, seed, flight=flight)
    measure = images if measure is None else measure
    ticks = iter(progress(range(1, intervals + 1)))
    last = np.empty(0)

    def image(k: int, state: FilterState) -> Array:
        nonlocal last
        next(ticks)
        if k >= updates:
            return np.full_like(last, np.nan)  # the filter coasts
        last = measure(k + 1, NavigationState.of(state.estimate.mean)).z
        return last

    estimates, innovations, S = run(
        setup.mekf if estimator is None else estimator,
        first_estimate(setup, images.true_state(0), images.noise.first),
        image,
        SarPass(setup.geometry, flight.T_e_b[1:]) if sensor is None else sensor,
        intervals,
        dynamics=setup.dynamics,
        record=lambda state: (state.estimate, state.innovation, state.S),
    )
    next(ticks, None)  # a bar that counts is done
    kept = sorted({*range(updates + 1), intervals})
    truths = np.stack([images.true_state(k).x for k in kept])
    made = slice(1, updates + 1)
    return MonteCarlo(
        flight.times[kept],
        difference(truths, estimates.mean[kept]),
        estimates.cov[kept],
        innovations[made],
        S[made],
    )


def open_table(
    case: str = "TC-1", runs: int = 100, seed: int = 0, progress: Callable[..., Any] = iter
) -> str:
    """Position at 600 s beside the paper's: deviations, how far they fell, and the NEES.

    Parameters
    ----------
    case : {"TC-1", "TC-2"}
    runs : int
        At least 2.
    seed : int
    progress : callable
        Wraps the iterable of intervals.

    Returns
    -------
    str
    """
    result = monte_carlo(case, runs=runs, seed=seed, progress=progress)
    first = of_case(case).sigma_r
    at_end = result.errors[-1], result.covariances[-1]
    spread, total = sample_deviation(*at_end, runs_axis=0), mean_nees(*at_end, runs_axis=0)
    lines = [f"{'':6}{'predicted':>11}{'sample (95 %)':>25}{'fell by':>10}{'paper':>18}"]
    for i, axis in enumerate("xyz"):
        low, sample, high = (f"{s[i]:.1f}" for s in (spread.low, spread.sample, spread.high))
        fell = 100 * (1 - spread.predicted[i] / first)
        paper = "{:.0f} m, {} %".format(*PAPER[case][axis]) if axis in PAPER[case] else "-"
        lines.append(
            f"{axis} (m) {spread.predicted[i]:11.1f}{f'{sample} ({low} to {high})':>25}"
            f"{fell:8.1f} %{paper:>18}"
        )
    band = f"{total.low:.1f} to {total.high:.1f}"
    lines.append(f"NEES  {total.mean:11.1f}{f'consistent: {band}':>25}")
    return "\n".join(lines)
