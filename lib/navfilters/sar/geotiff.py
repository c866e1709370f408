"""Elevation models and reference images from GeoTIFF files: what an image needs of them, no more.

Rasterio reads the files, in any coordinate reference system that it can transform to WGS 84. Of a
file with several bands the first is read. Places without data are where the file has none, where
its own mask says so, and beyond its edges.
"""

import importlib
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from navfilters.sar.geolocate import MATCHER, Matcher, Reference
from navfilters.sar.scene import LocalMap, Scene, Terrain
from navfilters.types import Array

WGS84 = "EPSG:4326"
FINEST = 1e-4
"""Elevation models are not read at a finer spacing, deg: about 11 m."""
_NOTHING = -1e30  # stands for no data while GDAL works


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
    posts, *_ = _posts(path, place, half_width)
    if np.isnan(posts).all():
        raise ValueError(f"{path} must cover {_around(place, half_width)}; found no heights there")
    return float(np.nanmedian(posts)) + geoid


def read_terrain(
    path: str | Path, place: LocalMap, half_width: float, *, geoid: float = 0.0
) -> Terrain:
    """An elevation model around a place.

    Posts in latitude and longitude are taken as they are; of anything else GDAL's cubic
    interpolation makes posts of about the same spacing.

    Parameters
    ----------
    path : str or Path
        Of a GeoTIFF file of heights, m.
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
        A file that has no coordinates, or that lacks a height in the square: with the first place
        that has none.
    OSError
        A file that cannot be read.
    ImportError
        Without rasterio.
    """
    posts, south, west, spacing = _posts(path, place, half_width)
    absent = np.argwhere(np.isnan(posts))
    if len(absent):
        latitude, longitude = np.array([south, west]) + spacing * absent[0]
        raise ValueError(
            f"{path} must hold all heights {_around(place, half_width)}; found none at "
            f"{latitude:.4f}, {longitude:.4f} deg and {len(absent) - 1} other posts"
        )
    return Terrain(posts + geoid, south, west, spacing)


def read_reference(
    path: str | Path,
    scene: Scene,
    *,
    half_width: float = 7000.0,
    pixel: float = 10.0,
    needed: float = 2500.0,
    matcher: Matcher = MATCHER,
) -> Reference:
    """An orthoimage about the middle of a scene's map.

    Parameters
    ----------
    path : str or Path
        Of a geocoded GeoTIFF image, corrected for the terrain: backscatter in dB if any of it is
        below zero; intensity or amplitude, and zero for no data, if none is.
    scene : Scene
        Whose map and elevation model go with it.
    half_width : float
        Of the square that is read, m.
    pixel : float
        To which the image is averaged or interpolated, m.
    needed : float
        Half of the side of the square in which at least half of the pixels must have data, m. All
        others get the median.
    matcher : Matcher

    Returns
    -------
    Reference

    Raises
    ------
    ValueError
        A file that has no coordinates, or not enough data.
    OSError, ImportError
        As :func:`read_terrain`.
    """
    half = int(half_width / pixel)
    to_east, to_north = scene.map.metres
    west, north = scene.map.longitude, scene.map.latitude
    step = pixel / to_east, pixel / to_north
    with _opened(path) as dataset:
        corner = west - half * step[0], north + half * step[1]
        values = _warped(dataset, corner, step, (2 * half + 1, 2 * half + 1), "bilinear")
    if not (values < 0).any():
        values = 10 * np.log10(np.where(values > 0, values, np.nan))
    inner = slice(max(half - int(needed / pixel), 0), half + int(needed / pixel) + 1)
    share = np.isfinite(values[inner, inner]).mean()
    if share < 0.5:
        raise ValueError(
            f"{path} must have data in half of the pixels {_around(scene.map, needed)}; found "
            f"{100 * share:.0f} %"
        )
    values = np.where(np.isnan(values), np.nanmedian(values), values).astype(np.float32)
    return Reference(values, pixel, scene, None, matcher)


def _around(place: LocalMap, half_width: float) -> str:
    return f"within {half_width:.0f} m of {place.latitude:.4f}, {place.longitude:.4f} deg"


def _posts(
    path: str | Path, place: LocalMap, half_width: float
) -> tuple[Array, float, float, float]:
    """Heights or NaN, rows from south to north; south, west and spacing of the posts, deg."""
    to_east, to_north = place.metres
    with _opened(path) as dataset:
        with _rasterio("rasterio.vrt").WarpedVRT(dataset, crs=WGS84) as suggested:
            given = suggested.transform
        spacing = max(min(given.a, -given.e), FINEST)
        left, top = given.c + given.a / 2, given.f + given.e / 2  # of the file's first post
        west, north = place.longitude - half_width / to_east, place.latitude + half_width / to_north
        column, row = np.floor((west - left) / spacing), np.floor((top - north) / spacing)
        shape = (
            int(np.ceil(2 * half_width / to_north / spacing)) + 2,
            int(np.ceil(2 * half_width / to_east / spacing)) + 2,
        )
        corner = float(left + column * spacing), float(top - row * spacing)
        posts = _warped(dataset, corner, (spacing, spacing), shape, "cubic")[::-1]
    return posts, corner[1] - (shape[0] - 1) * spacing, corner[0], spacing


@contextmanager
def _opened(path: str | Path) -> Iterator[Any]:
    """A rasterio dataset whose pixels have places and hold real numbers."""
    rasterio = _rasterio("rasterio")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        dataset = rasterio.open(path)
    with dataset:
        if dataset.crs is None:
            raise ValueError(
                f"{path} must have a coordinate reference system; found none: not a GeoTIFF, or "
                "one in radar geometry"
            )
        if dataset.transform.is_identity:
            raise ValueError(f"{path} must say where its pixels are; found no geotransform")
        if "complex" in dataset.dtypes[0]:
            raise ValueError(f"{path} must hold real numbers; found {dataset.dtypes[0]}")
        yield dataset


def _warped(
    dataset: Any,
    corner: tuple[float, float],
    step: tuple[float, float],
    shape: tuple[int, int],
    resampling: str,
) -> Array:
    """Values, NaN for none, at a grid of longitudes and latitudes; rows from north to south.

    The corner is the middle of its first pixel: east, north, deg.
    """
    transform = _rasterio("rasterio").Affine(
        step[0], 0.0, corner[0] - step[0] / 2, 0.0, -step[1], corner[1] + step[1] / 2
    )
    with _rasterio("rasterio.vrt").WarpedVRT(
        dataset,
        crs=WGS84,
        transform=transform,
        height=shape[0],
        width=shape[1],
        resampling=_rasterio("rasterio.enums").Resampling[resampling],
        dtype="float64",
        nodata=_NOTHING,
    ) as warped:
        values = warped.read(1, masked=True).filled(np.nan)
    values = np.where(np.isfinite(values), values, np.nan)
    return values * dataset.scales[0] + dataset.offsets[0]


def _rasterio(module: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError:
        raise ImportError("GeoTIFF files need rasterio: pip install navfilters[palsar]") from None
