"""The closed loop of Pogorelsky et al.: images formed, matched, and flown."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from navfilters.papers.pogorelsky2020.experiment import Setup, of_case
from navfilters.papers.pogorelsky2020.image_tables import ImageTable, tabulate
from navfilters.papers.pogorelsky2020.imaging import FULL, Imaging, same_images
from navfilters.papers.pogorelsky2020.noise_draws import noise
from navfilters.papers.pogorelsky2020.open_loop import MonteCarlo, monte_carlo
from navfilters.papers.pogorelsky2020.true_flight import truth
from navfilters.runs.consistency import mean_nees, sample_deviation
from navfilters.sar.images.slant_image import effective_velocity
from navfilters.space.image_measurement import Measurement
from navfilters.space.navigation_state import NavigationState
from navfilters.types import Array

UPDATES = 3
"""Images of the closed loop."""


@dataclass(frozen=True, eq=False)
class Images:
    """Measurements of the closed loop, from images focused at each run's predicted velocity.

    Parameters
    ----------
    setup : Setup
    runs : int or sequence of int
        See ``navfilters.papers.pogorelsky2020.noise_draws.noise``.
    seed : int
    imaging : Imaging
    geometry : {"nominal", "predicted"}
        What turns a run's in-track velocity into the effective one: the true position and pixel, so
        that the velocity alone is the run's; or the run's own position and boresight, whose errors
        then enter the measured velocity. The text leaves open which.
    tables : callable
        (setup, k, imaging) -> ImageTable: computed by default, or from a file.

    Raises
    ------
    ValueError
        An unknown geometry.

    References
    ----------
    pogorelsky2020, section "Closed-loop trajectory and SAR data": the same data in every run, the
    range with additional noise.
    """

    setup: Setup
    runs: int | Sequence[int] = 100
    seed: int = 0
    imaging: Imaging = FULL
    geometry: Literal["nominal", "predicted"] = "nominal"
    tables: Callable[[Setup, int, Imaging], ImageTable] = tabulate
    log: list["Attempt"] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        if self.geometry not in ("nominal", "predicted"):
            raise ValueError(f"geometry must be 'nominal' or 'predicted'; found {self.geometry!r}")

    def __call__(self, k: int, state: NavigationState) -> Measurement:
        """The image after interval k, as each run focuses it.

        Parameters
        ----------
        k : int
            From 1.
        state : NavigationState
            What the filter predicts; one for each run.

        Returns
        -------
        Measurement
            r_f (runs, 3), slant_range (runs,), speed (runs,): NaN where the climb found no peak or
            the image there no match.
        """
        table = self.tables(self.setup, k, self.imaging)
        start = np.linalg.norm(state.v, axis=-1)
        offset = self._offset(k, table, state)
        climbs = table.climbs(start, self.imaging.steps, offset)
        speed = np.array([climb.speed for climb in climbs])
        r_f = np.full((len(speed), 3), np.nan)
        focused = np.isfinite(speed)
        if len(table.matched):
            nearest = np.abs((speed + offset)[focused, None] - table.matched).argmin(axis=1)
            r_f[focused] = table.r_f[nearest]
        return self.measured(k, start, speed, r_f, [climb.ended for climb in climbs])

    def measured(
        self, k: int, start: Array, speed: Array, r_f: Array, ended: Sequence[str]
    ) -> Measurement:
        """What the filter is given of the images that runs have formed; logged.

        Parameters
        ----------
        k : int
        start, speed : array (runs,)
            In-track velocity before and after the climb, m/s; NaN for no peak.
        r_f : array (runs, 3)
            m; NaN for no match.
        ended : sequence of str
            Of the climbs.

        Returns
        -------
        Measurement
            With each run's own error of the range.
        """
        table = self.tables(self.setup, k, self.imaging)
        drawn = noise(self.runs, k, self.seed).slant_range[:, k - 1]
        slant_range = table.slant_range + self.setup.sigma_range * drawn
        absent = np.isnan(speed) | np.isnan(r_f).any(axis=-1)
        self.log.append(Attempt(k, start, speed, r_f, tuple(ended), absent))
        return Measurement(
            r_f, np.where(absent, np.nan, slant_range), np.where(absent, np.nan, speed)
        )

    def _offset(self, k: int, table: ImageTable, state: NavigationState) -> Array:
        """What a run's own geometry adds to the velocity that it assumes, m/s."""
        if self.geometry == "nominal":
            return np.zeros(len(state.v))
        known = truth(same_images(self.setup), k)
        model = replace(self.setup.geometry, T_e_b=known.T_e_b[k])
        r_f = state.r + table.slant_range * model.boresight(state.q_mu)
        a = self.setup.orbit.acceleration(np.concatenate([state.r, state.v], axis=-1))
        own = effective_velocity(state.r, state.v, r_f, a)
        nominal = np.linalg.norm(state.v, axis=-1) - table.true_speed
        return (own - table.effective[0]) / table.effective[1] - nominal


