"""Division by stacks of small matrices: right against LAPACK, and a failing member stays alone."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matrix_stacks import assert_alone, entries, square, stacks, symmetric
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.numerics.small_matrices import (
    right_divide,
)


def matrices(kind, m):
    rng = np.random.default_rng(m)
    if kind == "definite":
        return covariances(rng, (6,), m)
    if kind == "indefinite":
        return symmetric(rng, (6,), m)
    general = rng.normal(size=(6, m, m)) + 2 * np.linalg.qr(rng.normal(size=(6, m, m)))[0]
    if kind == "zero leading pivot":
        # A unit antidiagonal dominates, the upper left corner is zero: no elimination starts here.
        general = 0.2 * general + np.eye(m)[::-1]
        general[:, 0, 0] = 0.0
    return general


KINDS = ["definite", "indefinite", "general", "zero leading pivot"]


@pytest.mark.parametrize(
    ("kind", "m"),
    [(k, m) for k in KINDS for m in range(1, 6) if (k, m) != ("zero leading pivot", 1)],
)
@pytest.mark.parametrize("n", [1, 3])
def test_right_divide_is_lapacks(kind, m, n):
    A = matrices(kind, m)
    B = np.random.default_rng(10 + n).normal(size=(6, n, m))
    wanted = np.linalg.solve(A.mT, B.mT).mT
    got = right_divide(B, A)
    assert_allclose(got, wanted, rtol=0, atol=1e-11 * np.abs(wanted).max())


@pytest.mark.parametrize("m", [2, 3, 4])
def test_right_divide_by_a_permutation_is_exact(m):
    """Every order of pivots, zeros included, for each member on its own."""
    rng = np.random.default_rng(m)
    A = np.stack([np.eye(m)[rng.permutation(m)] for _ in range(20)])
    B = rng.normal(size=(20, 2, m))
    assert_array_equal(right_divide(B, A), B @ A.mT)


@pytest.mark.parametrize("m", [3, 4])
def test_right_divide_takes_the_largest_pivot(m):
    """A tiny pivot that is not exchanged would leave no digits."""
    A = np.eye(m)
    A[:2, :2] = [[1e-20, 1.0], [1.0, 1.0]]
    B = np.arange(1.0, 2 * m + 1).reshape(2, m)
    assert_allclose(right_divide(B, A), np.linalg.solve(A.T, B.T).T, rtol=1e-14)


@pytest.mark.parametrize("m", [1, 2, 3, 4])
@given(data=st.data())
def test_right_divide_undoes_the_product(m, data):
    """(X A) A^-1 = X within the condition number's rounding."""
    A = data.draw(square(m))
    X = data.draw(arrays(np.float64, (2, m), elements=entries))
    w = np.linalg.svd(A)[1]
    assume(w[0] < 1e6 * w[-1])
    condition = w[0] / w[-1]
    assert_allclose(right_divide(X @ A, A), X, rtol=0, atol=1e-13 * condition)


@pytest.mark.parametrize("m", [1, 2, 3])
def test_right_divide_broadcasts_batch_axes(m):
    rng = np.random.default_rng(m)
    A, B = covariances(rng, (4,), m), rng.normal(size=(3, 1, 2, m))
    got = right_divide(B, A)
    assert got.shape == (3, 4, 2, m)
    for i, j in np.ndindex(3, 4):
        assert_allclose(got[i, j], right_divide(B[i, 0], A[j]), rtol=1e-13)


@pytest.mark.parametrize("m", [1, 2, 3, 4])
@pytest.mark.parametrize("kind", ["NaN", "zero"])
def test_a_singular_matrix_is_not_finite_alone(m, kind):
    healthy, bad = stacks(m, kind)
    B = np.ones((5, 2, m))
    assert not np.isfinite(assert_alone(lambda A: right_divide(B, A), healthy, bad)).any()
