"""Sub-steps of an orbit by components, for the host: few calls of NumPy, and no copies.

To the last bit what :class:`~navfilters.space.gravity.Gravity` and the Runge-Kutta step give; what
accumulates over an interval but for rounding.
"""

from functools import lru_cache

import numpy as np

from navfilters.numerics.analytic import dot
from navfilters.space.gravity import Gravity
from navfilters.space.thrust import along_velocity
from navfilters.space.variations import (
    FEW,
    accumulated,
    all_to_end,
    few_of,
    middle,
    third_order,
)
from navfilters.types import Array

LONG = 4 * FEW
"""Sub-steps from which few of them stand for all."""

SLOW = 0.3
"""Radians that the orbit may turn by meanwhile."""


def increment(gravity: Gravity, x: Array, h: float, thrust: Array | None = None) -> np.ndarray:
    """What a Runge-Kutta step adds to a state.

    Parameters
    ----------
    gravity : Gravity
    x : array (..., 6)
        Position, m, and velocity, m/s.
    h : float
        Length of the step, s.
    thrust : array (...), optional
        Acceleration along the velocity, m/s^2.

    Returns
    -------
    array (..., 6)
    """
    # Position, velocity and acceleration at each stage: the last six are the derivative of the
    # first six, and none is put together. Numbers are arrays: NumPy asks a Python float for its
    # type at each call, which costs more than the product.
    batch = x.shape[:-1] or (1,)
    rows = x.transpose(-1, *range(x.ndim - 1)).reshape(6, *batch)
    stages = np.empty((4, 9, *batch), x.dtype)
    stages[0, :6] = rows
    half, whole, sixth = np.array(h / 2), np.array(h), np.array(h / 6)
    numbers = _numbers(gravity)
    for stage, later, ahead in zip(stages, stages[1:, :6], (half, half, whole), strict=False):
        _accelerate(numbers, stage, thrust)
        np.multiply(stage[3:], ahead, later)
        later += rows
    _accelerate(numbers, stages[3], thrust)
    k1, k, k3, k4 = stages[:, 3:]
    k += k3
    k += k  # twice
    k += k1
    k += k4
    k *= sixth
    return k.reshape(6, *x.shape[:-1]).transpose(*range(1, x.ndim), 0)


def _accelerate(numbers: tuple[np.ndarray, ...], stage: np.ndarray, thrust: Array | None) -> None:
    """Fill in the acceleration, whose place in memory serves until then."""
    mu, J2, one, five = numbers
    r, v, a = stage[:3], stage[3:6], stage[6:]
    along, of_J2, up = a
    np.multiply(r, r, a)
    along += of_J2
    along += up
    s = np.reciprocal(along, along)
    of_sphere = np.sqrt(s)
    of_sphere *= np.multiply(s, mu, of_J2)
    np.multiply(s, J2, of_J2)
    of_J2 *= of_sphere
    s *= five
    s *= up
    np.subtract(one, s, along)
    along *= of_J2
    along += of_sphere
    of_J2 += of_J2
    np.add(along, of_J2, up)
    up *= r[2]
    np.multiply(r[1], along, of_J2)
    along *= r[0]
    if thrust is not None:
        of_v = np.moveaxis(v, 0, -1)
        a += v * (thrust / np.sqrt(dot(of_v, of_v)))


@lru_cache(maxsize=16)
def _numbers(gravity: Gravity) -> tuple[np.ndarray, ...]:
    return tuple(np.array(number) for number in (-gravity.mu, gravity.of_J2, 1.0, 5.0))


