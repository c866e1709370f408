"""How small differences of position and velocity grow in a step: A = [0, I; G, V], written out."""

from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from navfilters.numerics.loops import repeat
from navfilters.numerics.small_matrices import members_first, members_last, product_of_last
from navfilters.types import Array

CACHED = 4000
"""Matrices worked on at a time: enough to amortise a call, few enough for the cache."""

FEW = 12
"""Terms that stand for all of a long series: over a third of a radian of an orbit, to 1e-14."""

Pair = tuple[Array, Array]
"""Differences of position and velocity, or their rates: arrays (3, k, ...), members last."""


def rates(G: Array, of_v: Callable[[Array], Array] | None, r: Array, v: Array) -> Pair:
    """How fast differences of position and velocity grow: v, and G r + V v.

    Parameters
    ----------
    G : array (3, 3, ...)
        Derivative of the acceleration with respect to position, s^-2.
    of_v : callable, optional
        v -> V v, with V the derivative with respect to velocity, s^-1; by default zero.
    r, v : array (3, k, ...)
        Differences of position, m, and of velocity, m/s.

    Returns
    -------
    tuple of array (3, k, ...)
        m/s and m/s^2.
    """
    of_r = product_of_last(G, r)
    return v, of_r if of_v is None else of_r + of_v(v)


def series(A: Callable[[Array, Array], Pair], h: float, order: int, r: Array, v: Array) -> Pair:
    """exp(h A) (r, v) to an order in h.

    Parameters
    ----------
    A : callable
        (r, v) -> their rates.
    h : float
        Length of the step, s.
    order : int
    r, v : array (3, k, ...)

    Returns
    -------
    tuple of array (3, k, ...)
    """
    grown = r, v
    for i in range(order, 0, -1):  # Horner's scheme: M + h A (M + h/2 A (M + h/3 A M))
        of_r, of_v = A(*grown)
        grown = r + (h / i) * of_r, v + (h / i) * of_v
    return grown


def third_order(hA: Array) -> Array:
    """exp(h A) to third order, (..., 6, 6)."""
    eye = hA.__array_namespace__().eye(6)
    return eye + hA @ (eye + hA @ (eye / 2 + hA / 6))


def forwards(
    step: Callable[[Array, Array], tuple[Array, Callable[[Array, Array], Pair]]],
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
        (k, x) -> the next x, and a function that makes F_k M of M's rows of position and velocity.
    x : array (..., 6)
        State at the start.
    count : int
    n : int
        Size of the derivative, that of the error: what it has beyond position and velocity stays.
    Q : array (..., n, n), optional
        Covariance of the noise after each step.

    Returns
    -------
    tuple of array (..., 6), array (..., n, n) and, given Q, array (..., n, n)
        x, F and W.

    Notes
    -----
    One loop, which JAX compiles once for all steps. NumPy is faster with :func:`to_end`.
    """
    xp, shape = x.__array_namespace__(), x.shape
    if Q is not None:  # which may have axes that no state has
        x = x[(None,) * (Q.ndim - 1 - x.ndim)]
    zero = 0 * x[..., 0]
    eye = xp.eye(n).reshape(n, n, *(1,) * zero.ndim) + zero
    start = [x, eye[:3, :6], eye[3:6, :6]]
    if Q is not None:
        added = members_last(Q + zero[..., None, None])
        start += [0 * added[:3], 0 * added[3:6]]

    def advance(k: Array, carry: tuple[Array, ...]) -> tuple[Array, ...]:
        x, r, v, *W = carry
        x, grow = step(k, x)
        return x, *grow(r, v), *(noisy(grow, *W) if W else ())

    def noisy(grow: Callable[[Array, Array], Pair], r: Array, v: Array) -> Pair:
        r, v = grow(r, v)
        turned = xp.concat([r, v])[:, :6].swapaxes(0, 1)
        parts = zip(grow(turned[:3], turned[3:]), (r, v), (added[:3], added[3:6]), strict=True)
        one, other = (xp.concat([M, rest[:, 6:]], axis=1) + q for M, rest, q in parts)
        return one, other

    x, r, v, *W = repeat(advance, tuple(start), count, xp)
    F = xp.concat([xp.concat([r, v]), eye[:6, 6:]], axis=1)
    found = x.reshape(shape), members_first(xp.concat([F, eye[6:]])).reshape(*shape[:-1], n, n)
    if Q is None:
        return found
    beside = xp.concat(W)
    below = xp.concat([beside[:, 6:].swapaxes(0, 1), count * added[6:, 6:]], axis=1)
    return *found, members_first(xp.concat([beside, below]))


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
