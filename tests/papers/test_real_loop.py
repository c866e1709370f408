"""The closed loop on files that are written here: raw data of a scene, quantized to 5 bits.

The pass, the terrain and the backscatter are simulated; product, elevation model and reference
image then say the same of them in their own formats, and everything is read back from these.
"""

import re
import subprocess
import sys
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import palsar_files as files
import pytest
from navfilters.estimators.multiplicative import MekfState
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp
from scipy.ndimage import map_coordinates

from navfilters.papers import pogorelsky2020
from navfilters.papers.pogorelsky2020 import CASES, NOMINAL, Setup, real_loop
from navfilters.papers.pogorelsky2020 import __main__ as command
from navfilters.papers.pogorelsky2020.imaging import Imaging
from navfilters.papers.pogorelsky2020.real_flight import first_lines, fitted, flight_through
from navfilters.papers.pogorelsky2020.real_loop import real_table as table
from navfilters.papers.pogorelsky2020.real_loop import run_filter, true_flight
from navfilters.papers.pogorelsky2020.real_patches import cut_patches
from navfilters.papers.pogorelsky2020.true_flight import initial_state
from navfilters.sar.ground.scene import View, draw_scene
from navfilters.sar.ground.terrain import LocalMap, Terrain, sample_posts
from navfilters.sar.palsar.opening import open_product
from navfilters.sar.palsar.product import Product
from navfilters.sar.raw.echoes_of_points import _half_aperture
from navfilters.sar.raw.flight import Flight
from navfilters.sar.raw.observation import _bright
from navfilters.sar.raw.radar import Radar, Window
from navfilters.sar.raw.rasters import scene_raster
from navfilters.sar.raw.synthesis import synthesize
from navfilters.space.frames import ecef_to_geodetic

rasterio = pytest.importorskip("rasterio")
warp = pytest.importorskip("rasterio.warp")