class Attempt(NamedTuple):
    """What became of one image in all runs.

    Parameters
    ----------
    k : int
    start, speed : array (runs,)
        In-track velocity, predicted and measured, m/s.
    r_f : array (runs, 3)
        Position of the centre pixel, m.
    ended : tuple of str
        Of each climb.
    absent : array (runs,) of bool
        No measurement.
    """

    k: int
    start: Array
    speed: Array
    r_f: Array
    ended: tuple[str, ...]
    absent: Array


def monte_carlo_closed(
    case: str | Setup = "TC-1",
    runs: int | Sequence[int] = 100,
    seed: int = 0,
    *,
    imaging: Imaging = FULL,
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
) -> MonteCarlo:
    """All runs of a test case with three images, at 8.33, 16.67 and 25 s, and a coast to 41.67 s.

    Parameters
    ----------
    case : {"TC-1", "TC-2"} or Setup
    runs : int or sequence of int
        How many, or which.
    seed : int
        First estimates and range errors, as of ``monte_carlo``; the images have
        ``imaging.seed``.
    imaging : Imaging
    progress : callable
        Wraps the iterable of intervals.

    Returns
    -------
    MonteCarlo
        NaN innovations where there was no measurement. The true misalignment does not walk: all
        runs see the same ground.

    References
    ----------
    pogorelsky2020, Figs. 8 and 10.
    """
    setup = replace(of_case(case), walk=False)
    images = Images(setup, runs, seed, imaging)
    return monte_carlo(setup, UPDATES, runs, seed, measure=images, progress=progress)


def closed_table(
    case: str = "TC-1",
    runs: int = 100,
    seed: int = 0,
    imaging: Imaging = FULL,
    progress: Callable[..., Any] = iter,
) -> str:
    """Position after three images, closed and open loop, and how many images failed.

    Parameters
    ----------
    case : {"TC-1", "TC-2"}
    runs : int
        At least 2.
    seed : int
    imaging : Imaging
    progress : callable
        Wraps the iterable of intervals.

    Returns
    -------
    str
    """
    closed = monte_carlo_closed(case, runs, seed, imaging=imaging, progress=progress)
    return summary(closed, monte_carlo(case, UPDATES, runs, seed))


def summary(closed: MonteCarlo, opened: MonteCarlo) -> str:
    """Position after three images, closed and open loop, and how many images failed.

    Parameters
    ----------
    closed, opened : MonteCarlo
        Of at least 2 runs.

    Returns
    -------
    str
    """
    lines = [f"{'':12}{'closed loop':>24}{'open loop':>24}"]
    lines.append(f"{'':12}{'predicted':>12}{'sample':>12}{'predicted':>12}{'sample':>12}")
    after = [(m.errors[UPDATES], m.covariances[UPDATES]) for m in (closed, opened)]
    spreads = [sample_deviation(*pair, runs_axis=0) for pair in after]
    for i, axis in enumerate("xyz"):
        cells = "".join(f"{s.predicted[i]:12.1f}{s.sample[i]:12.1f}" for s in spreads)
        lines.append(f"{axis} (m)      {cells}")
    totals = [mean_nees(*pair, runs_axis=0) for pair in after]
    lines.append(f"{'NEES':12}" + "".join(f"{'':12}{t.mean:12.1f}" for t in totals))
    failed = int(np.isnan(closed.innovations).any(axis=-1).sum())
    lines.append(f"{failed} of {closed.innovations.shape[1] * UPDATES} images failed")
    return "\n".join(lines)
