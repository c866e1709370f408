"""Pogorelsky et al. (2020): the set-up and its two test cases."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from navfilters.estimators.filter import Filter
from navfilters.estimators.moments import linearized
from navfilters.estimators.variants import Underweighting
from navfilters.numerics import validation
from navfilters.space.earth_fixed_navigation import EarthFixedNavigation
from navfilters.space.earth_fixed_orbit import EARTH_RATE, EarthFixedOrbit
from navfilters.space.frames import enu_covariance
from navfilters.space.gravity import EARTH, Gravity
from navfilters.space.image_measurement import SarGeometry
from navfilters.types import Array


@dataclass(frozen=True)
class Setup:
    """The open-loop experiment; change a field with ``dataclasses.replace`` and run again.

    Parameters
    ----------
    gravity : Gravity
        Values not in the text.
    rate : float
        Rotation of the Earth, rad/s.
    altitude : float
        Of the circular orbit above the equatorial radius, m: Table 2.
    inclination : float
        Deg: Table 2.
    ascending : bool
        Whether the pass goes north: "ascending to northern Canada".
    target : tuple of float
        Geodetic latitude and longitude that the boresight meets at the start, deg: Houston; not in
        the text.
    look : float
        Nominal look angle, deg, positive to the right; not in the text, PALSAR's.
    squint : float
        Nominal squint angle, deg.
    attitude : {"earth-fixed", "inertial", "constant rate"}
        Which horizontal axes the body keeps: along the Earth-fixed velocity, along the inertial
        velocity, or turned at the mean rate of the first of these over the closed-loop trajectory.
    sigma_r, sigma_v, sigma_mu : float
        First deviations of each component, m, m/s, deg: Table 4.
    psd_v, psd_mu : float
        Power spectral densities of the process noise, m^2/s^3 and rad^2/s: Q_PSD.
    sigma_range, sigma_speed : float
        Deviations of the measured slant range and in-track velocity, m, m/s: Table 3.
    pixel : tuple of float
        Deviations of the pixel's position to the east, the north and upwards at the target, m: D.
        The text says 2 to 8 m, Earth-fixed; these were chosen after seeing the paper's results.
    underweighting : float
        Lear's beta-bar.
    underweighted : int
        The first so many updates are underweighted.
    walk : bool
        Whether the true misalignment takes the random walk that ``psd_mu`` describes.
    interval : float
        Seconds between updates: 72 in 600 s.
    steps : int
        Steps of the propagation in each interval.
    shortest : int
        The flight lasts at least so many intervals, updated or not: 41.67 s.
    integrator : {"rk4", "printed"}
        That of the filter.

    References
    ----------
    pogorelsky2020, sections "Numerical simulation" and "Test cases".
    """

    gravity: Gravity = EARTH
    rate: float = EARTH_RATE
    altitude: float = 691.5e3
    inclination: float = 98.16
    ascending: bool = True
    target: tuple[float, float] = (29.76, -95.37)
    look: float = 34.3
    squint: float = 0.0
    attitude: Literal["earth-fixed", "inertial", "constant rate"] = "earth-fixed"
    sigma_r: float = 1000.0
    sigma_v: float = 10.0
    sigma_mu: float = 0.1
    psd_v: float = 3.5e-11
    psd_mu: float = 3.4e-13
    sigma_range: float = 1.0
    sigma_speed: float = 0.54
    pixel: tuple[float, float, float] = (2.0, 8.0, 1.0)
    underweighting: float = 0.2
    underweighted: int = 10
    walk: bool = True
    interval: float = 600 / 72
    steps: int = 10
    shortest: int = 5
    integrator: Literal["rk4", "printed"] = "rk4"

    def __post_init__(self) -> None:
        for name in ("pixel", "target"):  # lists too: a set-up is a key
            object.__setattr__(self, name, tuple(getattr(self, name)))
        known = ("constant rate", "earth-fixed", "inertial")
        if self.attitude not in known:
            raise ValueError(f"attitude must be one of {list(known)}; found {self.attitude!r}")
        for name in ("altitude", "interval"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name} must be positive; found {getattr(self, name)}")
        for name in ("steps", "shortest"):
            validation.whole_number(name, getattr(self, name), 1)
        validation.whole_number("underweighted", self.underweighted, 0)
        for name in NOT_NEGATIVE:
            found, needed = getattr(self, name), (3,) if name == "pixel" else ()
            value = validation.real_array(name, found, "")
            if value.shape != needed or (value < 0).any():
                each = "three numbers" if needed else "a number"
                raise ValueError(f"{name} must be {each} of at least 0; found {found}")

    @property
    def orbit(self) -> EarthFixedOrbit:
        """The filter's dynamics, Eqs. (8)-(12)."""
        Q = np.diag([self.psd_v] * 3 + [self.psd_mu] * 3)
        step = self.interval / self.steps
        return EarthFixedOrbit(self.gravity, self.rate, Q, step, self.integrator)

    @property
    def geometry(self) -> SarGeometry:
        """The measurement, Eqs. (13)-(30), with a body attitude that is yet to be set."""
        R = np.diag([0.0, 0.0, self.sigma_range**2, self.sigma_speed**2])
        D = enu_covariance(self.pixel, *self.target)
        return SarGeometry(np.deg2rad(self.look), np.deg2rad(self.squint), R, D)

    @property
    def mekf(self) -> Filter:
        """The multiplicative EKF: the EKF on a state with an attitude, underweighted at first."""
        return Filter(linearized, Underweighting(self.underweighting, self.underweighted))

    @property
    def dynamics(self) -> EarthFixedNavigation:
        """What the filter knows of the motion from one image to the next."""
        return EarthFixedNavigation(self.orbit, self.steps)

    @property
    def P0(self) -> Array:
        """Covariance of the first estimate, (9, 9): Table 4."""
        sigma = [self.sigma_r] * 3 + [self.sigma_v] * 3 + [np.deg2rad(self.sigma_mu)] * 3
        return np.diag(np.square(sigma))


NOT_NEGATIVE = (
    "sigma_r",
    "sigma_v",
    "sigma_mu",
    "psd_v",
    "psd_mu",
    "sigma_range",
    "sigma_speed",
    "pixel",
    "underweighting",
)

NOMINAL = np.array([0.0, 0.0, 0.0, 1.0])
"""The quaternion of no misalignment."""

CASES = {"TC-1": Setup(), "TC-2": Setup(sigma_mu=0.01, underweighting=0.0)}
"""The two test cases of Table 4. Only the first is underweighted."""

PAPER = {
    "TC-1": {"x": (20.0, 98.0), "y": (740.0, 26.0)},
    "TC-2": {"x": (12.0, 98.8), "y": (138.0, 86.2)},
}
"""Deviation at 600 s, m, and by how many percent it fell: what the text gives of each case."""


def of_case(case: Any) -> Setup:
    """The set-up of a test case.

    Parameters
    ----------
    case : {"TC-1", "TC-2"} or Setup

    Returns
    -------
    Setup

    Raises
    ------
    ValueError
        An unknown case.
    """
    if isinstance(case, Setup):
        return case
    if not isinstance(case, str) or case not in CASES:
        raise ValueError(f"case must be a Setup or one of {sorted(CASES)}; found {case!r}")
    return CASES[case]
