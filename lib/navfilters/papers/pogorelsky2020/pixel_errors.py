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

    The closer the slope is to facing the radar, the longer D is along it: without bound where it
    does.

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


def stretch(axes: Array, level: Array) -> Array:
    """By how much an error in distance displaces a pixel on a slope more than on level ground.

    Parameters
    ----------
    axes : array (..., 3, 3)
        Of the slope, see ``image_axes``.
    level : array (..., 3, 3)
        The same with the vertical for its normal.

    Returns
    -------
    array (...)
        Horizontally, across the flight. Below one where the slope turns away, negative where it is
        laid over.
    """
    up = level[..., 2, :]
    across = np.cross(level[..., 1, :], up)
    moved = [np.sum(across * np.linalg.inv(rows)[..., :, 0], axis=-1) for rows in (axes, level)]
    return moved[0] / moved[1]
