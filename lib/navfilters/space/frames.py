"""Frames between the Earth and an antenna, and where a beam meets the ground.

A matrix T_a^b takes components in frame a to components in frame b; its rows are the axes of b. The
Earth-fixed frame e turns with the Earth; the body frame b is local vertical, local horizontal; the
antenna frame s has its third axis along the boresight. Latitude and longitude are geodetic, in
degrees; every other angle is in radians. Geodetic coordinates need pymap3d.
"""

from typing import Any

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.analytic import dot
from navfilters.numerics.doors import takes
from navfilters.numerics.extras import needed
from navfilters.types import Array

SEMI_MAJOR = 6378137.0
"""Equatorial radius of the WGS-84 ellipsoid, m."""
FLATTENING = 1 / 298.257223563
"""Flattening of the WGS-84 ellipsoid."""
_AXES = np.array([SEMI_MAJOR, SEMI_MAJOR, SEMI_MAJOR * (1 - FLATTENING)])


@takes(r="3", v="3")
def body_axes(r: Array, v: Array) -> Array:
    """T_e^b of a body that points at the Earth's centre.

    z = -r / norm(r),   y along v x r,   x = y x z

    Parameters
    ----------
    r, v : array (..., 3)
        Position and velocity in the frame e, m and m/s: x is the horizontal direction of v, y is to
        the right of it.

    Returns
    -------
    array (..., 3, 3)
        Not finite where r and v are parallel.

    References
    ----------
    pogorelsky2020, section "Multiplicative extended Kalman filter": the body is aligned with the
    local vertical, local horizontal frame; which velocity makes it horizontal is not stated.
    """
    xp = r.__array_namespace__()
    r, v = (r, v) if r.shape == v.shape else xp.broadcast_arrays(r, v)
    z = -_unit(r)
    y = _unit(xp.linalg.cross(v, r))
    return xp.stack([xp.linalg.cross(y, z), y, z], axis=-2)


def antenna_axes(look: float, squint: float = 0.0) -> np.ndarray:
    """T_b^s of an antenna that looks to the side: about x by the look angle, then about the new y.

    The boresight, its last row, is (sin squint, cos squint sin look, cos squint cos look).

    Parameters
    ----------
    look : float
        From nadir to the beam, rad; positive to the right of the flight path.
    squint : float
        From the plane across the flight path to the beam, rad; positive forward.

    Returns
    -------
    ndarray (3, 3)

    References
    ----------
    pogorelsky2020, Eq. (15) and the section it stands in.
    """
    c, s = np.cos(look), np.sin(look)
    about_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    c, s = np.cos(squint), np.sin(squint)
    return np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) @ about_x


@takes(r="3", direction="3")
def ellipsoid_intersection(r: Array, direction: Array) -> Array:
    """Where rays first meet the WGS-84 ellipsoid.

    Parameters
    ----------
    r : array (..., 3)
        Start of each ray, Earth-fixed, outside of the ellipsoid, m.
    direction : array (..., 3)
        Any length but zero.

    Returns
    -------
    array (..., 3)
        The near intersection, Earth-fixed, m. NaN for rays that hold a NaN.

    Raises
    ------
    ValueError
        A ray that starts inside of the ellipsoid, or misses it, with the height at which it passes,
        measured towards the Earth's centre.

    Notes
    -----
    With the axes scaled so that the ellipsoid is the unit sphere, the root of the quadratic is
    taken in the form that does not cancel. The check reads values: it is for the host.

    References
    ----------
    pogorelsky2020, section "Open-loop trajectory".
    """
    xp = r.__array_namespace__()
    axes, u = xp.asarray(_AXES), _unit(direction)
    start, along = r / axes, u / axes
    a, b = dot(along, along), dot(start, along)
    c = dot(start, start) - 1
    inside = c.real < 0
    _refuse(inside, start, "r must be outside of the WGS-84 ellipsoid; found a start below it by")
    discriminant = b * b - a * c
    nearest = start + xp.where(b.real < 0, -b / a, 0.0)[..., None] * along
    misses = (discriminant.real < 0) | (b.real > 0)
    _refuse(
        misses, nearest, "direction must meet the WGS-84 ellipsoid; found one that misses it by"
    )
    return r + (c / (xp.sqrt(discriminant) - b))[..., None] * u


