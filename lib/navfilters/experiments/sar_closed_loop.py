"""Pogorelsky et al. (2020): the closed loop, in which images are formed with what the filter knows.

Each of three images is simulated once, as raw data: they are the same in every run, as the paper's
are. A run starts the autofocus at its own predicted velocity, and measures what the image focused
there gives. Sharpness and match depend on a run through that velocity alone, so they are tabulated;
:func:`measure_directly` forms a run's image without the table.

The scene is real terrain with synthetic land cover (:mod:`navfilters.sar.scene`): the sample tile
is moved to each image, mirrored for the second and turned for the third. The patch is cut around
the boresight's true hit on the terrain, by construction: processing to zero Doppler does not
measure where along the track the antenna points.
"""

import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from navfilters import validation
from navfilters._progress import progress as progress_bar
from navfilters.consistency import mean_nees, sample_deviation
from navfilters.experiments.sar_trn import (
    CASES,
    NOMINAL,
    MonteCarlo,
    Setup,
    monte_carlo,
    noise,
    parsed,
    truth,
)
from navfilters.frames import ecef_to_geodetic, ellipsoid_intersection, geodetic_to_ecef
from navfilters.models.sar_geometry import Measurement
from navfilters.multiplicative import MekfState
from navfilters.sar.autofocus import Climb, autofocus, hill_climb, sharpness
from navfilters.sar.echo import PALSAR, Flight, Radar, observe, view_of
from navfilters.sar.focus import Focuser, effective_velocity, to_ground
from navfilters.sar.geolocate import (
    MATCHER,
    Match,
    Matcher,
    Reference,
    form_reference,
    geolocate,
)
from navfilters.sar.scene import LocalMap, Scene, View, draw_scene, sample_terrain, terrain_hit
from navfilters.types import Array

UPDATES = 3
"""Images of the closed loop."""


@dataclass(frozen=True)
class Imaging:
    """How the images are simulated and processed.

    Parameters
    ----------
    radar : Radar
        PALSAR by default.
    lines, samples : int
        Of a focused image.
    bandwidth : float, optional
        Doppler band that is processed, Hz; None for all. By default what the antenna illuminates.
    looks : tuple of int
        In azimuth and range.
    pixel : float
        On the ground, m.
    half_width : float
        Of the reference image, m.
    incidence, heading : float
        By which the reference's pass differs from the flight, deg.
    steps : tuple of float
        Of the hill climb, m/s.
    near, reach : float
        Sharpness is tabulated at steps of 1 m/s up to ``near`` from the true velocity, and at
        steps of 3 m/s up to ``reach``; a climb that leaves the table is a failed image.
    relief : bool
        See ``geolocate``.
    matcher : Matcher
    seed : int
        Of land cover, speckle and noise.

    References
    ----------
    pogorelsky2020, sections "SAR image formation", "Image geolocation" and "Closed-loop trajectory
    and SAR data". The sizes, the looks and the first step are not in the text.
    """

    radar: Radar = PALSAR
    lines: int = 2048
    samples: int = 1024
    bandwidth: float | None = 1710.0
    looks: tuple[int, int] = (4, 2)
    pixel: float = 10.0
    half_width: float = 7000.0
    incidence: float = 1.5
    heading: float = 1.5
    steps: tuple[float, ...] = (4.0, 1.0)
    near: float = 8.0
    reach: float = 47.0
    relief: bool = True
    matcher: Matcher = MATCHER
    seed: int = 0

    def __post_init__(self) -> None:
        validation.whole_number("seed", self.seed, 0)
        if not 0 < self.near < self.reach:
            raise ValueError(
                f"near must be positive and below reach, {self.reach} m/s; found {self.near}"
            )


