"""Range and bearing: values and derivatives against thirty digits, in every quadrant."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import atan2, diff, hypot, mp
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.models import RangeBearing

MODEL = RangeBearing(np.diag([2.5e-5, 6e-3]))
COMPONENTS = (lambda x1, x2: hypot(x1, x2), lambda x1, x2: atan2(x2, x1))


def points():
    """Three in each quadrant, over six decades of range, and the axes but the branch cut."""
    rng = np.random.default_rng(0)
    size = 10.0 ** rng.uniform(-2, 4, (12, 2))
    signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]] * 3)
    return np.concatenate([size * signs, [[3.0, 0.0], [0.0, 2.0], [0.0, -2.0]]])


each_point = pytest.mark.parametrize("x", points(), ids=lambda x: f"{x[0]:.3g},{x[1]:.3g}")


def derivative(component, x, order):
    with mp.workdps(30):
        return float(diff(component, (mp.mpf(x[0]), mp.mpf(x[1])), order))


@each_point
def test_h(x):
    with mp.workdps(30):
        wanted = [float(component(*map(mp.mpf, x))) for component in COMPONENTS]
    assert_allclose(MODEL.h(x), wanted, rtol=1e-15)


@each_point
def test_jacobian(x):
    wanted = [[derivative(c, x, order) for order in [(1, 0), (0, 1)]] for c in COMPONENTS]
    got = MODEL.jacobian(x)
    for row, theirs in zip(got, np.array(wanted), strict=True):
        assert_allclose(row, theirs, rtol=0, atol=1e-14 * np.abs(theirs).max())


@each_point
def test_hessian(x):
    orders = [[(2, 0), (1, 1)], [(1, 1), (0, 2)]]
    wanted = [[[derivative(c, x, o) for o in row] for row in orders] for c in COMPONENTS]
    got = MODEL.hessian(x)
    for matrix, theirs in zip(got, np.array(wanted), strict=True):
        assert_allclose(matrix, theirs, rtol=0, atol=1e-14 * np.abs(theirs).max())


@given(st.floats(-np.pi, np.pi), st.floats(-6, 6))
def test_derivatives_of_any_direction(angle, decade):
    """H is a rotation with its second row over r; h'' is symmetric, and the bearing is harmonic."""
    r = 10.0**decade
    x = r * np.array([np.cos(angle), np.sin(angle)])
    H, second = MODEL.jacobian(x), MODEL.hessian(x)
    scaled = H * np.array([[1.0], [r]])
    assert_allclose(scaled @ scaled.T, np.eye(2), atol=1e-14)
    assert_array_equal(second, second.mT)
    assert_allclose(np.trace(second[1]) * r**2, 0.0, atol=1e-14)
    assert_allclose(second[0] @ x, 0.0, atol=1e-14)  # the range is homogeneous of degree one


@pytest.mark.parametrize("batch", [(), (5,), (2, 3), (0,)])
def test_batch_axes_come_first(batch):
    x = np.random.default_rng(0).normal(size=(*batch, 2))
    assert MODEL.h(x).shape == (*batch, 2)
    assert MODEL.jacobian(x).shape == (*batch, 2, 2)
    assert MODEL.hessian(x).shape == (*batch, 2, 2, 2)
    for i in np.ndindex(batch):
        assert_allclose(MODEL.h(x)[i], MODEL.h(x[i]), rtol=1e-14)
        assert_allclose(MODEL.jacobian(x)[i], MODEL.jacobian(x[i]), rtol=1e-14)
        assert_allclose(MODEL.hessian(x)[i], MODEL.hessian(x[i]), rtol=1e-14)


def test_bearings_are_not_wrapped():
    """Across the negative x1 axis the bearing jumps by 2 pi; on it, it is pi."""
    above, on, below = MODEL.h(np.array([[-1.0, 1e-9], [-1.0, 0.0], [-1.0, -1e-9]]))[:, 1]
    assert_allclose([above, on, below], [np.pi, np.pi, -np.pi], atol=1e-8)


def test_the_origin_has_no_derivatives_and_stays_alone():
    x = np.array([[3.0, 4.0], [0.0, 0.0], [-5.0, 12.0]])
    with np.errstate(all="ignore"):
        H, second = MODEL.jacobian(x), MODEL.hessian(x)
    for got in (H, second):
        assert not np.isfinite(got[1]).any()
        assert np.isfinite(got[[0, 2]]).all()
    assert_array_equal(MODEL.h(x)[1], 0.0)


def test_lists_are_taken_and_the_model_is_frozen():
    model = RangeBearing([[1, 0], [0, 2]])
    assert model.R.dtype == np.float64
    with pytest.raises(AttributeError, match="cannot assign"):
        model.R = np.eye(2)


def test_noise_may_be_a_batch():
    assert RangeBearing(np.stack([np.eye(2)] * 3)).R.shape == (3, 2, 2)


REFUSED = {
    "one variance": (np.eye(1), r"R must have shape \(\.\.\., 2, 2\)", r"\(1, 1\)"),
    "variances": ([2.5e-5, 6e-3], "R must be an array", r"\(2,\)"),
    "NaN": (np.diag([1.0, np.nan]), "R must be an array", r"nan at index \(1, 1\)"),
    "complex": (np.eye(2) * 1j, "R must be an array", "complex128"),
    "asymmetric": ([[1.0, 0.1], [0.2, 1.0]], "R must be symmetric", "difference of 0.1"),
    "indefinite": ([[1.0, 2.0], [2.0, 1.0]], "R must be symmetric positive definite", "-1"),
    "singular": (np.diag([1.0, 0.0]), "R must be symmetric positive definite", "eigenvalue"),
    "one bad member": (
        np.stack([np.eye(2), -np.eye(2)]),
        "R must be symmetric positive definite",
        "-1",
    ),
}


@pytest.mark.parametrize(("R", "needed", "found"), REFUSED.values(), ids=REFUSED)
def test_the_constructor_refuses_by_name(R, needed, found):
    with pytest.raises(ValueError, match=f"{needed}.*found.*{found}"):
        RangeBearing(R)
