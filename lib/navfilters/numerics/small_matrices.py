"""Products, factors and solutions of small matrices, batched: written out where that is faster."""

import math
from functools import lru_cache, partial

import numpy as np

from navfilters.numerics.in_floats import POINTS, SMALL, in_floats
from navfilters.numerics.loops import is_jax, repeat
from navfilters.types import Array

WRITTEN_OUT = SMALL
"""Largest size of the matrices whose products are written out; above, BLAS is as fast."""

COMPILED = 6
"""The same under JAX, whose ``@`` on a processor is a call for each member: as fast from here."""


def matmul(A: Array, B: Array) -> Array:
    """A B, for each pair of a stack.

    Parameters
    ----------
    A : array (..., n, k)
    B : array (..., k, m)

    Returns
    -------
    array (..., n, m)

    Notes
    -----
    Up to 2 x 2 the sum of the products of A's columns and B's rows, so that a member's last bits
    depend neither on the others nor on their number; larger ones are left to ``@``, under JAX
    those above 6 x 6.
    """
    size = max(A.shape[-2], A.shape[-1], B.shape[-1])
    if size <= WRITTEN_OUT:
        return written_out(A, B)
    if size <= COMPILED and type(A) is not np.ndarray and is_jax(A.__array_namespace__()):
        return _by_members(A, B)
    single = type(A) is type(B) is np.ndarray and A.ndim == B.ndim == 2
    if single and A.flags.forc and B.flags.forc:
        return A.dot(B)  # the same call of BLAS in a third of the time
    return A @ B


@partial(in_floats, longest=POINTS)
def written_out(A: Array, B: Array) -> Array:
    """A B as a sum of products of A's columns and B's rows, whatever their size.

    Parameters
    ----------
    A : array (..., n, k)
    B : array (..., k, m)

    Returns
    -------
    array (..., n, m)
    """
    product = A[..., :1] * B[..., :1, :]
    for i in range(1, A.shape[-1]):
        product += A[..., i : i + 1] * B[..., i : i + 1, :]  # in place where that can be
    return product


def _by_members(A: Array, B: Array) -> Array:
    """The same for JAX, with the members innermost in memory: an instruction is one of several."""
    xp, batch = A.__array_namespace__(), max(A.ndim, B.ndim) - 2
    A, B = (members_last(M[(None,) * (batch + 2 - M.ndim)]) for M in (A, B))
    # Put together from halves, XLA writes it to memory. Else it would compute each element of this
    # product anew for every element of the next one.
    half = len(A) // 2
    parts = (A[:half], A[half:]) if half else (A,)
    return members_first(xp.concat([product_of_last(part, B) for part in parts]))


def product_of_last(A: Array, B: Array) -> Array:
    """A B of matrices with their members last, (n, k, ...) and (k, m, ...)."""
    product = A[:, 0, None] * B[0]
    for i in range(1, A.shape[1]):
        product = product + A[:, i, None] * B[i]
    return product


def stacked(rows: list[list[Array]]) -> Array:
    """A matrix (n, m, ...) from the rows of its elements (...)."""
    xp = rows[0][0].__array_namespace__()
    return xp.stack([xp.stack(row) for row in rows])


def members_last(M: Array) -> Array:
    """M (..., n, k) as (n, k, ...)."""
    return M.__array_namespace__().permute_dims(M, (M.ndim - 2, M.ndim - 1, *range(M.ndim - 2)))


def members_first(M: Array) -> Array:
    """M (n, k, ...) as (..., n, k)."""
    return M.__array_namespace__().permute_dims(M, (*range(2, M.ndim), 0, 1))


def identity(A: Array) -> Array:
    """The identity that has as many rows as A.

    Parameters
    ----------
    A : array (..., n, m)

    Returns
    -------
    array (n, n)
        Under NumPy the same one for all, which cannot be written to.
    """
    if isinstance(A, np.ndarray):
        return _identity(A.shape[-2])
    return A.__array_namespace__().eye(A.shape[-2])


