"""Lines by gridding, beside the whole transform in double precision."""

import numpy as np
import pytest
from scipy import fft

from navfilters.sar.images.middle_lines import middle_lines
from navfilters.sar.phase_blocks import PIECE


@pytest.mark.parametrize(
    ("n", "k", "lines"),
    [
        (4032, 3207, 384),
        (500, 500, 500),
        (500, 499, 499),
        (2000, 37, 2),
        (300, 240, 171),
        (9, 9, 3),
    ],
)
def test_as_exact_as_single_precision(n, k, lines):
    """Few lines or all, an even number or odd, and frequencies that go once around."""
    rng, first, middle = np.random.default_rng(n + k), -(k // 2) - 3, lines // 2
    spectrum = rng.standard_normal((k, 4 * PIECE)).view(complex).astype(np.complex64)
    spectrum = np.hstack([spectrum, np.zeros((k, -spectrum.shape[1] % PIECE), np.complex64)])
    whole = np.zeros((n, spectrum.shape[1]), complex)
    whole[(first + np.arange(k)) % n] = spectrum
    exact = np.roll(fft.ifft(whole, axis=0), middle, axis=0)[:lines, :50]
    found = middle_lines(spectrum, first, n, lines, 50)
    rms = np.sqrt(np.mean(np.abs(exact) ** 2))
    assert np.sqrt(np.mean(np.abs(found - exact) ** 2)) < 3e-7 * rms
    assert np.abs(found - exact).max() < 3e-6 * rms
