"""Square roots of stacks of small matrices, singular ones too."""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from matrix_stacks import assert_alone, broken, sizes, square, stacks
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.numerics.matrix_roots import keep_exact, semidefinite_root, symmetric_root
from navfilters.numerics.small_matrices import (
    cholesky,
)


@sizes
@pytest.mark.parametrize("shape", [(), (7,), (2, 3)])
def test_cholesky_is_lapacks(n, shape):
    A = covariances(np.random.default_rng(n), shape, n)
    assert_allclose(cholesky(A), np.linalg.cholesky(A), rtol=1e-12, atol=1e-14)


@sizes
def test_cholesky_reads_the_lower_triangle_only(n):
    A = covariances(np.random.default_rng(n), (3,), n)
    assert_array_equal(cholesky(np.tril(A)), cholesky(A))


@sizes
@pytest.mark.parametrize("shape", [(), (7,), (2, 3)])
def test_symmetric_root_is_the_principal_root(n, shape):
    A = covariances(np.random.default_rng(n), shape, n)
    S = symmetric_root(A)
    wanted = np.stack([scipy.linalg.sqrtm(a).real for a in A.reshape(-1, n, n)]).reshape(A.shape)
    assert_allclose(S, wanted, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("root", [cholesky, symmetric_root])
@pytest.mark.parametrize("n", [2, 3])
@given(data=st.data())
def test_roots_give_the_matrix_back(root, n, data):
    """S S^T = A to rounding, for any scale."""
    B = data.draw(square(n))
    A = (B @ B.T + 0.1 * np.eye(n)) * 10.0 ** data.draw(st.integers(-12, 12))
    S = root(A)
    assert_allclose(S @ S.T, A, rtol=0, atol=1e-14 * n * np.trace(A))


@pytest.mark.parametrize("n", [2, 3, 4])
@given(data=st.data())
def test_symmetric_root_is_symmetric_and_positive(n, data):
    B = data.draw(square(n))
    S = symmetric_root(B @ B.T + 0.1 * np.eye(n))
    assert_allclose(S, S.T, rtol=0, atol=1e-14 * np.trace(S))
    assert np.linalg.eigvalsh(S).min() > 0


@pytest.mark.parametrize("root", [cholesky, symmetric_root])
@sizes
@broken
def test_a_matrix_without_root_is_nan_alone(root, n, kind):
    healthy, bad = stacks(n, kind)
    alone = assert_alone(root, healthy, bad)
    assert not np.isfinite(alone[-1]).all()
    if root is symmetric_root:
        assert not np.isfinite(np.diagonal(alone)).any()


def singular_stack(rng, n, rank, count=6):
    """Semidefinite matrices of that rank, in units that differ by decades."""
    B = rng.normal(size=(count, n, rank)) * 10.0 ** rng.uniform(-2, 2, (count, n, 1))
    return B @ B.mT


@pytest.mark.parametrize(("n", "rank"), [(n, r) for n in range(1, 6) for r in range(n)])
def test_a_semidefinite_matrix_has_a_root(n, rank):
    A = singular_stack(np.random.default_rng(10 * n + rank), n, rank)
    S, T = semidefinite_root(A)
    size = np.sqrt(np.diagonal(A, axis1=-2, axis2=-1))
    allowed = 1e-13 * size[..., :, None] * size[..., None, :]
    assert (np.abs(S @ S.mT - A) <= allowed).all()
    assert (np.abs(T @ A @ T.mT - A) <= allowed).all()
    assert ((S != 0).any(axis=-2).sum(axis=-1) == rank).all()  # a column for each direction
    assert_array_equal(np.trace(T, axis1=-2, axis2=-1), np.full(len(A), rank))
    for found, alone in zip(semidefinite_root(A[:, None]), (S, T), strict=True):
        assert_array_equal(found, alone[:, None])


@sizes
def test_a_definite_matrix_has_the_cholesky_factor_to_the_last_bit(n):
    A = covariances(np.random.default_rng(n), (50,), n)
    S, T = semidefinite_root(A)
    assert T is None
    assert_array_equal(S, cholesky(A))
    mixed = A.copy()
    mixed[7] = 0
    S, T = semidefinite_root(mixed)
    others = np.arange(50) != 7
    assert_array_equal(S[others], cholesky(A)[others])
    assert_array_equal(T[others], np.broadcast_to(np.eye(n), (49, n, n)))
    assert_array_equal(S[7], np.zeros((n, n)))


def test_the_root_is_the_limit_of_cholesky_factors():
    A = np.array([[4.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 9.0]])
    S, _ = semidefinite_root(A)
    assert_allclose(S, cholesky(A + 1e-12 * np.eye(3)), atol=1e-5)
    assert_array_equal(S, np.tril(S))


def test_a_pivot_that_is_rounding_is_zero_though_all_others_are_whole():
    A = np.diag([1.0, 1 + 4 * np.finfo(float).eps, 1.0])
    A[0, 1] = A[1, 0] = 1.0
    S, T = semidefinite_root(A)
    assert_array_equal(S[:, 1], np.zeros(3))
    assert_array_equal(T[1], [1.0, 0.0, 0.0])


def test_a_row_that_waits_for_a_later_one():
    """x2 = x1 + 1e-8 x3: the second pivot is zero to rounding, its covariance with x3 is not."""
    B = np.array([[1.0, 0.0], [1.0, 1e-8], [0.0, 1.0]])
    S, T = semidefinite_root(B @ B.T)
    assert_allclose(S @ S.T, B @ B.T, rtol=0, atol=1e-16)
    assert_allclose(T[1], [1.0, 0.0, 1e-8], rtol=1e-12)


INDEFINITE = {
    "a little": np.diag([1.0, -1e-12]),
    "by the covariance": np.array([[1.0, 0.5], [0.5, 0.25 - 1e-12]]),
    "of what does not vary": np.array([[0.0, 1e-9], [1e-9, 1.0]]),
    "of what does not vary, last": np.array([[1.0, 1e-9], [1e-9, 0.0]]),
    "three": np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 1e-3], [0.0, 1e-3, 1.0]]),
}


