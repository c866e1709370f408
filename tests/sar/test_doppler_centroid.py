"""The Doppler centroid: of tones, of points seen by antennas that squint, and of nothing."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from navfilters.sar.images.doppler_centroid import doppler_centroid
from navfilters.sar.raw.echoes_of_points import point_echo
from navfilters.sar.raw.observation import centred_window
from navfilters.sar.raw.radar import Window, receive

WINDOW = Window(0.0, 64, 8, 8e5)


@pytest.mark.parametrize("f", [-900.0, 0.0, 333.3])
def test_a_tone(small, f):
    tone = np.exp(2j * np.pi * f * np.arange(64) / small.prf)[:, None] * np.ones(8)
    assert_allclose(doppler_centroid(receive(small, WINDOW, tone)), f, atol=1e-9)


def test_whole_pulse_rates_cannot_be_told(small):
    tone = np.exp(2j * np.pi * (small.prf + 100) * np.arange(64) / small.prf)[:, None]
    assert_allclose(doppler_centroid(receive(small, WINDOW, tone)), 100.0, atol=1e-6)


@pytest.mark.parametrize("squint", [0.0, 0.02])
def test_a_point_and_an_antenna_that_squints(small, flight, hit, squint):
    looking = replace(small, squint=squint)
    window = centred_window(looking, flight, hit, 64, 32)
    found = doppler_centroid(receive(looking, window, point_echo(looking, flight, hit, window)))
    speed = np.linalg.norm(flight.velocity(0.0))
    right = 2 * speed / small.wavelength * np.sin(np.deg2rad(squint))
    assert abs(found - right) < 2.0  # the horizontal axis is not quite the velocity's


@pytest.mark.parametrize(
    ("samples", "message"),
    [(np.ones((1, 8), complex), "two pulses"), (np.zeros((4, 8), complex), "found none")],
)
def test_refuses(small, samples, message):
    with pytest.raises(ValueError, match=message):
        doppler_centroid(receive(small, WINDOW, samples))
