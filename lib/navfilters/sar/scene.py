"""Ground that a radar sees: a real terrain model, a land cover drawn at random, bright points.

Heights are of the sample tile that matplotlib ships (SRTM, 3 arc-seconds), moved to where the beam
meets the ground and taken as heights above the WGS-84 ellipsoid. The land cover has no counterpart
on the Earth. Horizontal positions are metres to the east and north on a :class:`LocalMap`, whose
latitude and longitude are exact; what one facet returns is reckoned over a flat Earth, with the
radar at its true range and incidence.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy import fft
from scipy.ndimage import map_coordinates, spline_filter
from scipy.optimize import brentq

from navfilters import validation
from navfilters._extras import needed
from navfilters.frames import (
    FLATTENING,
    SEMI_MAJOR,
    ecef_to_geodetic,
    ellipsoid_intersection,
)
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
    return 360.0 * np.round((np.asarray(longitude) - near) / 360.0)


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


def smooth_field(shape: tuple[int, int], correlation: float, rng: np.random.Generator) -> Array:
    """Standard normal numbers that vary smoothly, white noise through a Gaussian.

    Parameters
    ----------
    shape : tuple of int
    correlation : float
        Standard deviation of the Gaussian, cells. Opposite edges fit together.
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of float32
        Mean 0 and variance 1 over the ensemble.
    """
    white = rng.standard_normal(shape, dtype=np.float32)
    f = [fft.fftfreq(shape[0])[:, None], fft.rfftfreq(shape[1])[None, :]]
    kernel = np.exp(-2 * (np.pi * correlation) ** 2 * (f[0] ** 2 + f[1] ** 2)).astype(np.float32)
    both = np.concatenate([kernel, kernel[:, 1 : shape[1] - kernel.shape[1] + 1]], axis=1)
    power = np.sqrt(np.mean(both**2))
    return fft.irfft2(fft.rfft2(white, workers=2) * (kernel / power), s=shape, workers=2)


class CoverClass(NamedTuple):
    """A kind of ground.

    Parameters
    ----------
    share : float
        Bias of the class where classes compete: larger, more frequent.
    level : float
        Reflectivity, dB about the law of ``lambert``.
    texture : float
        Standard deviation within the class, dB.
    length : float
        Correlation of that texture, m.
    """

    share: float
    level: float
    texture: float
    length: float


COVER = {
    "water": CoverClass(-0.9, -11.0, 0.3, 200.0),
    "pasture": CoverClass(0.3, -4.0, 0.8, 80.0),
    "crops": CoverClass(0.0, 0.0, 1.2, 60.0),
    "forest": CoverClass(0.3, 4.0, 1.5, 30.0),
    "town": CoverClass(-0.9, 9.0, 3.0, 18.0),
}
"""Classes of the synthetic land cover; levels are of the order seen at L band."""


@dataclass(frozen=True, eq=False)
class LandCover:
    """Reflectivity of the ground on a raster about the middle of a :class:`LocalMap`.

    Parameters
    ----------
    reflectivity : array (n, n)
        Ratio to the law of ``lambert``; rows from south to north.
    spacing : float
        Of the raster, m.
    """

    reflectivity: Array
    spacing: float

    @classmethod
    def draw(
        cls,
        half_width: float,
        seed: Any,
        *,
        spacing: float = 8.0,
        patch: float = 120.0,
        classes: dict[str, CoverClass] = COVER,
    ) -> "LandCover":
        """Draw one: each class has a smooth random field, and the highest field wins.

        Parameters
        ----------
        half_width : float
            Of the square, m.
        seed : int or sequence of int
        spacing : float
            Of the raster, m.
        patch : float
            Correlation length of the fields that compete, m: the size of a patch of one class.
        classes : dict of CoverClass

        Returns
        -------
        LandCover
        """
        for name, value in (("half_width", half_width), ("spacing", spacing), ("patch", patch)):
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} must be a positive number of m; found {value}")
        n, rng = 2 * int(np.ceil(half_width / spacing)) + 1, np.random.default_rng(seed)
        best = np.full((n, n), -np.inf, np.float32)
        level = np.zeros((n, n), np.float32)
        for kind in classes.values():
            rank = kind.share + smooth_field((n, n), patch / spacing, rng)
            mine = kind.level + kind.texture * smooth_field((n, n), kind.length / spacing, rng)
            level = np.where(rank > best, mine, level)
            best = np.maximum(rank, best)
        return cls(10 ** (level / 10), spacing)

    def at(self, east: Array, north: Array) -> Array:
        """Reflectivity of places, linear between the raster's.

        Parameters
        ----------
        east, north : array (...)
            m. Beyond the raster its edge continues.

        Returns
        -------
        ndarray (...) of float32
        """
        middle = (len(self.reflectivity) - 1) / 2
        where = [north / self.spacing + middle, east / self.spacing + middle]
        return map_coordinates(self.reflectivity, where, order=1, mode="nearest")


def lambert(cosine: Array) -> Array:
    """Backscatter of rough ground at a local incidence angle, 1 at 38.7 degrees.

    sigma ~ cos(theta)^2

    Parameters
    ----------
    cosine : array (...)
        Of the local incidence angle; 0 or less is ground that faces away and returns nothing.

    Returns
    -------
    ndarray (...)
        Ratio of powers for equal areas.

    Notes
    -----
    Gentle, as of vegetation. Laws with a specular peak (Muhleman's: 26 dB at normal incidence) let
    a few slopes that face the radar decide the sharpness of the whole image.
    """
    return (np.clip(cosine, 0.0, 1.0) / 0.7804) ** 2


class Points(NamedTuple):
    """Bright scatterers on the ground.

    Parameters
    ----------
    east, north : array (n,)
        m.
    power : array (n,)
        Radar cross-section, in m^2 of ground of reflectivity 1.
    """

    east: Array
    north: Array
    power: Array


class View(NamedTuple):
    """Where a radar is when it looks at the middle of a scene.

    Parameters
    ----------
    heading : float
        Horizontal direction of flight, clockwise from north, rad. The radar looks to the right.
    incidence : float
        Between the ray and the vertical, rad.
    slant_range : float
        m; infinite for parallel rays.
    """

    heading: float
    incidence: float
    slant_range: float

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Unit vectors (east, north) along the flight, and across it, away from the radar."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        return np.array([s, c]), np.array([c, -s])


@dataclass(frozen=True, eq=False)
class Scene:
    """Terrain, land cover and bright points about the middle of a map.

    Parameters
    ----------
    map : LocalMap
    terrain : Terrain
    cover : LandCover
    points : Points
    """

    map: LocalMap
    terrain: Terrain
    cover: LandCover
    points: Points

    def height(self, east: Array, north: Array) -> Array:
        """Of the terrain, m.

        Parameters
        ----------
        east, north : array (...)
            m.

        Returns
        -------
        ndarray (...)
            NaN outside of the tile.
        """
        return self.terrain.height(*self.map.geodetic(east, north))

    def returns(self, view: View, along: Array, across: Array) -> tuple[Array, Array]:
        """Power that each facet of a grid sends back, and how high it is.

        Its area on the slope, times the reflectivity of its land, times ``lambert`` of the local
        incidence angle; none from facets that face away or lie in the shadow of others.

        Parameters
        ----------
        view : View
        along, across : array (n,), (m,)
            Ascending and evenly spaced positions along the flight and across it, m: the axes of
            ``view``. At least two each.

        Returns
        -------
        power : ndarray (n, m) of float32
            In m^2 of ground of reflectivity 1.
        height : ndarray (n, m) of float32
            m.

        Raises
        ------
        ValueError
            A grid that leaves the terrain.
        """
        flight, away = view.axes
        east = along[:, None] * flight[0] + across * away[0]
        north = along[:, None] * flight[1] + across * away[1]
        height = self.height(east, north).astype(np.float32)
        if np.isnan(height).any():
            raise ValueError(
                "along and across must stay on the terrain; found a grid from "
                f"{along[0]:.0f} to {along[-1]:.0f} m and {across[0]:.0f} to {across[-1]:.0f} m"
            )
        steps = along[1] - along[0], across[1] - across[0]
        rise, slope = np.gradient(height, *steps)
        ray = self._rays(view, across)
        # n = (-rise, -slope, 1): its length is also the area on the slope of one on the level
        stretch = np.sqrt(1 + rise * rise + slope * slope)
        cosine = (slope * np.sin(ray) + np.cos(ray)) / stretch
        power = self.cover.at(east, north) * lambert(cosine) * stretch * (steps[0] * steps[1])
        hidden = self._hidden(view, across, height)
        return np.where(hidden, 0, power).astype(np.float32), height

    def _rays(self, view: View, across: Array) -> Array:
        """Incidence on the level at each distance across the flight."""
        if not np.isfinite(view.slant_range):
            return np.full(across.shape, view.incidence, np.float32)
        out, up = np.sin(view.incidence), np.cos(view.incidence)
        ray = np.arctan2(view.slant_range * out + across, view.slant_range * up)
        return ray.astype(np.float32)

    def _hidden(self, view: View, across: Array, height: Array) -> Array:
        """Facets whose ray passes below one that is nearer."""
        height = height - self.height(0.0, 0.0)
        out, up = np.sin(view.incidence), np.cos(view.incidence)
        if np.isfinite(view.slant_range):
            reach = view.slant_range
            outwards = (reach * out + across) / (reach * up - height)  # tangent of the look angle
        else:
            outwards = across * up + height * out
        return outwards < np.maximum.accumulate(outwards, axis=1)


def draw_scene(
    terrain: Terrain,
    centre: LocalMap,
    seed: Any = 0,
    *,
    half_width: float = 10000.0,
    density: float = 5.0,
    powers: tuple[float, float] = (27.0, 41.0),
    **cover: Any,
) -> Scene:
    """A scene with a land cover and bright points drawn at random.

    Parameters
    ----------
    terrain : Terrain
    centre : LocalMap
        Its middle is the scene's.
    seed : int or sequence of int
    half_width : float
        Of the square that is drawn, m.
    density : float
        Bright points in a square kilometre.
    powers : tuple of float
        Their cross-sections are spread evenly between these, dB: see ``Points``. A cell of PALSAR's
        raster has 14 dB.
    **cover
        To ``LandCover.draw``.

    Returns
    -------
    Scene
    """
    seeds = np.random.SeedSequence(seed).spawn(2)
    rng = np.random.default_rng(seeds[1])
    number = round(density * (2 * half_width / 1000) ** 2)
    east, north = rng.uniform(-half_width, half_width, (2, number))
    power = 10 ** (rng.uniform(*powers, number) / 10)
    drawn = LandCover.draw(half_width, seeds[0], **cover)
    return Scene(centre, terrain, drawn, Points(east, north, power))