@pytest.mark.parametrize("case", INDEFINITE)
def test_what_is_indefinite_has_no_root(case):
    S, T = semidefinite_root(INDEFINITE[case])
    assert T is None
    assert np.isnan(S).any()


@pytest.mark.parametrize("n", [2, 3, 4])
def test_the_symmetric_root_of_singular_matrices(n):
    A = singular_stack(np.random.default_rng(n), n, n - 1)
    A[2] = 0
    S = symmetric_root(A, np.ones(len(A), bool))
    assert_array_equal(S, S.mT) if n == 2 else assert_allclose(S, S.mT, atol=1e-12)
    assert_allclose(S @ S.mT, A, rtol=0, atol=1e-13 * np.abs(A).max())


def test_what_is_exact_stays_exact():
    """An update that takes twelve digits leaves the old rounding; the combination shall not."""
    rng = np.random.default_rng(0)
    B = np.concatenate([np.tile(np.eye(2), (20, 1, 1)), rng.uniform(-1, 1, (20, 2, 2))], axis=1)
    T = semidefinite_root(B @ B.mT)[1]
    after = 1e-12 * B @ B.mT
    rounding = 1e-16 * rng.normal(size=(20, 4, 4))
    kept = keep_exact(after + rounding + rounding.mT, T)
    assert_array_equal(kept, kept.mT)
    assert_allclose(kept, after, rtol=0, atol=1e-14)
    again, still = semidefinite_root(kept)
    assert np.isfinite(again).all()
    assert_array_equal(np.trace(still, axis1=-2, axis2=-1), np.full(20, 2.0))


def test_what_is_definite_is_left_alone():
    A = covariances(np.random.default_rng(1), (4,), 3)
    A[1] = np.inf
    T = np.broadcast_to(np.eye(3), (4, 3, 3))
    with np.errstate(all="ignore"):
        assert_array_equal(keep_exact(A, T), A)
