"""The second autofocus, on a point that was focused with a known error."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from navfilters.oracles import sar_refocus

PRF, WAVELENGTH, RANGE, V = 2150.0, 0.236, 8.7e5, 7182.0


def a_point(faster):
    """Its spectrum is level in the middle band, turned as one that was focused so much too fast."""
    f = np.fft.fftfreq(512, 1 / PRF)[:, None]
    phase = np.pi * RANGE * WAVELENGTH * f**2 * faster / V**3  # the parabola, not the hyperbola
    spectrum = np.where(np.abs(f) < 800, 1.0, 0.0) * np.exp(1j * (phase - 2 * np.pi * f * 0.119))
    pixels = np.fft.ifft(spectrum, axis=0) * np.ones(4)
    return sar_refocus.Pixels(pixels, PRF, WAVELENGTH, np.full(4, RANGE), V)


@pytest.mark.parametrize("criterion", sar_refocus.CRITERIA)
@pytest.mark.parametrize("faster", [-2.0, 0.0, 1.3])
def test_a_point_is_mended(criterion, faster):
    assert_allclose(sar_refocus.best(criterion, a_point(faster)), -faster, atol=0.21)


def test_no_change_is_no_change_and_ends_fade():
    p = a_point(0.0)
    assert_allclose(np.fft.ifft(p.spectrum(0.0)[1], axis=0), p.values, atol=1e-6)
    ends = np.abs(replace(p, values=np.ones((64, 2))).faded(16).values[:, 0])
    assert_allclose(ends[[0, 31, 63]], [0.0024, 1.0, 0.0024], atol=2e-4)
    assert_allclose(ends, ends[::-1])