@dataclass(frozen=True, eq=False)
class Acquisition:
    """One image's raw data, ready to be focused, and what it is compared with.

    Parameters
    ----------
    focuser : Focuser
    reference : Reference
    scene : Scene
    r_f : array (3,)
        True position of the centre pixel, Earth-fixed, m.
    r, v : array (3,)
        True state when it was closest, m, m/s.
    acceleration : callable
        Of a state (..., 6), m/s^2.
    slope : float
        Change of the effective velocity's square with range, m/s^2.
    incidence, ground_speed : float
        rad, m/s: see ``to_ground``.
    """

    focuser: Focuser
    reference: Reference
    scene: Scene
    r_f: Array
    r: Array
    v: Array
    acceleration: Callable[[Array], Array]
    slope: float
    incidence: float
    ground_speed: float

    @property
    def speed(self) -> float:
        """The true in-track velocity, m/s."""
        return float(np.linalg.norm(self.v))

    def effective(self, speed: float) -> float:
        """Effective velocity of an in-track velocity, all else being as it is in truth.

        Parameters
        ----------
        speed : float
            m/s.

        Returns
        -------
        float
            m/s.
        """
        v = self.v * (speed / self.speed)
        a = self.acceleration(np.concatenate([self.r, v]))
        return float(effective_velocity(self.r, v, self.r_f, a))


def _same_images(setup: Setup) -> Setup:
    """The set-up with the fields that do not change the images at their defaults."""
    plain = Setup()
    return replace(setup, **{name: getattr(plain, name) for name in OF_THE_FILTER})


OF_THE_FILTER = (
    "sigma_r",
    "sigma_v",
    "sigma_mu",
    "psd_v",
    "psd_mu",
    "sigma_range",
    "sigma_speed",
    "pixel",
    "underweighting",
    "underweighted",
    "gamma",
    "walk",
    "integrator",
)
"""Fields of a set-up that change neither the true flight nor the images."""


def acquire(setup: Setup, k: int, imaging: Imaging = Imaging()) -> Acquisition:
    """Simulate one image: scene, raw data, reference.

    Parameters
    ----------
    setup : Setup
    k : int
        From 1: the image after interval k.
    imaging : Imaging

    Returns
    -------
    Acquisition

    References
    ----------
    pogorelsky2020, section "Closed-loop trajectory and SAR data".
    """
    validation.whole_number("k", k, 1)
    known, orbit = truth(setup, k), setup.orbit
    x = known.x[k]
    beam = replace(setup.geometry, T_e_b=known.T_e_b[k]).boresight(NOMINAL)
    radar = imaging.radar
    distance = np.linalg.norm(ellipsoid_intersection(x[:3], beam) - x[:3])
    lit = radar.wavelength / radar.antenna * distance / np.linalg.norm(x[3:])
    span = float(lit + imaging.lines / radar.prf)
    flight = Flight.through(orbit.derivative, x, max(span, 1.0))
    place = ecef_to_geodetic(ellipsoid_intersection(x[:3], beam))
    terrain = sample_terrain(
        float(place[0]),
        float(place[1]),
        quarter_turns=(k - 1) // 2 % 4,
        mirrored=(k - 1) % 2 == 1,
    )
    latitude, longitude, height = (
        float(a) for a in ecef_to_geodetic(terrain_hit(terrain.height, x[:3], beam))
    )
    scene = draw_scene(
        terrain,
        LocalMap(latitude, longitude),
        [imaging.seed, k, 0],
        half_width=imaging.half_width + 3000.0,  # relief and the reference's corners
    )
    r_f = geodetic_to_ecef(latitude, longitude, scene.height(0.0, 0.0))
    raw = observe(
        radar,
        flight,
        scene,
        lines=imaging.lines,
        samples=imaging.samples,
        speckle=[imaging.seed, k, 1],
    )
    focuser = Focuser(
        raw, lines=imaging.lines, samples=imaging.samples, bandwidth=imaging.bandwidth
    )
    view = view_of(flight, r_f)
    other = View(
        view.heading + np.deg2rad(imaging.heading),
        view.incidence + np.deg2rad(imaging.incidence),
        np.inf,
    )
    reference = form_reference(
        scene,
        other,
        half_width=imaging.half_width,
        pixel=imaging.pixel,
        speckle=[imaging.seed, k, 2],
        matcher=imaging.matcher,
    )
    t, R = (float(a) for a in flight.closest(r_f))
    r, v = flight.position(t), flight.velocity(t)
    a = orbit.acceleration(np.concatenate([r, v]))
    ends = np.stack([flight.ground_point(t, R + d, height) for d in (-2000.0, 2000.0)])
    squared = effective_velocity(r, v, ends, a) ** 2
    ground_speed = effective_velocity(r, v, r_f, a) ** 2 / np.linalg.norm(v)
    return Acquisition(
        focuser,
        reference,
        scene,
        r_f,
        r,
        v,
        orbit.acceleration,
        float(np.diff(squared)[0] / 4000.0),
        view.incidence,
        float(ground_speed),
    )