# half of PALSAR's aperture has a quarter of its sensitivity to velocity; half the pulse rate
RADAR = Radar(pulse_length=4e-6, prf=1100.0, antenna=17.8)
SMALL = Imaging(
    radar=RADAR,
    lines=384,
    samples=256,
    bandwidth=855.0,
    looks=(2, 2),
    half_width=1600.0,
    steps=(16.0, 4.0),
    reach=60.0,
)
COLUMNS, FIRST_COLUMN = 480, 45  # of the product, and of what the patches need of it
STEP = round(Setup().interval * RADAR.prf)
LINES = 2 * STEP + 2340
CENTRES = LINES // 2 + STEP * np.arange(-1, 2)
PASS = files.MS * 1e-3 + files.WITHIN + LINES / 2 / RADAR.prf
"""When the orbit is where the experiment's starts, s of the day."""
SPACING = RADAR.range_spacing
NEAR = round(866060 - (FIRST_COLUMN + SMALL.samples // 2) * SPACING)
UTM = "EPSG:32615"
LOST = 60
"""Lines in the third patch that are flagged as missing."""


def line_time(line):
    return files.MS * 1e-3 + files.WITHIN + line / RADAR.prf


@pytest.fixture(scope="session")
def orbit():
    """States (6,) at UTC seconds, by an integrator that the library does not use."""
    derivative = Setup().orbit.derivative
    ways = [
        solve_ivp(
            lambda _, x: derivative(x),
            (PASS, end),
            initial_state(Setup()),
            method="DOP853",
            rtol=1e-13,
            atol=1e-9,
            dense_output=True,
        ).sol
        for end in (36300.0, 38100.0)
    ]
    return lambda t: ways[int(t > PASS)](t)


@dataclass(frozen=True)
class World:
    """What the files are made from."""

    terrain: Terrain
    scenes: list
    echoes: list


def terrain_point(flight, terrain, slant_range):
    """Latitude, longitude and height at time 0 and a range: by turns, for gentle slopes."""
    height = 600.0
    for _ in range(50):
        latitude, longitude, _ = ecef_to_geodetic(flight.ground_point(0.0, slant_range, height))
        height = float(terrain.height(latitude, longitude))
    return float(latitude), float(longitude), height


@pytest.fixture(scope="session")
def world(orbit):
    posts = np.pad(sample_posts(), [(900, 900), (500, 500)], mode="symmetric")
    south, west = (29.76, -95.37) - np.array(posts.shape) / 2400
    terrain = Terrain(posts, float(south), float(west), 1 / 1200)
    scenes, echoes = [], []
    centre_range = NEAR + (FIRST_COLUMN + SMALL.samples // 2) * SPACING
    for k, line in enumerate(CENTRES):
        flight = Flight.through(Setup().orbit.derivative, orbit(line_time(line)), 3.0)
        latitude, longitude, height = terrain_point(flight, terrain, centre_range)
        scene = draw_scene(terrain, LocalMap(latitude, longitude), [5, k], half_width=2600.0)
        window = Window(0.0, 0, COLUMNS - FIRST_COLUMN, NEAR + FIRST_COLUMN * SPACING)
        half = _half_aperture(RADAR, flight, window) + SMALL.lines // 2
        window = window._replace(first_time=-half / RADAR.prf, pulses=2 * half)
        size = SMALL.lines, SMALL.samples
        received = synthesize(
            RADAR,
            flight,
            window,
            _bright(RADAR, flight, scene, window, *size, [6, k]),
            scene_raster(RADAR, flight, scene, window, *size, [7, k]),
            mean_height=height,
        )
        scenes.append(scene)
        echoes.append(received)
    return World(terrain, scenes, echoes)


def write_product(folder, orbit, world, line, numbers):
    """Lines far from the patches hold noise, or are not in the file."""
    rng = np.random.default_rng(8)
    signal = 2.0 * rng.standard_normal((LINES, COLUMNS, 2)).astype(np.float32)
    for centre, received in zip(CENTRES, world.echoes, strict=True):
        parts = received.view(np.float32).reshape(*received.shape, 2)
        half = len(received) // 2
        signal[centre - half : centre + half, FIRST_COLUMN:] += 4.5 / parts.std() * parts
    codes = np.clip(np.rint(signal + np.array([15.5, 15.625])), 0, 31).astype(np.uint8)
    length = 412 + 2 * COLUMNS
    image = files.image_bytes(
        rows=[(186, "I6", length), (248, "I8", COLUMNS), (280, "I8", length - 412)],
        each=[
            (8, "B4", length), (24, "B4", COLUMNS), (28, "B4", 0), (56, "B4", 1_100_000),
            (68, "B4", 4000), (76, "S4", -7_000_000), (116, "B4", NEAR),
        ],
        line=line,
        codes=codes,
        numbers=numbers,
        length=length,
        pri=1 / RADAR.prf,
    )  # fmt: skip
    leader = files.leader_bytes(
        summary=[(550, "E16", "-7.0000000E+12"), (742, "F16", "4.0000000")],
        orbit=files.state_rows([orbit(36400.25 + 60 * k) for k in range(28)]),
    )
    return files.product(folder, image, leader)


def write_geotiff(path, values, crs, west, north, step, units="", **options):
    """Rows from north to south; west and north are the middle of the first pixel."""
    place = rasterio.Affine(step, 0.0, west - step / 2, 0.0, -step, north + step / 2)
    rows, columns = values.shape
    profile = {
        "driver": "GTiff",
        "width": columns,
        "height": rows,
        "count": 1,
        "dtype": values.dtype,
    }
    with rasterio.open(path, "w", crs=crs, transform=place, **profile, **options) as file:
        file.write(values, 1)
        file.units = [units]
    return path


def write_elevation(path, terrain):
    north = terrain.south + terrain.spacing * (len(terrain.posts) - 1)
    posts = terrain.posts[::-1].astype(np.int16)
    return write_geotiff(path, posts, "EPSG:4326", terrain.west, north, terrain.spacing)


def orthoimage(scene, seed):
    """Backscatter in dB each 10 m, where the ground is: rows from south to north."""
    axis = np.arange(-200, 201) * 10.0
    power, _ = scene.returns(View(0.0, np.deg2rad(40.0), np.inf), axis, axis)
    east, north, bright = scene.points
    row, column = np.rint(north / 10).astype(int) + 200, np.rint(east / 10).astype(int) + 200
    inside = (np.abs(row - 200) <= 200) & (np.abs(column - 200) <= 200)
    np.add.at(power, (row[inside], column[inside]), bright[inside])
    speckle = np.random.default_rng(seed).standard_gamma(8.0, power.shape) / 8.0
    return 10 * np.log10((power / 100 + 0.005) * speckle)


def write_reference(path, scenes, shown=None, step=12.5, seed=9, units="dB"):
    """On a map in metres, the surroundings of the scenes alone, or what is ``shown`` in place."""
    places = np.array([(scene.map.longitude, scene.map.latitude) for scene in scenes])
    x, y = (np.array(a) for a in warp.transform("EPSG:4326", UTM, *places.T))
    west, north = x.min() - 2500, y.max() + 2500
    shape = (np.array([y.max() - y.min(), x.max() - x.min()]) + 5000) // step
    values = np.full(shape.astype(int), -999.0, np.float32)
    for k, scene in enumerate(scenes):
        row, column = int((north - y[k]) / step), int((x[k] - west) / step)
        rows, columns = np.arange(row - 145, row + 146), np.arange(column - 145, column + 146)
        grid = np.meshgrid(north - step * rows, west + step * columns, indexing="ij")
        to = warp.transform(UTM, "EPSG:4326", grid[1].ravel(), grid[0].ravel())
        here = scene.map.position(np.array(to[1]), np.array(to[0]))
        where = [here[1] / 10 + 200, here[0] / 10 + 200]
        image = orthoimage((shown or scenes)[k], [seed, k])
        sampled = map_coordinates(image, where, order=1, mode="nearest")
        values[np.ix_(rows, columns)] = sampled.reshape(grid[0].shape)
    options = {"nodata": -999.0, "compress": "deflate", "tiled": True, "units": units}
    return write_geotiff(path, values, UTM, west, north, step, **options)


def in_the_file(world):
    """Line numbers: the patches with some lines around them, and two lines in five of the rest."""
    lines = np.arange(LINES)
    near = np.abs(lines[:, None] - CENTRES).min(axis=1) <= len(world.echoes[0]) // 2 + 20
    return [int(n) + 1 for n in lines[near | (lines % 5 < 2)]]


@pytest.fixture(scope="session")
def folder(tmp_path_factory, orbit, world):
    """A product, an elevation model in degrees, a reference in metres."""
    folder = tmp_path_factory.mktemp("palsar")
    lost = {int(CENTRES[2]) + n: [(96, "B4", 1)] for n in range(LOST)}
    write_product(folder, orbit, world, line=lost, numbers=in_the_file(world))
    write_elevation(folder / "dem.tif", world.terrain)
    write_reference(folder / "reference.tif", world.scenes)
    return folder


@pytest.fixture(scope="session")
def product(folder):
    return open_product(folder)


@pytest.fixture(scope="session")
def patches(folder, product):
    return cut_patches(product, folder / "dem.tif", folder / "reference.tif", imaging=SMALL)


@pytest.mark.slow
def test_the_state_vectors_flight_is_the_orbit(product, orbit):
    """J2 and the turning Earth, of which nothing but a state a minute is known."""
    vectors = product.state_vectors.times
    for epoch in (vectors[10], vectors[10] + 29.0, PASS, vectors[3] + 1.0, vectors[-1] - 20.0):
        flight = flight_through(product, float(epoch))
        t = np.linspace(-15.0, 15.0, 31)
        x = np.stack([orbit(s) for s in epoch + t])
        assert_allclose(flight.position(t), x[:, :3], rtol=0, atol=1e-5)
        assert_allclose(flight.velocity(t), x[:, 3:], rtol=0, atol=1e-6)


def test_patches_avoid_missing_lines():
    rng = np.random.default_rng(4)
    for missing in (rng.random(90) < 0.05, np.arange(90) < 17, np.zeros(90, bool)):
        found = first_lines(missing, 20, 25, 3)
        lost = [[missing[s + 25 * k : s + 25 * k + 20].sum() for k in range(3)] for s in range(21)]
        worst = np.max(lost, axis=1)
        best = [s for s in range(21) if worst[s] == worst.min()]
        assert_array_equal(np.diff(found), [25, 25])
        assert found[0] in best
        assert abs(found[0] - 10) == min(abs(s - 10) for s in best)


def test_fewer_patches_where_lines_are_few_or_missing():
    assert_array_equal(first_lines(np.zeros(45, bool), 20, 25), [0, 25])
    assert_array_equal(first_lines(np.zeros(44, bool), 20, 25), [12])
    gap = (np.arange(90) >= 40) & (np.arange(90) < 50)
    assert_array_equal(first_lines(gap, 20, 25), [20])
    with pytest.raises(ValueError, match=r"20 lines in a row.*found 19 lines, 0 of them missing"):
        first_lines(np.zeros(19, bool), 20, 25)
    with pytest.raises(ValueError, match=r"at most 10 % of them missing.*90 lines, 30 of them"):
        first_lines(np.arange(90) % 3 == 0, 20, 25)


@pytest.mark.slow
def test_the_truth_is_where_range_and_zero_doppler_put_it(patches, world, orbit):
    assert len(patches) == 3
    for patch, centre, scene in zip(patches, CENTRES, world.scenes, strict=True):
        assert abs(patch.time - line_time(centre)) < 5 / RADAR.prf
        x, r_f = orbit(patch.time), patch.acquired.r_f
        assert_allclose(np.linalg.norm(r_f - x[:3]), patch.slant_range, rtol=0, atol=2e-3)
        assert abs((r_f - x[:3]) @ x[3:]) / np.linalg.norm(x[3:]) < 2e-3
        latitude, longitude, height = ecef_to_geodetic(r_f)
        assert_allclose(height, world.terrain.height(latitude, longitude), rtol=0, atol=0.02)
        assert_allclose(patch.acquired.v, x[3:], rtol=0, atol=1e-6)
        assert np.hypot(*scene.map.position(latitude, longitude)) < 30.0
    assert [patch.missing for patch in patches] == [0, 0, LOST]


@pytest.mark.slow
def test_the_boresight_passes_through_the_patches(product, patches):
    setup = replace(CASES["TC-2"], look=30.0)
    flight = true_flight(product, patches, setup)
    assert_allclose(np.diff(flight.times), setup.interval, rtol=0, atol=1 / RADAR.prf)
    for k, patch in enumerate(patches, start=1):
        beam = replace(setup.geometry, T_e_b=flight.T_e_b[k]).boresight(NOMINAL)
        ray = patch.acquired.r_f - flight.x[k, :3]
        assert_allclose(np.linalg.norm(np.cross(beam, ray)), 0.0, atol=1e-6)
        look, squint = np.rad2deg(patch.pointing)
        assert 34.0 < look < 34.6
        assert abs(squint) < 1e-3  # the orbit is circular


@pytest.mark.slow
def test_only_the_patches_lines_are_read(folder, product, monkeypatch):
    asked, read = [], Product.read

    def reading(self, first, last):
        asked.append((first, last))
        return read(self, first, last)

    monkeypatch.setattr(Product, "read", reading)
    patches = cut_patches(product, folder / "dem.tif", folder / "reference.tif", imaging=SMALL)
    lines = np.zeros(product.lines, bool)
    for first, last in asked:
        lines[first:last] = True
        assert last - first <= 257
    assert lines.sum() == 3 * patches[0].pulses


@pytest.mark.slow
def test_heights_above_sea_level_are_lifted(folder, product, patches, world):
    lifted = cut_patches(
        product, folder / "dem.tif", folder / "reference.tif", imaging=SMALL, geoid=-27.0
    )
    for one, other in zip(patches, lifted, strict=True):
        a = other.acquired
        latitude, longitude, height = ecef_to_geodetic(a.r_f)
        assert_allclose(height, world.terrain.height(latitude, longitude) - 27, rtol=0, atol=0.02)
        assert_allclose(np.linalg.norm(a.r_f - a.r), one.slant_range, rtol=0, atol=2e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"samples": 400}, "product must have 534 samples in a line for patches of 400; found 480"),
        ({"lines": 30000}, r"product must have 3\d{4} lines in a row"),
        (
            {"half_width": 90000.0},
            r"dem\.tif must hold all heights within 91000 m of 29\..* deg; found none at",
        ),
    ],
)
@pytest.mark.slow
def test_patches_that_do_not_fit(folder, product, change, message):
    with pytest.raises(ValueError, match=message):
        cut_patches(
            product,
            folder / "dem.tif",
            folder / "reference.tif",
            imaging=replace(SMALL, **change),
        )


