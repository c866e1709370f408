"""Xiong, Zhang and Liu (2009): the set-up, its readings, and its filters."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from navfilters.estimators.adaptive import AdaptiveNoise
from navfilters.estimators.filter import Filter
from navfilters.estimators.robust import AdaptiveRobust, Robust
from navfilters.space.gravity import EARTH, Gravity
from navfilters.space.inertial_orbit import Orbit
from navfilters.space.star_earth_sensor import StarEarthSensor
from navfilters.space.thrust import COASTING, Thrust
from navfilters.types import Array, Gaussian

ARCSECOND = np.pi / 648000


@dataclass(frozen=True, eq=False)
class Setup:
    """The manoeuvre experiment; change a field with ``dataclasses.replace`` and run again.

    Parameters
    ----------
    gravity : Gravity
        Eq. (36); values not in the text.
    altitude : float
        Height of the first, circular orbit, m.
    inclination : float
        Degrees; not in the text. In Table 1 sigma_z / sigma_y is tan(26 to 27 deg) in every row.
    burns : tuple of (float, float)
        Whole seconds between which the thruster fires.
    perigee : float
        Height of the osculating perigee that the last burn ends with, m.
    thrust : float, optional
        Acceleration while the thruster fires, m/s^2; by default what reaches the perigee.
    stars : tuple
        Directions, inertial; not in the text, but Eq. (44) has them in the pattern of A.
    earth_noise, star_noise : float or array (..., 1)
        Deviations, degrees and arcseconds; each angle has both, independent. An array is one
        setting per leading axis; the trailing 1 is for the seeds.
    p_r, p_v : float
        First error and its deviation in each component, m and m/s: Eqs. (39), (40).
    q_r, q_v : float or array (..., 1)
        Deviation of the process noise of one sub-step, m and m/s: Eq. (41).
    interval, step, duration : int
        Seconds between measurements, of a sub-step (not in the text), and of the run.
    window : int
        The n of Eq. (42): seconds at the end of the run from which an RMS error is taken.
    integrator : {"rk4", "euler"}
        That of the filters; the printed Eq. (35) is "euler".

    References
    ----------
    xiong2009, section 5.
    """

    gravity: Gravity = EARTH
    altitude: float = 500e3
    inclination: float = 27.0
    burns: tuple[tuple[float, float], ...] = ((7293, 8373), (11279, 12068))
    perigee: float = 2000e3
    thrust: float | None = None
    stars: tuple[tuple[float, float, float], ...] = ((1, 0, 1), (0, 1, 0))
    earth_noise: Any = 0.02
    star_noise: Any = 5.0
    p_r: float = 5000.0
    p_v: float = 10.0
    q_r: Any = 2e-5
    q_v: Any = 2e-4
    interval: int = 100
    step: float = 1.0
    duration: int = 20000
    window: int = 2000
    integrator: Literal["rk4", "euler"] = "rk4"

    def __post_init__(self) -> None:
        if not (self.interval > 0 and self.duration % self.interval == 0):
            found = f"{self.interval} and {self.duration}"
            raise ValueError(f"interval must divide duration; found {found}")
        if not (0 < self.step <= 1 and (1 / self.step).is_integer()):
            raise ValueError(f"step must be a second or a whole part of it; found {self.step}")
        if not 1 < self.window <= self.duration:
            raise ValueError(f"window must be 2 to {self.duration} s; found {self.window}")

    @property
    def x0(self) -> Array:
        """The true first state, on the circular orbit at its ascending node: (6,), m and m/s."""
        radius, i = self.gravity.radius + self.altitude, np.deg2rad(self.inclination)
        speed = np.sqrt(self.gravity.mu / radius)
        return np.array([radius, 0.0, 0.0, 0.0, speed * np.cos(i), speed * np.sin(i)])

    @property
    def prior(self) -> Gaussian:
        """The first estimate, x0 minus the error (39), and P0 of (40)."""
        p = np.array([self.p_r] * 3 + [self.p_v] * 3)
        return Gaussian(self.x0 - p, np.diag(p**2))

    @property
    def sigma(self) -> Array:
        """Deviation of each measured angle, rad: both sensors' noise combined."""
        earth, star = np.deg2rad(self.earth_noise), np.asarray(self.star_noise) * ARCSECOND
        return np.hypot(earth, star)

    @property
    def sensor(self) -> StarEarthSensor:
        """The stars' angles, Eq. (38), with R = sigma^2 I."""
        R = self.sigma[..., None, None] ** 2 * np.eye(len(self.stars))
        return StarEarthSensor(np.array(self.stars, float), R)

    def orbit(self, thrust: Thrust = COASTING) -> Orbit:
        """The filters' dynamics, Eqs. (35), (36), (41), with what they know of the thruster."""
        q_r, q_v = (np.asarray(q, float)[..., None, None] ** 2 for q in (self.q_r, self.q_v))
        Q = q_r * np.diag([1.0, 1, 1, 0, 0, 0]) + q_v * np.diag([0.0, 0, 0, 1, 1, 1])
        substeps = round(self.interval / self.step)
        return Orbit(self.gravity, thrust, Q, self.step, substeps, self.integrator)