@lru_cache
def _identity(n: int) -> np.ndarray:
    eye = np.eye(n)
    eye.flags.writeable = False
    return eye


def outer_sum(a: Array, b: Array) -> Array:
    """sum_i a_i b_i^T, for each pair of two series of stacks of vectors.

    Parameters
    ----------
    a : array (k, ..., n)
    b : array (k, ..., m)

    Returns
    -------
    array (..., n, m)

    Notes
    -----
    Up to 2 x 2 written out, as in :func:`matmul`.
    """
    xp = a.__array_namespace__()
    A = xp.permute_dims(a, (*range(1, a.ndim), 0))
    B = xp.permute_dims(b, (*range(1, b.ndim - 1), 0, b.ndim - 1))
    return written_out(A, B) if max(A.shape[-2], B.shape[-1]) <= WRITTEN_OUT else A @ B


def vector(elements: list[Array]) -> Array:
    """A vector over the batch axes, from its elements.

    Parameters
    ----------
    elements : list of array (...)

    Returns
    -------
    array (..., n)
        With the members innermost in memory.
    """
    xp = elements[0].__array_namespace__()
    if type(elements[0]) in (np.float64, np.ndarray) and elements[0].ndim == 0:
        return np.array(elements)  # of single numbers it takes a fifth of the time; no subclass
    v = xp.stack(elements)
    return xp.permute_dims(v, (*range(1, v.ndim), 0))


def matrix(rows: list[list[Array]]) -> Array:
    """A matrix over the batch axes, from the rows of its elements.

    Parameters
    ----------
    rows : list of list of array (...)

    Returns
    -------
    array (..., n, m)
        With the members innermost in memory.
    """
    v = vector([element for row in rows for element in row])
    return v.reshape(*v.shape[:-1], len(rows), len(rows[0]))


def cholesky(A: Array) -> Array:
    """Lower triangular L with A = L L^T, for each matrix of a stack.

    Parameters
    ----------
    A : array (..., n, n)
        Symmetric; only the lower triangle is read.

    Returns
    -------
    array (..., n, n)
        NaN from the first pivot that is not positive, in the members that have none.
    """
    n = A.shape[-1]
    alone = type(A) is np.ndarray and A.size == n * n and A.dtype.char == "d"
    if alone:
        a = A.reshape(n, n).tolist()
    else:
        a = [[A[..., i, j] for j in range(i + 1)] for i in range(n)]
    root = _root if alone else _roots
    zero = 0.0 if alone else a[0][0].__array_namespace__().zeros_like(a[0][0])
    L = [[zero] * n for _ in range(n)]
    for j in range(n):
        L[j][j] = root(a[j][j] - sum(L[j][k] * L[j][k] for k in range(j)))
        for i in range(j + 1, n):
            L[i][j] = (a[i][j] - sum(L[i][k] * L[j][k] for k in range(j))) / L[j][j]
    return np.array(L).reshape(A.shape) if alone else matrix(L)


def _root(pivot: float) -> float:
    return math.sqrt(pivot) if pivot > 0 else math.nan


def _roots(pivot: Array) -> Array:
    xp = pivot.__array_namespace__()
    return xp.sqrt(xp.where(pivot > 0, pivot, xp.nan))


def whitened_square(L: Array, y: Array) -> Array:
    """y^T (L L^T)^-1 y by forward substitution, for each pair of a stack.

    Parameters
    ----------
    L : array (..., n, n)
        Lower triangular, as of :func:`cholesky`.
    y : array (..., n)

    Returns
    -------
    array (...)
        NaN where L has no factor.
    """
    w: list[Array] = []
    for i in range(y.shape[-1]):
        w.append((y[..., i] - sum(L[..., i, j] * w[j] for j in range(i))) / L[..., i, i])
    return sum(x * x for x in w)


