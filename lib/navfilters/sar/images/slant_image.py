"""An image in the coordinates of the radar."""

from typing import NamedTuple

import numpy as np

from navfilters.numerics.doors import takes
from navfilters.types import Array


@takes(r="3", v="3", r_f="3", acceleration="3")
def effective_velocity(r: Array, v: Array, r_f: Array, acceleration: Array) -> Array:
    """The velocity of the hyperbola that a point's range follows, where the point is closest.

    V^2 = (R^2)'' / 2 = norm(v)^2 + (r - r_f) . a

    Parameters
    ----------
    r, v, acceleration : array (..., 3)
        Of the antenna, Earth-fixed, m, m/s, m/s^2.
    r_f : array (..., 3)
        The point, Earth-fixed, m.

    Returns
    -------
    array (...)
        m/s.

    Notes
    -----
    It is less than the in-track velocity, by 5 % in a low orbit, because the path is curved and the
    ground is closer to the centre of the curve.
    """
    return np.sqrt(np.sum(v * v + (r - r_f) * acceleration, axis=-1))


class Image(NamedTuple):
    """A single-look complex image.

    Parameters
    ----------
    pixels : array (lines, samples) of complex64
        One line for each pulse, in zero-Doppler time.
    first_time : float
        Of the first line, s.
    prf : float
        Lines in a second, Hz.
    near_range : float
        Slant range of the first sample, m: r_0.
    range_spacing : float
        dr, m.

    References
    ----------
    pogorelsky2020, Eqs. (1), (2).
    """

    pixels: Array
    first_time: float
    prf: float
    near_range: float
    range_spacing: float

    @property
    def centre_range(self) -> float:
        """Slant range of the centre pixel, r_0 + (k_c - 1) dr, m. Eq. (1), which counts from 1."""
        return self.near_range + self.pixels.shape[1] // 2 * self.range_spacing
