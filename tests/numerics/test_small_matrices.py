"""Stacks of small matrices: right against LAPACK, and a failing member stays alone."""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.numerics.matrix_roots import keep_exact, semidefinite_root, symmetric_root
from navfilters.numerics.small_matrices import (
    cholesky,
    is_positive_definite,
    matmul,
    matrix,
    outer_sum,
    right_divide,
    spectral_norm,
    vector,
)

entries = st.floats(-10, 10).map(lambda value: round(value, 6))  # no subnormal numbers
sizes = pytest.mark.parametrize("n", [1, 2, 3, 4])


def square(n):
    return arrays(np.float64, (n, n), elements=entries)


def symmetric(rng, shape, n):
    """Random symmetric matrices with eigenvalues of both signs, none near zero."""
    V, _ = np.linalg.qr(rng.normal(size=(*shape, n, n)))
    w = rng.uniform(0.5, 2.0, (*shape, 1, n)) * np.where(np.arange(n) % 2, 1, -1)
    A = (V * w) @ V.mT
    return (A + A.mT) / 2


BROKEN = {
    "NaN": lambda n: np.full((n, n), np.nan),
    "one NaN": lambda n: np.where(np.arange(n * n).reshape(n, n) == n * n - 1, np.nan, np.eye(n)),
    "infinite": lambda n: np.diag(np.full(n, np.inf)),
    "zero": lambda n: np.zeros((n, n)),
    "negative": lambda n: -np.eye(n),
    "indefinite": lambda n: np.diag([1.0] * (n - 1) + [-1.0]),
    "semidefinite": lambda n: np.ones((n, n)) - (n == 1),
}
broken = pytest.mark.parametrize("kind", BROKEN)


def stacks(n, kind):
    """Five healthy members, and the same stack with the third one broken."""
    healthy = covariances(np.random.default_rng(n), (5,), n)
    bad = healthy.copy()
    bad[2] = BROKEN[kind](n)
    return healthy, bad


def assert_alone(function, healthy, bad, member=2):
    """The broken member is NaN, the others are what they are without it, to the last bit."""
    with np.errstate(all="ignore"):
        got, wanted = function(bad), function(healthy)
    others = np.arange(len(healthy)) != member
    assert_array_equal(got[others], wanted[others])
    assert np.isfinite(wanted).all()
    return got[member]


# --- products -----------------------------------------------------------------------------------


SHAPES = [(n, k, m) for n in (1, 2, 3) for k in (1, 2, 3) for m in (1, 2, 3)]


@pytest.mark.parametrize(("n", "k", "m"), SHAPES)
def test_matmul_is_the_product(n, k, m):
    """Batch axes broadcast; two by two and larger."""
    rng = np.random.default_rng(n + 3 * k + 9 * m)
    A, B = rng.normal(size=(4, 1, n, k)), rng.normal(size=(5, k, m))
    got = matmul(A, B)
    assert got.shape == (4, 5, n, m)
    assert_allclose(got, A @ B, rtol=0, atol=1e-15 * k * np.abs(A).max() * np.abs(B).max())


@pytest.mark.parametrize(("n", "m"), [(n, m) for n in (1, 2, 3) for m in (1, 2, 3)])
@pytest.mark.parametrize("k", [1, 4])
def test_outer_sum_is_the_sum_of_outer_products(n, m, k):
    rng = np.random.default_rng(n + 3 * m)
    a, b = rng.normal(size=(k, 7, n)), rng.normal(size=(k, 7, m))
    got = outer_sum(a, b)
    assert got.shape == (7, n, m)
    for i in range(7):
        wanted = sum(np.outer(x, y) for x, y in zip(a[:, i], b[:, i], strict=True))
        assert_allclose(got[i], wanted, rtol=0, atol=1e-14)


def test_a_written_out_product_is_the_same_alone_and_among_others():
    """To the last bit, in any order of memory, and beside a member that is not finite."""
    rng = np.random.default_rng(0)
    A, B = rng.normal(size=(2, 501, 2, 2))
    a, b = rng.normal(size=(2, 4, 501, 2))
    products, sums = matmul(A, B), outer_sum(a, b)
    for i in (0, 250, 500):
        assert_array_equal(matmul(A[i], B[i]), products[i])
        assert_array_equal(outer_sum(a[:, i], b[:, i]), sums[i])
    innermost = [np.moveaxis(np.moveaxis(X, 0, -1).copy(), -1, 0) for X in (A, B)]
    assert_array_equal(matmul(*innermost), products)
    A[250, 0, 0] = np.nan
    assert_array_equal(np.delete(matmul(A, B), 250, 0), np.delete(products, 250, 0))


@pytest.mark.parametrize("shape", [(), (7,), (2, 3)])
def test_vectors_and_matrices_from_their_elements(shape):
    """Equal to what NumPy stacks; members innermost in memory, and still so after a product."""
    elements = list(np.random.default_rng(0).normal(size=(6, *shape)))
    v, M = vector(elements), matrix([elements[:3], elements[3:]])
    assert_array_equal(v, np.stack(elements, axis=-1))
    assert_array_equal(M, np.stack(elements, axis=-1).reshape(*shape, 2, 3))
    square = matrix([elements[:2], elements[2:4]])
    for array in (
        v,
        M,
        square,
        matmul(square, square.mT),
        outer_sum(v[None, ..., :2], v[None, ..., :2]),
    ):
        assert len(shape) == 0 or array.strides[len(shape) - 1] == array.itemsize


# --- square roots -------------------------------------------------------------------------------


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


# --- definiteness and norm ----------------------------------------------------------------------


@sizes
@broken
def test_broken_matrices_are_not_positive_definite(n, kind):
    _, bad = stacks(n, kind)
    with np.errstate(all="ignore"):
        assert is_positive_definite(bad).tolist() == [True, True, False, True, True]


@pytest.mark.parametrize("n", [1, 2, 3, 4])
@given(data=st.data())
def test_definiteness_is_the_sign_of_the_smallest_eigenvalue(n, data):
    B = data.draw(square(n))
    A = (B + B.T) / 2
    w = np.linalg.eigvalsh(A).min()
    assume(abs(w) > 1e-10)
    assert is_positive_definite(A) == (w > 0)


@sizes
@pytest.mark.parametrize("shape", [(), (7,), (2, 3)])
def test_spectral_norm_is_lapacks(n, shape):
    A = symmetric(np.random.default_rng(n), shape, n)
    assert_allclose(spectral_norm(A), np.linalg.norm(A, 2, axis=(-2, -1)), rtol=1e-13)


@pytest.mark.parametrize("n", [1, 2, 3])
@given(data=st.data())
def test_spectral_norm_of_any_symmetric_matrix(n, data):
    """Any signs and repeated eigenvalues; |c A| = |c| |A|."""
    B = data.draw(square(n))
    A = (B + B.T) / 2
    c = data.draw(st.sampled_from([-1.0, -1e-8, 1e8]))
    norm = np.linalg.norm(A, 2)
    assert_allclose(spectral_norm(A), norm, rtol=1e-13, atol=1e-300)
    assert_allclose(spectral_norm(c * A), abs(c) * norm, rtol=1e-13, atol=1e-300)


@sizes
@pytest.mark.parametrize("kind", ["NaN", "one NaN"])
def test_the_norm_of_a_nan_matrix_is_nan_alone(n, kind):
    assert np.isnan(assert_alone(spectral_norm, *stacks(n, kind)))


# --- division -----------------------------------------------------------------------------------


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


# --- roots of singular matrices -----------------------------------------------------------------


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