def transitions(
    gravity: Gravity, path: Array, h: float, thrust: Array | None, *, turned: bool = False
) -> np.ndarray:
    """exp(h A) to third order in h, A between each state and the next.

    Where no force depends on the velocity it is
    [I + h^2/2 G, h I + h^3/6 G; h G + h^3/6 G^2, I + h^2/2 G].

    Parameters
    ----------
    gravity : Gravity
    path : array (k + 1, ..., 6)
        States a step apart: positions, m, and velocities, m/s.
    h : float
        Length of the step, s.
    thrust : array (k, ...), optional
        Acceleration along the velocity, m/s^2.
    turned : bool
        Whether its transpose is asked for.

    Returns
    -------
    array (k, ..., 6, 6)
    """
    F = np.empty((len(path) - 1, *path.shape[1:-1], 6, 6), path.dtype)
    out = F.mT if turned else F
    at = middle(path[:-1], path[1:], h)
    G = gravity.gradient_elements(at[..., 0], at[..., 1], at[..., 2])
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        one, g = float(i == j), G[i][j]
        squared = G[i][0] * G[0][j] + G[i][1] * G[1][j] + G[i][2] * G[2][j]
        same = one + (h * h / 2) * g
        of_r, of_v = h * g + (h**3 / 6) * squared, one * h + (h**3 / 6) * g
        for a, b in {(i, j), (j, i)}:
            out[..., a, b] = out[..., 3 + a, 3 + b] = same
            out[..., 3 + a, b], out[..., a, 3 + b] = of_r, of_v
    if thrust is not None:
        fires = thrust.reshape(len(thrust), -1).any(axis=1)
        A = np.zeros_like(F[fires])
        A[..., :3, 3:] = np.eye(3)
        for i in range(3):
            for j in range(3):
                A[..., 3 + i, j] = G[i][j][fires]
        A[..., 3:, 3:] = along_velocity(at[fires][..., 3:], thrust[fires])
        out[fires] = third_order(h * A)
    return F


def smooth_to_end(gravity: Gravity, path: Array, h: float) -> tuple[np.ndarray, np.ndarray]:
    """The derivatives of a coasting path's end; where the orbit is slow, from few transitions.

    Parameters
    ----------
    gravity, path, h : Gravity, array (k + 1, ..., 6), float
        As of :func:`transitions`: m, m/s and s.

    Returns
    -------
    tuple of array (k + 1, ..., 6, 6), bool array (...)
        As of :func:`~navfilters.space.variations.all_to_end`, but for rounding; and which members
        are fast, so that every transition of theirs was computed.
    """

    def each(k: int, part: Array) -> np.ndarray:
        return transitions(gravity, part, h, None, turned=True)

    count, batch = len(path) - 1, path.shape[1:-1]
    if count < LONG:
        return all_to_end(each, path, 6), np.ones(batch, bool)
    at, _, of_each = few_of(count)
    some = np.stack([path[at - 1], path[at]])
    known = transitions(gravity, some, h, None, turned=True).reshape(FEW, -1, 36).swapaxes(0, 1)

    def between(k: int, part: Array) -> np.ndarray:
        steps = len(part) - 1
        out = np.empty((steps, len(known), 36), known.dtype)
        # A product for each member: so small that BLAS starts no threads.
        np.matmul(of_each[k : k + steps], known, out=out.swapaxes(0, 1))
        return out.reshape(steps, *batch, 6, 6)

    turned = all_to_end(between, path, 6)
    r = some[1, ..., :3]
    nearest = np.sqrt(dot(r, r)).real.min(axis=0)
    fast = ~(np.sqrt(gravity.mu / nearest**3) * (h * count) < SLOW)
    if fast.any():
        turned[:, fast] = all_to_end(each, path[:, fast], 6)
    return turned, fast


def noise(turned: Array, fast: Array, Q: Array) -> Array:
    """The noise of all sub-steps at the end; where the orbit is slow, from few of its terms.

    Parameters
    ----------
    turned, fast : array (k + 1, ..., 6, 6), bool array (...)
        Of :func:`smooth_to_end`.
    Q : array (..., 6, 6)
        Covariance of each sub-step's noise.

    Returns
    -------
    array (..., 6, 6)
    """
    if fast.all():
        return accumulated(turned, Q)
    at, weights, _ = few_of(len(turned) - 1)
    W = accumulated(turned[[0, *at]], Q, weights)
    if fast.any():
        of_each = np.broadcast_to(Q, np.broadcast_shapes(Q.shape, turned.shape[1:]))
        W[..., fast, :, :] = accumulated(turned[:, fast], of_each[..., fast, :, :])
    return W
