"""The processor against theory: point response, position, velocity, migration."""

from dataclasses import replace

import numpy as np
import pytest
from focused_points import (
    LONG,
    hyperbola,
    point,
    response,
    sinc_response,
    velocity_at,
)
from numpy.testing import assert_allclose
from scipy.constants import c

from navfilters.papers.pogorelsky2020.experiment import NOMINAL
from navfilters.papers.pogorelsky2020.true_flight import truth
from navfilters.sar.images.autofocusing import sharpness
from navfilters.sar.images.focuser import Focuser
from navfilters.sar.images.slant_image import effective_velocity
from navfilters.sar.raw.echoes_of_points import point_echo
from navfilters.sar.raw.observation import centred_window
from navfilters.sar.raw.radar import PALSAR, receive
from navfilters.space.frames import ellipsoid_intersection


def test_effective_velocity_is_the_range_s_curvature(setup, flight, hit):
    t, _ = flight.closest(hit)
    h = 0.05
    squared = [np.sum((hit - flight.position(t + s * h)) ** 2) for s in (-2, -1, 0, 1, 2)]
    second = np.dot([-1, 16, -30, 16, -1], squared) / (12 * h * h)
    assert_allclose(velocity_at(setup, flight, hit), np.sqrt(second / 2), rtol=1e-6)


def test_velocity_of_the_paper(setup):
    """7182.48 m/s at the start; it changes by 1.054 of a change of the in-track velocity."""
    known = truth(setup, 1)
    x = known.x[0]
    beam = replace(setup.geometry, T_e_b=known.T_e_b[0]).boresight(NOMINAL)
    p = ellipsoid_intersection(x[:3], beam)

    def V(stretch):
        v = x[3:] * stretch
        a = setup.orbit.acceleration(np.concatenate([x[:3], v]))
        return effective_velocity(x[:3], v, p, a)

    assert_allclose(V(1.0), 7182.48, atol=0.01)
    change = (V(1 + 1e-4) - V(1 - 1e-4)) / (2e-4 * np.linalg.norm(x[3:]))
    assert_allclose(change, 1.054, atol=1e-3)


def test_range_response(setup, flight, hit):
    """A flat spectrum of 28 in 32 MHz: 0.886 c / 2B, -13.3 dB, position to 0.01 samples."""
    image = point(LONG, flight, hit).image(velocity_at(setup, flight, hit))
    line = image.pixels[64]
    place, width, peak_ratio, side_ratio = response(line)
    assert_allclose(place, 32.0, atol=0.02)
    assert_allclose(width * image.range_spacing, 0.886 * c / (2 * 28e6), rtol=0.02)
    assert_allclose(peak_ratio, -13.26, atol=0.5)
    theory = sinc_response(28 / 32)
    assert_allclose(side_ratio, theory[3], atol=0.6)


def test_azimuth_response(setup, flight, hit):
    """Uniform illumination over the Doppler band 2 V_sat / L: 0.886 L / 2 on the orbit."""
    image = point(LONG, flight, hit).image(velocity_at(setup, flight, hit))
    place, width, peak_ratio, side_ratio = response(image.pixels[:, 32])
    speed = np.linalg.norm(flight.velocity(0.0))
    assert_allclose(place, 64.0, atol=0.02)
    assert_allclose(width / LONG.prf * speed, 0.886 * LONG.antenna / 2, rtol=0.02)
    assert_allclose(peak_ratio, -13.26, atol=0.5)
    assert_allclose(side_ratio, sinc_response(2 * speed / LONG.antenna / LONG.prf)[3], atol=0.6)


def test_palsar_response(setup, flight, hit):
    """With the antenna's pattern: the spectrum is the pattern, so is the response."""
    image = point(PALSAR, flight, hit, 128, 32).image(velocity_at(setup, flight, hit))
    assert np.unravel_index(np.abs(image.pixels).argmax(), image.pixels.shape) == (64, 16)
    place, width, peak_ratio, side_ratio = response(image.pixels[:, 16])
    band = 2 * np.linalg.norm(flight.velocity(0.0)) / PALSAR.antenna / PALSAR.prf
    k = np.fft.fftfreq(512)
    spectrum = np.where(np.abs(k) < band / 2, np.sinc(k / band) ** 2, 0.0)
    theory = response(np.roll(np.fft.ifft(spectrum), 256))
    assert_allclose(place, 64.0, atol=0.02)
    assert_allclose(width, theory[1], rtol=0.01)
    assert_allclose(peak_ratio, theory[2], atol=0.5)
    assert_allclose(side_ratio, theory[3], atol=0.6)
    assert_allclose(response(image.pixels[64])[0], 16.0, atol=0.02)


