"""Raw data against exact echoes in time."""

import ast
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import navfilters.sar
from navfilters.sar.ground.scene import draw_scene
from navfilters.sar.ground.terrain import LocalMap, sample_terrain
from navfilters.sar.raw.echoes_of_points import Echoes, _history, point_echo
from navfilters.sar.raw.flight import Flight, view_of
from navfilters.sar.raw.observation import centred_window, observe
from navfilters.sar.raw.radar import PALSAR, Radar, Window, receive
from navfilters.sar.raw.rasters import _facets, _lattice, _to_radar, scene_raster
from navfilters.sar.raw.synthesis import Raster, _span, synthesize
from navfilters.space.frames import ecef_to_geodetic, geodetic_to_ecef


def at(flight, hit, dt, dR, height):
    """A point near the boresight's hit: so much later, farther, and so high."""
    t, R = flight.closest(hit)
    return flight.ground_point(float(t) + dt, float(R) + dR, height)


def echoes_of(flight, points, heights):
    t, R = flight.closest(np.array(points))
    return Echoes(t, R, np.array(heights, float), np.ones(len(points), complex))


def received(radar, flight, p, window, rows, oversampling=8):
    """Exact echoes through a receiver that passes the sampled band and nothing else."""
    lines = []
    for n in rows:
        pulse = window._replace(
            first_time=window.first_time + n / radar.prf, pulses=1, ranges=window.ranges + 64
        )
        F = np.fft.fft(point_echo(radar, flight, p, pulse, oversampling)[0])
        k = np.fft.fftfreq(pulse.ranges, 1 / pulse.ranges).round().astype(int)
        lines.append(np.fft.ifft(F[k] / oversampling)[: window.ranges])
    return np.array(lines)


def test_flight_is_the_orbit(setup, flight):
    orbit = replace(setup.orbit, step=0.3)
    x = np.concatenate([flight.position(-2.9), flight.velocity(-2.9)])
    path = orbit.path(x, 19)
    t = -2.9 + 0.3 * np.arange(20)
    assert_allclose(flight.position(t), path[:, :3], atol=1e-5)
    assert_allclose(flight.velocity(t), path[:, 3:], atol=1e-5)
    with pytest.raises(ValueError, match="span must be a positive"):
        Flight.through(orbit.derivative, x, 0.0)


def test_closest_is_where_range_is_least(flight, hit):
    p = at(flight, hit, 0.4, 1000.0, 200.0)
    t, R = flight.closest(p)
    s = t + np.linspace(-0.01, 0.01, 201)
    distance = np.linalg.norm(p - flight.position(s), axis=1)
    assert distance.argmin() == 100
    assert_allclose(R, distance.min(), rtol=1e-12)


def test_ground_point(flight, hit):
    t, R = flight.closest(hit)
    p = flight.ground_point(float(t) + 0.2, float(R) - 500.0, 321.0)
    assert_allclose(flight.closest(p), (t + 0.2, R - 500.0), rtol=1e-9, atol=1e-8)
    assert_allclose(ecef_to_geodetic(p)[2], 321.0, atol=1e-4)
    assert_allclose(flight.ground_point(float(t), float(R), 0.0), hit, atol=0.1)
    with pytest.raises(ValueError, match="slant_range must reach height"):
        flight.ground_point(0.0, 1000.0, 0.0)


