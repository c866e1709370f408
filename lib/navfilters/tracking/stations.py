"""What stations measure of a satellite: range by a signal's way, azimuth and elevation."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from navfilters.numerics.analytic import atan2, dot
from navfilters.numerics.doors import takes
from navfilters.tracking.sky import OMEGA, Sky, geodetic
from navfilters.types import Array

LIGHT = 299792458.0
"""m/s."""


@dataclass(frozen=True, eq=False)
class Sites:
    """Where stations are when they measure, one row for each measurement, or one of them.

    Parameters
    ----------
    position, velocity : array (..., 3)
        In the axes of the sky, m and m/s.
    axes : array (..., 3, 3)
        Rows east, north and up, in the axes of the sky.
    height : array (...)
        Above the ellipsoid, m.
    """

    position: Array
    velocity: Array
    axes: Array
    height: Array

    def __getitem__(self, rows: Any) -> "Sites":
        """Some of them."""
        return Sites(*(a[rows] for a in (self.position, self.velocity, self.axes, self.height)))


def sites(places: Array, station: Array, time: Array, sky: Sky) -> Sites:
    """Stations at the times of measurements.

    Parameters
    ----------
    places : array (S, 3)
        Latitude and longitude, rad, and height, m, of each station.
    station : int array (N,)
        Number of a station.
    time : array (N,)
        s after the epoch.
    sky : Sky

    Returns
    -------
    Sites
        Of N rows.
    """
    known = [geodetic(*place) for place in places]
    earth = sky.at(time)[0]
    position = (earth @ np.array([p for p, _ in known])[station][..., None])[..., 0]
    axes = np.array([a for _, a in known])[station] @ earth.mT
    velocity = OMEGA * np.cross(earth[..., 2], position)
    return Sites(position, velocity, axes, np.asarray(places)[station, 2])


def observe(state: Array, site: Sites, *, troposphere: bool = True) -> Array:
    """Range, azimuth and elevation of a satellite, without biases.

    Parameters
    ----------
    state : array (..., 6)
        Position and velocity at the time of reception, m and m/s; in the place of ... the axes of
        ``site``, or what broadcasts with them.
    site : Sites
    troposphere : bool
        Whether the air delays and bends the signal.

    Returns
    -------
    array (..., 3)
        Half the way of a signal from station to satellite and back, m; azimuth from north over
        east and elevation, rad, of the way down.

    Notes
    -----
    During the signal's way the satellite moves on a straight line: its acceleration makes 2 mm
    where it is far and slow, and less where it is near.
    """
    r, v = state[..., :3], state[..., 3:6]
    down = _length(r - site.position)
    for _ in range(2):  # each makes the error smaller by v/c
        way = r - v * (down / LIGHT)[..., None] - site.position
        down = _length(way)
    up = down
    for _ in range(2):
        up = _length(way + site.velocity * ((down + up) / LIGHT)[..., None])
    east, north, height = np.moveaxis((site.axes @ way[..., None])[..., 0], -1, 0)
    azimuth, elevation = atan2(east, north), np.arcsin(height / down)
    distance = (down + up) / 2
    if troposphere:
        distance = distance + delay(elevation, site.height)
        elevation = elevation + refraction(elevation, site.height)
    return np.stack([distance, azimuth, elevation], axis=-1)


@takes(elevation="", height="")
def refraction(elevation: Array, height: Array) -> Array:
    """By how much the air lifts a satellite, rad.

    Parameters
    ----------
    elevation : array (...)
        Without air, rad, from about -1 deg on.
    height : array (...)
        Of the station, m.

    Returns
    -------
    array (...)

    Notes
    -----
    Made for low satellites: at 45 deg it gives 0.010 deg, where the air's refractivity says 0.018.

    References
    ----------
    ITU-R P.834, the closed formula for the reference atmosphere by elevation in free space.
    """
    e, h = np.degrees(1.0) * elevation, height / 1e3
    inverse = (
        1.728 + 0.5411 * e + 0.03723 * e**2
        + h * (0.1815 + 0.06272 * e + 0.01138 * e**2)
        + h**2 * (0.01727 + 0.008288 * e)
    )  # fmt: skip
    return np.radians(1.0) / inverse


@takes(elevation="", height="")
def delay(elevation: Array, height: Array) -> Array:
    """By how much the air lengthens the way, m: Saastamoinen's zenith delays, mapped.

    Parameters
    ----------
    elevation : array (...)
        Without air, rad.
    height : array (...)
        Of the station, m; its air is the standard atmosphere's, with half of the moisture.

    Returns
    -------
    array (...)

    References
    ----------
    J. Saastamoinen (1972) for the zenith; H. D. Black and A. Eisner (1984) for the mapping.
    """
    pressure = 1013.25 * (1 - 2.2557e-5 * height) ** 5.2568
    kelvin = 288.15 - 6.5e-3 * height
    vapour = 0.5 * np.exp(-6.396e-4 * height) * 17.04  # hPa, of 288 K
    zenith = 2.277e-3 * (pressure + (1255 / kelvin + 0.05) * vapour)
    sine = np.sin(elevation)
    return zenith * 1.001 / np.sqrt(0.002001 + sine * sine)


def _length(r: Array) -> Array:
    return np.sqrt(dot(r, r))
