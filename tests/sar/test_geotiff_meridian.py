"""Files about the 180th meridian, and of places that they do not hold."""

import numpy as np
import pytest
from geotiff_files import (
    backscatter,
    degrees,
    dem,
    hills,
    image,
    read,
    write,
)
from numpy.testing import assert_allclose

from navfilters.sar.ground.land_cover import LandCover
from navfilters.sar.ground.scene import Points, Scene
from navfilters.sar.ground.terrain import LocalMap, Terrain
from navfilters.sar.palsar.geotiff_reader import median_height, read_reference, read_terrain

rasterio = pytest.importorskip("rasterio")
warp = pytest.importorskip("rasterio.warp")


def crossing(longitude, shift):
    """In degrees, from 179 E to 179 W; ``shift`` turns are added to all longitudes."""
    step = 1 / 600
    west = 179.0 + 360 * shift
    longitudes, latitudes = west + step * np.arange(1201), -16.5 - step * np.arange(601)
    posts = surface(*np.meshgrid(longitudes, latitudes))
    return posts.astype("float32"), degrees(west, -16.5, step, *posts.shape)


def surface(longitude, latitude):
    """Heights of a smooth ground about (-17, 180)."""
    east = (np.asarray(longitude) % 360) - 180
    return 500 + 200 * np.sin(3 * east + 0.3) + 100 * np.cos(4 * (np.asarray(latitude) + 17))


NEAR_THE_MERIDIAN = [179.6, 179.98, 180.0, -180.0, -179.99, -179.5]


def agrees(found, place, reach=2500.0):
    east, north = np.random.default_rng(3).uniform(-reach, reach, (2, 200))
    latitude, longitude = place.geodetic(east, north)
    for turn in (-360, 0, 360):
        heights = found.height(latitude, longitude + turn)
        assert_allclose(heights, surface(longitude, latitude), rtol=0, atol=0.2)


@pytest.mark.parametrize("longitude", NEAR_THE_MERIDIAN)
@pytest.mark.parametrize("shift", [0, -1])
def test_degrees_across_the_180th_meridian(tmp_path, longitude, shift):
    place = LocalMap(-17.0, longitude)
    posts, at = crossing(longitude, shift)
    path = write(tmp_path / "a.tif", posts, at)
    agrees(read_terrain(path, place, 3000.0), place)
    wanted = np.median(surface(*np.meshgrid(longitude + np.linspace(-0.028, 0.028), -17.0)))
    assert_allclose(median_height(path, place, 3000.0), wanted, atol=10)


@pytest.mark.slow
@pytest.mark.parametrize("longitude", NEAR_THE_MERIDIAN)
@pytest.mark.parametrize(("west", "crs"), [(-180, "EPSG:4326"), (0, "EPSG:4326"), (0, "EPSG:4269")])
def test_a_model_of_the_whole_earth(tmp_path, longitude, west, crs):
    """Its seam is at the 180th meridian, or is not."""
    step, place = 0.02, LocalMap(-17.0, longitude)
    longitudes, latitudes = west + step * (np.arange(18000) + 0.5), -15 - step * np.arange(200)
    posts = surface(*np.meshgrid(longitudes, latitudes)).astype("float32")
    path = write(tmp_path / "a.tif", posts, degrees(longitudes[0], -15, step, 0, 0), crs)
    found = read_terrain(path, place, 9000.0)
    assert found.spacing == pytest.approx(step)
    east, north = np.random.default_rng(3).uniform(-9000, 9000, (2, 99))
    latitude, longitude = place.geodetic(east, north)
    assert_allclose(found.height(latitude, longitude), surface(longitude, latitude), atol=3.0)


@pytest.mark.parametrize("longitude", NEAR_THE_MERIDIAN)
@pytest.mark.parametrize("zone", [32760, 32701, 3832, 3460])
def test_metres_across_the_180th_meridian(tmp_path, longitude, zone):
    """UTM of either side, a Mercator about 150 E, and Fiji's own map."""
    place, crs, step = LocalMap(-17.0, longitude), f"EPSG:{zone}", 150.0
    (x,), (y,) = warp.transform("EPSG:4326", crs, [longitude], [-17.0])
    x, y = x + step * np.arange(-200, 201), y - step * np.arange(-200, 201)
    grid = np.meshgrid(x, y)
    lon, lat = warp.transform(crs, "EPSG:4326", grid[0].ravel(), grid[1].ravel())
    posts = surface(np.array(lon), np.array(lat)).reshape(grid[0].shape).astype("float32")
    at = rasterio.Affine(step, 0, x[0] - step / 2, 0, -step, y[0] + step / 2)
    found = read_terrain(write(tmp_path / "a.tif", posts, at, crs), place, 3000.0)
    assert 0.5 * step < found.spacing * place.metres[1] < 1.5 * step
    agrees(found, place)


