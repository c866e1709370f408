"""Map drift: two halves of a point's spectrum, and an error that is found and mended."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from navfilters.sar.images.focuser import Focuser
from navfilters.sar.images.map_drift import Drift, drift_to_velocity, look_drift, map_drift
from navfilters.sar.images.slant_image import Image
from navfilters.sar.raw.echoes_of_points import point_echo
from navfilters.sar.raw.observation import centred_window
from navfilters.sar.raw.radar import receive

V = 7181.91


@pytest.fixture(scope="module")
def focuser(small, flight, hit):
    window = centred_window(small, flight, hit, 128, 32)
    return Focuser(
        receive(small, window, point_echo(small, flight, hit, window)), lines=128, samples=32
    )


def test_known_shifts_are_found():
    """Two lines in frequency, one of which was moved by whole lines, and by parts of them."""
    rng, n = np.random.default_rng(0), 256
    f = np.fft.fftfreq(n)[:, None]
    spectrum = np.where(np.abs(f) < 0.4, 1.0, 0.0) * np.exp(2j * np.pi * f * 100)
    for lines in (-7.0, 0.0, 3.5, 2.05, -4.93):
        moved = spectrum * np.where(f > 0, np.exp(-2j * np.pi * f * lines), 1.0)
        pixels = np.fft.ifft(moved * rng.uniform(1, 2, (1, 16)), axis=0)
        found = look_drift(Image(pixels, 0.0, 2000.0, 8e5, 5.0))
        assert_allclose(found.seconds * 2000.0, lines, atol=0.02)
        assert_allclose(found.apart, 2000.0 * 0.4, rtol=0.02)


@pytest.mark.parametrize("off", [-40.0, -6.0, 6.0, 40.0])
def test_the_sign_and_size_of_a_velocity_error(small, focuser, off):
    image = focuser.image(V + off)
    drift = look_drift(image)
    assert np.sign(drift.seconds) == -np.sign(off)
    found = drift_to_velocity(drift, V + off, image.centre_range, small.wavelength)
    assert_allclose(found, off, rtol=0.3)


@pytest.mark.parametrize("start", [-45.0, 20.0])
def test_it_drifts_to_the_velocity_of_a_point(focuser, start):
    found = map_drift(focuser, V + start, lambda v: v)
    assert_allclose(found.speed, V, atol=1.5)
    assert len(found.path) == 3


def test_it_says_when_it_does_not_settle(focuser):
    """A velocity that jumps where its slope is small: each correction is larger than the last."""
    runaway = map_drift(focuser, 5.0, lambda v: V + 0.02 * v + 30.0 * np.sign(v), passes=4)
    assert np.isnan(runaway.speed)
    assert len(runaway.path) == 2


def test_closed_form():
    drift = Drift(-1e-3, 800.0)
    assert_allclose(
        drift_to_velocity(drift, 7000.0, 9e5, 0.2), 1e-3 * 7000.0**3 / (9e5 * 0.2 * 800)
    )


@pytest.mark.parametrize(
    ("pixels", "message"),
    [
        (np.ones((4, 4), complex), "number of lines must be"),
        (np.ones((16, 4), complex), "power on both sides"),
    ],
)
def test_refuses(pixels, message):
    with pytest.raises(ValueError, match=message):
        look_drift(Image(pixels, 0.0, 2000.0, 8e5, 5.0))


def test_passes_is_a_number(focuser):
    with pytest.raises(ValueError, match="passes"):
        map_drift(focuser, V, lambda v: v, passes=0)
