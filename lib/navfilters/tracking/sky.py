"""Earth rotation, Sun and Moon over a span of time, by astropy and without a download."""

from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from navfilters.numerics.extras import needed

OMEGA = 7.292115e-5
"""Angular velocity of the Earth, rad/s."""

STEP = 120.0  # s; a cubic through rotation matrices this far apart errs by 2e-11


@dataclass(frozen=True, eq=False)
class Sky:
    """Where the Earth, the Sun and the Moon are, in axes that do not rotate (GCRS).

    Parameters
    ----------
    spline : callable
        Seconds after the epoch (...) -> (..., 15): the rotation from ITRS to GCRS by rows, Sun and
        Moon from the Earth's centre, m.
    end : float
        The last second that it knows.
    """

    spline: Any
    end: float

    def at(self, t: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rotation from ITRS to GCRS (..., 3, 3), Sun (..., 3) and Moon (..., 3), m.

        Parameters
        ----------
        t : array (...)
            s after the epoch.

        Raises
        ------
        ValueError
            A time out of the span.
        """
        t = np.asarray(t)
        if t.size and not (t.min() >= -STEP and t.max() <= self.end):
            found = f"{t.min()} to {t.max()}"
            raise ValueError(f"t must be between {-STEP} and {self.end} s; found {found}")
        row = self.spline(t)
        return row[..., :9].reshape(*t.shape, 3, 3), row[..., 9:12], row[..., 12:]


def sky(epoch: datetime, duration: float) -> Sky:
    """The sky from two minutes before the epoch to two after the duration, at least.

    Parameters
    ----------
    epoch : datetime
        UTC.
    duration : float
        s.

    Returns
    -------
    Sky
        IAU 2006 precession, nutation, UT1 and polar motion as astropy holds them in its own tables;
        Sun and Moon by its built-in series, whose few km matter to no tide.

    Raises
    ------
    ImportError
        astropy is not installed.
    """
    needed("astropy.coordinates", "navfilters[flight]", "a real orbit")
    from astropy import units as u
    from astropy.coordinates import GCRS, ITRS, CartesianRepresentation, get_body_barycentric
    from astropy.time import Time
    from astropy.utils import iers

    t = np.arange(-STEP, duration + 2 * STEP, STEP)
    # The final values of the Earth's orientation, which come with astropy: nothing is downloaded.
    with iers.earth_orientation_table.set(iers.IERS_B.open()):
        time = Time(epoch, scale="utc") + t * u.s
        columns = []
        for axis in np.eye(3):
            there = CartesianRepresentation(*(axis[:, None] * np.ones(len(t))), unit=u.m)
            turned = ITRS(there, obstime=time).transform_to(GCRS(obstime=time))
            columns.append(turned.cartesian.xyz.to_value(u.m).T)
        centre, sun, moon = (
            get_body_barycentric(body, time, ephemeris="builtin").xyz.to_value(u.m).T
            for body in ("earth", "sun", "moon")
        )
    rotation = np.stack(columns, axis=-1).reshape(len(t), 9)
    table = np.concatenate([rotation, sun - centre, moon - centre], axis=-1)
    return Sky(CubicSpline(t, table), t[-1])


def geodetic(latitude: float, longitude: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    """A place on the WGS-84 ellipsoid in ITRS, and its local axes.

    Parameters
    ----------
    latitude, longitude : float
        rad.
    height : float
        m above the ellipsoid.

    Returns
    -------
    position : array (3,)
        m.
    axes : array (3, 3)
        Rows east, north and up.
    """
    needed("astropy.coordinates", "navfilters[flight]", "a real orbit")
    from astropy import units as u
    from astropy.coordinates import EarthLocation

    place = EarthLocation.from_geodetic(
        longitude * u.rad, latitude * u.rad, height * u.m, ellipsoid="WGS84"
    )
    position = np.array([place.x.to_value(u.m), place.y.to_value(u.m), place.z.to_value(u.m)])
    (sin_lat, sin_lon), (cos_lat, cos_lon) = (
        function([latitude, longitude]) for function in (np.sin, np.cos)
    )
    east = [-sin_lon, cos_lon, 0.0]
    north = [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat]
    up = [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat]
    return position, np.array([east, north, up])