@pytest.mark.parametrize(("dt", "dR"), [(0.02, 100.0), (-0.021, -70.0)])
def test_position_of_points_off_the_grid(setup, flight, hit, small, dt, dR):
    t, R = (float(a) for a in flight.closest(hit))
    p = flight.ground_point(t + dt, R + dR, 0.0)
    window = centred_window(small, flight, hit, 128, 64)
    focuser = Focuser(
        receive(small, window, point_echo(small, flight, p, window)), lines=128, samples=64
    )
    image = focuser.image(velocity_at(setup, flight, hit))
    row, column = np.unravel_index(np.abs(image.pixels).argmax(), image.pixels.shape)
    line, sample = response(image.pixels[:, column])[0], response(image.pixels[row])[0]
    assert_allclose(image.first_time + line / image.prf, t + dt, atol=0.03 / image.prf)
    found = image.near_range + sample * image.range_spacing
    assert_allclose(found, R + dR, atol=0.03 * image.range_spacing)


def test_phase_is_that_of_the_range():
    """A point's phase is -4 pi R_0 / wavelength, its amplitude the root of the pulse's energy."""
    raw = hyperbola(7182.0)
    pixels = Focuser(raw).image(7182.0).pixels
    row, column = np.unravel_index(np.abs(pixels).argmax(), pixels.shape)
    assert (row, column) == (1024, 32)
    phase = np.angle(pixels[row, column] * np.exp(4j * np.pi * 866e3 / raw.wavelength))
    assert abs(phase + np.pi / 4) < 0.05  # of the azimuth chirp's spectrum


def test_wrong_velocity_blurs_and_only_blurs(small):
    focuser = Focuser(hyperbola(7182.0), samples=64)
    sharp, blurred = (focuser.image(7182.0 + dv).pixels for dv in (0.0, 120.0))
    assert response(blurred[:, 32])[1] > 2 * response(sharp[:, 32])[1]
    power = [np.abs(p) ** 2 for p in (sharp, blurred)]
    assert_allclose(power[0].sum(), power[1].sum(), rtol=1e-3)
    centre = [np.sum(p * np.arange(2048)[:, None]) / p.sum() for p in power]
    assert_allclose(centre[0], centre[1], atol=0.3)
    assert sharpness(power[0]) > 2 * sharpness(power[1])


def test_migration_must_be_corrected(flight, hit, setup):
    """18 cells of it: without correction the velocity hardly matters to the sharpness."""
    change = {}
    V = float(velocity_at(setup, flight, hit))
    for migration in (True, False):
        focuser = point(PALSAR, flight, hit, 128, 32, migration=migration)
        values = [sharpness(np.abs(focuser.image(V + dv).pixels) ** 2) for dv in (0.0, 15.0)]
        change[migration] = values[0] / values[1], values[0]
    assert change[True][0] > 3
    assert change[True][1] > 5 * change[False][1]


def test_slope_of_the_velocity_with_range():
    """A point 2.4 km from the middle is sharp when the slope carries its velocity to it."""
    focuser = Focuser(hyperbola(7190.0, ranges=1200))
    middle = (1200 - 128) // 2
    slope = (7190.0**2 - 7130.0**2) / ((32 - middle) * focuser.range_spacing)
    peaks = [
        np.abs(focuser.image(*assumed).pixels[:, 32]).max()
        for assumed in ((7190.0,), (7130.0, slope), (7130.0,))
    ]
    assert_allclose(peaks[1], peaks[0], rtol=0.01)
    assert peaks[2] < 0.9 * peaks[0]


@pytest.mark.parametrize(("seen", "centroid"), [((0.2, 0.5), -710.0), ((0.5, 0.8), -1315.0)])
def test_doppler_centroid(seen, centroid):
    """Seen by a squinted beam, also beyond half the PRF, a point is where it would be anyway."""
    raw = hyperbola(7182.0, at=-0.3, seen=seen)
    image = Focuser(raw, samples=64, doppler_centroid=centroid, bandwidth=1400.0).image(7182.0)
    row, column = np.unravel_index(np.abs(image.pixels).argmax(), image.pixels.shape)
    assert column == 32
    assert_allclose(image.first_time + row / image.prf, -0.3, atol=1 / image.prf)
    aside = Focuser(raw, samples=64, doppler_centroid=0.0, bandwidth=1000.0).image(7182.0)
    assert np.abs(aside.pixels).max() < 0.7 * np.abs(image.pixels).max()