def test_a_flight_of_ones_own_is_flown():
    setup = replace(Setup(), shortest=2)
    own = pogorelsky2020.truth(setup, 2)
    plain = pogorelsky2020.monte_carlo(setup, 2, 3)
    assert_array_equal(pogorelsky2020.monte_carlo(setup, 2, 3, flight=own).errors, plain.errors)
    with pytest.raises(ValueError, match="flight must last 3 intervals, one an update; found 2"):
        pogorelsky2020.monte_carlo(setup, 3, 3, flight=own)


def at_the_truth(patch):
    a = patch.acquired
    return MekfState(a.r[None], a.v[None], NOMINAL[None], np.zeros((1, 9, 9)))


@pytest.mark.slow
def test_no_line_and_no_sample_is_lost(patches):
    """A line is 6.2 m along the track and a sample 4.7 m of range: the mean misses are smaller."""
    images = pogorelsky2020.RealImages(patches, np.zeros((1, 3)), SMALL)
    misses = []
    for k, patch in enumerate(patches, start=1):
        a = patch.acquired
        error = images(k, at_the_truth(patch)).r_f[0] - a.r_f
        axes = np.stack([a.v / a.speed, (a.r_f - a.r) / patch.slant_range])
        misses.append(axes @ error)
    assert (np.abs(misses) < 8.0).all()
    assert (np.abs(np.mean(misses, axis=0)) < 2.5).all()


