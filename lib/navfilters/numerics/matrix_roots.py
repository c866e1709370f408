"""Square roots of covariances, also of those that know a combination of states exactly."""

import importlib
from collections.abc import Callable
from functools import reduce
from operator import and_
from typing import Any

import numpy as np

from navfilters.numerics.loops import is_jax
from navfilters.numerics.small_matrices import (
    _deferred_cholesky,
    _rounding,
    cholesky,
    is_positive_definite,
    matmul,
)
from navfilters.types import Array


def semidefinite_root(A: Array) -> tuple[Array, Array | None]:
    """S with A = S S^T also for a singular A, and what such an A knows exactly.

    Parameters
    ----------
    A : array (..., n, n)
        Symmetric; only the lower triangle is read.

    Returns
    -------
    S : array (..., n, n)
        The Cholesky factor, to the last bit, where A is positive definite. Where it is semidefinite
        to rounding, the factor with a column of zeros for each pivot that is zero; NaN elsewhere.
    T : array (..., n, n) or None
        A = T A T^T. Rows of a member's T whose diagonal element is 0 say how a component of the
        state follows from the others, those with a 1 stand for themselves; the identity where A is
        not singular. None if, on the host, no member is.

    Notes
    -----
    A pivot is zero if it is at most 8 n eps of the diagonal element it is left of. Its row waits
    until the others are done, and is then a combination T of theirs, up to a residual of rounding;
    otherwise A is indefinite. A member is looked at only where the plain factor has such a pivot.
    """
    L, n = cholesky(A), A.shape[-1]
    pivots = range(1, n) if n > 1 else (0,)  # the first of several is the element itself
    large = [L[..., j, j] ** 2 > _rounding(n) * A[..., j, j] for j in pivots]  # NaN is not
    definite = reduce(and_, large)
    if not isinstance(A, np.ndarray):
        return _where_any(~definite, _compiled_root, _plain_root, A, L)
    if definite is np.True_ or definite.all():  # of one member it takes a tenth of the time
        return L, None
    look = ~definite & np.isfinite(A).all(axis=(-2, -1))
    S, T, singular = _deferred_cholesky(A[look])
    if not singular.any():
        return L, None
    some = singular[:, None, None]
    identity = np.broadcast_to(np.eye(A.shape[-1]), A.shape).copy()
    L[look], identity[look] = np.where(some, S, L[look]), np.where(some, T, identity[look])
    return L, identity


def _plain_root(A: Array, L: Array) -> tuple[Array, Array]:
    xp = A.__array_namespace__()
    return L, xp.broadcast_to(xp.eye(A.shape[-1]), A.shape)


def _compiled_root(A: Array, L: Array) -> tuple[Array, Array]:
    S, T, singular = _deferred_cholesky(A)
    xp, some = A.__array_namespace__(), singular[..., None, None]
    return xp.where(some, S, L), xp.where(some, T, xp.eye(A.shape[-1]))


def _where_any(
    some: Array, function: Callable[..., Any], otherwise: Callable[..., Any], *arrays: Array
) -> Any:
    """function(*arrays) if it is true of some member, else the cheaper otherwise(*arrays).

    What is right for all members is function; a branch that compiles saves it.
    """
    xp = some.__array_namespace__()
    if not is_jax(xp):
        return function(*arrays)
    cond = importlib.import_module("jax").lax.cond
    return cond(xp.any(some), function, otherwise, *arrays)


def keep_exact(P: Array, T: Array) -> Array:
    """P with the combinations that T knows: exact, whatever rounding did to P.

    P <- T P T^T in the members in which T is singular

    Parameters
    ----------
    P : array (..., n, n)
        A covariance after an update.
    T : array (..., n, n)
        Of the covariance before it, from :func:`semidefinite_root`.

    Returns
    -------
    array (..., n, n)
        Symmetric. Other members as they are, to the last bit.

    Notes
    -----
    An update that takes six digits from P leaves its rounding, and a combination without variance
    has that of the *old* P. What is put together from T is right to the rounding of the new one;
    so much is taken off its variance, that the next factor finds zero or less and never a little
    more.
    """
    known = P.__array_namespace__().linalg.diagonal(T) == 0
    return _where_any(known, _kept_exact, lambda P, T: P, P, T)


def _kept_exact(P: Array, T: Array) -> Array:
    xp, n = P.__array_namespace__(), P.shape[-1]
    known = xp.linalg.diagonal(T) == 0
    kept = matmul(matmul(T, P), T.mT)
    variance = xp.linalg.diagonal(P)
    deviation = xp.sqrt(xp.where(variance > 0, variance, 0.0))
    reach = matmul(xp.abs(T), deviation[..., None])[..., 0]
    less = xp.where(known, _rounding(n) * reach * reach, 0.0)
    kept = (kept + kept.mT) / 2 - less[..., None] * xp.eye(n)
    return xp.where(xp.any(known, axis=-1)[..., None, None], kept, P)


def symmetric_root(A: Array, singular: Array | None = None) -> Array:
    """Symmetric S with A = S S, the principal square root, for each matrix of a stack.

    Parameters
    ----------
    A : array (..., n, n)
        Symmetric.
    singular : bool array (...), optional
        Members that are semidefinite, as :func:`semidefinite_root` finds them. By default none.

    Returns
    -------
    array (..., n, n)
        NaN in the members that are neither positive definite nor named as singular.

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
        if singular is not None:
            s = xp.where(singular, 0.0, s)
        trace = A[..., 0, 0] + A[..., 1, 1]
        size = xp.sqrt(trace + 2 * s)
        if singular is not None:
            size = xp.where(singular & (trace == 0), 1.0, size)
        return (A + s[..., None, None] * xp.eye(2)) / size[..., None, None]
    usable = is_positive_definite(A)
    if singular is not None:
        usable = usable | singular
    w, V = xp.linalg.eigh(xp.where(usable[..., None, None], A, xp.eye(n)))
    if singular is not None:
        w = xp.where(w > 0, w, 0.0)
    S = (V * xp.sqrt(w)[..., None, :]) @ V.mT
    return xp.where(usable[..., None, None], S, xp.nan)
