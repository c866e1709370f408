"""Constant offsets of what an image measures, as states behind those of the spacecraft."""

from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from navfilters.numerics import validation
from navfilters.space import pose
from navfilters.types import Array

POSE, ERRORS = 10, 9
"""How many numbers the state of the spacecraft has, and its error."""


def retract(x: Array, dx: Array) -> Array:
    """The state that differs by an error: the spacecraft's as in a pose, offsets by addition.

    Parameters
    ----------
    x : array (..., 10 + m)
        Position, m, velocity, m/s, unit quaternion, and m offsets.
    dx : array (..., 9 + m)

    Returns
    -------
    array (..., 10 + m)
    """
    moved = pose.retract(x[..., :POSE], dx[..., :ERRORS])
    return x.__array_namespace__().concat([moved, x[..., POSE:] + dx[..., ERRORS:]], axis=-1)


def difference(x: Array, y: Array) -> Array:
    """The error dx with which retract(y, dx) is x.

    Parameters
    ----------
    x, y : array (..., 10 + m)

    Returns
    -------
    array (..., 9 + m)
    """
    apart = pose.difference(x[..., :POSE], y[..., :POSE])
    return x.__array_namespace__().concat([apart, x[..., POSE:] - y[..., POSE:]], axis=-1)


@dataclass(frozen=True, eq=False)
class OffsetImages:
    """Images some of whose numbers are measured with an offset, the same in all of them.

    Parameters
    ----------
    sensor : ZeroDoppler, SarPass or SarGeometry
        Of the spacecraft's state alone.
    rows : tuple of int
        Which numbers of its y; one offset for each, in their units.

    Raises
    ------
    ValueError
        A row that is no number of one, or twice the same.
    """

    sensor: Any
    rows: tuple[int, ...]

    def __post_init__(self) -> None:
        rows = tuple(validation.whole_number("rows", row, 0) for row in self.rows)
        if len(set(rows)) < len(rows):
            raise ValueError(f"rows must be different ones; found {rows}")
        object.__setattr__(self, "rows", rows)

    @property
    def R(self) -> Array:
        """That of the sensor."""
        return self.sensor.R

    def at(self, k: Array) -> "OffsetImages":
        """Those of image k, from 0."""
        if not hasattr(self.sensor, "at"):
            return self
        here = copy(self)
        object.__setattr__(here, "sensor", self.sensor.at(k))
        return here

    def given(self, z: Array) -> tuple[Array, "OffsetPixel"]:
        """What is compared with h, and the sensor that it makes.

        Parameters
        ----------
        z : array (..., k)
            As the sensor takes it.

        Returns
        -------
        tuple of array (..., m), OffsetPixel
        """
        y, pixel = self.sensor.given(z)
        return y, OffsetPixel(pixel, self.rows)

    retract = staticmethod(retract)
    difference = staticmethod(difference)


@dataclass(frozen=True, eq=False)
class OffsetPixel:
    """The sensor of one image, with offsets.

    Parameters
    ----------
    pixel : Pixel
    rows : tuple of int
    """

    pixel: Any
    rows: tuple[int, ...]

    @property
    def R(self) -> Array:
        """That of the pixel."""
        return self.pixel.R

    def noise(self, x: Array) -> Array:
        """That of the pixel, at the state x (..., 10 + m)."""
        return self.pixel.noise(x[..., :POSE])

    def h(self, x: Array) -> Array:
        """The expected measurement, with the offsets in it."""
        xp, y = x.__array_namespace__(), self.pixel.h(x[..., :POSE])
        return y + (xp.asarray(self._places(y.shape[-1])) @ x[..., POSE:, None])[..., 0]

    def jacobian(self, x: Array) -> Array:
        """H, (..., m, 9 + m), by the error of the state."""
        xp, H = x.__array_namespace__(), self.pixel.jacobian(x[..., :POSE])
        places = xp.asarray(self._places(H.shape[-2]))
        return xp.concat([H, xp.broadcast_to(places, (*H.shape[:-1], len(self.rows)))], axis=-1)

    def _places(self, size: int) -> np.ndarray:
        return np.eye(size)[:, list(self.rows)]

    retract = staticmethod(retract)
    difference = staticmethod(difference)


@dataclass(frozen=True, eq=False)
class OffsetNavigation:
    """A spacecraft's dynamics, and offsets that stay.

    Parameters
    ----------
    dynamics : EarthFixedNavigation
    offsets : int
    """

    dynamics: Any
    offsets: int

    @property
    def Q(self) -> Array:
        """Covariance of the noise of one step, (..., 9 + m, 9 + m); none of the offsets'."""
        return self._padded(self.dynamics.Q, 0.0)

    def f(self, x: Array) -> Array:
        """The state after all steps."""
        return self._with_offsets(self.dynamics.f(x[..., :POSE]), x)

    def propagate(self, x: Array, Q: Array) -> tuple[Array, Array, Array]:
        """The same, F, and the covariance of the noise at the end: see the dynamics.

        Parameters
        ----------
        x : array (..., 10 + m)
        Q : array (..., 9 + m, 9 + m)

        Returns
        -------
        tuple of array (..., 10 + m), array (..., 9 + m, 9 + m), array (..., 9 + m, 9 + m)
        """
        moved, F, W = self.dynamics.propagate(x[..., :POSE], Q[..., :ERRORS, :ERRORS])
        return self._with_offsets(moved, x), self._padded(F, 1.0), self._padded(W, 0.0)

    def _with_offsets(self, moved: Array, x: Array) -> Array:
        return x.__array_namespace__().concat([moved, x[..., POSE:]], axis=-1)

    def _padded(self, square: Array, diagonal: float) -> Array:
        size = ERRORS + self.offsets
        whole = np.zeros((*square.shape[:-2], size, size)) + diagonal * np.eye(size)
        whole[..., :ERRORS, :ERRORS] = square
        return whole

    retract = staticmethod(retract)
    difference = staticmethod(difference)
