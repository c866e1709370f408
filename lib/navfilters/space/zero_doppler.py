"""The plane in which a focused image sees a point: a measurement that needs no antenna."""

from copy import copy
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.analytic import dot
from navfilters.space.image_sensor import Pixel
from navfilters.space.navigation_state import NavigationState
from navfilters.space.pose import difference, retract
from navfilters.types import Array

ROWS = (0, 1, 3, 4)
"""Where the antenna's four numbers stand among the five."""


class TimedMeasurement(NamedTuple):
    """What one image gives whose lines are timed.

    Parameters
    ----------
    r_f : array (..., 3)
        Earth-fixed position of the matched pixel, m.
    slant_range, speed : array (...)
        As of :class:`~navfilters.space.image_measurement.Measurement`, m, m/s.
    azimuth : array (...)
        How far ahead of the plane of zero Doppler the pixel stands, m: 0 for the line that was
        abeam when the image was taken.
    ratios : array (..., 2)
        Of the pixel in the antenna's axes: 0 for the centre of the beam.

    Notes
    -----
    Any of it may be NaN, which is not measured; without r_f nothing is.
    """

    r_f: Array
    slant_range: Array
    speed: Array
    azimuth: Array
    ratios: Array

    @property
    def z(self) -> Array:
        """All of it, (..., 8)."""
        xp = self.r_f.__array_namespace__()
        numbers = (
            xp.asarray(number)[..., None] for number in (self.slant_range, self.speed, self.azimuth)
        )
        return xp.concat([self.r_f, *numbers, self.ratios], axis=-1)


@dataclass(frozen=True, eq=False)
class ZeroDoppler:
    """An image's five numbers: those of the antenna, and the plane of zero Doppler.

    y = (x_s / z_s, y_s / z_s, (r_f - r) . v / norm(v), norm(r_f - r), norm(v))

    A point is focused where its distance is stationary, in Earth-fixed axes in the plane through
    the spacecraft at right angles to v. The time of its line is the measurement; which way the
    antenna points does not enter.

    Parameters
    ----------
    antenna : SarGeometry or SarPass
        Of the other four, with D.
    sigma_azimuth : float or array (...)
        Deviation of the third, m: that of the time of a line, times the speed at which the plane
        sweeps over the ground. At least 0.
    pointing : float or array (...)
        Deviation of white errors of the body's attitude about each axis, rad: added to the noise of
        the two ratios. At least 0.

    Raises
    ------
    ValueError
        A deviation that is negative or not finite.
    """

    antenna: Any
    sigma_azimuth: Array = field(metadata={"axes": 0})
    pointing: Array = field(default=0.0, metadata={"axes": 0})

    def __post_init__(self) -> None:
        for name in ("sigma_azimuth", "pointing"):
            sigma = validation.real_array(name, getattr(self, name), "")
            if (sigma < 0).any():
                raise ValueError(f"{name} must be at least 0; found {np.min(sigma)}")
            object.__setattr__(self, name, sigma)

    @property
    def R(self) -> Array:
        """Covariance of the noise of y, the pixel's error left out, (..., 5, 5)."""
        batch = np.broadcast_shapes(self.sigma_azimuth.shape, self.pointing.shape)
        R = np.zeros((*batch, 5, 5))
        R[..., np.array(ROWS)[:, None], np.array(ROWS)] = self.antenna.R
        R[..., 2, 2] = self.sigma_azimuth**2
        R[..., [0, 1], [0, 1]] += self.pointing[..., None] ** 2
        return R

    def at(self, k: Array) -> "ZeroDoppler":
        """That of image k, from 0, where the antenna's is a pass."""
        if not hasattr(self.antenna, "at"):
            return self
        here = copy(self)  # not replace(), which would check the values again
        object.__setattr__(here, "antenna", self.antenna.at(k))
        return here

    def h(self, state: NavigationState, r_f: Array) -> Array:
        """The expected y.

        Parameters
        ----------
        state : NavigationState
        r_f : array (..., 3)
            Earth-fixed position of the pixel, m.

        Returns
        -------
        array (..., 5)
            Two ratios, m, m, m/s.
        """
        xp, w = r_f.__array_namespace__(), _unit(state.v)
        azimuth = dot(r_f - state.r, w)[..., None]
        y = self.antenna.h(state, r_f)
        return xp.concat([y[..., :2], azimuth, y[..., 2:]], axis=-1)

    def jacobian(self, state: NavigationState, r_f: Array) -> Array:
        """H: derivative of y with respect to the errors in position, velocity and misalignment.

        Parameters
        ----------
        state : NavigationState
        r_f : array (..., 3)

        Returns
        -------
        array (..., 5, 9)
        """
        xp, w, d = r_f.__array_namespace__(), _unit(state.v), r_f - state.r
        speed = xp.sqrt(dot(state.v, state.v))[..., None]
        of_v = (d - dot(d, w)[..., None] * w) / speed
        H = self.antenna.jacobian(state, r_f)
        row = xp.concat([-w + 0 * of_v, of_v, 0 * of_v], axis=-1)[..., None, :]
        return _with_row(H, row)

    def pixel_jacobian(self, state: NavigationState, r_f: Array) -> Array:
        """Derivative of y with respect to the position of the pixel.

        Parameters
        ----------
        state : NavigationState
        r_f : array (..., 3)

        Returns
        -------
        array (..., 5, 3)
        """
        H_f = self.antenna.pixel_jacobian(state, r_f)
        return _with_row(H_f, _unit(state.v)[..., None, :])

    def noise(self, state: NavigationState, r_f: Array) -> Array:
        """R + H_f D H_f^T: the pixel's error is one error in all rows.

        Parameters
        ----------
        state : NavigationState
        r_f : array (..., 3)

        Returns
        -------
        array (..., 5, 5)
        """
        xp = r_f.__array_namespace__()
        H_f = self.pixel_jacobian(state, r_f)
        return xp.asarray(self.R) + H_f @ xp.asarray(self.antenna.D) @ H_f.mT

    def given(self, z: Array) -> tuple[Array, Pixel]:
        """What is compared with h, and the sensor that it makes: for a filter.

        Parameters
        ----------
        z : array (..., 8)
            ``TimedMeasurement.z``.

        Returns
        -------
        tuple of array (..., 5), Pixel
        """
        z = validation.core("z", validation.given("z", z), (8,))
        xp, r_f = z.__array_namespace__(), z[..., :3]
        lost = xp.any(xp.isnan(r_f), axis=-1)[..., None]
        y = xp.stack([z[..., i] for i in (6, 7, 5, 3, 4)], axis=-1)
        return xp.where(lost, xp.nan, y), Pixel(self, r_f)

    retract = staticmethod(retract)
    difference = staticmethod(difference)


def _unit(v: Array) -> Array:
    return v / v.__array_namespace__().sqrt(dot(v, v))[..., None]


def _with_row(matrix: Array, row: Array) -> Array:
    """A matrix (..., 4, n) with one more row, the third."""
    xp = matrix.__array_namespace__()
    batch = xp.broadcast_shapes(matrix.shape[:-2], row.shape[:-2])
    matrix, row = (xp.broadcast_to(a, (*batch, *a.shape[-2:])) for a in (matrix, row))
    return xp.concat([matrix[..., :2, :], row, matrix[..., 2:, :]], axis=-2)
