"""How small differences of position and velocity grow in a step: A = [0, I; G, V], written out."""

from collections.abc import Callable, Iterator

import numpy as np

from navfilters.numerics.loops import repeat
from navfilters.numerics.small_matrices import written_out
from navfilters.types import Array

CACHED = 2000
"""Matrices worked on at a time: enough to amortise a call, few enough for the cache."""


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


def coasting_transition(G: Array, h: float) -> Array:
    """exp(h A) to third order in h where no force depends on the velocity, under NumPy.

    [I + h^2/2 G, h I + h^3/6 G; h G + h^3/6 G^2, I + h^2/2 G]

    Parameters
    ----------
    G : array (..., 3, 3)
        Derivative of the acceleration with respect to position, s^-2, symmetric.
    h : float
        Length of the step, s.

    Returns
    -------
    array (..., 6, 6)
    """
    F = np.empty((*G.shape[:-2], 6, 6), G.dtype)
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        one, g = float(i == j), G[..., i, j]
        squared = sum(G[..., i, k] * G[..., k, j] for k in range(3))
        same = one + (h * h / 2) * g
        of_r, of_v = h * g + (h**3 / 6) * squared, one * h + (h**3 / 6) * g
        for a, b in {(i, j), (j, i)}:
            F[..., a, b] = F[..., 3 + a, 3 + b] = same
            F[..., 3 + a, b], F[..., a, 3 + b] = of_r, of_v
    return F


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
