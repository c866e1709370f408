"""Stacks of small matrices: products, definiteness and norm."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from matrix_stacks import assert_alone, broken, sizes, square, stacks, symmetric
from numpy.testing import assert_allclose, assert_array_equal

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

SHAPES = [(n, k, m) for n in (1, 2, 3) for k in (1, 2, 3) for m in (1, 2, 3)]


@pytest.mark.parametrize(("n", "k", "m"), SHAPES)
def test_matmul_is_the_product(n, k, m):
    """Batch axes broadcast; two by two and larger."""
    rng = np.random.default_rng(n + 3 * k + 9 * m)
    A, B = rng.normal(size=(4, 1, n, k)), rng.normal(size=(5, k, m))
    got = matmul(A, B)
    assert got.shape == (4, 5, n, m)
    assert_allclose(got, A @ B, rtol=0, atol=1e-15 * k * np.abs(A).max() * np.abs(B).max())


@pytest.mark.parametrize(("n", "k", "m"), [(1, 3, 1), (6, 1, 2), (3, 6, 6), (6, 6, 5), (7, 7, 7)])
@pytest.mark.parametrize("batches", [((), ()), ((4, 1), (5,)), ((), (5,)), ((2, 5), (5,))], ids=str)
def test_matmul_is_the_product_compiled(n, k, m, batches):
    jax = pytest.importorskip("jax")
    rng = np.random.default_rng(0)
    A, B = (rng.normal(size=(*b, *c)) for b, c in zip(batches, ((n, k), (k, m)), strict=True))
    with jax.enable_x64(True):
        got = jax.jit(matmul)(A, B)
    assert_allclose(got, A @ B, rtol=0, atol=1e-14 * k, strict=True)


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


@pytest.mark.parametrize("broken", ["whole", "NaN", "infinite", "singular", "negative", "huge"])
def test_one_matrix_alone_has_the_bits_that_it_has_among_others(broken):
    """Alone it is computed by Python's floats, which raise where NumPy says infinite or NaN."""
    rng = np.random.default_rng(1)
    X, B = rng.normal(size=(2, 40, 2, 2))
    A = X @ X.mT
    A[:, 0, 1] = A[:, 1, 0]
    changes = {"NaN": np.nan, "infinite": np.inf, "negative": -1.0}
    if broken in changes:
        A[:, 1, 1] *= changes[broken]
    elif broken == "huge":
        A[:, 0, 1] = A[:, 1, 0] = 1e200
    elif broken == "singular":
        A[:] = A[:, :1, :1]
    with np.errstate(all="ignore"):
        for function in (lambda A, B: cholesky(A), right_divide, lambda A, B: matmul(B, A)):
            for together, one in zip(function(A, B), zip(A, B, strict=True), strict=True):
                assert_array_equal(function(*one), together)


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