@pytest.mark.slow
def test_the_command_navigates(folder, capsys, monkeypatch):
    """From the files to the table, each number of which is read back here."""
    monkeypatch.setattr(command, "report", partial(pogorelsky2020.report, imaging=SMALL))
    command.main(
        f"--closed-loop --palsar {folder} --dem {folder}/dem.tif --reference "
        f"{folder}/reference.tif --case TC-2 --runs 2 --seed 1".split()
    )
    out = capsys.readouterr().out
    assert out.startswith("IMG-HH-ALPSRP230940670-H1.0__A, 2008-03-05, 3 of 3 patches\n")
    assert f"{LOST} of 2248" in out
    rows = re.findall(
        r"^ +(\d) +(\d) +([\d.]+) +(-[\d.]+) +([\d.]+) m +(-?[\d.]+) m/s +(\d+)$", out, re.M
    )
    assert [row[:2] for row in rows] == [(r, k) for r in "12" for k in "123"]
    found = np.array(rows, float)
    assert (found[:, 4] < 12.0).all()
    assert (np.abs(found[:, 5]) < 8.0).all()
    assert (found[:, 6] >= 8).all()
    totals = np.array(re.findall(r"^[xyz] \(m\) +(.+)$", out, re.M))
    before, _, after, sigma = np.array([row.split() for row in totals], float).T
    assert np.linalg.norm(after) < 0.4 * np.linalg.norm(before)
    assert (after < 4 * sigma).all()


