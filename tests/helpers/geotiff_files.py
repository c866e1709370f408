"""GeoTIFF files of one band, on pixels of a map or in degrees."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from navfilters.sar.ground.terrain import LocalMap
from navfilters.sar.palsar.geotiff_reader import read_reference

rasterio = pytest.importorskip("rasterio")

PLACE = LocalMap(30.0, -95.0)
SIZE = 401


def write(path, values, transform, crs="EPSG:4326", *, units=None, name=None, colour=None, **more):
    """One band, rows from north; GDAL's affine transform of pixel corners."""
    values = np.asarray(values)
    rows, columns = values.shape
    more |= {"driver": "GTiff", "height": rows, "width": columns, "count": 1, "dtype": values.dtype}
    with rasterio.open(path, "w", transform=transform, crs=crs, **more) as file:
        file.write(values, 1)
        if units is not None:
            file.units = [units]
        if name is not None:
            file.descriptions = [name]
        if colour is not None:
            file.colorinterp = [rasterio.enums.ColorInterp[colour]]
    return path


def degrees(west, north, step, rows, columns):
    """The middle of the first pixel is given."""
    del rows, columns
    return rasterio.Affine(step, 0, west - step / 2, 0, -step, north + step / 2)


def image(path, values, scale=10.0, place=PLACE, **more):
    """On the pixels that are asked for, or on larger or smaller ones."""
    east, north = place.metres
    half = len(values) / 2 * scale
    corner = place.longitude - half / east, place.latitude + half / north
    at = rasterio.Affine(scale / east, 0, corner[0], 0, -scale / north, corner[1])
    return write(path, values, at, **more)


def backscatter(seed=1, spread=4.0, level=-12.0, looks=None, size=SIZE):
    """A pattern in dB, with speckle."""
    rng = np.random.default_rng(seed)
    pattern = gaussian_filter(rng.standard_normal((size, size)), 3) * 10.6 * spread + level
    if looks:
        pattern += 10 * np.log10(rng.standard_gamma(looks, pattern.shape) / looks)
    return pattern.astype("float32")


def power(decibels):
    return (10 ** (np.asarray(decibels, float) / 10)).astype("float32")


def read(path, scene, **options):
    return read_reference(path, scene, half_width=1500.0, needed=1200.0, **options).values


def hills(size=301, level=400.0, spread=60.0, seed=4):
    rng = np.random.default_rng(seed)
    return level + gaussian_filter(rng.standard_normal((size, size)), 12) * 42 * spread


def dem(path, posts, step=1 / 1200, place=PLACE, **more):
    half = step * (len(posts) - 1) / 2
    at = degrees(place.longitude - half, place.latitude + half, step, *posts.shape)
    return write(path, posts, at, **more)


SHORT = (-32768, -9999, -32767, 32767)
