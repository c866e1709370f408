"""The drawn land cover: every class is there, as often and as bright as it is said to be."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.stats import norm

from navfilters.sar.ground.land_cover import COVER, PATCH, SPACING, LandCover, smooth_field

ORDER = ["water", "pasture", "crops", "forest", "town"]


def frequency(name):
    """How often a Gaussian of the class's mean is the highest of all: by quadrature."""
    others = [norm(kind.share) for other, kind in COVER.items() if other != name]
    own = norm(COVER[name].share)
    return quad(lambda x: own.pdf(x) * np.prod([o.cdf(x) for o in others]), -9, 9)[0]


def test_classes_are_all_frequent_and_in_the_order_of_l_band():
    assert sorted(COVER, key=lambda name: COVER[name].level) == ORDER
    assert_allclose(sum(map(frequency, COVER)), 1, rtol=1e-6)
    assert all(frequency(name) > 0.05 for name in COVER)
    assert all(kind.length > SPACING and 0 < kind.texture < 5 for kind in COVER.values())


def test_a_drawn_cover_has_each_class_as_often_as_it_should():
    """To four deviations of so few patches, each of 4 pi (PATCH / SPACING)^2 cells."""
    dB = 10 * np.log10(LandCover.draw(6000.0, 3).reflectivity)
    assert dB.shape == (1501, 1501)
    four = 4 / np.sqrt(dB.size / (4 * np.pi * (PATCH / SPACING) ** 2))
    water = frequency("water")  # darker than -9.5 dB, and nearly nothing else
    assert_allclose(np.median(dB[dB < -9.5]), COVER["water"].level, rtol=0, atol=0.1)
    assert_allclose(np.mean(dB < -9.5), water, rtol=0, atol=four * np.sqrt(water))
    mean = sum(frequency(name) * kind.level for name, kind in COVER.items())
    square = sum(frequency(n) * (k.level**2 + k.texture**2) for n, k in COVER.items())
    deviation = np.sqrt(square - mean**2)
    assert_allclose(dB.mean(), mean, rtol=0, atol=four * deviation)
    assert_allclose(dB.std(), deviation, rtol=four)


@pytest.mark.parametrize("correlation", [2.0, 5.0])
def test_a_smooth_field_has_the_correlation_of_a_gaussian_kernel(correlation):
    """White noise under exp(-(x / l)^2 / 2): correlated by exp(-(x / l)^2 / 4), variance 1."""
    field = smooth_field((1500, 1500), correlation, np.random.default_rng(0))
    assert abs(field.mean()) < 0.02
    for lag in (0, 2, 5):
        wanted = np.exp(-((lag / correlation) ** 2) / 4)
        assert_allclose(np.mean(field * np.roll(field, lag, 0)), wanted, rtol=0, atol=0.02)
        assert_allclose(np.mean(field * np.roll(field, lag, 1)), wanted, rtol=0, atol=0.02)
