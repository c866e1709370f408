"""Elevation models as GeoTIFF files: what is read of them, and what is refused."""

import tracemalloc

import numpy as np
import pytest
from geotiff_bands import (
    PLACE,
    UTM,
    in_degrees,
    places,
    write,
)
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import gaussian_filter

from navfilters.sar.ground.terrain import LocalMap
from navfilters.sar.palsar.geotiff_reader import median_height, read_terrain

rasterio = pytest.importorskip("rasterio")
warp = pytest.importorskip("rasterio.warp")


def test_posts_in_degrees_are_taken_as_they_are(tmp_path, tile):
    found = read_terrain(in_degrees(tmp_path / "a.tif", tile), PLACE, 3000.0)
    assert_allclose(found.spacing, 1 / 1200, rtol=1e-12)
    row = round((found.south - tile.south) * 1200)
    column = round((found.west - tile.west) * 1200)
    rows, columns = found.posts.shape
    assert_array_equal(found.posts, tile.posts[row : row + rows, column : column + columns])
    assert_allclose((found.south, found.west), (tile.south + row / 1200, tile.west + column / 1200))
    inside = places(3000.0)
    assert not np.isnan(found.height(*inside)).any()
    assert rows * columns < 100**2


def test_heights_on_a_map_in_metres(tmp_path):
    """A smooth hill each 20 m in UTM, against its formula."""

    def hill(x, y):
        return 300 + 80 * np.exp(-((x - 500300) ** 2 + (y - 3318900) ** 2) / (2 * 900.0**2))

    x, y = 500000 + 20.0 * np.arange(-250, 251), 3319000 - 20.0 * np.arange(-250, 251)
    path = write(
        tmp_path / "a.tif", hill(*np.meshgrid(x, y)).astype("float32"), x[0], y[0], 20.0, UTM
    )
    middle = warp.transform(UTM, "EPSG:4326", [500100.0], [3318950.0])
    place = LocalMap(middle[1][0], middle[0][0])
    found = read_terrain(path, place, 2500.0, geoid=-26.5)
    latitude, longitude = place.geodetic(*np.random.default_rng(0).uniform(-2500, 2500, (2, 300)))
    truth = hill(*np.array(warp.transform("EPSG:4326", UTM, longitude, latitude)))
    assert_allclose(found.height(latitude, longitude), truth - 26.5, rtol=0, atol=0.03)


def test_posts_that_are_narrower_to_the_east(tmp_path, tile):
    """As where a model keeps its distances in metres: 3 arc-seconds by 1.5 become 1.5 by 1.5."""
    posts = gaussian_filter(tile.posts, 3)[::-1].astype("float32")
    path = write(tmp_path / "a.tif", posts, PLACE.longitude - 0.15, 30.07, (1 / 1200, 1 / 2400))
    found = read_terrain(path, PLACE, 2000.0)
    assert_allclose(found.spacing, 1 / 2400)
    at = 30.07 - 190 / 2400, PLACE.longitude - 0.15 + 180 / 1200
    assert_allclose(found.height(*at), posts[190, 180], rtol=0, atol=0.05)


def test_very_fine_posts_are_averaged(tmp_path):
    rng = np.random.default_rng(2)
    fine = 100 + gaussian_filter(rng.standard_normal((2400, 2400)), 40) * 500
    path = write(tmp_path / "a.tif", fine.astype("float32"), -95.012, 30.012, 1e-5)
    found = read_terrain(path, PLACE, 900.0)
    assert_allclose(found.spacing, 1e-4)
    at = 30.012 - 1e-5 * 1100, -95.012 + 1e-5 * 1300
    assert_allclose(found.height(*at), fine[1100, 1300], rtol=0, atol=0.1)


def test_stored_numbers_may_be_scaled(tmp_path, tile):
    path = in_degrees(tmp_path / "a.tif", tile, scale=(0.1, 50.0))
    assert_allclose(median_height(path, PLACE, 2000.0), 50 + 0.1 * np.median(
        read_terrain(in_degrees(tmp_path / "b.tif", tile), PLACE, 2000.0).posts
    ))  # fmt: skip


def test_the_first_band_is_read(tmp_path, tile):
    posts = tile.posts[::-1].astype(np.int16)
    north = tile.south + tile.spacing * (len(posts) - 1)
    path = write(tmp_path / "a.tif", np.stack([posts, 0 * posts]), tile.west, north, tile.spacing)
    found = read_terrain(path, PLACE, 3000.0).height(30.0, -95.0)
    assert_allclose(found, tile.height(30.0, -95.0), atol=1e-6)


def test_a_median_needs_no_complete_square(tmp_path, tile):
    path = in_degrees(tmp_path / "a.tif", tile)
    corner = LocalMap(tile.south, tile.west)
    assert_allclose(
        median_height(path, corner, 900.0, geoid=5.0), 5 + np.median(tile.posts[:10, :12]), atol=15
    )
    with pytest.raises(ValueError, match=r"a\.tif must cover within 900 m of 10\.0000.*no heights"):
        median_height(path, LocalMap(10.0, -95.0), 900.0)


def test_only_what_is_needed_is_read(tmp_path):
    """Of 4e8 posts, 1.6 GB, that the file does not even store."""
    step = 1 / 3600
    with rasterio.open(
        tmp_path / "a.tif", "w", driver="GTiff", width=20000, height=20000, count=1,
        dtype="float32", crs="EPSG:4326", tiled=True, sparse_ok=True,
        transform=rasterio.Affine(step, 0, -97.0, 0, -step, 32.0),
    ):  # fmt: skip
        pass
    tracemalloc.start()
    with pytest.warns(UserWarning, match=r"a\.tif has odd heights .* 0 everywhere"):
        assert not read_terrain(tmp_path / "a.tif", PLACE, 8000.0).posts.any()
    assert tracemalloc.get_traced_memory()[1] < 40e6
    tracemalloc.stop()


@pytest.mark.parametrize("mark", ["value", "nan", "mask"])
def test_a_hole_is_refused_with_its_place(tmp_path, tile, mark):
    posts = tile.posts[::-1].astype("float32")
    hole = np.zeros(posts.shape, bool)
    row = round((tile.south + tile.spacing * (len(posts) - 1) - 30.01) / tile.spacing)
    hole[row, 200:202] = True
    options = {"value": {"nodata": -32768.0}, "nan": {}, "mask": {}}[mark]
    posts[hole] = {"value": -32768.0, "nan": np.nan, "mask": 5.0}[mark]
    north = tile.south + tile.spacing * (len(posts) - 1)
    path = write(tmp_path / "a.tif", posts, tile.west, north, tile.spacing, **options)
    if mark == "mask":
        with rasterio.open(path, "r+") as file:
            file.write_mask(~hole)
    message = (
        r"a\.tif must hold all heights within 4000 m of 30\.0000, -95\.0000 deg; "
        r"found none at 30\.0\d+, -95\.0\d+ deg and \d+ other"
    )
    with pytest.raises(ValueError, match=message):
        read_terrain(path, PLACE, 4000.0)
    read_terrain(path, LocalMap(29.95, -95.0), 2000.0)


def test_beyond_the_edge_there_is_no_ground(tmp_path, tile):
    path = in_degrees(tmp_path / "a.tif", tile)
    with pytest.raises(ValueError, match="must hold all heights within 3000 m"):
        read_terrain(path, LocalMap(tile.south + 0.01, -95.0), 3000.0)
