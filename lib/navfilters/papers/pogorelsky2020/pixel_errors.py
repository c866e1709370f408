"""Errors of a matched pixel: small in the image, and spread out where the ground leans to it."""

import numpy as np

from navfilters.numerics import validation
from navfilters.sar.ground.terrain import LocalMap, Terrain
from navfilters.space.frames import east_north_up
from navfilters.types import Array


def terrain_normal(terrain: Terrain, latitude: float, longitude: float) -> Array:
    """The direction that stands on the ground.

    Parameters
    ----------
    terrain : Terrain
    latitude, longitude : float
        Geodetic, deg.

    Returns
    -------
    array (3,)
        Earth-fixed, of length one, upwards; NaN where heights are not known.
    """
    here, step = LocalMap(latitude, longitude), 5.0  # m; between posts are 75
    east, north = (
        (terrain.height(*here.geodetic(*ahead)) - terrain.height(*here.geodetic(*-ahead)))
        / (2 * step)
        for ahead in step * np.eye(2)
    )
    normal = np.array([-float(east), -float(north), 1.0])
    return normal / np.linalg.norm(normal) @ east_north_up(latitude, longitude)


def image_axes(r_f: Array, r: Array, v: Array, normal: Array) -> Array:
    """The three directions along which the parts of a pixel's error are measured.

    Parameters
    ----------
    r_f : array (..., 3)
        The pixel, Earth-fixed, m.
    r, v : array (..., 3)
        The radar when the pixel was closest, m, m/s.
    normal : array (..., 3)
        Of the ground there.

    Returns
    -------
    array (..., 3, 3)
        In rows, of length one: line of sight, flight, normal. Times an error, they are what it is
        in the image's distance and in its time, and how far it leaves the ground.
    """
    rows = np.broadcast_arrays(np.asarray(r_f) - r, v, normal)
    return np.stack([row / np.linalg.norm(row, axis=-1, keepdims=True) for row in rows], axis=-2)


def pixel_covariance(axes: Array, sigma: Array) -> Array:
    """D of a pixel whose errors in the image are independent.

    D = A^-1 diag(sigma^2) A^-T

    On a slope alpha that faces a radar of incidence theta, D has a deviation of
    sigma_1 / sin(theta - alpha) up the slope: without bound where the two are equal.

    Parameters
    ----------
    axes : array (..., 3, 3)
        A, of ``image_axes``.
    sigma : array (3,)
        Deviations along the line of sight, along the flight and of the ground's height, m.

    Returns
    -------
    array (..., 3, 3)
        Earth-fixed, m^2.

    Raises
    ------
    ValueError
        Deviations that are negative, or not three.
    """
    sigma = validation.real_array("sigma", sigma, "3")
    if sigma.shape != (3,) or (sigma < 0).any():
        raise ValueError(f"sigma must be three numbers of at least 0; found {sigma}")
    spread = np.linalg.inv(axes) * sigma
    return spread @ spread.mT