EPS = float(np.finfo(float).eps)


def _rounding(n: int) -> float:
    return 8 * n * EPS


def _deferred_cholesky(A: Array) -> tuple[Array, Array, Array]:
    """S, T and whether they are those of a singular, semidefinite member.

    Column by column, in loops that JAX compiles in a tenth of the time of elements written out.
    """
    xp, n, batch = A.__array_namespace__(), A.shape[-1], A.shape[:-2]
    front, back = (len(batch), len(batch) + 1, *range(len(batch))), (*range(2, A.ndim), 0, 1)
    lower = 1.0 * xp.where(xp.tril(xp.ones((n, n), dtype=bool)), A, A.mT)  # no whole numbers
    flat = xp.reshape(xp.permute_dims(lower, front), (-1,))  # the members innermost in memory
    a = xp.reshape(flat, (n, n, *batch))
    number, zero = xp.arange(n).reshape(n, *(1,) * len(batch)), xp.zeros_like(a[0])

    def put(X: Array, j: Array, diagonal: Array, others: Array) -> Array:
        column = xp.where(number == j, diagonal, others)
        if is_jax(xp):
            return X.at[:, j].set(column)
        X[:, j] = column
        return X

    def factor(j: Array, carry: tuple[Array, Array]) -> tuple[Array, Array]:
        S, live = carry
        rest = a[:, j] - repeat(lambda k, so_far: so_far + S[:, k] * S[j, k], zero, n, xp)
        alive = rest[j] > _rounding(n) * a[j, j]
        root = xp.sqrt(xp.where(alive, rest[j], 1.0))
        others = xp.where(alive & ~live, rest / root, 0.0)  # later rows, and those that wait
        S = put(S, j, xp.where(alive, root, 0.0), others)
        return S, xp.where(number == j, alive, live)

    def follow(last: Array, T: Array) -> Array:
        j = n - 1 - last
        of_later = repeat(lambda k, so_far: so_far + T[:, k] * S[k, j], zero, n, xp)
        others = (S[:, j] - of_later) / xp.where(live[j], S[j, j], 1.0)
        return put(T, j, xp.where(live[j], 1.0, 0.0), xp.where(live[j] & ~live, others, 0.0))

    S, live = repeat(factor, (xp.zeros_like(a), zero > 0), n, xp)
    T = repeat(follow, xp.zeros_like(a), n, xp)
    variance = xp.stack([a[j, j] for j in range(n)])
    deviation = xp.sqrt(xp.where(variance > 0, variance, 0.0))
    reach = repeat(lambda k, so_far: so_far + xp.abs(T[:, k]) * deviation[k], zero, n, xp)
    size = xp.where(reach > deviation, reach, deviation)
    whole = repeat(lambda k, so_far: so_far + S[:, None, k] * S[:, k], xp.zeros_like(a), n, xp)
    small = xp.abs(a - whole) <= 8 * _rounding(n) * (size[:, None] * size)
    singular = xp.all(live[:, None] | live | small, axis=(0, 1)) & ~xp.all(live, axis=0)
    return xp.permute_dims(S, back), xp.permute_dims(T, back), singular


def right_divide(B: Array, A: Array) -> Array:
    """B A^-1, for each pair of a stack.

    Parameters
    ----------
    B : array (..., n, m)
    A : array (..., m, m)
        Any invertible matrix. A P_zz need not be definite: the second-order filter subtracts
        from it.

    Returns
    -------
    array (..., n, m)
        NaN or infinite in the members whose A is singular.

    Notes
    -----
    m = 1 divides, m = 2 uses the adjugate, anything larger Gauss-Jordan elimination with the row of
    the largest pivot, chosen for each member on its own.
    """
    m = A.shape[-1]
    if m == 1:
        return B / A
    if m == 2:
        adjugate, determinant = _adjugate(A)
        return matmul(B, adjugate) / determinant
    return _solve(A.mT, B.mT).mT


