"""z = (range, bearing) of a point in the plane, seen from the origin."""

from dataclasses import dataclass
from functools import partial
from math import pi

from navfilters.numerics import validation
from navfilters.numerics.analytic import atan2, hypot
from navfilters.numerics.in_floats import POINTS, in_floats
from navfilters.numerics.small_matrices import matrix, vector
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class RangeBearing:
    """Distance and angle of a point x = (x1, x2): z = (hypot(x1, x2), atan2(x2, x1)) + v.

    Parameters
    ----------
    R : array (..., 2, 2)
        Covariance of the noise v, symmetric positive definite: units squared, radians squared.
    wrap : bool
        Whether the residual of a bearing is brought to (-pi, pi].

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.

    Notes
    -----
    Bearings are in (-pi, pi]. Without ``wrap`` a filter that looks across the negative x1 axis sees
    a jump of 2 pi. At the origin the derivatives do not exist; they are not finite there.

    References
    ----------
    perea2007, section III.
    """

    R: Array
    wrap: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "R", validation.covariance("R", self.R, 2, definite=True))
        object.__setattr__(self, "wrap", validation.flag("wrap", self.wrap))

    def h(self, x: Array) -> Array:
        """Range and bearing, (..., 2).

        Parameters
        ----------
        x : array (..., 2)
            Position, in units.

        Returns
        -------
        array (..., 2)
            Range in units, bearing in radians.
        """
        return _polar(x)

    def residual(self, z: Array, z_hat: Array) -> Array:
        """z minus z_hat, (..., 2), the bearing's in (-pi, pi] with ``wrap``.

        Parameters
        ----------
        z, z_hat : array (..., 2)

        Returns
        -------
        array (..., 2)
        """
        return _wrapped(z, z_hat) if self.wrap else z - z_hat

    def jacobian(self, x: Array) -> Array:
        """First derivatives, (..., 2, 2): rows range and bearing, columns x1 and x2.

        Parameters
        ----------
        x : array (..., 2)

        Returns
        -------
        array (..., 2, 2)
        """
        return _derivatives(x)

    def hessian(self, x: Array) -> Array:
        """Second derivatives of range and of bearing, (..., 2, 2, 2).

        Parameters
        ----------
        x : array (..., 2)

        Returns
        -------
        array (..., 2, 2, 2)
        """
        xp = x.__array_namespace__()
        x1, x2 = x[..., 0], x[..., 1]
        r = hypot(x1, x2)
        c, s = x1 / r, x2 / r
        of_range = matrix([[s * s, -s * c], [-s * c, c * c]]) / r[..., None, None]
        sin_2, cos_2 = 2 * s * c, c * c - s * s
        of_bearing = matrix([[sin_2, -cos_2], [-cos_2, -sin_2]]) / (r * r)[..., None, None]
        return xp.moveaxis(xp.stack([of_range, of_bearing]), 0, -3)


@in_floats
def _polar(x: Array) -> Array:
    x1, x2 = x[..., 0], x[..., 1]
    return vector([hypot(x1, x2), atan2(x2, x1)])


@partial(in_floats, longest=POINTS)
def _wrapped(z: Array, z_hat: Array) -> Array:
    y = z - z_hat
    turns = y.__array_namespace__().ceil(y[..., 1] / (2 * pi) - 0.5)
    return vector([y[..., 0], y[..., 1] - 2 * pi * turns])


@in_floats
def _derivatives(x: Array) -> Array:
    x1, x2 = x[..., 0], x[..., 1]
    r = hypot(x1, x2)
    c, s = x1 / r, x2 / r
    return matrix([[c, s], [-s / r, c / r]])
