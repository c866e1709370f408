"""An image on the ground: looks, decibels, and the map."""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates

from navfilters.numerics import validation
from navfilters.numerics.doors import takes
from navfilters.sar.images.slant_image import Image
from navfilters.types import Array


def multilook(image: Image, azimuth: int = 4, in_range: int = 2) -> Array:
    """Mean intensity of neighbouring pixels.

    Parameters
    ----------
    image : Image
    azimuth, in_range : int
        How many lines and samples become one; by default the "2 x 4 looks" that make PALSAR's pixel
        13 m by 15 m on the ground. What is left over at the far ends is cut off.

    Returns
    -------
    ndarray (lines // azimuth, samples // in_range) of float32

    Raises
    ------
    ValueError
        Numbers that are not integers of at least 1, or exceed the image.
    """
    shape = image.pixels.shape
    for name, value, most in (("azimuth", azimuth, shape[0]), ("in_range", in_range, shape[1])):
        if validation.whole_number(name, value, 1) > most:
            raise ValueError(f"{name} must be at most {most} for this image; found {value}")
    rows, columns = shape[0] // azimuth, shape[1] // in_range
    cut = image.pixels[: rows * azimuth, : columns * in_range]
    power = cut.real**2 + cut.imag**2
    return power.reshape(rows, azimuth, columns, in_range).mean(axis=(1, 3))


@takes(power="")
def decibels(power: Array) -> Array:
    """Logarithmic scale, 10 log10.

    Parameters
    ----------
    power : array (...)
        Not negative. Zeros become as dark as the darkest that is not.

    Returns
    -------
    ndarray (...)
        dB.

    Raises
    ------
    ValueError
        Nothing above zero.
    """
    bright = power > 0
    if not bright.any():
        raise ValueError("power must be positive somewhere; found none above zero")
    return 10 * np.log10(np.where(bright | np.isnan(power), power, power[bright].min()))


class GroundImage(NamedTuple):
    """An image on the ground, as seen from above: the radar flew upwards on its left.

    Parameters
    ----------
    values : array (rows, columns) of float32
        dB; rows from late to early, columns away from the radar.
    pixel : float
        Side of a pixel, m.
    centre : tuple of int
        Row and column of what was the centre pixel of the image, exactly.
    incidence : float
        At the centre, rad.
    """

    values: Array
    pixel: float
    centre: tuple[int, int]
    incidence: float


def to_ground(
    image: Image,
    *,
    incidence: float,
    ground_speed: float,
    looks: tuple[int, int] = (4, 2),
    pixel: float = 10.0,
    radius: float = 6.371e6,
) -> GroundImage:
    """Multilooked, in dB, resampled to square pixels on ground of constant height.

    R(g)^2 = R_c^2 + 2 R_c g sin(theta) + g^2 (1 + R_c cos(theta) / radius),   t(s) = s / speed

    Parameters
    ----------
    image : Image
    incidence : float
        theta, at the centre pixel, rad.
    ground_speed : float
        Of the line across the flight on the ground, about V_eff^2 / norm(v), m/s.
    looks : tuple of int
        In azimuth and in range.
    pixel : float
        m.
    radius : float
        Of the Earth, m.

    Returns
    -------
    GroundImage
        Terrain that is higher than the centre lies closer to the radar in it than in truth. Lines
        of equal time are drawn square to the flight: on the turning Earth they are sheared, by
        0.5 % at most.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.
    """
    if not 0 < incidence < np.pi / 2:
        raise ValueError(f"incidence must be between 0 and pi/2 rad; found {incidence}")
    for name, value in (("ground_speed", ground_speed), ("pixel", pixel), ("radius", radius)):
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be a positive number; found {value}")
    power = multilook(image, *looks)
    lines, samples = image.pixels.shape
    dR, R_c = image.range_spacing, image.centre_range
    rows = int(0.495 * lines / image.prf * ground_speed / pixel)
    columns = int(0.495 * samples * dR / np.sin(incidence) / pixel)
    along = pixel * np.arange(rows, -rows - 1, -1)
    across = pixel * np.arange(-columns, columns + 1)
    bend = 1 + R_c * np.cos(incidence) / radius
    distance = np.sqrt(R_c**2 + 2 * R_c * np.sin(incidence) * across + bend * across**2)
    line = lines // 2 + along / ground_speed * image.prf
    sample = samples // 2 + (distance - R_c) / dR
    # a multilooked pixel is at the mean index of those in it
    where = [(line - (looks[0] - 1) / 2) / looks[0], (sample - (looks[1] - 1) / 2) / looks[1]]
    grid = np.meshgrid(*where, indexing="ij")
    values = map_coordinates(decibels(power), grid, order=1, mode="nearest")
    return GroundImage(values.astype(np.float32), pixel, (rows, columns), incidence)