@pytest.mark.slow
def test_a_reference_whose_unit_is_open_needs_it_said(folder, product, patches, world, tmp_path):
    """The scenes lie about 0 dB: as many pixels are below as above."""
    path = write_reference(tmp_path / "plain.tif", world.scenes, units="")
    with pytest.raises(ValueError, match=r"plain\.tif must tell whether it is in dB or linear"):
        cut_patches(product, folder / "dem.tif", path, imaging=SMALL)
    said = cut_patches(product, folder / "dem.tif", path, imaging=SMALL, unit="dB")
    values = [patch.acquired.reference.values for patch in (*patches, *said)]
    assert_array_equal(values[:3], values[3:])


@pytest.mark.slow
def test_a_reference_of_another_place_is_reported(folder, product, world, tmp_path):
    """Each patch is shown the surroundings of the next: dead reckoning, but a table."""
    shown = [*world.scenes[1:], world.scenes[0]]
    wrong = write_reference(tmp_path / "wrong.tif", world.scenes, shown)
    patches = cut_patches(product, folder / "dem.tif", wrong, imaging=SMALL)
    outcome = run_filter(product, patches, CASES["TC-2"], 1, imaging=SMALL)
    text = table(product, patches, outcome)
    assert len(re.findall(r"no match: \d inliers", text)) == 3
    assert np.isnan(outcome.result.innovations).all()
    assert np.isfinite(outcome.result.errors).all()
    assert len(re.findall(r"^[xyz] \(m\)", text, re.M)) == 3


