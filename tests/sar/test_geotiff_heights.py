"""Elevation models that do not say what their numbers are: voids, units, vertical systems."""

import time
import warnings

import numpy as np
import pytest
from geotiff_files import (
    PLACE,
    SHORT,
    dem,
    hills,
    write,
)
from numpy.testing import assert_allclose

from navfilters.sar.ground.terrain import LocalMap
from navfilters.sar.palsar.geotiff_posts import LARGEST_GEOID
from navfilters.sar.palsar.geotiff_reader import median_height, read_terrain

rasterio = pytest.importorskip("rasterio")
warp = pytest.importorskip("rasterio.warp")


@pytest.mark.parametrize(
    ("kind", "void"),
    [
        *(("int16", void) for void in SHORT),
        *(("float32", void) for void in (*SHORT, -99999.0, 1e20, -3.4028235e38)),
    ],
)
@pytest.mark.parametrize("size", [1, 9])
def test_an_undeclared_void_is_no_height(tmp_path, void, kind, size):
    posts = hills().astype(kind)
    wanted = median_height(dem(tmp_path / "a.tif", posts), PLACE, 3000.0)
    posts[140 : 140 + size, 130 : 130 + size] = void
    path = dem(tmp_path / "b.tif", posts)
    at = (posts.shape[0] - 1) / 2
    latitude = PLACE.latitude - (140 + size - 1 - at) / 1200
    message = (
        rf"b\.tif must hold heights from -600 to 9200 m within 3000 m of 30\.0000, -95\.0000 deg; "
        rf"found {void:.8g} at {latitude:.4f}, -95\.0167 deg and {size**2 - 1} other posts: a void "
        rf"that the file does not declare\? `rio edit-info --nodata {void:.8g} FILE` does"
    ).replace("+", r"\+")
    with pytest.raises(ValueError, match=message):
        read_terrain(path, PLACE, 3000.0)
    assert_allclose(median_height(path, PLACE, 3000.0), wanted, atol=5.0)
    assert read_terrain(path, LocalMap(29.92, -95.0), 1500.0).posts.min() > 100


@pytest.mark.parametrize("scale", [0.1, 0.01])
def test_a_void_of_scaled_numbers_is_none_either(tmp_path, scale):
    """-32768 hundredths are a height that the Earth has."""
    posts = np.round(hills(level=100.0, spread=20.0) / scale).astype("int16")
    path = dem(tmp_path / "a.tif", posts)
    with rasterio.open(path, "r+") as file:
        file.scales = [scale]
    found = read_terrain(path, PLACE, 3000.0)
    assert_allclose(found.height(30.0, -95.0), scale * posts[150, 150], atol=1e-6)
    posts[150, 150] = -32768
    with rasterio.open(path, "r+") as file:
        file.write(posts, 1)
    with pytest.raises(
        ValueError, match=r"found -32768 at 30\.0000, -95\.0000 deg and 0 other pos"
    ):
        read_terrain(path, PLACE, 3000.0)


@pytest.mark.parametrize("more", [{}, {"compress": "deflate"}])
@pytest.mark.parametrize("share", [0.05, 0.4, 0.7])
def test_a_file_that_is_cut_is_called_by_its_name(tmp_path, more, share):
    path = dem(tmp_path / "a.tif", hills().astype("float32"), **more)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    for reads in (read_terrain, median_height):
        with pytest.raises(OSError, match=r"a\.tif is damaged, or cut: .*"):
            reads(path, PLACE, 12000.0)


def test_many_islands_take_no_time(tmp_path):
    """A flat shore at sea level, with a thousand ponds of exactly 0."""
    posts = np.random.default_rng(5).integers(-2, 3, (301, 301)).astype("int16")
    started = time.perf_counter()
    read_terrain(dem(tmp_path / "a.tif", posts), PLACE, 12000.0)
    assert time.perf_counter() - started < 10


def test_a_map_of_no_place_on_earth_is_refused(tmp_path):
    at = rasterio.Affine(10, 0, 0, 0, -10, 0)
    local = 'LOCAL_CS["site",UNIT["metre",1]]'
    path = write(tmp_path / "a.tif", hills(), at, local)
    with pytest.raises(
        ValueError, match=r"a\.tif must have a map that shows 30\.0000, -95\.0000 deg"
    ):
        read_terrain(path, PLACE, 2000.0)
    path = write(tmp_path / "b.tif", hills(), at, "EPSG:32615")
    with pytest.raises(
        ValueError, match=r"b\.tif must hold .* the file reaches from 0 to 3010 east"
    ):
        read_terrain(path, LocalMap(-17.0, 95.0), 2000.0)


