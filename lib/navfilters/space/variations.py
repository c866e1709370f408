"""How small differences of position and velocity grow in a step: A = [0, I; G, V], written out."""

from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from navfilters.numerics.loops import repeat
from navfilters.numerics.small_matrices import written_out
from navfilters.types import Array

CACHED = 4000
"""Matrices worked on at a time: enough to amortise a call, few enough for the cache."""

FEW = 12
"""Terms that stand for all of a long series: over a third of a radian of an orbit, to 1e-14."""


def rates(G: Array, V: Array | None, M: Array) -> Array:
    """A M, the rate of change of M, of which only position and velocity change.

    Parameters
    ----------
    G, V : array (..., 3, 3)
        Derivatives of the acceleration with respect to position, s^-2, and velocity, s^-1; a V of
        None is zero.
    M : array (..., n, k)
        n of at least 6.

    Returns
    -------
    array (..., n, k)
    """
    of_v = M[..., 3:6, :]
    of_a = written_out(G, M[..., :3, :])
    if V is not None:
        of_a = of_a + written_out(V, of_v)
    xp = M.__array_namespace__()
    return xp.concat([of_v, of_a, xp.zeros_like(M[..., 6:, :])], axis=-2)


def series(A: Callable[[Array], Array], h: float, order: int, M: Array) -> Array:
    """exp(h A) M to an order in h.

    Parameters
    ----------
    A : callable
        M -> A M.
    h : float
        Length of the step, s.
    order : int
    M : array (..., n, k)

    Returns
    -------
    array (..., n, k)
    """
    grown = M
    for i in range(order, 0, -1):  # Horner's scheme: M + h A (M + h/2 A (M + h/3 A M))
        grown = M + (h / i) * A(grown)
    return grown


def third_order(hA: Array) -> Array:
    """exp(h A) to third order, (..., 6, 6)."""
    eye = hA.__array_namespace__().eye(6)
    return eye + hA @ (eye + hA @ (eye / 2 + hA / 6))


def forwards(
    step: Callable[[Array, Array], tuple[Array, Callable[[Array], Array]]],
    x: Array,
    count: int,
    n: int,
    Q: Array | None = None,
) -> tuple[Array, ...]:
    """State, derivative and noise after some steps, from the first to the last.

    F <- F_k F,   W <- F_k W F_k^T + Q

    Parameters
    ----------
    step : callable
        (k, x) -> the next x, and a function M -> F_k M.
    x : array (..., m)
        State at the start.
    count : int
    n : int
        Size of the derivative, that of the error.
    Q : array (..., n, n), optional
        Covariance of the noise after each step.

    Returns
    -------
    tuple of array (..., m), array (..., n, n) and, given Q, array (..., n, n)
        x, F and W.

    Notes
    -----
    One loop, which JAX compiles once for all steps. NumPy is faster with :func:`to_end`.
    """
    xp = x.__array_namespace__()
    F = xp.zeros_like(x[..., :1])[..., None] + xp.eye(n)
    W = () if Q is None else (xp.zeros_like(F + Q),)

    def advance(k: Array, carry: tuple[Array, ...]) -> tuple[Array, ...]:
        x, F, *W = carry
        x, grow = step(k, x)
        return x, grow(F), *(grow(grow(w).mT) + Q for w in W)

    return repeat(advance, (x, F, *W), count, xp)


