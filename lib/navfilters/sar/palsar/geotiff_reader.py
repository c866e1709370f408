"""Terrain and reference images from GeoTIFF files."""

from pathlib import Path

import numpy as np
from scipy import ndimage

from navfilters.sar.ground.scene import Scene
from navfilters.sar.ground.terrain import LocalMap, Terrain
from navfilters.sar.matching.matcher import MATCHER, Matcher
from navfilters.sar.matching.reference import Reference
from navfilters.sar.palsar.geotiff_posts import (
    HIGHEST,
    LOWEST,
    _around,
    _near,
    _posts,
    _warn_of_odd,
)
from navfilters.sar.palsar.geotiff_values import (
    UNITS,
    _declared_unit,
    _extremes,
    _name,
    _opened,
    _pixel,
    _sound_unit,
    _void,
    _warped,
)


def median_height(
    path: str | Path, place: LocalMap, half_width: float, *, geoid: float = 0.0
) -> float:
    """Of an elevation model around a place, as far as the file reaches: where a search can start.

    Parameters
    ----------
    path, place, half_width, geoid
        As for :func:`read_terrain`.

    Returns
    -------
    float
        Above the WGS-84 ellipsoid, m.

    Raises
    ------
    ValueError
        A file that has no coordinates, or no heights there at all.
    OSError, ImportError
        As :func:`read_terrain`.
    """
    posts = _posts(path, place, half_width, geoid)
    if np.isnan(posts.heights).all():
        found = posts.wrong or f"no heights there{_why_none(path, place, half_width)}"
        raise ValueError(f"{path} must cover {_around(place, half_width)}; found {found}")
    return float(np.nanmedian(posts.heights)) + geoid


def read_terrain(
    path: str | Path, place: LocalMap, half_width: float, *, geoid: float = 0.0
) -> Terrain:
    """An elevation model around a place.

    Posts in latitude and longitude are taken as they are; of anything else GDAL's cubic
    interpolation makes posts of about the same spacing.

    Parameters
    ----------
    path : str or Path
        Of a GeoTIFF file of heights: m, or feet if it declares them.
    place : LocalMap
        In the middle.
    half_width : float
        Of the square that is needed, m.
    geoid : float
        Added to all heights, m: where they count from sea level, the height of the geoid above
        the WGS-84 ellipsoid.

    Returns
    -------
    Terrain
        Heights above the WGS-84 ellipsoid.

    Raises
    ------
    ValueError
        A file that has no coordinates, holds no heights, or lacks one in the square: with the first
        place that has none, or one that no ground has. A geoid that is none.
    OSError
        A file that cannot be read.
    ImportError
        Without rasterio.

    Warns
    -----
    UserWarning
        Heights of exactly 0 amid high ground, or everywhere; steps between neighbouring posts that
        hardly any ground has; heights that the file declares to count from sea level, and no geoid.
    """
    posts = _posts(path, place, half_width, geoid)
    if posts.wrong:
        needed = f"heights from {LOWEST:.0f} to {HIGHEST:.0f} m"
        raise ValueError(
            f"{path} must hold {needed} {_around(place, half_width)}; found {posts.wrong}"
        )
    absent = np.argwhere(np.isnan(posts.heights))
    if len(absent):
        raise ValueError(
            f"{path} must hold all heights {_around(place, half_width)}; found none at "
            f"{posts.place(*absent[0])} and {len(absent) - 1} other posts"
            f"{_why_none(path, place, half_width)}"
        )
    _warn_of_odd(path, place, half_width, posts)
    return Terrain(posts.heights + geoid, posts.south, posts.west, posts.spacing)


def read_reference(
    path: str | Path,
    scene: Scene,
    *,
    half_width: float = 7000.0,
    pixel: float = 10.0,
    needed: float = 2500.0,
    unit: str | None = None,
    matcher: Matcher = MATCHER,
) -> Reference:
    """An orthoimage about the middle of a scene's map.

    Parameters
    ----------
    path : str or Path
        Of a geocoded GeoTIFF image, corrected for the terrain: backscatter in dB, or intensity or
        amplitude. What is not above zero in the latter has not been measured.
    scene : Scene
        Whose map and elevation model go with it.
    half_width : float
        Of the square that is read, m.
    pixel : float
        To which the image is averaged or interpolated, m.
    needed : float
        Half of the side of the square in which at least half of the pixels must have data, m. All
        others get the median.
    unit : {"dB", "linear"}, optional
        Of the image. By default what its band declares, or what its pixels together tell: in dB, at
        least 55 % are below zero, and the darkest by more than 3 dB; otherwise at most 10 % are,
        the darkest are far below the brightest, and the bright ones spread wider than the dark ones
        do. Anything between is refused.
    matcher : Matcher

    Returns
    -------
    Reference

    Raises
    ------
    ValueError
        A file that has no coordinates, not enough data, values that no backscatter has, or a unit
        that it does not tell.
    OSError, ImportError
        As :func:`read_terrain`.
    """
    half = int(half_width / pixel)
    to_east, to_north = scene.map.metres
    west, north = scene.map.longitude, scene.map.latitude
    step = pixel / to_east, pixel / to_north
    if unit not in (None, *UNITS):
        raise ValueError(f"unit must be 'dB', 'linear' or None; found {unit!r}")
    with _opened(path) as dataset:
        grid = (west - half * step[0], north + half * step[1]), step, (2 * half + 1, 2 * half + 1)
        coarser = _pixel(dataset, scene.map) / pixel
        values = _warped(dataset, *grid, "bilinear")
        raw, low, high = _extremes(dataset, *grid)
        void, zero = _void(dataset, raw, low, high)
        declared = _declared_unit(dataset, path, unit)
    reach = int(np.ceil(coarser - 0.01)) if coarser > 0.99 else 2  # of what is averaged with a void
    values[_near(void, reach) | zero] = np.nan
    if np.isfinite(values).any():
        unit = _sound_unit(path, values, unit or declared)
        if unit == "linear":
            zero = ndimage.binary_opening(zero, np.ones((3, 3)))  # others are noise, cut at 0
        values[_near(zero, reach)] = np.nan
        if unit == "linear":
            values = 10 * np.log10(np.where(values > 0, values, np.nan))
    inner = slice(max(half - int(needed / pixel), 0), half + int(needed / pixel) + 1)
    share = np.isfinite(values[inner, inner]).mean()
    if share < 0.5:
        raise ValueError(
            f"{path} must have data in half of the pixels {_around(scene.map, needed)}; found "
            f"{100 * share:.0f} %{_why_none(path, scene.map, needed)}"
        )
    values = np.where(np.isnan(values), np.nanmedian(values), values).astype(np.float32)
    return Reference(values, pixel, scene, None, matcher)


def _why_none(path: str | Path, place: LocalMap, half_width: float) -> str:
    """Where a file ends, and whether the 180th meridian has to do with it."""
    with _opened(path) as dataset:
        left, bottom, right, top = dataset.bounds
        reach = f"{left:.8g} to {right:.8g} east, {bottom:.8g} to {top:.8g} north"
        why = f"; the file reaches from {reach} in {_name(dataset.crs)}"
    longitude = abs((place.longitude + 180) % 360 - 180)
    if longitude + half_width / place.metres[0] > 180:
        why += (
            ". The 180th meridian crosses the square: both sides must be in one file, such as one "
            "in UTM"
        )
    return why
