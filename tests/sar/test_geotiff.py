"""GeoTIFF files written here: what is read of them, and every file that is refused."""

import sys
import tracemalloc
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import gaussian_filter

from navfilters.sar.ground.land_cover import LandCover
from navfilters.sar.ground.scene import Points, Scene
from navfilters.sar.ground.terrain import LocalMap, sample_terrain
from navfilters.sar.matching.reference import Reference
from navfilters.sar.palsar.geotiff_reader import median_height, read_reference, read_terrain

rasterio = pytest.importorskip("rasterio")
warp = pytest.importorskip("rasterio.warp")

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


@pytest.fixture(scope="module")
def tile():
    return sample_terrain(PLACE.latitude, PLACE.longitude)


def in_degrees(path, tile, **options):
    north = tile.south + tile.spacing * (len(tile.posts) - 1)
    posts = tile.posts[::-1].astype(np.int16)
    return write(path, posts, tile.west, north, tile.spacing, **options)


def around(east, north):
    return PLACE.geodetic(np.asarray(east), np.asarray(north))


def places(reach, n=400, seed=1):
    return around(*np.random.default_rng(seed).uniform(-reach, reach, (2, n)))


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


@pytest.fixture(scope="module")
def scene(tile):
    none = np.zeros(0)
    return Scene(PLACE, tile, LandCover(np.ones((1, 1)), 1.0), Points(none, none, none))


def picture(half=300, seed=3):
    """A pattern in dB, each 10 m on the map, rows from north to south."""
    rng = np.random.default_rng(seed)
    pattern = gaussian_filter(rng.standard_normal((2 * half + 1, 2 * half + 1)), 3) * 60 - 12
    return pattern.astype("float32")


def as_file(path, values, **options):
    """On the very pixels that are asked for."""
    to_east, to_north = PLACE.metres
    half = len(values) // 2
    corner = PLACE.longitude - half * 10 / to_east, PLACE.latitude + half * 10 / to_north
    return write(path, values, *corner, (10 / to_east, 10 / to_north), **options)


def test_pixels_are_where_the_map_says(tmp_path, scene):
    values = picture()
    path = as_file(tmp_path / "a.tif", values)
    found = read_reference(path, scene, half_width=2000.0)
    assert isinstance(found, Reference)
    assert found.values.dtype == np.float32
    assert_allclose(found.values, values[100:-100, 100:-100], rtol=0, atol=1e-4)
    assert_allclose(found.geodetic(200, 200), (30.0, -95.0))


def test_nothing_leans_in_an_orthoimage(tmp_path, scene, tile):
    found = read_reference(as_file(tmp_path / "a.tif", picture()), scene, half_width=2000.0)
    column, row = np.array([20.0, 200.0, 391.5]), np.array([333.25, 200.0, 8.0])
    latitude, longitude, height = found.ground(column, row)
    assert_allclose((latitude, longitude), found.geodetic(column, row), rtol=1e-14)
    assert_allclose(height, tile.height(latitude, longitude), rtol=0, atol=1e-6)
    assert len(found.on_terrain) > 50
    assert_allclose(found.on_terrain[:, :2], found.features.places, rtol=0, atol=1e-4)
    east, north = (found.on_terrain[:, 0] - 200) * 10, (200 - found.on_terrain[:, 1]) * 10
    assert_allclose(
        found.on_terrain[:, 2], scene.height(east, north) - scene.height(0, 0), atol=1e-6
    )


def test_intensity_and_amplitude_are_the_same_picture(tmp_path, scene):
    decibels = picture()
    pictures = {
        "decibels": decibels,
        "intensity": 10 ** (decibels / 10),
        "amplitude": 10 ** (decibels / 20),
    }
    paths = [as_file(tmp_path / f"{name}.tif", values) for name, values in pictures.items()]
    one, two, three = (read_reference(path, scene, half_width=2000.0) for path in paths)
    assert_allclose(two.values, one.values, rtol=0, atol=1e-3)
    assert_allclose(2 * three.values, one.values, rtol=0, atol=1e-3)
    assert_allclose(three.features.places[:9], one.features.places[:9], atol=0.05)


