"""What the closed loop images with: radar, grid and sizes."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from navfilters.numerics import validation
from navfilters.papers.pogorelsky2020.experiment import Setup
from navfilters.sar.ground.scene import Scene
from navfilters.sar.images.focuser import Focuser
from navfilters.sar.images.slant_image import effective_velocity
from navfilters.sar.matching.matcher import MATCHER, Matcher
from navfilters.sar.matching.reference import Reference
from navfilters.sar.raw.flight import Flight, view_of
from navfilters.sar.raw.radar import PALSAR, Radar
from navfilters.space.frames import geodetic_to_ecef
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
    moved : tuple of float
        By which the tile of terrain is moved to the north and the east, deg: other hills.

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
    moved: tuple[float, float] = (0.0, 0.0)

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

    @cached_property
    def climber(self) -> Focuser:
        """The focuser without ranges from which no whole pulse came back: to climb on."""
        return self.focuser.patch(self.focuser.samples, self.effective(self.speed))

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