def test_window_of_the_paper(flight, hit):
    """About 9260 x 1890 raw samples make 2048 x 1024; migration is 18 cells."""
    window = centred_window(PALSAR, flight, hit)
    assert_allclose((window.pulses, window.ranges), (9260, 1890), rtol=0.01)
    t, R = flight.closest(hit)
    assert_allclose(window.first_time + window.pulses // 2 / PALSAR.prf, t, atol=1e-12)
    assert_allclose(window.near_range + 512 * PALSAR.range_spacing, R)
    edge, _ = _history(PALSAR, flight, hit, np.array([window.first_time + 1024 / PALSAR.prf]))
    assert_allclose((edge - R) / PALSAR.range_spacing, 18, atol=0.6)
    with pytest.raises(ValueError, match="lines must be even"):
        centred_window(PALSAR, flight, hit, lines=101)


@pytest.mark.parametrize(("oversampling", "dR"), [(1, 0.0), (3, -150.0), (1, 2000.0)])
def test_the_echo_of_a_point_is_its_formula(flight, hit, oversampling, dR):
    """a(angle) rect((t - 2R/c) / T) exp(i pi K (t - 2R/c - T/2)^2 - 4 i pi R / wavelength)"""
    whole = centred_window(PALSAR, flight, hit, 16, 16)
    window = Window(whole.first_time + 1.0, 2500, 77, whole.near_range + dR)
    t = window.first_time + np.arange(window.pulses)[:, None] / PALSAR.prf
    R, pattern = _history(PALSAR, flight, hit, t)
    into = np.arange(oversampling * window.ranges) / (oversampling * PALSAR.sampling)
    into = into + 2 * (window.near_range - R) / 299792458.0
    chirp = np.exp(1j * np.pi * PALSAR.chirp_rate * (into - PALSAR.pulse_length / 2) ** 2)
    wanted = pattern * chirp * np.exp(-4j * np.pi * R / PALSAR.wavelength)
    wanted[(into < 0) | (into >= PALSAR.pulse_length)] = 0
    assert wanted.any()
    echo = point_echo(PALSAR, flight, hit, window, oversampling)
    assert_allclose(echo, wanted, rtol=0, atol=1e-10)


@pytest.mark.parametrize("squint", [0.2, -0.2])
def test_a_beam_that_looks_ahead_meets_a_point_earlier(small, flight, hit, squint):
    looking = replace(small, squint=squint)
    window = centred_window(looking, flight, hit, 16, 16)
    heard = np.abs(point_echo(looking, flight, hit, window)).max(axis=1)
    assert heard[0] == heard[-1] == 0 < heard.max()  # the window holds the whole beam
    t = window.first_time + np.arange(window.pulses) / looking.prf
    middle = np.sum(heard**2 * t) / np.sum(heard**2) - flight.closest(hit)[0]
    ray, v = hit - flight.position(middle), flight.velocity(middle)
    ahead = np.rad2deg(np.arcsin(ray @ v / np.linalg.norm(ray) / np.linalg.norm(v)))
    assert_allclose(ahead, squint, rtol=0.02)
    with pytest.raises(ValueError, match="squint must be less than 5 deg"):
        replace(small, squint=-5.0)


@pytest.mark.parametrize(
    ("dt", "dR", "height"), [(0.0, 0.0, 0.0), (0.011, 333.3, 260.0), (-0.3, -1100.0, -120.0)]
)
def test_synthesis_is_the_exact_echo(small, flight, hit, dt, dR, height):
    """Within 1.5 % in amplitude, at ranges, heights and times away from where it is exact."""
    p = at(flight, hit, dt, dR, height)
    window = centred_window(small, flight, hit, 512, 512)
    corners = [at(flight, hit, s * 0.3, s * 1190.0, 0.0) for s in (-1, 1)]
    echoes = echoes_of(flight, [p, *corners], [height, 0, 0])
    echoes.amplitude[1:] = 0  # they only widen the extent to that of an image
    rows = np.arange(40, window.pulses, 150)
    exact = received(small, flight, p, window, rows)
    error = synthesize(small, flight, window, echoes)[rows] - exact
    assert np.linalg.norm(error) < 0.015 * np.linalg.norm(exact)


def test_synthesis_with_palsar(flight, hit):
    """The same with the long aperture, 18 cells of migration and the long pulse."""
    p = at(flight, hit, 0.02, 150.0, 90.0)
    window = centred_window(PALSAR, flight, hit, 64, 64)
    rows = np.arange(100, window.pulses, 900)
    exact = received(PALSAR, flight, p, window, rows)
    found = synthesize(PALSAR, flight, window, echoes_of(flight, [p], [90.0]))[rows]
    assert np.linalg.norm(found - exact) < 0.01 * np.linalg.norm(exact)


def test_what_the_receiver_takes_away(small, flight, hit):
    """Sampling a chirp of sharp edges directly lets in 3 to 6 % that lies out of the band."""
    window, rows = centred_window(small, flight, hit, 32, 32), np.array([900])
    exact = received(small, flight, hit, window, rows)
    direct = point_echo(small, flight, hit, window)[rows]
    assert 0.02 < np.linalg.norm(direct - exact) / np.linalg.norm(exact) < 0.1


def test_raster_is_made_of_points(small, flight, hit):
    """One cell of a raster, between two layers of height, and the point that it stands for."""
    window = centred_window(small, flight, hit, 64, 64)
    line, cell, height = window.pulses // 2 + 5, 40, 40.0
    t, R = window.first_time + line / small.prf, window.near_range + cell * small.range_spacing
    point = Echoes(*(np.array([a]) for a in (t, R, height, 1j)))
    raster = Raster(np.zeros((9, 11), np.complex64), np.full((9, 11), height), line - 3, cell - 6)
    raster.amplitude[3, 6] = 1j * np.exp(-4j * np.pi * R / small.wavelength)
    a = synthesize(small, flight, window, point, blocks=1)
    b = synthesize(small, flight, window, raster=raster, blocks=1)
    assert np.linalg.norm(a - b) < 2e-3 * np.linalg.norm(a)


def test_blocks_and_layers_converge(small, flight, hit):
    window = centred_window(small, flight, hit, 32, 512)
    rng = np.random.default_rng(0)
    shape = (8, 500)
    amplitude = rng.standard_normal((*shape, 2)).astype(np.float32).view(np.complex64)[..., 0]
    raster = Raster(amplitude, 300 * rng.random(shape), window.pulses // 2, 5)
    few = synthesize(small, flight, window, raster=raster)
    many = synthesize(small, flight, window, raster=raster, blocks=10, layer=30.0)
    assert np.linalg.norm(few - many) < 1e-2 * np.linalg.norm(many)


def test_something_must_send_back(small, flight, hit):
    window = centred_window(small, flight, hit, 32, 32)
    with pytest.raises(ValueError, match="echoes or raster must hold scatterers"):
        synthesize(small, flight, window)


def test_beam_ends():
    edge = PALSAR.wavelength / (2 * PALSAR.antenna)
    assert_allclose(PALSAR.pattern([0.0, 0.999 * edge, 1.001 * edge]), [1, 0.406, 0], atol=1e-3)


@pytest.fixture(scope="module")
def scene(flight, hit):
    place = ecef_to_geodetic(hit)
    ground = sample_terrain(float(place[0]), float(place[1]))
    return draw_scene(ground, LocalMap(float(place[0]), float(place[1])), 5, half_width=3000.0)


@pytest.mark.parametrize("steepness", [1.0, 8.0])
def test_facets_are_where_they_are(flight, scene, steepness):
    """The polynomials to time and range against the exact solution: 1e-3 of a sample.

    Also where the ground rises from 2.5 to 7.8 km.
    """
    view = view_of(flight, geodetic_to_ecef(scene.map.latitude, scene.map.longitude))
    along, across = np.linspace(-3400, 3400, 7), np.linspace(-4800, 4800, 9)
    east, north = _lattice(view, along, across)
    height = steepness * scene.height(east, north)
    got = _to_radar(flight, scene, view, along, across, height)(slice(None))
    exact = flight.closest(geodetic_to_ecef(*scene.map.geodetic(east, north), height))
    assert_allclose(got[0], exact[0], atol=1e-3 / PALSAR.prf)
    assert_allclose(got[1], exact[1], rtol=0, atol=1e-3 * PALSAR.range_spacing)


def test_raster_keeps_the_power(small, flight, scene):
    """Cells hold what the facets send, on the average the area of a cell times reflectivity."""
    lines, samples = 128, 96
    p = geodetic_to_ecef(scene.map.latitude, scene.map.longitude, scene.height(0.0, 0.0))
    window = centred_window(small, flight, p, lines, samples)
    power, height, first = _facets(small, flight, scene, window, lines, samples, 8)
    assert first == (window.pulses - lines) // 2 - 8
    view = view_of(flight, p)
    reach = 0.7 * lines / 2 / small.prf * 6792, 0.5 * samples / 2 * 7.5
    along, across = np.arange(-reach[0], reach[0], 5.0), np.arange(-reach[1], reach[1], 5.0)
    sent, heights = scene.returns(view, along, across)
    cell = 6792 / small.prf * small.range_spacing / np.sin(view.incidence)
    assert_allclose(power.mean() / cell, sent.mean() / 25.0, rtol=0.25)  # not the same ground
    assert heights.min() - 30 < height.mean() < heights.max() + 30
    one = scene_raster(small, flight, scene, window, lines, samples, 3, margin=8)
    assert_allclose(np.mean(np.abs(one.amplitude) ** 2), power.mean(), rtol=0.1)
    again = scene_raster(small, flight, scene, window, lines, samples, 3, margin=8)
    assert_array_equal(one.amplitude, again.amplitude)


def test_dark_ground_has_its_heights_too(small, flight, scene):
    dark = replace(scene, cover=replace(scene.cover, reflectivity=1e-9 * scene.cover.reflectivity))
    p = geodetic_to_ecef(scene.map.latitude, scene.map.longitude, scene.height(0.0, 0.0))
    window = centred_window(small, flight, p, 32, 32)
    power, height, _ = _facets(small, flight, scene, window, 32, 32, 8)
    darker, same, _ = _facets(small, flight, dark, window, 32, 32, 8)
    assert_allclose(darker, 1e-9 * power, rtol=1e-5)
    assert_allclose(same, height, rtol=1e-5)
    assert np.ptp(height) > 5


def test_noise_is_that_of_the_reflectivity(small, flight, scene):
    sizes = {"lines": 64, "samples": 64}
    quiet = observe(replace(small, nesz=-np.inf), flight, scene, speckle=7, **sizes)
    noisy = observe(replace(small, nesz=-10.0), flight, scene, speckle=7, **sizes)
    same = observe(replace(small, nesz=-10.0), flight, scene, speckle=7, **sizes)
    assert_array_equal(noisy.samples, same.samples)
    noise = noisy.samples - quiet.samples
    view = view_of(flight, geodetic_to_ecef(scene.map.latitude, scene.map.longitude))
    cell = 6792 / small.prf * small.range_spacing / np.sin(view.incidence)
    pulses = quiet.samples.shape[0] - 64
    mean = np.mean(np.sinc(np.linspace(-0.5, 0.5, 999)) ** 4)
    expected = 0.1 * cell * 4e-6 * 32e6 * pulses * mean
    assert_allclose(np.mean(np.abs(noise) ** 2), expected, rtol=0.02)


def test_header(small):
    raw = receive(small, Window(-1.0, 4, 5, 8e5), np.zeros((4, 5), np.complex64))
    assert (raw.near_range, raw.first_time, raw.prf) == (8e5, -1.0, small.prf)
    assert_allclose(raw.chirp_rate * raw.pulse_length, -small.bandwidth)
    assert replace(small, falling=False).chirp_rate == -small.chirp_rate


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"wavelength": 0.0}, "wavelength must be a positive number; found 0.0"),
        ({"prf": np.nan}, "prf must be a positive number; found nan"),
        ({"sampling": 1e6}, "sampling must be at least the bandwidth"),
        ({"nesz": np.nan}, "nesz must be a number of dB"),
    ],
)
def test_radar_refuses(change, message):
    with pytest.raises(ValueError, match=message):
        Radar(**change)


