"""The flight of an antenna, and how the ground sees it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from navfilters.numerics import validation
from navfilters.numerics.runge_kutta import runge_kutta
from navfilters.sar.ground.scene import View
from navfilters.space.frames import east_north_up, ecef_to_geodetic
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class Flight:
    """Position as a polynomial in time about an epoch.

    Parameters
    ----------
    path : tuple of numpy.polynomial.Polynomial
        Of time, s, to each Earth-fixed coordinate, m.
    """

    path: tuple[Polynomial, Polynomial, Polynomial]

    @classmethod
    def through(
        cls, derivative: Callable[[Array], Array], x: Array, span: float, step: float = 0.25
    ) -> "Flight":
        """The free flight through a state, by Runge-Kutta both ways.

        Parameters
        ----------
        derivative : callable
            dx/dt of x: ``EarthFixedOrbit.derivative``.
        x : array (6,)
            Earth-fixed position, m, and velocity, m/s, at the epoch.
        span : float
            Seconds before and after it.
        step : float
            Of the integration, s.

        Returns
        -------
        Flight
            A fit of degree 8, good to micrometres for 10 s of a low orbit.
        """
        x = validation.real_array("x", x, "6")
        if not (np.isfinite(span) and span > 0):
            raise ValueError(f"span must be a positive number of s; found {span}")
        n = max(int(np.ceil(span / step)), 5)
        states = {0: x}
        for sign in (-1, 1):
            for k in range(1, n + 1):
                states[sign * k] = runge_kutta(derivative, states[sign * (k - 1)], sign * span / n)
        t = np.arange(-n, n + 1) * (span / n)
        r = np.stack([states[i][:3] for i in range(-n, n + 1)]) - x[:3]
        fits = [Polynomial.fit(t, r[:, i], 8, domain=[-span, span]) + x[i] for i in range(3)]
        return cls((fits[0], fits[1], fits[2]))

    def position(self, t: Any) -> Array:
        """Earth-fixed, m.

        Parameters
        ----------
        t : array (...)
            s.

        Returns
        -------
        ndarray (..., 3)
        """
        return np.stack([p(np.asarray(t, float)) for p in self.path], axis=-1)

    def velocity(self, t: Any) -> Array:
        """Earth-fixed, m/s.

        Parameters
        ----------
        t : array (...)
            s.

        Returns
        -------
        ndarray (..., 3)
        """
        return np.stack([p.deriv()(np.asarray(t, float)) for p in self.path], axis=-1)

    def closest(self, p: Array) -> tuple[Array, Array]:
        """When points pass through the plane across the flight, and how far away they are then.

        Parameters
        ----------
        p : array (..., 3)
            Earth-fixed, m.

        Returns
        -------
        tuple of ndarray (...)
            Zero-Doppler time, s, and slant range, m.
        """
        p = np.asarray(p, float)
        t = np.zeros(p.shape[:-1])
        for _ in range(4):  # Newton: the second pass is good to micrometres
            v, ray = self.velocity(t), p - self.position(t)
            a = np.stack([q.deriv(2)(t) for q in self.path], axis=-1)
            t = t + np.sum(ray * v, axis=-1) / np.sum(v * v - ray * a, axis=-1)
        return t, np.linalg.norm(p - self.position(t), axis=-1)

    def ground_point(self, t: float, slant_range: float, height: float) -> Array:
        """The point to the right that is closest at a time, at a range, with a height.

        Parameters
        ----------
        t : float
            s.
        slant_range : float
            m.
        height : float
            Above the ellipsoid, m.

        Returns
        -------
        ndarray (3,)
            Earth-fixed, m.

        Raises
        ------
        ValueError
            A range at which there is no such point.
        """
        r, v = self.position(t), self.velocity(t)
        right = np.cross(v, r)
        right /= np.linalg.norm(right)
        down = np.cross(v, right)
        down /= -np.copysign(np.linalg.norm(down), down @ r)

        def point(look: float) -> Array:
            return r + slant_range * (np.cos(look) * down + np.sin(look) * right)

        def above(look: float) -> float:
            return float(ecef_to_geodetic(point(look))[2]) - height

        if above(0.0) > 0 or above(1.1) < 0:
            raise ValueError(
                f"slant_range must reach height {height} m; found {slant_range} m from "
                f"{ecef_to_geodetic(r)[2]:.0f} m up"
            )
        return point(brentq(above, 0.0, 1.1, xtol=1e-13))


def view_of(flight: Flight, centre: Array) -> View:
    """Where the radar is when a point is closest, over a flat Earth at that point.

    Parameters
    ----------
    flight : Flight
    centre : array (3,)
        Earth-fixed, m.

    Returns
    -------
    View
        Its heading is that of the line across the ray, on the ground.
    """
    t, R = flight.closest(centre)
    latitude, longitude, _ = ecef_to_geodetic(centre)
    ray = east_north_up(float(latitude), float(longitude)) @ (centre - flight.position(t))
    heading = np.arctan2(ray[0], ray[1]) - np.pi / 2  # the radar looks to the right
    return View(float(heading), float(np.arccos(-ray[2] / R)), float(R))