def to_end(transitions: Callable[[int, Array], Array], path: Array, n: int) -> Iterator[Array]:
    """Derivative of a path's last state with respect to each, from the last to the first.

    Parameters
    ----------
    transitions : callable
        (k, a part of the path that starts with its state k) -> the derivative of each of its
        states with respect to the one before, (..., n, n).
    path : array (k + 1, ..., m)
        States a step apart.
    n : int

    Yields
    ------
    array (..., n, n)
    """
    xp = path.__array_namespace__()
    Phi = xp.zeros_like(path[0, ..., :1])[..., None] + xp.eye(n)
    yield Phi
    size = max(1, CACHED // max(1, path[0, ..., 0].size))
    for first in reversed(range(0, path.shape[0] - 1, size)):
        for F in transitions(first, path[first : first + size + 1])[::-1]:
            Phi = Phi @ F
            yield Phi


def all_to_end(
    transposed: Callable[[int, Array], np.ndarray], path: np.ndarray, n: int
) -> np.ndarray:
    """The derivatives of :func:`to_end`, transposed, for the host.

    Parameters
    ----------
    transposed : callable
        As of :func:`to_end`, but it gives the transposes.
    path : array (k + 1, ..., m)
    n : int

    Returns
    -------
    array (k + 1, ..., n, n)
        In the order of the path: the last is the identity.
    """
    count, batch = len(path) - 1, path.shape[1:-1]
    turned = np.empty((count + 1, *batch, n, n), path.dtype)
    turned[count] = np.eye(n)
    size = max(1, CACHED // max(1, path[0, ..., 0].size))
    for first in reversed(range(0, count, size)):
        F = transposed(first, path[first : first + size + 1])
        for k in reversed(range(len(F))):
            np.matmul(F[k], turned[first + k + 1], out=turned[first + k])
    return turned


def accumulated(turned: np.ndarray, Q: Array, weights: np.ndarray | None = None) -> Array:
    """sum_k w_k Phi_k Q Phi_k^T, of a noise that enters after each step.

    Parameters
    ----------
    turned : array (k + 1, ..., n, n)
        Of :func:`all_to_end`.
    Q : array (..., n, n)
    weights : array (k,), optional
        1 by default.

    Returns
    -------
    array (..., n, n)
    """
    # Transposed, BLAS takes half the time: each term is (Phi (Phi Q)^T)^T, to the last bit.
    missing = max(0, Q.ndim - turned.ndim + 1)  # axes that only Q has, behind that of the steps
    turned = turned.reshape(len(turned), *(1,) * missing, *turned.shape[1:])
    Q_turned = np.ascontiguousarray(Q.mT)
    size = max(1, CACHED // max(1, turned[0, ..., 0, 0].size))
    W: Any = 0.0
    for first in range(1, len(turned), size):
        some = turned[first : first + size]
        right = Q_turned @ some
        if weights is not None:
            right *= weights[first - 1 :][: len(some)].reshape(-1, *(1,) * (right.ndim - 1))
        for term in some.mT @ right:
            W = W + term
    return W.mT


@lru_cache(maxsize=16)
def few_of(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where to look at a smooth function of 1 to count, and what its values there say of all.

    Parameters
    ----------
    count : int
        Several times ``FEW``.

    Returns
    -------
    tuple of int array (FEW,), array (FEW,), array (count, FEW)
        The places, whole numbers near the extrema of a Chebyshev polynomial; the weights of its
        sum; those of each value. Exact but for rounding of polynomials of a degree below ``FEW``.
    """
    ends = np.cos(np.pi * np.arange(FEW) / (FEW - 1))
    at = np.rint((count + 1) / 2 - (count - 1) / 2 * ends).astype(int)
    s = (2 * np.arange(1, count + 1) - count - 1) / (count - 1)
    values = np.polynomial.chebyshev.chebvander(s, FEW - 1)
    of_each = np.linalg.solve(values[at - 1].T, values.T).T
    return at, np.linalg.solve(values[at - 1].T, values.sum(axis=0)), of_each


def middle(x: Array, x_next: Array, h: float) -> Array:
    """Half a step on: the position is that of the cubic through both positions and velocities.

    Parameters
    ----------
    x, x_next : array (..., 6)
        Position, m, and velocity, m/s, a step apart.
    h : float
        Length of the step, s.

    Returns
    -------
    array (..., 6)
    """
    xp = x.__array_namespace__()
    mean = (x + x_next) / 2
    bend = (x[..., 3:] - x_next[..., 3:]) * (h / 8)
    return xp.concat([mean[..., :3] + bend, mean[..., 3:]], axis=-1)