def _refuse(bad: Array, scaled: Array, message: str) -> None:
    """Raise for the first bad point, given in units of the ellipsoid's axes, with its height."""
    bad = np.asarray(bad)
    if not bad.any():
        return
    where = tuple(int(i) for i in np.argwhere(bad)[0])
    point = np.broadcast_to(np.asarray(scaled), (*bad.shape, 3))[where]
    height = np.linalg.norm(point * _AXES) * (1 - 1 / np.linalg.norm(point))
    member = f" at index {where}" if where else ""
    raise ValueError(f"{message} {abs(height):.6g} m{member}")


def east_north_up(latitude: float, longitude: float) -> np.ndarray:
    """T_e^l: the rows are the directions of east, north and up.

    Parameters
    ----------
    latitude, longitude : float
        Geodetic, deg.

    Returns
    -------
    ndarray (3, 3)
    """
    (sin_lat, sin_lon), (cos_lat, cos_lon) = (
        f(np.deg2rad([latitude, longitude])) for f in (np.sin, np.cos)
    )
    return np.array(
        [
            [-sin_lon, cos_lon, 0.0],
            [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
            [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat],
        ]
    )


def enu_covariance(deviations: Any, latitude: float, longitude: float) -> np.ndarray:
    """Earth-fixed covariance of independent errors to the east, the north and upwards.

    Parameters
    ----------
    deviations : array-like (3,)
        East, north, up, m.
    latitude, longitude : float
        Geodetic, deg.

    Returns
    -------
    ndarray (3, 3)
        m^2.

    References
    ----------
    pogorelsky2020, Eq. (29), whose D is in these axes here.
    """
    deviations = validation.real_array("deviations", deviations, "3")
    if deviations.shape != (3,):
        raise ValueError(f"deviations must have shape (3,); found {deviations.shape}")
    T = east_north_up(latitude, longitude)
    D = T.T @ np.diag(deviations**2) @ T
    return (D + D.T) / 2


def geodetic_to_ecef(latitude: Any, longitude: Any, height: Any = 0.0) -> np.ndarray:
    """Earth-fixed position of a point given by latitude, longitude and height.

    Parameters
    ----------
    latitude, longitude : array-like (...)
        Geodetic, deg.
    height : array-like (...)
        Above the WGS-84 ellipsoid, m.

    Returns
    -------
    ndarray (..., 3)
        m.

    Raises
    ------
    ImportError
        Without pymap3d.

    References
    ----------
    pogorelsky2020, section "Image geolocation".
    """
    names = ("latitude", "longitude", "height")
    point = [
        validation.real_array(name, value, "", finite=False)
        for name, value in zip(names, (latitude, longitude, height), strict=True)
    ]
    validation.batch(**{name: value.shape for name, value in zip(names, point, strict=True)})
    return np.stack(_pymap3d().geodetic2ecef(*np.broadcast_arrays(*point)), -1)


def ecef_to_geodetic(r: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Latitude, longitude and height of an Earth-fixed position.

    Parameters
    ----------
    r : array-like (..., 3)
        m.

    Returns
    -------
    tuple of ndarray (...)
        Geodetic latitude and longitude, deg, and height above the WGS-84 ellipsoid, m.

    Raises
    ------
    ImportError
        Without pymap3d.
    """
    r = validation.core("r", validation.real_array("r", r, "3", finite=False), (3,))
    return _pymap3d().ecef2geodetic(*np.moveaxis(r, -1, 0))


def _pymap3d() -> Any:
    return needed("pymap3d", "navfilters[sar]", "geodetic arithmetic")


def _unit(v: Array) -> Array:
    xp = v.__array_namespace__()
    return v / xp.sqrt(dot(v, v))[..., None]
