"""What accelerates a satellite of the Earth, analytic in position and velocity."""

from dataclasses import dataclass, field

import numpy as np

from navfilters.numerics.analytic import dot
from navfilters.numerics.doors import takes
from navfilters.tracking.harmonics import Harmonics
from navfilters.tracking.sky import OMEGA, Sky
from navfilters.types import Array

SUN, MOON = 1.32712440018e20, 4.902800066e12
"""Gravitational constants, m^3/s^2."""

PRESSURE, UNIT = 4.56e-6, 1.495978707e11
"""Of sunlight on a black surface, N/m^2, at one astronomical unit, m."""

RADIUS, FLATTENING = 6378137.0, 1 / 298.257223563

TOP = 2e6
"""Height above which there is no air, m: what the table has there decelerates by 1e-12 m/s^2."""

# Height (km), density (kg/m^3) and scale height (km) of a standard atmosphere, the density falling
# exponentially between them: D. A. Vallado, Fundamentals of Astrodynamics, the exponential model.
_TABLE = np.array(
    [
        [100, 5.297e-7, 5.877],
        [110, 9.661e-8, 7.263],
        [120, 2.438e-8, 9.473],
        [130, 8.484e-9, 12.636],
        [140, 3.845e-9, 16.149],
        [150, 2.070e-9, 22.523],
        [180, 5.464e-10, 29.740],
        [200, 2.789e-10, 37.105],
        [250, 7.248e-11, 45.546],
        [300, 2.418e-11, 53.628],
        [350, 9.518e-12, 53.298],
        [400, 3.725e-12, 58.515],
        [450, 1.585e-12, 60.828],
        [500, 6.967e-13, 63.822],
        [600, 1.454e-13, 71.835],
        [700, 3.614e-14, 88.667],
        [800, 1.170e-14, 124.64],
        [900, 5.245e-15, 181.05],
        [1000, 3.019e-15, 268.00],
    ]
)


@takes(height="")
def density(height: Array) -> Array:
    """Of a standard atmosphere, kg/m^3.

    Parameters
    ----------
    height : array (...)
        m, from 100 km; below, as if it went on.

    Returns
    -------
    array (...)
    """
    row = np.searchsorted(_TABLE[1:, 0], np.real(height) / 1e3, side="right")
    base, rho, scale = np.moveaxis(_TABLE[row], -1, 0)
    return rho * np.exp((base - height / 1e3) / scale)


@dataclass(frozen=True, eq=False)
class Forces:
    """Earth, Sun, Moon, air, light and leak.

    Parameters
    ----------
    gravity : Harmonics
    sky : Sky
    sun, moon : float or array (...)
        Factors of their tides; 0 leaves them out.
    drag : float or array (...)
        Drag coefficient times area by mass, m^2/kg.
    radiation : float or array (...)
        Radiation coefficient times area by mass, m^2/kg.
    leak, leak_rate : array (..., 3)
        An acceleration in the axes of the sky, m/s^2, and its growth from the epoch on, m/s^3.
    """

    gravity: Harmonics
    sky: Sky
    sun: Array = 1.0
    moon: Array = 1.0
    drag: Array = 0.0
    radiation: Array = 0.0
    leak: Array = field(default_factory=lambda: np.zeros(3))
    leak_rate: Array = field(default_factory=lambda: np.zeros(3))

    def acceleration(self, t: float, r: Array, v: Array) -> Array:
        """Of a satellite at r with velocity v, (..., 3), m/s^2.

        Parameters
        ----------
        t : float
            s after the epoch.
        r, v : array (..., 3)
            m and m/s, in the axes of the sky.
        """
        earth, sun, moon = self.sky.at(t)
        total = self.gravity.acceleration(r @ earth) @ earth.T + (self.leak + self.leak_rate * t)
        total = total + _each(self.sun) * tide(r, sun, SUN) + _each(self.moon) * tide(r, moon, MOON)
        if np.any(self.drag) and np.min(np.real(dot(r, r))) < (RADIUS + TOP) ** 2:
            total = total + _each(self.drag) * drag(r, v, earth[:, 2])
        if np.any(self.radiation):
            total = total + _each(self.radiation) * radiation(r, sun)
        return total


def tide(r: Array, body: Array, mu: float) -> Array:
    """Pull of a distant body beyond its pull on the Earth, m/s^2.

    Parameters
    ----------
    r : array (..., 3)
        m.
    body : array (3,)
        From the Earth's centre, m.
    mu : float
        m^3/s^2.

    Returns
    -------
    array (..., 3)
    """
    to_body = body - r
    return mu * (to_body / _cubed(to_body) - body / _cubed(body))


def drag(r: Array, v: Array, axis: Array) -> Array:
    """Acceleration by air that turns with the Earth, for 1 m^2/kg: half density by speed squared.

    Parameters
    ----------
    r, v : array (..., 3)
        m and m/s.
    axis : array (3,)
        The Earth's.

    Returns
    -------
    array (..., 3)
    """
    distance = np.sqrt(dot(r, r))
    sine = r @ axis / distance
    rho = density(distance - RADIUS * (1 - FLATTENING * sine * sine))
    x, y, z = OMEGA * axis
    u = v + r @ np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return -(rho * np.sqrt(dot(u, u)) / 2)[..., None] * u


def radiation(r: Array, sun: Array) -> Array:
    """Acceleration by sunlight for 1 m^2/kg, nothing in the Earth's cylindrical shadow.

    Parameters
    ----------
    r : array (..., 3)
    sun : array (3,)
        From the Earth's centre, m.

    Returns
    -------
    array (..., 3)
    """
    from_sun = r - sun
    along = r @ (sun / np.sqrt(dot(sun, sun)))
    dark = (np.real(along) < 0) & (np.real(dot(r, r) - along * along) < RADIUS**2)
    light = np.where(dark, 0.0, PRESSURE * UNIT**2)[..., None]
    return light * from_sun / _cubed(from_sun)


def _cubed(r: Array) -> Array:
    square = dot(r, r)[..., None]
    return square * np.sqrt(square)


def _each(factor: Array) -> Array:
    """A factor for every member, beside vectors."""
    return np.asarray(factor)[..., None]
