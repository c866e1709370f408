"""A point in the plane with range and bearing as its state."""

from dataclasses import dataclass
from typing import Any

from navfilters.models.range_bearing import RangeBearing
from navfilters.numerics.analytic import atan2, hypot
from navfilters.numerics.doors import takes
from navfilters.numerics.small_matrices import matmul, vector
from navfilters.numerics.state_derivatives import first_derivative
from navfilters.types import Array


@takes(x="n")
def to_polar(x: Array) -> Array:
    """Range and bearing, and their rates, of a place and its velocity.

    Parameters
    ----------
    x : array (..., 2) or (..., 4)
        (x1, x2), or with (v1, v2) behind.

    Returns
    -------
    array (..., 2) or (..., 4)
        (r, b), or with (r', b') behind; rad.
    """
    _check_size("x", x)
    x1, x2 = x[..., 0], x[..., 1]
    r, b = hypot(x1, x2), atan2(x2, x1)
    if x.shape[-1] == 2:
        return vector([r, b])
    v1, v2 = x[..., 2], x[..., 3]
    return vector([r, b, (x1 * v1 + x2 * v2) / r, (x1 * v2 - x2 * v1) / (r * r)])


@takes(p="n")
def to_cartesian(p: Array) -> Array:
    """The inverse of :func:`to_polar`.

    Parameters
    ----------
    p : array (..., 2) or (..., 4)

    Returns
    -------
    array (..., 2) or (..., 4)
    """
    _check_size("p", p)
    xp = p.__array_namespace__()
    r, c, s = p[..., 0], xp.cos(p[..., 1]), xp.sin(p[..., 1])
    if p.shape[-1] == 2:
        return vector([r * c, r * s])
    r_rate, turn = p[..., 2], r * p[..., 3]
    return vector([r * c, r * s, r_rate * c - turn * s, r_rate * s + turn * c])


def _check_size(name: str, x: Array) -> None:
    if x.shape[-1] not in (2, 4):
        raise ValueError(f"{name} must have shape (..., 2) or (..., 4); found {x.shape}")


@dataclass(frozen=True, eq=False)
class PolarState(RangeBearing):
    """Range and bearing of a point whose state is range and bearing: a linear measurement.

    Parameters
    ----------
    R : array (..., 2, 2)
        As of :class:`~navfilters.models.range_bearing.RangeBearing`.
    wrap : bool
        The same.

    Notes
    -----
    The state is that of :func:`to_polar`. Its bearing is not wrapped and counts turns; its range
    may become negative, and then looks in the opposite direction.

    References
    ----------
    aidala1983, for the idea; there of bearings alone.
    """

    def h(self, x: Array) -> Array:
        """The first two components, (..., 2)."""
        return x[..., :2]

    def jacobian(self, x: Array) -> Array:
        """(..., 2, n): the identity, and zeros."""
        xp = x.__array_namespace__()
        return xp.zeros((*x.shape[:-1], 2, x.shape[-1])) + xp.eye(2, x.shape[-1])

    def hessian(self, x: Array) -> Array:
        """Zeros, (..., 2, n, n)."""
        n = x.shape[-1]
        return x.__array_namespace__().zeros((*x.shape[:-1], 2, n, n))


@dataclass(frozen=True, eq=False)
class InPolar:
    """Dynamics of a place in the plane, for a filter whose state is polar.

    Parameters
    ----------
    dynamics : Dynamics
        Of the Cartesian state, (..., 2) or (..., 4), with ``f`` or ``transition``.

    Notes
    -----
    Q is the Cartesian one. It enters where the prediction ends, through the derivative there.
    """

    dynamics: Any

    @property
    def Q(self) -> Array:
        """Of the Cartesian state, (..., n, n)."""
        return self.dynamics.Q

    def at(self, k: Array) -> "InPolar":
        """The dynamics of step k."""
        return InPolar(self.dynamics.at(k)) if hasattr(self.dynamics, "at") else self

    def f(self, p: Array) -> Array:
        """The next polar state; its bearing within half a turn of the last."""
        xp, after = p.__array_namespace__(), to_polar(self._moved(to_cartesian(p)))
        turns = xp.round((after[..., 1].real - p[..., 1].real) / (2 * xp.pi))
        jump = 2 * xp.pi * turns[..., None] * (xp.arange(p.shape[-1]) == 1)
        return after - jump

    def propagate(self, p: Array, Q: Array) -> tuple[Array, Array, Array]:
        """f(p), its Jacobian, and what Q amounts to in polar coordinates."""
        after = self.f(p)
        F = first_derivative(self.f, p, "dynamics.f")
        J = first_derivative(to_polar, to_cartesian(after), "to_polar")
        return after, F, matmul(matmul(J, Q), J.mT)

    def _moved(self, x: Array) -> Array:
        if hasattr(self.dynamics, "f"):
            return self.dynamics.f(x)
        return self.dynamics.transition(x)[0]
