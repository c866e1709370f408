"""GeoTIFF files of several bands, on a map in metres or in degrees."""

import numpy as np
import pytest

from navfilters.sar.ground.terrain import LocalMap

rasterio = pytest.importorskip("rasterio")

PLACE = LocalMap(30.0, -95.0)
UTM = "EPSG:32615"


def write(path, bands, west, north, step, crs="EPSG:4326", **options):
    """Bands (n, rows, columns) or one, rows from north; the middle of the first pixel is given."""
    bands = np.atleast_3d(bands) if np.ndim(bands) == 1 else np.asarray(bands)
    bands = bands[None] if bands.ndim == 2 else bands
    step = np.broadcast_to(step, 2)
    place = rasterio.Affine(step[0], 0.0, west - step[0] / 2, 0.0, -step[1], north + step[1] / 2)
    scale = options.pop("scale", None)
    options |= {"driver": "GTiff", "count": len(bands), "dtype": bands.dtype}
    options |= {"height": bands.shape[1], "width": bands.shape[2], "crs": crs}
    with rasterio.open(path, "w", transform=place, **options) as file:
        file.write(bands)
        if scale is not None:
            file.scales, file.offsets = [scale[0]], [scale[1]]
    return path


def in_degrees(path, tile, **options):
    north = tile.south + tile.spacing * (len(tile.posts) - 1)
    posts = tile.posts[::-1].astype(np.int16)
    return write(path, posts, tile.west, north, tile.spacing, **options)


def around(east, north):
    return PLACE.geodetic(np.asarray(east), np.asarray(north))


def places(reach, n=400, seed=1):
    return around(*np.random.default_rng(seed).uniform(-reach, reach, (2, n)))
