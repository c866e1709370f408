"""Linear algebra for stacks of small matrices.

Measurement-sized problems are written out, element by element over the batch axes: one LAPACK call
per matrix costs ten to thirty times the arithmetic, and raises for the whole stack when one member
fails. Here the member that fails becomes NaN, alone.
"""

from navfilters.types import Array


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
    xp = A.__array_namespace__()
    n = A.shape[-1]
    L = [[xp.zeros_like(A[..., 0, 0])] * n for _ in range(n)]
    for j in range(n):
        pivot = A[..., j, j] - sum(L[j][k] ** 2 for k in range(j))
        L[j][j] = xp.sqrt(xp.where(pivot > 0, pivot, xp.nan))
        for i in range(j + 1, n):
            L[i][j] = (A[..., i, j] - sum(L[i][k] * L[j][k] for k in range(j))) / L[j][j]
    return _stack(xp, L)


def symmetric_root(A: Array) -> Array:
    """Symmetric S with A = S S, the principal square root, for each matrix of a stack.

    Parameters
    ----------
    A : array (..., n, n)
        Symmetric.

    Returns
    -------
    array (..., n, n)
        NaN in the members that are not positive definite.

    Notes
    -----
    Two by two in closed form, S = (A + s I) / sqrt(tr A + 2 s) with s = sqrt(det A); otherwise from
    the eigenvalues, with the members that have none masked first.
    """
    xp = A.__array_namespace__()
    n = A.shape[-1]
    if n == 2:
        L = cholesky(A)
        s = L[..., 0, 0] * L[..., 1, 1]
        trace = A[..., 0, 0] + A[..., 1, 1]
        return (A + s[..., None, None] * xp.eye(2)) / xp.sqrt(trace + 2 * s)[..., None, None]
    definite = is_positive_definite(A)[..., None, None]
    w, V = xp.linalg.eigh(xp.where(definite, A, xp.eye(n)))
    S = (V * xp.sqrt(w)[..., None, :]) @ V.mT
    return xp.where(definite, S, xp.nan)


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
    xp = A.__array_namespace__()
    m = A.shape[-1]
    if m == 1:
        return B / A
    if m == 2:
        a, b, c, d = A[..., 0, 0], A[..., 0, 1], A[..., 1, 0], A[..., 1, 1]
        adjugate = _stack(xp, [[d, -b], [-c, a]])
        return (B @ adjugate) / (a * d - b * c)[..., None, None]
    return _solve(xp, A.mT, B.mT).mT


def _solve(xp, A: Array, B: Array) -> Array:
    """A^-1 B for a stack, by Gauss-Jordan elimination with partial pivoting."""
    m = A.shape[-1]
    batch = xp.broadcast_shapes(A.shape[:-2], B.shape[:-2])
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


def _stack(xp, rows: list) -> Array:
    """A matrix over the batch axes from a nested list of its elements."""
    return xp.stack([xp.stack(row, axis=-1) for row in rows], axis=-2)