def test_a_finer_image_is_averaged(tmp_path, scene):
    """Speckle at 2.5 m comes down by four in each direction, and no pixel moves."""
    to_east, to_north = PLACE.metres
    speckle = np.random.default_rng(5).standard_exponential((1600, 1600)).astype("float32")
    speckle[:, 800:] *= 10
    corner = PLACE.longitude - 1998.75 / to_east, PLACE.latitude + 1998.75 / to_north
    path = write(tmp_path / "a.tif", speckle, *corner, (2.5 / to_east, 2.5 / to_north))
    found = read_reference(path, scene, half_width=1500.0, needed=1000.0)
    power = 10 ** (found.values / 10)
    assert power[:, :140].std() < 0.4
    assert_allclose(power[:, :140].mean(), 1.0, rtol=0.02)
    assert_allclose(power[:, 160:].mean(), 10.0, rtol=0.02)
    edge = np.argmin(np.abs(power.mean(axis=0) - 5.5))
    assert abs(edge - 150) <= 1


def test_holes_get_the_median(tmp_path, scene):
    values = picture()
    values[:200] = -999.0
    path = as_file(tmp_path / "a.tif", values, nodata=-999.0)
    found = read_reference(path, scene, half_width=2000.0, needed=900.0)
    assert_allclose(found.values[:95], np.median(values[200:-100, 100:-100]), atol=0.3)
    assert_allclose(found.values[105:], values[205:-100, 100:-100], rtol=0, atol=1e-4)


@pytest.mark.parametrize("nothing", ["nodata", "zero", "infinite", "edge"])
def test_a_patch_without_data_is_refused(tmp_path, scene, nothing):
    values, options = picture(), {}
    if nothing == "edge":
        values = values[250:351, 250:351]
    elif nothing == "zero":
        values = 10 ** (values / 10)
    fill = {"nodata": -999.0, "zero": 0.0, "infinite": -np.inf, "edge": 0.0}[nothing]
    if nothing != "edge":
        values[150:-150, 150:-150] = fill
        options = {"nodata": fill} if nothing == "nodata" else {}
    path = as_file(tmp_path / "a.tif", values, **options)
    message = (
        r"a\.tif must have data in half of the pixels within 1500 m of 30\.0000, -95\.0000 deg; "
        r"found \d+ %"
    )
    with pytest.raises(ValueError, match=message):
        read_reference(path, scene, half_width=2000.0, needed=1500.0)


def test_files_without_coordinates(tmp_path, scene):
    values = picture()
    bare = {"driver": "GTiff", "width": 601, "height": 601, "count": 1}
    cases = {
        "must have a coordinate reference system": {},
        "must say where its pixels are; found no geotransform": {"crs": UTM},
    }
    for k, (message, options) in enumerate(cases.items()):
        path = tmp_path / f"{k}.tif"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
            with rasterio.open(path, "w", dtype="float32", **bare, **options) as file:
                file.write(values, 1)
        for read in (
            lambda path: read_terrain(path, PLACE, 1000.0),
            lambda path: read_reference(path, scene),
        ):
            with pytest.raises(ValueError, match=rf"{path.name} {message}"):
                read(path)


def test_complex_numbers_are_no_picture(tmp_path, scene):
    path = as_file(tmp_path / "a.tif", picture().astype("complex64"))
    with pytest.raises(ValueError, match=r"a\.tif must hold real numbers; found complex64"):
        read_reference(path, scene)


def test_files_that_cannot_be_opened(tmp_path):
    with pytest.raises(OSError, match=r"none\.tif: No such file"):
        read_terrain(tmp_path / "none.tif", PLACE, 1000.0)
    (tmp_path / "text.tif").write_text("heights")
    with pytest.raises(OSError, match=r"text\.tif.*not recognized"):
        read_terrain(tmp_path / "text.tif", PLACE, 1000.0)


def test_rasterio_is_asked_for_by_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "rasterio", None)
    with pytest.raises(ImportError, match=r"pip install navfilters\[palsar\]"):
        read_terrain("a.tif", PLACE, 1000.0)
