"""Files that do not say what their numbers are: read right, or refused with the true reason."""

import time
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import gaussian_filter

from navfilters.sar.ground.land_cover import LandCover
from navfilters.sar.ground.scene import Points, Scene
from navfilters.sar.ground.terrain import LocalMap, Terrain, sample_terrain
from navfilters.sar.palsar.geotiff_posts import LARGEST_GEOID
from navfilters.sar.palsar.geotiff_reader import median_height, read_reference, read_terrain

rasterio = pytest.importorskip("rasterio")
warp = pytest.importorskip("rasterio.warp")

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


# ---- images: decibels or not


@pytest.fixture(scope="module")
def scene():
    none = np.zeros(0)
    terrain = sample_terrain(PLACE.latitude, PLACE.longitude)
    return Scene(PLACE, terrain, LandCover(np.ones((1, 1)), 1.0), Points(none, none, none))


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


@pytest.mark.parametrize("share", [1e-5, 1e-3, 0.03])
@pytest.mark.parametrize("amount", [-2e-5, -0.01, 0.0])
@pytest.mark.parametrize("gain", [1.0, 2e5])
def test_noise_that_was_subtracted_makes_no_decibels(tmp_path, scene, share, amount, gain):
    """Pixels at or below zero were not measured; all others are what they are without them."""
    values = power(backscatter(looks=4.0)) * gain
    wanted = read(image(tmp_path / "a.tif", values), scene)
    bad = np.random.default_rng(2).random(values.shape) < share
    bad[200, 200] = True
    values[bad] = amount * gain
    found = read(image(tmp_path / "b.tif", values), scene)
    kept = ~bad[50:-50, 50:-50]
    assert_allclose(found[kept], wanted[kept], rtol=0, atol=1e-4)
    assert_allclose(found[~bad[50:-50, 50:-50]].mean(), wanted.mean(), atol=0.1)


@pytest.mark.parametrize("level", [-25.0, -12.0, -3.0, -0.8])
@pytest.mark.parametrize("spread", [2.5, 4.0])
def test_decibels_with_a_town_are_decibels(tmp_path, scene, level, spread):
    values = backscatter(level=level, spread=spread)
    values[190:210, 190:210] = 12.0
    found = read(image(tmp_path / "a.tif", values), scene)
    assert_allclose(found, values[50:-50, 50:-50], rtol=0, atol=1e-4)


@pytest.mark.parametrize(
    "values",
    [
        backscatter(level=0.0),  # half below zero
        backscatter(level=-0.02, spread=0.01),  # noise alone, too much of which was subtracted
        backscatter(level=6.0, spread=3.0),
        backscatter(level=40.0),  # decibels of digital numbers: none below zero
        backscatter(level=40.0, looks=1.0),
        backscatter(level=80.0, spread=6.0),
        np.full((SIZE, SIZE), 3.0, "float32"),
        power(backscatter(spread=0.2)),  # linear, but as even as decibels may be
    ],
)
def test_an_image_that_may_be_either_is_refused_until_it_is_said(tmp_path, scene, values):
    path = image(tmp_path / "a.tif", values)
    message = (
        r"a\.tif must tell whether it is in dB or linear; found pixels of which .* below zero, the "
        r'middle one .*: say unit="dB" or unit="linear"'
    )
    with pytest.raises(ValueError, match=message):
        read(path, scene)
    found = read(path, scene, unit="dB")
    assert_allclose(found, values[50:-50, 50:-50], rtol=0, atol=2e-4)
    if (values > 0).all():
        found = read(path, scene, unit="linear")
        assert_allclose(found, 10 * np.log10(values[50:-50, 50:-50]), rtol=0, atol=1e-3)
    elif np.mean(values < 0) > 0.5:
        with pytest.raises(ValueError, match="must hold intensity or amplitude; found pixels"):
            read(path, scene, unit="linear")


@pytest.mark.parametrize(
    ("units", "name"),
    [("dB", None), ("decibel", None), ("DB", "VV"), ("", "Sigma0_VV_db"), ("", "gamma0 [dB]")],
)  # fmt: skip
def test_declared_decibels_are_believed(tmp_path, scene, units, name):
    values = backscatter(level=3.0)
    found = read(image(tmp_path / "a.tif", values, units=units, name=name), scene)
    assert_allclose(found, values[50:-50, 50:-50], rtol=0, atol=1e-4)


@pytest.mark.parametrize("units", ["linear", "intensity", "Amplitude", "power"])
def test_a_declared_linear_scale_is_believed(tmp_path, scene, units):
    values = power(backscatter(spread=0.2))
    found = read(image(tmp_path / "a.tif", values, units=units), scene)
    assert_allclose(found, 10 * np.log10(values[50:-50, 50:-50]), rtol=0, atol=1e-3)
    path = image(tmp_path / "b.tif", backscatter(), units=units)
    with pytest.raises(
        ValueError, match=r"b\.tif must hold intensity or amplitude; found .* below"
    ):
        read(path, scene)


@pytest.mark.parametrize("units", ["m", "metre", "radian", "degree", "K"])
def test_another_quantity_is_no_image(tmp_path, scene, units):
    path = image(tmp_path / "a.tif", power(backscatter()), units=units)
    with pytest.raises(ValueError, match=rf"in dB or linear; found the unit '{units}'"):
        read(path, scene)