@pytest.mark.parametrize("turned", [-360, 0, 360])
def test_longitudes_from_0_to_360(tmp_path, turned):
    """Far from the meridian, too: -95 is 265."""
    posts, place = hills(), LocalMap(30.0, -95.0)
    path = dem(tmp_path / "a.tif", posts, place=LocalMap(30.0, 265.0))
    found = read_terrain(path, LocalMap(30.0, place.longitude + max(turned, 0)), 3000.0)
    assert_allclose(found.height(30.0, -95.0), posts[150, 150], atol=1e-6)


@pytest.mark.parametrize(("longitude", "west"), [(179.99, 179.0), (-179.99, -180.0)])
def test_a_file_of_one_side_is_refused_with_the_reason(tmp_path, longitude, west):
    step = 1 / 600
    longitudes, latitudes = west + step * (np.arange(600) + 0.5), -16.5 - step * np.arange(601)
    posts = surface(*np.meshgrid(longitudes, latitudes)).astype("float32")
    path = write(tmp_path / "a.tif", posts, degrees(longitudes[0], -16.5, step, 0, 0))
    message = (
        rf"a\.tif must hold all heights .*; found none at -1\d\.\d+, -?1\d\d\.\d+ deg .* file "
        rf"reaches from {west:.8g} to {west + 1:.8g} east, .* in EPSG:4326\. The 180th meridian "
    )
    with pytest.raises(ValueError, match=message):
        read_terrain(path, LocalMap(-17.0, longitude), 3000.0)
    read_terrain(path, LocalMap(-17.0, west + 0.5), 3000.0)


def test_another_place_is_refused_with_the_files_own_edges(tmp_path):
    path = dem(tmp_path / "a.tif", hills())
    message = (
        r"must cover .*; found no heights there; the file reaches from -95\.\d+ to -94\.\d+ east"
    )
    with pytest.raises(ValueError, match=message) as caught:
        median_height(path, LocalMap(30.0, 95.0), 2000.0)
    assert "meridian" not in str(caught.value)


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:32760", "EPSG:32701"])
def test_an_image_across_the_180th_meridian(tmp_path, crs):
    place = LocalMap(-17.0, 179.999)
    terrain = Terrain(np.full((301, 301), 50.0), -17.15, 179.85, 1e-3)
    none = np.zeros(0)
    scene = Scene(place, terrain, LandCover(np.ones((1, 1)), 1.0), Points(none, none, none))
    values = backscatter()
    if crs == "EPSG:4326":
        path = image(tmp_path / "a.tif", values, place=place)
    else:
        (x,), (y,) = warp.transform("EPSG:4326", crs, [place.longitude], [place.latitude])
        at = rasterio.Affine(10, 0, x - 2005, 0, -10, y + 2005)
        path = write(tmp_path / "a.tif", values, at, crs)
    found = read(path, scene)
    off = np.abs(found - values[50:-50, 50:-50])
    assert np.median(off[130:170, 130:170]) < (1e-3 if crs == "EPSG:4326" else 0.5)
    assert np.isnan(read_reference(path, scene, half_width=1500.0).ground(9.0, 9.0)).sum() == 0


def test_maps_and_terrain_count_no_turns():
    place = LocalMap(-17.0, 179.9)
    for turn in (-720, -360, 0, 360):
        east, north = place.position(-16.99, 180.1 + turn)
        assert_allclose((east, north), (0.2 * place.metres[0], 0.01 * place.metres[1]), rtol=1e-9)
    terrain = Terrain(np.arange(100.0).reshape(10, 10), -17.5, 179.5, 0.1)
    assert_allclose(terrain.height(-17.0, [180.2, -179.8, 540.2]), 57.0)
    assert np.isnan(terrain.height(-17.0, [-179.4, 179.4, 0.0])).all()
