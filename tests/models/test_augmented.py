"""A sensor of some states: its values, its Jacobian and its refusals."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.models import Augmented, ConvertedRangeBearing, Linear, RangeBearing
from navfilters.numerics.complex_step import complex_step

SENSOR = RangeBearing(np.diag([0.1, 1e-3]))
B = np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]])


def test_it_is_the_sensor_and_a_bias():
    model = Augmented(SENSOR, 2, B)
    x = np.random.default_rng(0).normal(size=(7, 4)) + np.array([20.0, 30.0, 0.0, 0.0])
    assert_array_equal(model.h(x), SENSOR.h(x[:, :2]) + np.stack([x[:, 3], 0 * x[:, 3]], axis=-1))
    assert_allclose(model.jacobian(x), complex_step(model.h, x), rtol=1e-12, atol=1e-14)
    assert_array_equal(model.R, SENSOR.R)
    z = np.array([1.0, 3.1])
    assert_array_equal(model.residual(z, -z), SENSOR.residual(z, -z))
    plain = Augmented(Linear(np.eye(2), np.eye(2)), 2, B)
    assert_array_equal(plain.residual(z, -z), 2 * z)


@pytest.mark.parametrize(
    ("own", "matrix", "message"),
    [
        (2, np.zeros((3, 4)), r"B must have shape \(..., 2, n\), as sensor.R; found \(3, 4\)"),
        (0, B, "own must be an integer of at least 1"),
        (5, B, "own must be at most 4, the columns of B; found 5"),
        (2, [1.0], "B must be an array"),
    ],
)
def test_what_does_not_fit_is_named(own, matrix, message):
    with pytest.raises(ValueError, match=message):
        Augmented(SENSOR, own, matrix)


@pytest.mark.parametrize(
    ("sensor", "found"),
    [
        (ConvertedRangeBearing(np.diag([0.1, 1e-3])), "ConvertedRangeBearing with noise"),
        (SimpleNamespace(R=np.eye(2), h=SENSOR.h), "SimpleNamespace with no jacobian"),
        (SimpleNamespace(R=np.eye(2), at=lambda k: SENSOR), "SimpleNamespace with at, which would"),
    ],
)
def test_what_cannot_be_passed_on_is_refused(sensor, found):
    """A converted measurement was compared with a place, unconverted, by the noise of a bearing."""
    with pytest.raises(ValueError, match=f"sensor must have R, h and jacobian.*found {found}"):
        Augmented(sensor, 2, B)