BLIND = replace(SMALL, reach=10.0, steps=(16.0,))
"""No room for a single step: no climb can find a peak."""


@pytest.mark.slow
def test_a_climb_without_a_peak_is_reported(product, patches):
    outcome = run_filter(product, patches[:1], CASES["TC-2"], 1, imaging=BLIND)
    assert "no image: the climb ended at a limit" in table(product, patches[:1], outcome)


@pytest.mark.slow
def test_the_range_has_the_runs_own_noise(product, patches):
    images = pogorelsky2020.RealImages(patches, np.array([[1.5, 0.0, 0.0]]), BLIND)
    state = at_the_truth(patches[0])
    found = replace(images, imaging=SMALL)(1, state)
    assert_allclose(found.slant_range, patches[0].slant_range + 1.5)
    none = images(1, state)
    assert all(np.isnan(value).all() for value in none)


FBD = replace(RADAR, bandwidth=14e6, sampling=16e6)


@pytest.fixture(scope="session")
def narrow(tmp_path_factory, orbit, world):
    """The second patch in a product of half the band, as PALSAR's with two polarisations."""
    folder, centre, columns = tmp_path_factory.mktemp("fbd"), int(CENTRES[1]), COLUMNS // 2
    flight = Flight.through(Setup().orbit.derivative, orbit(line_time(centre)), 3.0)
    scene, size = world.scenes[1], (SMALL.lines, SMALL.samples // 2)
    window = Window(0.0, 0, columns, NEAR + FIRST_COLUMN * SPACING - 40 * FBD.range_spacing)
    half = _half_aperture(FBD, flight, window) + SMALL.lines // 2
    window = window._replace(first_time=-half / FBD.prf, pulses=2 * half)
    received = synthesize(
        FBD,
        flight,
        window,
        _bright(FBD, flight, scene, window, *size, [6, 1]),
        scene_raster(FBD, flight, scene, window, *size, [7, 1]),
        mean_height=float(scene.height(0.0, 0.0)),
    )
    parts = received.view(np.float32).reshape(*received.shape, 2)
    codes = np.zeros((centre + half, columns, 2), np.uint8)
    codes[centre - half :] = np.clip(np.rint(4.5 / parts.std() * parts + 15.5), 0, 31)
    length = 412 + 2 * columns
    image = files.image_bytes(
        rows=[(186, "I6", length), (248, "I8", columns), (280, "I8", length - 412)],
        each=[
            (8, "B4", length), (24, "B4", columns), (28, "B4", 0), (56, "B4", 1_100_000),
            (68, "B4", 4000), (76, "S4", -3_500_000), (116, "B4", round(window.near_range)),
        ],
        codes=codes,
        numbers=[int(n) for n in range(centre - half + 1, centre + half + 1)],
        length=length,
        pri=1 / FBD.prf,
    )  # fmt: skip
    leader = files.leader_bytes(
        summary=[
            (550, "E16", "-3.5000000E+12"), (742, "F16", "4.0000000"), (710, "F16", "16.0000000"),
        ],
        orbit=files.state_rows([orbit(36400.25 + 60 * k) for k in range(28)]),
    )  # fmt: skip
    return open_product(files.product(folder, image, leader))


@pytest.mark.slow
def test_half_the_band_makes_images_of_the_same_ground(folder, narrow):
    """Half as many looks in range: with those of the full band a cell would be twice as long."""
    cut = fitted(SMALL, narrow)
    assert (cut.looks, cut.samples, cut.lines) == ((2, 1), 128, 384)
    assert fitted(cut, narrow) is cut
    patches = cut_patches(narrow, folder / "dem.tif", folder / "reference.tif", imaging=SMALL)
    assert len(patches) == 1
    focuser = patches[0].acquired.focuser
    pixels = focuser.image(patches[0].acquired.effective(7500.0)).pixels
    assert pixels.shape == (384, 128)
    outcome = run_filter(narrow, patches, CASES["TC-2"], 1, imaging=SMALL)
    (attempt,) = outcome.attempts
    assert attempt.matched
    assert np.linalg.norm(attempt.match.r_f - patches[0].acquired.r_f) < 20.0


@pytest.mark.parametrize("rate", [21e6, 8e6, 40e6])
def test_a_band_for_which_no_looks_are_right_is_refused(product, rate):
    other = replace(product, sampling_rate=rate)
    message = rf"2 looks in range at 32 MHz are a whole number; found {rate / 1e6:g} MHz in .*LED-"
    with pytest.raises(ValueError, match=message):
        fitted(SMALL, other)


def test_options_reach_the_reader(monkeypatch, capsys):
    def opening(folder, **options):
        raise ValueError(f"{folder} {options}")

    monkeypatch.setattr(real_loop, "open_product", opening)
    options = "--polarisation HV --records 5 900 --clock-offset -0.002"
    with pytest.raises(SystemExit) as ended:
        command.main(f"--closed-loop --palsar A --dem B --reference C {options}".split())
    assert ended.value.code == (
        "A {'polarisation': 'HV', 'records': [5, 900], 'clock_offset': -0.002}"
    )


def test_the_unit_of_the_reference_reaches_its_reader(monkeypatch, capsys):
    monkeypatch.setattr(real_loop, "open_product", lambda folder, **options: None)

    def cutting(product, elevation, reference, **options):
        raise ValueError(f"{elevation} {reference} {options['unit']} {options['geoid']}")

    monkeypatch.setattr(real_loop, "cut_patches", cutting)
    for more, said in (("--reference-unit linear --geoid 7", "linear 7.0"), ("", "None 0.0")):
        with pytest.raises(SystemExit) as ended:
            command.main(f"--closed-loop --palsar A --dem B --reference C {more}".split())
        assert ended.value.code == f"B C {said}"


def test_the_closed_loop_is_a_command_of_its_own(monkeypatch):
    asked = []
    monkeypatch.setattr(command, "closed_table", lambda *a, **o: asked.append(a) or "")
    command.main(["--closed-loop", "--case", "TC-2", "--seed", "3"])
    assert asked == [("TC-2", 100, 3)]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--palsar A", "--palsar must come with --closed-loop, --dem, --reference"),
        ("--palsar A --dem B --reference C", "--palsar must come with --closed-loop"),
        ("--palsar A --closed-loop --dem B", "--palsar must come with --reference"),
        ("--dem B", "--dem must come with --palsar"),
        ("--closed-loop --clock-offset 0", "--clock-offset must come with --palsar"),
        (
            "--palsar A --closed-loop --dem B --reference C --runs 0",
            "--runs must be at least 1 and --seed at least 0; found 0, 0",
        ),
        ("--closed-loop --runs 1", "--runs must be at least 2"),
    ],
)
def test_arguments_that_do_not_fit(arguments, message, capsys):
    with pytest.raises(SystemExit) as ended:
        command.main(arguments.split())
    assert ended.value.code == 2
    assert message in capsys.readouterr().err


def test_files_that_are_not_there_end_the_command(tmp_path):
    command = [sys.executable, "-m", "navfilters.papers.pogorelsky2020", "--closed-loop"]
    files = ["--palsar", str(tmp_path / "none"), "--dem", "B", "--reference", "C"]
    done = subprocess.run([*command, *files], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert str(tmp_path / "none") in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_product_without_its_elevation_model_ends_the_command(folder, monkeypatch):
    monkeypatch.setattr(command, "report", partial(pogorelsky2020.report, imaging=SMALL))
    with pytest.raises(SystemExit) as ended:
        command.main(
            f"--closed-loop --palsar {folder} --dem {folder}/none.tif --reference C".split()
        )
    assert "none.tif: No such file" in ended.value.code