def _locate(acquired: Acquisition, speed: float, imaging: Imaging) -> Match:
    image = acquired.focuser.image(acquired.effective(speed), acquired.slope)
    ground = to_ground(
        image,
        incidence=acquired.incidence,
        ground_speed=acquired.ground_speed,
        looks=imaging.looks,
        pixel=imaging.pixel,
    )
    return geolocate(ground, acquired.reference, relief=imaging.relief)


def measure_directly(
    acquired: Acquisition, start: float, imaging: Imaging = Imaging()
) -> tuple[Climb, Match | None]:
    """Focus and match one run's image, without the table.

    Parameters
    ----------
    acquired : Acquisition
    start : float
        In-track velocity that the run predicts, m/s.
    imaging : Imaging

    Returns
    -------
    climb : Climb
    match : Match or None
        None if the climb found no peak.
    """
    limits = (acquired.speed - imaging.reach, acquired.speed + imaging.reach)
    climb = autofocus(
        acquired.focuser,
        start,
        acquired.effective,
        steps=imaging.steps,
        limits=limits,
        slope=acquired.slope,
    )
    return climb, (_locate(acquired, climb.speed, imaging) if climb.ended == "peak" else None)


class ImageTable(NamedTuple):
    """What one image's raw data give at each assumed velocity.

    Parameters
    ----------
    speed, sharpness : array (n,)
        In-track velocity, m/s, and Eq. (3).
    matched : array (m,)
        In-track velocities at which the image was matched: wherever climbs can end, m/s.
    r_f : array (m, 3)
        Position of the centre pixel, m; NaN for no match.
    inliers : array (m,)
    slant_range : float
        Of the centre pixel, by the image, m.
    truth : array (3,)
        True position of the centre pixel, m.
    true_speed : float
        m/s.
    effective : array (3,)
        Effective velocity at the true speed, m/s, its derivative by the speed, and that of its
        square by the slant range, m/s^2.
    place : tuple of float
        Latitude, longitude and height of the centre, deg, deg, m.
    """

    speed: Array
    sharpness: Array
    matched: Array
    r_f: Array
    inliers: Array
    slant_range: float
    truth: Array
    true_speed: float
    effective: Array
    place: tuple[float, float, float]

    def climb(self, start: float, steps: Sequence[float], offset: float = 0.0) -> Climb:
        """Hill climb on the tabulated sharpness, by a cubic spline.

        Parameters
        ----------
        start : float
            m/s.
        steps : sequence of float
            m/s.
        offset : float
            What the run's geometry adds to the in-track velocity, m/s.

        Returns
        -------
        Climb
        """
        curve = CubicSpline(self.speed, self.sharpness)
        limits = (float(self.speed[0]) - offset, float(self.speed[-1]) - offset)
        return hill_climb(lambda speed: float(curve(speed + offset)), start, steps, limits)