@pytest.mark.parametrize("void", [-9999.0])
def test_a_void_of_one_fine_pixel_is_not_averaged_away(tmp_path, void):
    """Of 3 m posts, twelve make one that is read: the average with the void would be a height."""
    posts = hills(1201).astype("float32")
    posts[600, 611] = void
    (x,), (y,) = warp.transform("EPSG:4326", "EPSG:32615", [-95.0], [30.0])
    at = rasterio.Affine(3, 0, x - 1801.5, 0, -3, y + 1801.5)
    path = write(tmp_path / "a.tif", posts, at, "EPSG:32615")
    with pytest.raises(
        ValueError, match=rf"found {void:.0f} at 30\.0\d*, -9\d\.\d* deg and \d+ ot"
    ):
        read_terrain(path, PLACE, 1500.0)
    path = write(tmp_path / "b.tif", posts, at, "EPSG:32615", nodata=void)
    assert read_terrain(path, PLACE, 1500.0).posts.min() > 100


def test_a_void_beside_the_square_is_felt(tmp_path):
    """Interpolation reaches two posts beyond what it makes."""
    step = 90.0
    (x,), (y,) = warp.transform("EPSG:4326", "EPSG:32615", [-95.0], [30.0])
    at = rasterio.Affine(step, 0, x - 60.5 * step, 0, -step, y + 60.5 * step)
    posts = hills(121).astype("float32")
    clean = read_terrain(write(tmp_path / "a.tif", posts, at, "EPSG:32615"), PLACE, 2000.0)
    for column in (25, 28, 29, 30, *range(33, 40), 60, *range(80, 88), 90, 91, 95):
        holed = posts.copy()
        holed[:, column] = -9999.0
        path = write(tmp_path / "b.tif", holed, at, "EPSG:32615")
        if 33 <= column <= 87:
            with pytest.raises(ValueError, match="found -9999 at"):
                read_terrain(path, PLACE, 2000.0)
        elif not 31 <= column <= 89:
            found = read_terrain(path, PLACE, 2000.0)
            assert_allclose(found.posts, clean.posts, rtol=0, atol=1e-6)


def test_a_geoid_lifts_the_median_as_it_lifts_the_posts(tmp_path):
    path = dem(tmp_path / "a.tif", hills())
    for geoid in (-27.0, 45.5):
        apart = median_height(path, PLACE, 2000.0, geoid=geoid) - median_height(path, PLACE, 2000.0)
        assert apart == pytest.approx(geoid, abs=1e-9)
        posts = (read_terrain(path, PLACE, 2000.0, geoid=g).posts for g in (geoid, 0.0))
        assert_allclose(next(posts) - next(posts), geoid, rtol=1e-9)


def test_heights_in_feet(tmp_path):
    """Declared, they are turned into metres; undeclared, high ones are refused."""
    metres = hills(level=3200.0)
    wanted = read_terrain(dem(tmp_path / "m.tif", metres), PLACE, 2000.0).posts
    international = ("ft", "foot", "feet", "International foot")
    for k, unit in enumerate((*international, "US survey foot", "ftUS", "us-ft", "foot_US")):
        path = dem(tmp_path / f"{k}.tif", metres / 0.3048, units=unit)
        assert_allclose(read_terrain(path, PLACE, 2000.0).posts, wanted, rtol=1e-5)
        assert_allclose(median_height(path, PLACE, 2000.0), np.median(wanted), rtol=1e-2)
    path = dem(tmp_path / "ft.tif", metres / 0.3048)
    with pytest.raises(
        ValueError, match=r"ft\.tif must hold heights .*feet\? `rio edit-info --bid"
    ):
        read_terrain(path, PLACE, 2000.0)


@pytest.mark.parametrize("unit", ["m", "metre", "metres", "meter", "meters", "unknown", ""])
def test_metres_by_any_name(tmp_path, unit):
    posts = hills()
    path = dem(tmp_path / "a.tif", posts, units=unit)
    assert_allclose(read_terrain(path, PLACE, 2000.0).height(30.0, -95.0), posts[150, 150])


@pytest.mark.parametrize("unit", ["cm", "decimetre", "km", "degree", "dB"])
def test_another_unit_is_no_height(tmp_path, unit):
    path = dem(tmp_path / "a.tif", hills(), units=unit)
    message = rf"a\.tif must hold heights in metres or feet; found the unit {unit}"
    with pytest.raises(ValueError, match=message):
        read_terrain(path, PLACE, 2000.0)