@in_floats
def _adjugate(A: Array) -> tuple[Array, Array]:
    """That of 2 x 2, and the determinant (..., 1, 1)."""
    a, b, c, d = A[..., 0, 0], A[..., 0, 1], A[..., 1, 0], A[..., 1, 1]
    return matrix([[d, -b], [-c, a]]), (a * d - b * c)[..., None, None]


def _solve(A: Array, B: Array) -> Array:
    """A^-1 B for a stack, by Gauss-Jordan elimination with partial pivoting."""
    xp, m = A.__array_namespace__(), A.shape[-1]
    batch = A.shape[:-2]
    if B.shape[:-2] != batch:
        batch = xp.broadcast_shapes(batch, B.shape[:-2])
    if type(A) is type(B) is np.ndarray:
        return _by_elements(A, B, batch, m)
    work = xp.concat([xp.broadcast_to(X, (*batch, *X.shape[-2:])) for X in (A, B)], axis=-1)
    rows = xp.arange(m)
    for j in range(m):
        size = xp.where(rows >= j, xp.abs(work[..., :, j]), -1.0)
        pivot = xp.argmax(size, axis=-1)[..., None]
        order = xp.where(rows == j, pivot, xp.where(rows == pivot, j, rows))
        work = xp.take_along_axis(work, order[..., None], axis=-2)
        row = (work[..., j, :] / work[..., j, j, None])[..., None, :]
        work = xp.where((rows == j)[:, None], row, work - work[..., :, j, None] * row)
    return work[..., :, m:]


def _by_elements(A: np.ndarray, B: np.ndarray, batch: tuple[int, ...], m: int) -> np.ndarray:
    """The same under NumPy: each element over all members, and none that is not needed again."""
    work = np.empty((m, m + B.shape[-1], *batch), np.result_type(A, B))
    for part, X in ((work[:, :m], A), (work[:, m:], B)):
        elements = X.transpose(-2, -1, *range(X.ndim - 2))
        part[...] = elements[(slice(None), slice(None), *(None,) * (work.ndim - X.ndim))]
    for j in range(m):
        pivot = j + np.abs(work[j:, j]).argmax(axis=0)
        for i in range(j + 1, m):
            if (swap := pivot == i) is not np.False_ and swap.any():
                one, other = work[j, j:].copy(), work[i, j:]
                work[j, j:] = np.where(swap, other, one)
                work[i, j:] = np.where(swap, one, other)
        work[j, j + 1 :] /= work[j, j]
        for i in {*range(m)} - {j}:
            work[i, j + 1 :] -= work[i, j] * work[j, j + 1 :]
    return np.ascontiguousarray(work[:, m:].transpose(*range(2, work.ndim), 0, 1))


def spectral_norm(A: Array) -> Array:
    """Largest absolute eigenvalue of symmetric A, for each matrix of a stack.

    Parameters
    ----------
    A : array (..., n, n)
        Symmetric.

    Returns
    -------
    array (...)
        NaN in the members that hold a NaN.
    """
    xp = A.__array_namespace__()
    if A.shape[-1] == 2:
        a, b, c = A[..., 0, 0], A[..., 0, 1], A[..., 1, 1]
        return xp.abs(a + c) / 2 + xp.hypot((a - c) / 2, b)
    finite = xp.all(xp.isfinite(A), axis=(-2, -1))
    w = xp.linalg.eigvalsh(xp.where(finite[..., None, None], A, xp.eye(A.shape[-1])))
    return xp.where(finite, xp.max(xp.abs(w), axis=-1), xp.nan)


def is_positive_definite(A: Array) -> Array:
    """Whether each matrix of a stack has a Cholesky factor.

    Parameters
    ----------
    A : array (..., n, n)
        Symmetric.

    Returns
    -------
    bool array (...)
    """
    xp = A.__array_namespace__()
    return xp.all(xp.isfinite(cholesky(A)), axis=(-2, -1))