@lru_cache(maxsize=16)
def _tabulate(setup: Setup, k: int, imaging: Imaging) -> ImageTable:
    acquired = acquire(setup, k, imaging)
    true = acquired.speed
    inner = np.arange(-imaging.near, imaging.near + 0.5)
    outer = np.arange(imaging.near + 3.0, imaging.reach + 0.5, 3.0)
    speed = true + np.concatenate([-outer[::-1], inner, outer])
    sharp = np.empty(len(speed))
    for i, s in enumerate(speed):
        pixels = acquired.focuser.image(acquired.effective(float(s)), acquired.slope).pixels
        sharp[i] = sharpness(pixels.real**2 + pixels.imag**2)
    effective = acquired.effective(true)
    derivative = (acquired.effective(true + 1) - acquired.effective(true - 1)) / 2
    scene = acquired.scene
    place = (scene.map.latitude, scene.map.longitude, float(scene.height(0.0, 0.0)))
    image = acquired.focuser.image(effective, acquired.slope)
    table = ImageTable(
        speed,
        sharp,
        np.zeros(0),
        np.zeros((0, 3)),
        np.zeros(0, int),
        image.centre_range,
        acquired.r_f,
        true,
        np.array([effective, derivative, acquired.slope]),
        place,
    )
    starts = np.arange(speed[0], speed[-1], 0.25)
    ends = np.array([table.climb(float(s), imaging.steps).speed for s in starts])
    matched = np.unique(np.round(2 * (ends[np.isfinite(ends)] - true))) / 2 + true
    found = [_locate(acquired, float(s), imaging) for s in matched]
    return table._replace(
        matched=matched,
        r_f=np.array([match.r_f for match in found]).reshape(-1, 3),
        inliers=np.array([match.inliers for match in found], int),
    )


def tabulate(setup: Setup | str = "TC-1", k: int = 1, imaging: Imaging = Imaging()) -> ImageTable:
    """Sharpness and match of one image at each assumed velocity: about a minute.

    Parameters
    ----------
    setup : Setup or {"TC-1", "TC-2"}
    k : int
        From 1.
    imaging : Imaging

    Returns
    -------
    ImageTable
        Computed once for all set-ups that have the same truth.
    """
    return _tabulate(_same_images(_case(setup)), validation.whole_number("k", k, 1), imaging)


