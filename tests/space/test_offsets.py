"""Constant offsets as states: a manifold, an update and a flight beside the ones without them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.papers.pogorelsky2020 import CASES, simulate_images, truth
from navfilters.space import EarthFixedNavigation, SarPass
from navfilters.space.offsets import (
    OffsetImages,
    OffsetNavigation,
    difference,
    retract,
)

SETUP = CASES["TC-1"]
SIZE = np.array([1e3] * 3 + [10.0] * 3 + [1e-3] * 3 + [5.0, 2.0])


def states(count=4):
    rng = np.random.default_rng(0)
    images = simulate_images(SETUP, count, flight=truth(SETUP, 5))
    first = np.concatenate([images.true_state(1).x, np.zeros((count, 2))], axis=-1)
    return images, retract(first, SIZE * rng.normal(size=(count, 11)))


def test_difference_undoes_retract():
    _, x = states()
    dx = SIZE * np.random.default_rng(1).normal(size=(4, 11))
    assert_allclose(difference(retract(x, dx), x) / SIZE, dx / SIZE, atol=1e-7)
    assert_array_equal(retract(x, 0 * dx)[:, 10:], x[:, 10:])


def test_an_offset_is_added_to_its_row_and_to_no_other():
    images, x = states()
    passing = SarPass(SETUP.geometry, truth(SETUP, 5).T_e_b[1:])
    z = images(1, None).z
    y, plain = passing.at(0).given(z)
    same, sensor = OffsetImages(passing, (3, 2)).at(0).given(z)
    assert_array_equal(same, y)
    moved = sensor.h(x) - plain.h(x[:, :10])
    assert_allclose(moved[:, :2], 0, atol=1e-12)
    assert_allclose(moved[:, 3], x[:, 10], rtol=1e-6)
    assert_allclose(moved[:, 2], x[:, 11], rtol=1e-6)
    assert_array_equal(sensor.noise(x), plain.noise(x[:, :10]))


def test_its_jacobian_is_that_of_h():
    images, x = states()
    passing = SarPass(SETUP.geometry, truth(SETUP, 5).T_e_b[1:])
    _, sensor = OffsetImages(passing, (2,)).at(0).given(images(1, None).z)
    x, size, H = x[:, :11], SIZE[:10], sensor.jacobian(x[:, :11])
    unit = np.array([1e-3, 1e-3, 1e3, 10.0])
    for i in range(10):
        step = 1e-4 * size[i] * np.eye(10)[i]
        slope = (sensor.h(retract(x, step)) - sensor.h(retract(x, -step))) / 2e-4 / unit
        assert_allclose(H[..., i] * size[i] / unit, slope, rtol=1e-5, atol=1e-7)


def test_offsets_stay_and_the_rest_moves_as_without_them():
    _, x = states()
    plain = EarthFixedNavigation(SETUP.orbit, 3)
    dynamics = OffsetNavigation(plain, 2)
    moved, F, W = dynamics.propagate(x, dynamics.Q)
    wanted = plain.propagate(x[:, :10], plain.Q)
    assert_array_equal(moved[:, :10], wanted[0])
    assert_array_equal(moved[:, 10:], x[:, 10:])
    assert_array_equal(dynamics.f(x), moved)
    assert_array_equal(F[:, :9, :9], wanted[1])
    assert_array_equal(W[:, :9, :9], wanted[2])
    assert_array_equal(F[:, 9:, 9:], np.broadcast_to(np.eye(2), (4, 2, 2)))
    assert not F[:, :9, 9:].any()
    assert not F[:, 9:, :9].any()
    assert not W[:, 9:].any()


@pytest.mark.parametrize(
    ("rows", "message"), [((-1,), "rows must be .* at least 0"), ((2, 2), r"different .*\(2, 2\)")]
)
def test_rows_are_different_numbers_from_0(rows, message):
    with pytest.raises(ValueError, match=message):
        OffsetImages(SarPass(SETUP.geometry, None), rows)
