"""Land cover, and how bright it is."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy import fft
from scipy.ndimage import map_coordinates

from navfilters.numerics.doors import takes
from navfilters.types import Array


def smooth_field(shape: tuple[int, int], correlation: float, rng: np.random.Generator) -> Array:
    """Standard normal numbers that vary smoothly, white noise through a Gaussian.

    Parameters
    ----------
    shape : tuple of int
    correlation : float
        Standard deviation of the Gaussian, cells. Opposite edges fit together.
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of float32
        Mean 0 and variance 1 over the ensemble.
    """
    rows, columns = (_smoothing(n, correlation) for n in shape)
    low = np.flatnonzero(columns[: shape[1] // 2 + 1])  # beyond is nothing to transform
    spectrum = fft.rfft(rng.standard_normal(shape, dtype=np.float32), axis=1)[:, low]
    spectrum *= columns[low]
    spectrum = fft.fft(spectrum, axis=0, overwrite_x=True)
    spectrum *= rows[:, None]
    spectrum = fft.ifft(spectrum, axis=0, overwrite_x=True)
    return fft.irfft(spectrum, shape[1], axis=1)


@lru_cache(maxsize=8)
def _smoothing(n: int, correlation: float) -> Array:
    """Gaussian in frequency, scaled so that the variance stays 1; zero where it would not count."""
    kernel = np.exp(-2 * (np.pi * correlation * fft.fftfreq(n)) ** 2)
    return np.where(kernel > 1e-9, kernel / np.sqrt(np.mean(kernel**2)), 0).astype(np.float32)


class CoverClass(NamedTuple):
    """A kind of ground.

    Parameters
    ----------
    share : float
        Bias of the class where classes compete: larger, more frequent.
    level : float
        Reflectivity, dB about the law of ``lambert``.
    texture : float
        Standard deviation within the class, dB.
    length : float
        Correlation of that texture, m.
    """

    share: float
    level: float
    texture: float
    length: float


COVER = {
    "water": CoverClass(-0.9, -11.0, 0.3, 200.0),
    "pasture": CoverClass(0.3, -4.0, 0.8, 80.0),
    "crops": CoverClass(0.0, 0.0, 1.2, 60.0),
    "forest": CoverClass(0.3, 4.0, 1.5, 30.0),
    "town": CoverClass(-0.9, 9.0, 3.0, 18.0),
}
"""Classes of the synthetic land cover; levels are of the order seen at L band."""

SPACING = 8.0
"""Of a drawn raster, m."""

PATCH = 120.0
"""Correlation length of the fields that compete, m: the size of a patch of one class."""


@dataclass(frozen=True, eq=False)
class LandCover:
    """Reflectivity of the ground on a raster about the middle of a local map.

    Parameters
    ----------
    reflectivity : array (n, n)
        Ratio to the law of ``lambert``; rows from south to north.
    spacing : float
        Of the raster, m.
    """

    reflectivity: Array
    spacing: float

    @classmethod
    def draw(cls, half_width: float, seed: Any) -> "LandCover":
        """Draw one: each class has a smooth random field, and the highest field wins.

        Parameters
        ----------
        half_width : float
            Of the square, m.
        seed : int or sequence of int

        Returns
        -------
        LandCover
        """
        if not (np.isfinite(half_width) and half_width > 0):
            raise ValueError(f"half_width must be a positive number of m; found {half_width}")
        n, rng = 2 * int(np.ceil(half_width / SPACING)) + 1, np.random.default_rng(seed)
        best = np.full((n, n), -np.inf, np.float32)
        level = np.zeros((n, n), np.float32)
        for kind in COVER.values():
            rank = kind.share + smooth_field((n, n), PATCH / SPACING, rng)
            mine = kind.level + kind.texture * smooth_field((n, n), kind.length / SPACING, rng)
            level = np.where(rank > best, mine, level)
            best = np.maximum(rank, best)
        return cls(10 ** (level / 10), SPACING)

    def at(self, east: Array, north: Array) -> Array:
        """Reflectivity of places, linear between the raster's.

        Parameters
        ----------
        east, north : array (...)
            m. Beyond the raster its edge continues.

        Returns
        -------
        ndarray (...) of float32
        """
        middle = (len(self.reflectivity) - 1) / 2
        where = [north / self.spacing + middle, east / self.spacing + middle]
        return map_coordinates(self.reflectivity, where, order=1, mode="nearest")


@takes(cosine="")
def lambert(cosine: Array) -> Array:
    """Backscatter of rough ground at a local incidence angle, 1 at 38.7 degrees.

    sigma ~ cos(theta)^2

    Parameters
    ----------
    cosine : array (...)
        Of the local incidence angle; 0 or less is ground that faces away and returns nothing.

    Returns
    -------
    ndarray (...)
        Ratio of powers for equal areas.

    Notes
    -----
    Gentle, as of vegetation. Laws with a specular peak (Muhleman's: 26 dB at normal incidence) let
    a few slopes that face the radar decide the sharpness of the whole image.
    """
    return (np.clip(cosine, 0.0, 1.0) / 0.7804) ** 2
