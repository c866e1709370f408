"""Thrust in the local axes of an orbit."""

from dataclasses import dataclass

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.analytic import dot
from navfilters.types import Array


@dataclass(frozen=True)
class Thrust:
    """A thruster that pushes along the inertial velocity, with one strength, in given arcs.

    Parameters
    ----------
    magnitude : float
        Acceleration, m/s^2, at least 0.
    arcs : tuple of (float, float)
        First and last second of each arc, in order of time.

    Raises
    ------
    ValueError
        A negative magnitude; arcs that are empty, overlap or are not in order.
    """

    magnitude: float
    arcs: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        magnitude = validation.number("magnitude", self.magnitude, least=0, needed="at least 0")
        object.__setattr__(self, "magnitude", magnitude)
        times = validation.real_array("arcs", self.arcs, "").reshape(-1)
        if 2 * len(self.arcs) != times.size or not (np.diff(times) >= 0).all():
            raise ValueError(f"arcs must be (start, end) pairs in order of time; found {self.arcs}")

    @property
    def coasts(self) -> bool:
        """Whether it never pushes."""
        return not (self.magnitude and self.arcs)

    def strength(self, t: Array) -> Array:
        """Acceleration at time t: the magnitude from an arc's start to before its end.

        Parameters
        ----------
        t : float or array (...)
            Seconds.

        Returns
        -------
        array (...)
            m/s^2.
        """
        xp = t.__array_namespace__() if hasattr(t, "__array_namespace__") else np
        start, end = np.reshape(np.asarray(self.arcs, float), (-1, 2)).T
        t = xp.asarray(t)[..., None]
        burns = xp.any((t >= xp.asarray(start)) & (t < xp.asarray(end)), axis=-1)
        return xp.where(burns, self.magnitude, 0.0)

    def strengths(self, times: Array, x: Array) -> Array | None:
        """Strength at each of a series of times, to go with states.

        Parameters
        ----------
        times : array (k, ...)
            Seconds; behind the first, leading axes of x.
        x : array (..., 6)

        Returns
        -------
        array (k, ...) or None
            m/s^2, with axes of length one for the other axes of x; None if it does not push.
        """
        if self.coasts:
            return None
        strength = self.strength(times)
        if isinstance(strength, np.ndarray) and not strength.any():
            return None
        strength = strength[(..., *(None,) * (x.ndim - strength.ndim))]
        return x.__array_namespace__().asarray(strength)


COASTING = Thrust(0.0, ())


def along_velocity(v: Array, thrust: Array) -> Array:
    """Derivative of an acceleration along the velocity with respect to it: it turns with it.

    Parameters
    ----------
    v : array (..., 3)
        m/s.
    thrust : array (...)
        Acceleration, m/s^2.

    Returns
    -------
    array (..., 3, 3)
        s^-1.
    """
    xp = v.__array_namespace__()
    speed = xp.sqrt(dot(v, v))
    u = v / speed[..., None]
    across = xp.eye(3) - u[..., :, None] * u[..., None, :]
    return (xp.asarray(thrust) / speed)[..., None, None] * across
