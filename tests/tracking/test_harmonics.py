"""Spherical harmonics against a potential that is written another way."""

from math import factorial

import numpy as np
import pytest
from scipy.special import lpmv

from navfilters.space.gravity import Gravity
from navfilters.tracking import Harmonics, read_coefficients
from navfilters.tracking.w3b import FOLDER

PLACES = np.array([[4.2e6, -3.1e6, 5.0e6], [6.5e6, 1e5, -2e5], [-2e7, 3e7, -1e6]])


def potential(field, r):
    """Sum of associated Legendre functions by latitude and longitude."""
    x, y, z = r
    d, lon, total = np.linalg.norm(r), np.arctan2(y, x), 0.0
    for n in range(field.degree + 1):
        for m in range(n + 1):
            norm = ((1 if m == 0 else 2) * (2 * n + 1) * factorial(n - m) / factorial(n + m)) ** 0.5
            wave = field.C[n, m] * np.cos(m * lon) + field.S[n, m] * np.sin(m * lon)
            legendre = (-1) ** m * lpmv(m, n, z / d)
            total += (field.radius / d) ** n * norm * legendre * wave
    return field.mu / d * total


@pytest.mark.parametrize("degree", [0, 2, 8, 20])
def test_acceleration_is_the_gradient_of_the_potential(degree):
    field = Harmonics(*read_coefficients(FOLDER / "EGM96-truncated-21x21", degree))
    for r in PLACES:
        a = field.acceleration(r)
        h = 1e-5 * np.linalg.norm(r)
        for i, e in enumerate(h * np.eye(3)):
            near, far = (potential(field, r + k * e) - potential(field, r - k * e) for k in (1, 2))
            assert a[i] == pytest.approx((8 * near - far) / (12 * h), abs=2e-9)


def test_degree_two_without_orders_is_the_oblate_earth():
    C, S = read_coefficients(FOLDER / "EGM96-truncated-21x21", 2)
    C[2, 1:] = 0
    field = Harmonics(C, 0 * S)
    oblate = Gravity(field.mu, field.radius, -C[2, 0] * 5**0.5)
    assert np.abs(field.acceleration(PLACES) - oblate.acceleration(PLACES)).max() < 1e-14


def test_members_of_a_batch_do_not_mix_and_complex_steps_pass():
    field = Harmonics(*read_coefficients(FOLDER / "EGM96-truncated-21x21", 8))
    together = field.acceleration(PLACES)
    for r, a in zip(PLACES, together, strict=True):
        assert np.abs(field.acceleration(r) - a).max() <= 1e-14
    slope = field.acceleration(PLACES[0] + 1e-20j * np.eye(3)).imag / 1e-20
    assert np.abs(slope - slope.T).max() < 1e-18
    assert abs(np.trace(slope)) < 1e-18


def test_coefficients_must_be_square_and_alike():
    with pytest.raises(ValueError, match="C and S must have shape"):
        Harmonics(np.ones((3, 2)), np.ones((3, 2)))
