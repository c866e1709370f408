"""The checks behind run and the models: what they let through, and that units do not decide."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from navfilters import Gaussian
from navfilters.numerics import validation


def test_a_float64_array_is_not_copied():
    array = np.ones((3, 2))
    assert validation.real_array("x", array, "n") is array


@pytest.mark.parametrize("value", [[1, 2], np.array([1, 2], np.uint8), np.float32([1, 2])])
def test_real_numbers_become_float64(value):
    got = validation.real_array("x", value, "n")
    assert got.dtype == np.float64
    assert got.tolist() == [1.0, 2.0]


@pytest.mark.parametrize("core", ["n", "m, n", "n, n"])
@pytest.mark.parametrize("batch", [(), (3,), (2, 1)])
def test_leading_axes_are_free(core, batch):
    shape = (*batch, *[2] * len(core.split(",")))
    assert validation.real_array("x", np.ones(shape), core).shape == shape


def test_rounding_is_no_asymmetry():
    """The symmetric part comes back; a difference beyond 1e-9 of the largest entry is an error."""
    slightly = np.array([[2.0, 1.0 + 1e-12], [1.0, 2.0]])
    got = validation.covariance("P", slightly, definite=True)
    assert_array_equal(got, got.T)
    with pytest.raises(ValueError, match="P must be symmetric; found a difference"):
        validation.covariance("P", slightly + np.triu(np.full((2, 2), 1e-8), 1), definite=True)


UNITS = pytest.mark.parametrize("units", [(1.0, 1.0), (1e-9, 1e9), (1e12, 1e-3)])


@pytest.mark.parametrize("scale", [1e-150, 1e-12, 1.0, 1e12, 1e150])
@UNITS
@pytest.mark.parametrize("correlation", [0.0, 0.999, -0.999999])
def test_units_do_not_decide_definiteness(scale, units, correlation):
    square = scale * np.outer(units, units)
    P = square * np.array([[1.0, correlation], [correlation, 1.0]])
    assert_array_equal(validation.covariance("P", P, definite=True), P)
    indefinite = square * np.array([[1.0, 1.001], [1.001, 1.0]])
    with pytest.raises(ValueError, match="P must be symmetric positive semidefinite"):
        validation.covariance("P", indefinite, definite=False)


@UNITS
def test_units_do_not_decide_symmetry(units):
    """Correlations of 0.5 and 0 across the diagonal, beside a component in much smaller units."""
    scale = np.outer([1e6, *units], [1e6, *units])
    P = scale * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
    with pytest.raises(ValueError, match="P must be symmetric; found a difference"):
        validation.covariance("P", P, definite=False)


@pytest.mark.parametrize("entry", [1e-12, 1e-8, 1.0, 1e6])
def test_what_does_not_vary_does_not_covary(entry):
    """[[0, c], [c, 1]] is indefinite for any c, in any units."""
    with pytest.raises(ValueError, match="P must be symmetric positive semidefinite"):
        validation.covariance("P", np.array([[0.0, entry], [entry, 1.0]]), definite=False)


@pytest.mark.parametrize("P", [np.zeros((2, 2)), np.ones((2, 2)), np.diag([1.0, 0.0])])
def test_semidefinite_is_not_definite(P):
    assert_array_equal(validation.covariance("P", P, definite=False), P)
    with pytest.raises(ValueError, match="P must be symmetric positive definite"):
        validation.covariance("P", P, definite=True)


def test_a_gaussian_is_checked_part_by_part():
    got = validation.gaussian("g", Gaussian([1, 2], [[1, 0], [0, 1]]))
    assert isinstance(got, Gaussian)
    assert got.mean.dtype == got.cov.dtype == np.float64
    with pytest.raises(ValueError, match=r"g\.mean"):
        validation.gaussian("g", Gaussian([np.nan, 2], np.eye(2)))
    with pytest.raises(
        ValueError, match=r"g\.cov must have shape \(\.\.\., 2, 2\); found \(3, 3\)"
    ):
        validation.gaussian("g", Gaussian([1, 2], np.eye(3)))


def test_batch_is_the_common_shape_or_an_error_that_names_each():
    assert validation.batch(a=(3, 1), b=(4,), c=()) == (3, 4)
    with pytest.raises(ValueError, match=r"found a \(3,\), b \(4,\)"):
        validation.batch(a=(3,), b=(4,))


def test_a_huge_covariance_is_no_overflow():
    P = 1.5e308 * np.eye(2)
    assert_array_equal(validation.covariance("P", P, definite=True), P)