def test_digital_numbers_of_16_bits_are_linear(tmp_path, scene):
    """Amplitudes as the agency's mosaic has them, 0 for no data."""
    numbers = np.rint(10 ** ((backscatter(spread=2.0, looks=16.0) + 83) / 20)).astype("uint16")
    numbers[:120] = 0
    found = read(image(tmp_path / "a.tif", numbers), scene)
    kept = numbers[125:-50, 50:-50]
    assert_allclose(found[75:], 10 * np.log10(kept), rtol=0, atol=1e-3)


def test_eight_bits_are_a_picture_until_it_is_said(tmp_path, scene):
    grey = np.clip(backscatter() * 5 + 180, 1, 255).astype("uint8")
    path = image(tmp_path / "a.tif", grey)
    with pytest.raises(ValueError, match="found uint8, as of a picture for the eye: say unit="):
        read(path, scene)
    found = read(path, scene, unit="linear")
    assert_allclose(found, 10 * np.log10(np.maximum(grey[50:-50, 50:-50], 1.0)), atol=1e-3)
    for colour in ("red", "palette"):
        path = image(tmp_path / f"{colour}.tif", grey, colour=colour)
        with pytest.raises(ValueError, match=f"found a picture in colours: {colour}"):
            read(path, scene, unit="dB")


@pytest.mark.parametrize("unit", ["db", "sigma", 3])
def test_a_unit_that_is_none(tmp_path, scene, unit):
    with pytest.raises(ValueError, match=f"unit must be 'dB', 'linear' or None; found {unit!r}"):
        read(tmp_path / "a.tif", scene, unit=unit)


@pytest.mark.parametrize(
    ("scale", "void"),
    [
        *((10.0, v) for v in (-9999.0, -32768.0, -999.0, 0.0, -3.4028235e38, 1e30, np.nan)),
        *((scale, v) for scale in (5.0, 23.0) for v in (-9999.0, 0.0)),
    ],
)
@pytest.mark.parametrize("linear", [False, True])
def test_undeclared_voids_touch_nothing_around_them(tmp_path, scene, scale, void, linear):
    """A pixel at the edge of a void would be an average with -9999."""
    values = backscatter(spread=2.0, size=int(4010 / scale))
    values = power(values) if linear else values
    middle = int(len(values) * 0.42)
    holed = values.copy()
    holed[middle : middle + 12, middle : middle + 60] = void
    wanted = read(image(tmp_path / "a.tif", values, scale), scene)
    found = read(image(tmp_path / "b.tif", holed, scale), scene)
    filled = np.median(found)
    same = np.abs(found - wanted) < 1e-3
    assert_array_equal(same | (np.abs(found - filled) < 0.2), True)
    assert (~same).sum() < 1.6 * 720 * (scale / 10) ** 2 + 1500


@pytest.mark.parametrize(("linear", "void"), [(False, -500.0), (False, 300.0), (True, -500.0)])
def test_values_that_no_echo_has_are_refused(tmp_path, scene, linear, void):
    values = power(backscatter()) if linear else backscatter()
    values[150:160, 180:190] = void
    with pytest.raises(
        ValueError, match=rf"a\.tif must hold .*; found {void:.0f}.*edit-info --nod"
    ):
        read(image(tmp_path / "a.tif", values), scene)
    read(image(tmp_path / "b.tif", values, nodata=void), scene)


def test_a_void_at_the_largest_number_is_refused(tmp_path, scene):
    numbers = np.rint(10 ** ((backscatter() + 70) / 20)).astype("uint16")
    numbers[200, 200] = 65535  # a single bright point may be
    assert read(image(tmp_path / "a.tif", numbers), scene).max() > 40
    numbers[100:180] = 65535
    with pytest.raises(
        ValueError, match=r"found \d+ % of its pixels at 65535, the largest of uint"
    ):
        read(image(tmp_path / "b.tif", numbers), scene)


# ---- elevation models: voids and units


def hills(size=301, level=400.0, spread=60.0, seed=4):
    rng = np.random.default_rng(seed)
    return level + gaussian_filter(rng.standard_normal((size, size)), 12) * 42 * spread


def dem(path, posts, step=1 / 1200, place=PLACE, **more):
    half = step * (len(posts) - 1) / 2
    at = degrees(place.longitude - half, place.latitude + half, step, *posts.shape)
    return write(path, posts, at, **more)


SHORT = (-32768, -9999, -32767, 32767)


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


@pytest.mark.slow
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


def test_heights_in_feet(tmp_path):
    """Declared, they are turned into metres; undeclared, high ones are refused."""
    metres = hills(level=3200.0)
    wanted = read_terrain(dem(tmp_path / "m.tif", metres), PLACE, 2000.0).posts
    for k, unit in enumerate(("ft", "foot", "feet", "US survey foot")):
        path = dem(tmp_path / f"{k}.tif", metres / 0.3048, units=unit)
        assert_allclose(read_terrain(path, PLACE, 2000.0).posts, wanted, rtol=1e-5)
        assert_allclose(median_height(path, PLACE, 2000.0), np.median(wanted), rtol=1e-2)
    path = dem(tmp_path / "ft.tif", metres / 0.3048)
    with pytest.raises(
        ValueError, match=r"ft\.tif must hold heights .*feet\? `rio edit-info --bid"
    ):
        read_terrain(path, PLACE, 2000.0)


@pytest.mark.parametrize("unit", ["m", "metre", "meters", ""])
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


# ---- places: the 180th meridian


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
