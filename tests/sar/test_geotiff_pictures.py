"""Reference images as GeoTIFF files: what is read of them, and every file that is refused."""

import sys
import warnings

import geotiff_files
import numpy as np
import pytest
from geotiff_bands import (
    PLACE,
    UTM,
    write,
)
from numpy.testing import assert_allclose
from scipy.ndimage import gaussian_filter

from navfilters.sar.matching.reference import Reference
from navfilters.sar.palsar.geotiff_reader import read_reference, read_terrain

rasterio = pytest.importorskip("rasterio")


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


def test_three_by_three_zeros_are_a_void_and_fewer_are_noise(tmp_path, scene):
    """What lies beside a void was averaged with it."""
    values = 10 ** (picture() / 10)
    for rows, columns in ((3, 3), (2, 3), (3, 2)):
        values[200 * (rows - 1) + columns :][:rows, 300:][:, :columns] = 0.0
    path = as_file(tmp_path / "a.tif", values)
    found = read_reference(path, scene, half_width=2000.0, needed=900.0, unit="linear").values
    filled = np.median(found)
    assert_allclose(found[302, 200:203], filled, atol=0.01)
    for beside in ((202, 200), (301, 200)):
        row, column = np.add(beside, 100)
        assert_allclose(found[beside], 10 * np.log10(values[row, column]), atol=1e-3)


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


def test_pixels_that_are_nowhere_are_refused(tmp_path, scene):
    path = write(tmp_path / "a.tif", picture(), -95.0, 30.0, (np.nan, 1e-4))
    for read in (lambda path: read_terrain(path, PLACE, 9.0), lambda p: read_reference(p, scene)):
        with pytest.raises(ValueError, match=r"a\.tif must say where .*a geotransform that is not"):
            read(path)


def test_complex_numbers_are_no_picture(tmp_path, scene):
    path = as_file(tmp_path / "a.tif", picture().astype("complex64"))
    with pytest.raises(ValueError, match=r"a\.tif must hold real numbers; found complex64"):
        read_reference(path, scene)


def test_a_map_that_leads_nowhere_is_refused(tmp_path, scene):
    """A plane of an engineer's, with no place on the Earth."""
    path = as_file(tmp_path / "a.tif", picture(), crs='LOCAL_CS["site",UNIT["metre",1]]')
    with pytest.raises(ValueError, match=r"a\.tif must have a map that shows .*found site"):
        read_reference(path, scene)


def test_texts_that_are_not_utf_8_are_refused(tmp_path, scene):
    path = geotiff_files.image(tmp_path / "a.tif", picture(), units="decibel")
    path.write_bytes(path.read_bytes().replace(b">decibel<", b">d\xe9cibel<"))
    with pytest.raises(ValueError, match=r"a\.tif must hold its texts in UTF-8; found .*0xe9"):
        read_reference(path, scene)


def test_a_thousand_bands_are_enough(tmp_path, scene):
    bare = {"driver": "GTiff", "width": 2, "height": 2, "count": 1001, "crs": UTM}
    at = rasterio.Affine(10, 0, 5e5, 0, -10, 3e6)
    with rasterio.open(tmp_path / "a.tif", "w", dtype="uint8", transform=at, **bare):
        pass
    for read in (lambda path: read_terrain(path, PLACE, 9.0), lambda p: read_reference(p, scene)):
        with pytest.raises(ValueError, match=r"a\.tif must hold at most 1000 bands; found 1001"):
            read(tmp_path / "a.tif")


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
