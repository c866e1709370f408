"""Patches of a PALSAR product: where they are, what is read, what does not fit."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import palsar_files as files
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from palsar_scene import (
    CENTRES,
    COLUMNS,
    FIRST_COLUMN,
    LOST,
    NEAR,
    PASS,
    RADAR,
    SMALL,
    SPACING,
    line_time,
    write_reference,
)
from scipy.constants import c

from navfilters.papers.pogorelsky2020 import CASES, Setup
from navfilters.papers.pogorelsky2020.real_flight import first_lines, fitted, flight_through
from navfilters.papers.pogorelsky2020.real_loop import run_filter
from navfilters.papers.pogorelsky2020.real_patches import Patch, _sizes, cut_patches
from navfilters.sar.palsar.opening import open_product
from navfilters.sar.palsar.orbit_and_pulse import StateVectors
from navfilters.sar.palsar.product import Product
from navfilters.sar.raw.echoes_of_points import _half_aperture
from navfilters.sar.raw.flight import Flight
from navfilters.sar.raw.observation import _bright
from navfilters.sar.raw.radar import Window
from navfilters.sar.raw.rasters import scene_raster
from navfilters.sar.raw.synthesis import synthesize
from navfilters.space.frames import antenna_axes, body_axes, ecef_to_geodetic


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


def circle(t):
    """Position and velocity on a tilted circle of 7071 km, once around in 99 minutes."""
    turn, across = 2 * np.pi / 5940.0, np.array([0.6, 0.0, 0.8])
    phase = turn * np.asarray(t)[..., None]
    along = np.array([0.0, 1.0, 0.0])
    r = np.cos(phase) * along + np.sin(phase) * across
    v = turn * (np.cos(phase) * across - np.sin(phase) * along)
    return 7.071e6 * r, 7.071e6 * v


def test_a_patch_reads_the_samples_through_which_its_points_migrate():
    """By the distance at the aperture's ends, on a path that is no hyperbola."""
    times, spacing = 43000.0 + 60.0 * np.arange(-13, 15), c / 64e6
    product = SimpleNamespace(
        state_vectors=StateVectors(times, *circle(times)), near_range=8.5e5, wavelength=0.236,
        line_times=43000.0 + np.arange(9) / 2000.0, lines=9, samples=4000, prf=2000.0,
        sampling_rate=32e6, pulse_length=16e-6, image="IMG",
    )  # fmt: skip
    sizes = _sizes(product, Setup(), SMALL)
    flight, R = flight_through(product, 43000.0), 8.5e5 + (4000 - 512) / 2 * spacing
    t = (sizes.pulses - SMALL.lines) / 2 / product.prf
    edge = flight.position(t) - flight.ground_point(0.0, R, 0.0)
    cells = (np.linalg.norm(edge) - R) / spacing
    assert cells > 4
    assert abs(sizes.ranges - SMALL.samples - 512 - cells - 1) < 1.0


@pytest.mark.parametrize("epoch", [43000.0, 43031.0, 42955.0])
def test_the_flight_through_a_circles_state_vectors_is_the_circle(epoch):
    """To what is promised: 10 micrometres and 1 micrometre a second."""
    times = 43000.0 + 60.0 * np.arange(-13, 15)
    product = SimpleNamespace(state_vectors=StateVectors(times, *circle(times)))
    flight, t = flight_through(product, epoch), np.linspace(-15.0, 15.0, 31)
    r, v = circle(epoch + t)
    assert_allclose(flight.position(t), r, rtol=0, atol=1e-5)
    assert_allclose(flight.velocity(t), v, rtol=0, atol=1e-6)


@pytest.mark.parametrize(("look", "squint"), [(0.6, 0.0), (0.5, 0.1), (0.4, -0.2)])
def test_look_and_squint_are_those_of_the_boresight(look, squint):
    r, v = circle(700.0)
    ray = body_axes(r, v).T @ antenna_axes(look, squint)[2]
    true = SimpleNamespace(r=r, v=v, r_f=r + 8e5 * ray)
    assert_allclose(Patch(true, 0.0, 8e5, 0.0, 1, 0).pointing, (look, squint), atol=1e-12)


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


@pytest.mark.slow
def test_a_reference_whose_unit_is_open_needs_it_said(folder, product, patches, world, tmp_path):
    """The scenes lie about 0 dB: as many pixels are below as above."""
    path = write_reference(tmp_path / "plain.tif", world.scenes, units="")
    with pytest.raises(ValueError, match=r"plain\.tif must tell whether it is in dB or linear"):
        cut_patches(product, folder / "dem.tif", path, imaging=SMALL)
    said = cut_patches(product, folder / "dem.tif", path, imaging=SMALL, unit="dB")
    values = [patch.acquired.reference.values for patch in (*patches, *said)]
    assert_array_equal(values[:3], values[3:])


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
    assert_allclose((cut.radar.sampling, cut.radar.bandwidth), (16e6, 14e6))
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