def test_a_map_in_feet_must_say_what_its_heights_are(tmp_path):
    crs = "EPSG:2277"  # central Texas, in US survey feet
    (x,), (y,) = warp.transform("EPSG:4326", crs, [-99.0], [30.0])
    at = rasterio.Affine(100, 0, x - 15050, 0, -100, y + 15050)
    place, posts = LocalMap(30.0, -99.0), hills()
    path = write(tmp_path / "a.tif", posts, at, crs)
    with pytest.raises(ValueError, match=r"a\.tif must declare the unit of its heights, since its"):
        read_terrain(path, place, 1000.0)
    for k, (unit, size) in enumerate({"foot": 0.3048, "metre": 1.0}.items()):
        path = write(tmp_path / f"{k}.tif", posts, at, crs, units=unit)
        found = read_terrain(path, place, 1000.0).height(30.0, -99.0)
        assert_allclose(found, size * posts[150, 150], rtol=1e-4)


@pytest.mark.parametrize(
    ("crs", "size", "warned"),
    [("EPSG:4269+6360", 1200 / 3937, True), ("EPSG:4326+5773", 1.0, True),
     ("EPSG:4979", 1.0, False)],
)  # fmt: skip
def test_a_declared_vertical_system_counts(tmp_path, crs, size, warned):
    posts = hills()
    path = dem(tmp_path / "a.tif", posts, crs=crs)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = read_terrain(path, PLACE, 2000.0)
    assert_allclose(found.height(30.0, -95.0), size * posts[150, 150], rtol=1e-4)
    assert any("count from sea level" in str(w.message) for w in told) == warned
    if warned:
        lifted = read_terrain(path, PLACE, 2000.0, geoid=-27.0)
        assert_allclose(lifted.posts, found.posts - 27, rtol=1e-12)
    else:
        with pytest.raises(
            ValueError, match="must count heights from sea level for a geoid of -27"
        ):
            read_terrain(path, PLACE, 2000.0, geoid=-27.0)


@pytest.mark.parametrize("geoid", [-111.0, 300.0, np.nan, np.inf])
def test_a_geoid_that_is_none(tmp_path, geoid):
    message = f"geoid must be a number from -{LARGEST_GEOID:.0f} to {LARGEST_GEOID:.0f} m; found"
    for reads in (read_terrain, median_height):
        with pytest.raises(ValueError, match=message):
            reads(dem(tmp_path / "a.tif", hills()), PLACE, 2000.0, geoid=geoid)


def test_the_floor_of_the_sea_is_no_surface(tmp_path):
    path = dem(tmp_path / "a.tif", hills(level=-3000.0))
    with pytest.raises(ValueError, match=r"found -\d+.*the sea's floor\? A radar sees its surface"):
        read_terrain(path, PLACE, 2000.0)
    with pytest.raises(ValueError, match=r"must cover .*; found -\d+.*the sea's floor"):
        median_height(path, PLACE, 2000.0)


@pytest.mark.parametrize("level", [200.0, 900.0, 3000.0])
@pytest.mark.parametrize("size", [2, 30])
def test_voids_that_are_filled_with_zeros_are_told(tmp_path, level, size):
    posts = hills(level=level, spread=20.0).astype("int16")
    posts[140 : 140 + size, 150 : 150 + size] = 0
    with pytest.warns(UserWarning, match=r"a\.tif has odd heights .* exactly 0 at .* voids that"):
        read_terrain(dem(tmp_path / "a.tif", posts), PLACE, 3000.0)


def test_a_spike_is_told(tmp_path):
    posts = hills()
    posts[150, 160] = 7000.0
    with pytest.warns(
        UserWarning, match=r"a step of 6\d\d\d m between posts 92 m apart, at \d\d\.\d+, -94\.99"
    ):
        read_terrain(dem(tmp_path / "a.tif", posts), PLACE, 3000.0)


def test_a_coast_is_no_void(tmp_path):
    """Land that rises from the sea, and ground below it."""
    posts = np.round(np.clip(hills(level=20.0, spread=40.0), 0, None)).astype("int16")
    assert (posts == 0).mean() > 0.2
    found = read_terrain(dem(tmp_path / "a.tif", posts), PLACE, 3000.0)
    assert_allclose(found.height(30.0, -95.0), posts[150, 150], atol=1e-6)
    below = read_terrain(dem(tmp_path / "b.tif", hills(level=-420.0, spread=5.0)), PLACE, 3000.0)
    assert below.posts.max() < -390