def test_echo_and_focus_share_nothing():
    """Neither imports from the other, and no number or formula is imported by both."""
    names = {}
    for package in ("raw", "images"):
        names[package] = set()
        for module in (Path(navfilters.sar.__file__).parent / package).glob("*.py"):
            tree = ast.parse(module.read_text(encoding="utf-8"))
            froms = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
            names[package] |= {(n.module, a.name) for n in froms for a in n.names}
    for package, other in (("raw", "images"), ("images", "raw")):
        assert not any(f"sar.{other}" in (source or "") for source, _ in names[package])
    shared = {
        pair
        for pair in names["raw"] & names["images"]
        if pair[0].split(".")[0] in ("navfilters", "numpy")
    }
    how_work_is_split = {("navfilters.sar.in_parts", n) for n in ("blocks", "in_threads")}
    assert shared == how_work_is_split | {
        ("navfilters.numerics", "validation"),
        ("navfilters.types", "Array"),
    }


def test_the_span_of_what_scatters_is_that_of_both(small):
    """Lines and cells by hand: a raster from line -7 and cell 3, two points about it."""
    window = Window(2.0, 100, 200, 8e5)
    raster = SimpleNamespace(amplitude=np.zeros((20, 50)), line=-7, cell=3)
    time = 2.0 + np.array([-10.5, 30.5]) / small.prf
    slant = 8e5 + np.array([60.5, 4.5]) * small.range_spacing
    points = Echoes(time, slant, np.zeros(2), np.ones(2))
    assert _span(small, window, None, raster) == ((-7, 13), (3, 53))
    assert _span(small, window, points, None) == ((-11, 31), (4, 61))
    assert _span(small, window, points, raster) == ((-11, 31), (3, 61))
    with pytest.raises(ValueError, match="must hold scatterers"):
        _span(small, window, None, None)
