"""The three images of Pogorelsky et al. (2020), simulated as raw data and formed at any velocity.

The scene is real terrain with synthetic land cover (:mod:`navfilters.sar.scene`): the sample tile
is moved to each image, mirrored for the second and turned for the third. The patch is cut around
the boresight's true hit on the terrain, by construction: processing to zero Doppler does not
measure where along the track the antenna points.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from navfilters import validation
from navfilters.experiments.sar_trn import NOMINAL, Setup, of_case, truth
from navfilters.frames import ecef_to_geodetic, ellipsoid_intersection, geodetic_to_ecef
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


FULL = Imaging()
"""Images of 2048 by 1024 pixels."""


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

    @classmethod
    def of(
        cls,
        flight: Flight,
        acceleration: Callable[[Array], Array],
        scene: Scene,
        focuser: Focuser,
        reference: Reference,
    ) -> "Acquisition":
        """From the flight, and a scene whose middle is the centre pixel.

        Parameters
        ----------
        flight : Flight
        acceleration : callable
            See above.
        scene : Scene
        focuser : Focuser
        reference : Reference

        Returns
        -------
        Acquisition
        """
        height = float(scene.height(0.0, 0.0))
        r_f = geodetic_to_ecef(scene.map.latitude, scene.map.longitude, height)
        t, R = (float(a) for a in flight.closest(r_f))
        r, v = flight.position(t), flight.velocity(t)
        a = acceleration(np.concatenate([r, v]))
        ends = np.stack([flight.ground_point(t, R + d, height) for d in (-2000.0, 2000.0)])
        squared = effective_velocity(r, v, ends, a) ** 2
        return cls(
            focuser,
            reference,
            scene,
            r_f,
            r,
            v,
            acceleration,
            slope=float(np.diff(squared)[0] / 4000.0),
            incidence=view_of(flight, r_f).incidence,
            ground_speed=float(effective_velocity(r, v, r_f, a) ** 2 / np.linalg.norm(v)),
        )

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


def same_images(setup: Setup) -> Setup:
    """The set-up with the fields that do not change the images at their defaults.

    Parameters
    ----------
    setup : Setup

    Returns
    -------
    Setup
    """
    plain = Setup()
    return replace(setup, **{name: getattr(plain, name) for name in OF_THE_FILTER})


def acquire(setup: Setup, k: int, imaging: Imaging = FULL) -> Acquisition:
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
    latitude, longitude, _ = (
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
    return Acquisition.of(flight, orbit.acceleration, scene, focuser, reference)


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
    acquired: Acquisition, start: float, imaging: Imaging = FULL
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
    place : array (3,)
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
    place: Array

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


def image_table(
    acquired: Acquisition,
    imaging: Imaging = FULL,
    progress: Callable[[Iterable], Iterable] = iter,
) -> ImageTable:
    """Sharpness of one image at each assumed velocity, and its match wherever climbs can end.

    Parameters
    ----------
    acquired : Acquisition
    imaging : Imaging
    progress : callable
        Wraps the iterable of the ``len(assumed_speeds(imaging))`` velocities.

    Returns
    -------
    ImageTable
    """
    true = acquired.speed
    speed = true + assumed_speeds(imaging)
    sharp = np.empty(len(speed))
    for i in progress(range(len(speed))):
        velocity = acquired.effective(float(speed[i]))
        pixels = acquired.focuser.image(velocity, acquired.slope).pixels
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
        np.array(place),
    )
    starts = np.arange(speed[0], speed[-1], 0.25)
    ends = np.array([table.climb(float(s), imaging.steps).speed for s in starts])
    matched = np.unique(np.round(4 * (ends[np.isfinite(ends)] - true))) / 4 + true
    found = [_locate(acquired, float(s), imaging) for s in matched]
    return table._replace(
        matched=matched,
        r_f=np.array([match.r_f for match in found]).reshape(-1, 3),
        inliers=np.array([match.inliers for match in found], int),
    )


def assumed_speeds(imaging: Imaging) -> Array:
    """Velocities at which sharpness is tabulated, relative to the true one.

    Parameters
    ----------
    imaging : Imaging

    Returns
    -------
    array (n,)
        m/s, ascending.
    """
    inner = np.arange(-imaging.near, imaging.near + 0.5)
    outer = np.arange(imaging.near + 3.0, imaging.reach + 0.5, 3.0)
    return np.concatenate([-outer[::-1], inner, outer])


@lru_cache(maxsize=16)
def _tabulate(setup: Setup, k: int, imaging: Imaging) -> ImageTable:
    return image_table(acquire(setup, k, imaging), imaging)


def tabulate(setup: Setup | str = "TC-1", k: int = 1, imaging: Imaging = FULL) -> ImageTable:
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
    return _tabulate(same_images(of_case(setup)), validation.whole_number("k", k, 1), imaging)
