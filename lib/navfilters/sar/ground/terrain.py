"""Terrain as posts on a local map, and where a beam meets it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates, spline_filter
from scipy.optimize import brentq

from navfilters.numerics import validation
from navfilters.numerics.extras import needed
from navfilters.space.frames import FLATTENING, SEMI_MAJOR, ecef_to_geodetic, ellipsoid_intersection
from navfilters.types import Array

TILE = "jacksboro_fault_dem.npz"
"""The sample tile, by the name that matplotlib knows it by: 344 x 403 posts, 236 to 1076 m."""


@dataclass(frozen=True)
class LocalMap:
    """Metres to the east and the north of a point, linear in latitude and longitude.

    Parameters
    ----------
    latitude, longitude : float
        Geodetic, of the point, deg.

    Notes
    -----
    The scale is right on the ellipsoid at the point's latitude; 8 km to the north it is 0.08 % too
    large for the east at 30 degrees. Positions are not: they are latitudes and longitudes.
    """

    latitude: float
    longitude: float

    def __post_init__(self) -> None:
        for name, limit in (("latitude", 89.0), ("longitude", 360.0)):
            value = validation.real_array(name, getattr(self, name), "")
            if value.ndim or abs(value) > limit:
                raise ValueError(
                    f"{name} must be a number of at most {limit} deg; found {getattr(self, name)}"
                )

    @property
    def metres(self) -> tuple[float, float]:
        """Of one degree of longitude and of one of latitude, m."""
        e2, phi = FLATTENING * (2 - FLATTENING), np.deg2rad(self.latitude)
        w = np.sqrt(1 - e2 * np.sin(phi) ** 2)
        to_north = SEMI_MAJOR * (1 - e2) / w**3
        return np.deg2rad(SEMI_MAJOR / w * np.cos(phi)), np.deg2rad(to_north)

    def geodetic(self, east: Any, north: Any) -> tuple[Any, Any]:
        """Latitude and longitude of positions.

        Parameters
        ----------
        east, north : array (...)
            m.

        Returns
        -------
        tuple of array (...)
            deg.
        """
        to_east, to_north = self.metres
        return self.latitude + north / to_north, self.longitude + east / to_east

    def position(self, latitude: Any, longitude: Any) -> tuple[Any, Any]:
        """The way back.

        Parameters
        ----------
        latitude, longitude : array (...)
            Geodetic, deg; whole turns do not count.

        Returns
        -------
        tuple of array (...)
            East and north, m.
        """
        to_east, to_north = self.metres
        turned = longitude - _turns(longitude, self.longitude)
        return (turned - self.longitude) * to_east, (latitude - self.latitude) * to_north


def _turns(longitude: Any, near: float) -> Any:
    """The whole turns, deg, by which longitudes are farther than half a turn from another."""
    away = np.asarray(longitude) - near
    return 0.0 if np.all(np.abs(away) < 180.0) else 360.0 * np.round(away / 360.0)


@dataclass(frozen=True, eq=False)
class Terrain:
    """Heights above the ellipsoid: a cubic spline through posts in latitude and longitude.

    Parameters
    ----------
    posts : array (n, m)
        Heights, m, rows from south to north and columns from west to east; at least 4 by 4.
    south, west : float
        Of the first post, geodetic, deg.
    spacing : float
        Between posts, deg.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.
    """

    posts: Array
    south: float
    west: float
    spacing: float
    _coefficients: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        posts = validation.real_array("posts", self.posts, "n, m")
        if posts.ndim != 2 or min(posts.shape) < 4:
            raise ValueError(f"posts must be at least 4 by 4; found shape {posts.shape}")
        if not (np.isfinite(self.spacing) and self.spacing > 0):
            raise ValueError(f"spacing must be a positive number of deg; found {self.spacing}")
        object.__setattr__(self, "posts", posts)
        object.__setattr__(self, "_coefficients", spline_filter(posts, order=3, mode="mirror"))

    def height(self, latitude: Any, longitude: Any) -> Array:
        """Heights of places.

        Parameters
        ----------
        latitude, longitude : array (...)
            Geodetic, deg; whole turns do not count.

        Returns
        -------
        ndarray (...)
            m. NaN outside of the posts.
        """
        place = np.broadcast_arrays(latitude, longitude)
        row = (place[0] - self.south) / self.spacing
        middle = self.west + self.spacing * (self.posts.shape[1] - 1) / 2
        column = (place[1] - _turns(place[1], middle) - self.west) / self.spacing
        where = np.stack([np.ravel(row), np.ravel(column)])  # no axes are too few for SciPy
        height = map_coordinates(
            self._coefficients, where, order=3, mode="mirror", prefilter=False
        ).reshape(row.shape)
        rows, columns = self.posts.shape
        inside = (row >= 0) & (row <= rows - 1) & (column >= 0) & (column <= columns - 1)
        return np.where(inside, height, np.nan)


@lru_cache(maxsize=1)
def sample_posts() -> Array:
    """Heights of matplotlib's sample tile.

    Returns
    -------
    ndarray (344, 403)
        m, rows from south to north; read-only.

    Raises
    ------
    ImportError
        Without matplotlib.
    """
    tile = needed("matplotlib.cbook", "navfilters[sar]", "the sample terrain").get_sample_data(TILE)
    with tile:
        posts = tile["elevation"][::-1].astype(float)
    posts.setflags(write=False)
    return posts


def sample_terrain(
    latitude: float, longitude: float, *, quarter_turns: int = 0, mirrored: bool = False
) -> Terrain:
    """The sample tile, moved so that its middle is at a place, mirrored and turned.

    Posts stay 3 arc-seconds apart: where a degree of longitude is longer than it was, so is the
    terrain, and slopes are gentler.

    Parameters
    ----------
    latitude, longitude : float
        Geodetic, deg.
    quarter_turns : int
        Counter-clockwise, after mirroring.
    mirrored : bool
        Whether east becomes west first.

    Returns
    -------
    Terrain
    """
    posts = sample_posts()[:, ::-1] if mirrored else sample_posts()
    posts, spacing = np.rot90(posts[::-1], quarter_turns)[::-1], 1 / 1200
    rows, columns = posts.shape
    return Terrain(
        posts,
        latitude - spacing * (rows - 1) / 2,
        longitude - spacing * (columns - 1) / 2,
        spacing,
    )


def terrain_hit(
    height: Callable[[Any, Any], Any], r: Array, direction: Array, highest: float = 9000.0
) -> Array:
    """Where a ray first meets terrain.

    Parameters
    ----------
    height : callable
        (latitude, longitude) -> m, NaN where it does not reach: ``Terrain.height``. It must not be
        below the ellipsoid.
    r : array (3,)
        Start of the ray, Earth-fixed, m.
    direction : array (3,)
        Any length but zero.
    highest : float
        No terrain is above this height, m.

    Returns
    -------
    ndarray (3,)
        Earth-fixed, m, to a millimetre.

    Raises
    ------
    ValueError
        A ray that misses the ellipsoid, or meets it outside of the terrain.
    """
    end = ellipsoid_intersection(r, direction)
    u = (end - r) / np.linalg.norm(end - r)
    axes = np.array([SEMI_MAJOR, SEMI_MAJOR, SEMI_MAJOR * (1 - FLATTENING)])
    steepness = -np.sum(u * end / axes**2) / np.linalg.norm(end / axes**2)
    back = np.arange(0.0, 1.2 * highest / steepness, 10.0)[::-1]

    def above(distance: Any) -> Any:
        latitude, longitude, h = ecef_to_geodetic(end - np.multiply.outer(distance, u))
        return h - height(latitude, longitude)

    clear = above(back)
    if np.isnan(clear[-1]):
        raise ValueError(
            "direction must meet the ground where height is known; found "
            f"{ecef_to_geodetic(end)[:2]} deg outside of it"
        )
    under = np.flatnonzero(clear <= 0)
    if not under.size:
        return end  # at height zero
    i = int(under[0])
    if i == 0 or np.isnan(clear[i - 1]):
        raise ValueError(
            "direction must reach the ground through air where height is known; found a ray that "
            "comes from outside of the terrain, or terrain above the highest"
        )
    return end - brentq(above, back[i], back[i - 1], xtol=1e-4) * u
