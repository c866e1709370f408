"""Motion between measurements, with what a filter needs of it.

The state is position, m, velocity, m/s, and leak, m/s^2, in the axes of the sky; whatever follows
does not move.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from navfilters.space.gravity import EARTH
from navfilters.tracking.forces import Forces
from navfilters.types import Array

LEAK, BIASES = slice(6, 9), 9
"""Where leak and biases stand in the state."""


@dataclass(frozen=True, eq=False)
class Leg:
    """The motion between two measurements.

    Parameters
    ----------
    Q : array (..., 3, 3)
        Spectral density of a white acceleration, m^2/s^3.
    forces : Forces
    start, step : float
        s after the epoch, and s.
    count : int
        Steps; 0 where no time passes.
    """

    Q: Array
    forces: Forces
    start: float
    step: float
    count: int

    def f(self, x: Array) -> Array:
        """The state at the end, (..., n), by the Runge-Kutta rule of fourth order."""
        for i in range(self.count):
            x = self._step(self.start + i * self.step, x)
        return x

    def propagate(self, x: Array, Q: Array) -> tuple[Array, Array, Array]:
        """The state at the end, its Jacobian (..., n, n), and what Q amounts to, (..., n, n).

        The Jacobian is that of the gravity of an oblate Earth alone, in the middle of each step.
        """
        n = x.shape[-1]
        F, W = np.eye(9), np.zeros((9, 9))
        h = self.step
        grown = np.zeros((*Q.shape[:-2], 9, 9))
        grown[..., :3, :3], grown[..., 3:6, 3:6] = Q * (h**3 / 3), Q * h
        grown[..., :3, 3:6] = grown[..., 3:6, :3] = Q * (h**2 / 2)
        for i in range(self.count):
            before, x = x, self._step(self.start + i * h, x)
            over = _transition((before[..., :3] + x[..., :3]) / 2, h)
            F, W = over @ F, over @ W @ over.mT + grown
        members = np.broadcast_shapes(x.shape[:-1], W.shape[:-2])
        whole = np.zeros((2, *members, n, n))
        whole[0] = np.eye(n)
        whole[0, ..., :9, :9], whole[1, ..., :9, :9] = F, W
        return x, whole[0], whole[1]

    def hessian(self, x: Array) -> Array:
        """Second derivatives of the end, (..., n, n, n): differences of the Jacobian."""
        n = x.shape[-1]
        second = np.zeros((*x.shape[:-1], n, n, n))
        if self.count:
            size = np.array([1e4] * 3 + [1.0] * 3)
            apart = sides(size, x)
            F = self.propagate(np.stack([x + apart, x - apart]), np.zeros((3, 3)))[1]
            second[..., :6] = np.moveaxis(F[0] - F[1], 0, -1) / (2 * size)
            second = (second + second.mT) / 2
        return second

    def _step(self, t: float, x: Array) -> Array:
        r, v, leak, h = x[..., :3], x[..., 3:6], x[..., LEAK], self.step
        a1 = self.forces.acceleration(t, r, v) + leak
        v2 = v + (h / 2) * a1
        a2 = self.forces.acceleration(t + h / 2, r + (h / 2) * v, v2) + leak
        v3 = v + (h / 2) * a2
        a3 = self.forces.acceleration(t + h / 2, r + (h / 2) * v2, v3) + leak
        v4 = v + h * a3
        a4 = self.forces.acceleration(t + h, r + h * v3, v4) + leak
        r = r + (h / 6) * (v + 2 * (v2 + v3) + v4)
        v = v + (h / 6) * (a1 + 2 * (a2 + a3) + a4)
        return np.concatenate([r, v, x[..., 6:]], axis=-1)


def _transition(r: Array, h: float) -> Array:
    """The transition over a step at r, (..., 9, 9), the gravity gradient being constant."""
    G = EARTH.gradient(r)
    one = np.eye(3)
    total = np.zeros((*G.shape[:-2], 9, 9))
    square = G @ G
    total[..., :3, :3] = total[..., 3:6, 3:6] = one + h**2 / 2 * G + h**4 / 24 * square
    total[..., :3, 3:6] = total[..., 3:6, 6:] = h * one + h**3 / 6 * G
    total[..., 3:6, :3] = h * G + h**3 / 6 * square
    total[..., :3, 6:] = h**2 / 2 * one + h**4 / 24 * G
    total[..., 6:, 6:] = one
    return total


def sides(size: Array, x: Array) -> Array:
    """A step along each of the first components of x, (len(size), 1, ..., n)."""
    steps = np.zeros((len(size), *(1,) * (x.ndim - 1), x.shape[-1]))
    for j, length in enumerate(size):
        steps[j, ..., j] = length
    return steps


@dataclass(frozen=True, eq=False)
class Legs:
    """Dynamics from measurement to measurement.

    Parameters
    ----------
    Q : array (..., 3, 3)
        Spectral density of a white acceleration, m^2/s^3.
    leg : callable
        The leg that ends at measurement k, for a Q: (Q, k) -> Leg.
    """

    Q: Array
    leg: Callable[[Array, int], Leg]

    def at(self, k: int) -> Leg:
        """The leg that ends at measurement k."""
        return self.leg(self.Q, k)