@dataclass(frozen=True, eq=False)
class Images:
    """Measurements of the closed loop, from images focused at each run's predicted velocity.

    Parameters
    ----------
    setup : Setup
    runs : int or sequence of int
        See ``navfilters.experiments.sar_trn.noise``.
    seed : int
    imaging : Imaging
    geometry : {"nominal", "predicted"}
        What turns a run's in-track velocity into the effective one: the true position and pixel,
        as in the paper, where the velocity alone is perturbed; or the run's own position and
        boresight, whose errors then enter the measured velocity.

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
    imaging: Imaging = Imaging()
    geometry: Literal["nominal", "predicted"] = "nominal"
    log: list["Attempt"] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        if self.geometry not in ("nominal", "predicted"):
            raise ValueError(f"geometry must be 'nominal' or 'predicted'; found {self.geometry!r}")

    def __call__(self, k: int, state: MekfState) -> Measurement:
        """The image after interval k, as each run focuses it.

        Parameters
        ----------
        k : int
            From 1.
        state : MekfState
            What the filter predicts; one for each run.

        Returns
        -------
        Measurement
            r_f (runs, 3), slant_range (runs,), speed (runs,): NaN where the climb found no peak or
            the image there no match.
        """
        table = tabulate(self.setup, k, self.imaging)
        start = np.linalg.norm(state.v, axis=-1)
        offset = self._offset(k, table, state)
        climbs = [
            table.climb(float(s), self.imaging.steps, float(o))
            for s, o in zip(start, offset, strict=True)
        ]
        speed = np.array([climb.speed for climb in climbs])
        r_f = np.full((len(speed), 3), np.nan)
        focused = np.isfinite(speed)
        if len(table.matched):
            nearest = np.abs((speed + offset)[focused, None] - table.matched).argmin(axis=1)
            r_f[focused] = table.r_f[nearest]
        drawn = noise(self.runs, k, self.seed).slant_range[:, k - 1]
        slant_range = table.slant_range + self.setup.sigma_range * drawn
        absent = np.isnan(speed) | np.isnan(r_f).any(axis=-1)
        self.log.append(Attempt(k, start, speed, tuple(c.ended for c in climbs), absent))
        return Measurement(
            r_f, np.where(absent, np.nan, slant_range), np.where(absent, np.nan, speed)
        )

    def _offset(self, k: int, table: ImageTable, state: MekfState) -> Array:
        """What a run's own geometry adds to the velocity that it assumes, m/s."""
        if self.geometry == "nominal":
            return np.zeros(len(state.v))
        known = truth(_same_images(self.setup), k)
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
    ended : tuple of str
        Of each climb.
    absent : array (runs,) of bool
        No measurement.
    """

    k: int
    start: Array
    speed: Array
    ended: tuple[str, ...]
    absent: Array


def monte_carlo_closed(
    case: str | Setup = "TC-1",
    runs: int | Sequence[int] = 100,
    seed: int = 0,
    *,
    imaging: Imaging = Imaging(),
    geometry: Literal["nominal", "predicted"] = "nominal",
    progress: Callable[[Iterable], Iterable] = iter,
    **options: Any,
) -> MonteCarlo:
    """All runs of a test case with three images, at 8.33, 16.67 and 25 s, and a coast to 41.67 s.

    Parameters
    ----------
    case : {"TC-1", "TC-2"} or Setup
    runs : int or sequence of int
        How many, or which.
    seed : int
        First estimates and range errors, as in ``sar_trn.monte_carlo``; the images have
        ``imaging.seed``.
    imaging : Imaging
    geometry : {"nominal", "predicted"}
        See ``Images``.
    progress : callable
        Wraps the iterable of intervals.
    **options
        To ``sar_trn.monte_carlo``, but ``updates`` and ``measure``.

    Returns
    -------
    MonteCarlo
        NaN innovations where there was no measurement. The true misalignment does not walk: all
        runs see the same ground.

    References
    ----------
    pogorelsky2020, Figs. 8 and 10.
    """
    setup = replace(_case(case), walk=False)
    images = Images(setup, runs, seed, imaging, geometry)
    return monte_carlo(setup, UPDATES, runs, seed, measure=images, progress=progress, **options)


def _case(case: Any) -> Setup:
    if isinstance(case, Setup):
        return case
    if not isinstance(case, str) or case not in CASES:
        raise ValueError(f"case must be a Setup or one of {sorted(CASES)}; found {case!r}")
    return CASES[case]


def table(
    case: str = "TC-1",
    runs: int = 100,
    seed: int = 0,
    imaging: Imaging = Imaging(),
    progress: Callable = iter,
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
    opened = monte_carlo(case, UPDATES, runs, seed)
    lines = [f"{'':12}{'closed loop':>24}{'open loop':>24}"]
    lines.append(f"{'':12}{'predicted':>12}{'sample':>12}{'predicted':>12}{'sample':>12}")
    at = UPDATES
    spreads = [sample_deviation(m.errors[:, at], m.covariances[:, at]) for m in (closed, opened)]
    for i, axis in enumerate("xyz"):
        cells = "".join(f"{s.predicted[i]:12.1f}{s.sample[i]:12.1f}" for s in spreads)
        lines.append(f"{axis} (m)      {cells}")
    totals = [mean_nees(m.errors[:, at], m.covariances[:, at]) for m in (closed, opened)]
    lines.append(f"{'NEES':12}" + "".join(f"{'':12}{t.mean:12.1f}" for t in totals))
    failed = int(np.isnan(closed.innovations).any(axis=-1).sum())
    lines.append(f"{failed} of {closed.innovations.shape[0] * UPDATES} images failed")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table: ``python -m navfilters.experiments.sar_closed_loop --case TC-1``.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.
    """
    chosen = parsed("Closed-loop Monte Carlo of Pogorelsky et al.", arguments)
    text = table(chosen.case, chosen.runs, chosen.seed, progress=progress_bar)
    sys.stdout.write(f"{chosen.case}, {chosen.runs} runs, 1-sigma position at 25 s\n{text}\n")


if __name__ == "__main__":
    main()