VARIANTS = {
    "A": Setup(),
    "B": Setup(earth_noise=0.0),
    "C": Setup(q_v=13 * 2e-4),
    "D": Setup(earth_noise=0.02 / 3, star_noise=5.0 / 3),
}
"""Readings of the noise: A both sensors as stated, for one standard deviation; D for three of them;
B 5 arcseconds only and C a larger q_v, both chosen after seeing what the paper's 203 m needs."""


def together(variants: str = "ABCD") -> Setup:
    """Several readings of the noise as one set-up, to fly side by side.

    Parameters
    ----------
    variants : str
        Keys of ``VARIANTS``, a letter each.

    Returns
    -------
    Setup
        Its noises are arrays (readings, 1).

    Raises
    ------
    ValueError
        A letter that is none.
    """
    readings = [_variant(name) for name in variants]
    return Setup(
        earth_noise=np.array([[setup.earth_noise] for setup in readings]),
        star_noise=np.array([[setup.star_noise] for setup in readings]),
        q_v=np.array([[setup.q_v] for setup in readings]),
    )


class Estimator(NamedTuple):
    """One row of the comparison: a filter, whether it is told the thrust, and Table 1's numbers."""

    filter: Any
    knows_thrust: bool = False
    paper: tuple[float, ...] = (np.nan,) * 4


ESTIMATORS = {
    "EKF": Estimator(Filter(form="short"), paper=(0.2771e6, 2.4096e6, 1.2367e6, 2.7175e6)),
    "REKF": Estimator(
        Filter(rule=Robust(), form="short"), paper=(0.1382e6, 1.4027e6, 0.7055e6, 1.5762e6)
    ),
    "AEKF": Estimator(
        Filter(rule=AdaptiveNoise(), form="short"), paper=(1.9091e4, 1.2786e4, 0.6441e4, 2.3863e4)
    ),
    "AREKF": Estimator(
        Filter(rule=AdaptiveRobust(), form="short"), paper=(126.1731, 143.1503, 69.5699, 203.1050)
    ),
    "EKF with thrust": Estimator(Filter(form="short"), knows_thrust=True),
}
"""The filters of Table 1 by the paper's names, with its values in m, and one that is told more."""


def _named(argument: str, name: Any, known: Mapping[str, Any]) -> Any:
    if not isinstance(name, str) or name not in known:
        raise ValueError(f"{argument} must be one of {sorted(known)}; found {name!r}")
    return known[name]


def _variant(variant: Any) -> Setup:
    return variant if isinstance(variant, Setup) else _named("variant", variant, VARIANTS)
