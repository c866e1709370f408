"""The velocity at which two halves of the aperture see the same picture: map drift."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import fft

from navfilters.numerics import validation
from navfilters.sar.images.focuser import Focuser
from navfilters.sar.images.slant_image import Image
from navfilters.types import Array

FINER = 8
"""Places of the correlation for each line, before a parabola."""


class Drift(NamedTuple):
    """How far two looks of an image lie apart.

    Parameters
    ----------
    seconds : float
        By which the look of higher Doppler frequencies is later than the other, s.
    apart : float
        Between the mean Doppler frequencies of the two looks, Hz.
    """

    seconds: float
    apart: float


def look_drift(image: Image, doppler_centroid: float = 0.0) -> Drift:
    """Split an image's Doppler spectrum in two halves, and correlate the two pictures.

    Parameters
    ----------
    image : Image
        Cut or whole; at least 8 lines.
    doppler_centroid : float
        Where the spectrum is split, Hz.

    Returns
    -------
    Drift
        Of the highest correlation of the two intensities along the flight, over all ranges; between
        lines by a parabola.

    Raises
    ------
    ValueError
        Too few lines, or a half without power.

    References
    ----------
    carrara1995, chapter 6; cumming2005, where the looks' misregistration gives the Doppler rate.
    """
    lines = validation.whole_number("the image's number of lines", image.pixels.shape[0], 8)
    spectrum = fft.fft(image.pixels, axis=0, workers=2)
    f = fft.fftfreq(lines, 1 / image.prf)
    f = (f - doppler_centroid + image.prf / 2) % image.prf - image.prf / 2
    power = np.sum(spectrum.real**2 + spectrum.imag**2, axis=1, dtype=float)
    means, looks = list[float](), list[Array]()
    for half in (f < 0, f > 0):
        if not power[half].sum() > 0:
            raise ValueError("image must have power on both sides of doppler_centroid; found none")
        means.append(float(np.average(f[half], weights=power[half])))
        look = fft.ifft(spectrum * half[:, None], axis=0, workers=2)
        intensity = look.real**2 + look.imag**2
        looks.append(fft.rfft(intensity - intensity.mean(axis=0), axis=0, workers=2))
    both = fft.irfft(np.sum(np.conj(looks[0]) * looks[1], axis=1), FINER * lines)
    best = int(np.argmax(both))
    before, here, after = (float(both[(best + i) % len(both)]) for i in (-1, 0, 1))
    curved = before - 2 * here + after
    place = best + (0.5 * (before - after) / curved if curved < 0 else 0.0)
    place = (place / FINER + lines / 2) % lines - lines / 2
    return Drift(place / image.prf, means[1] - means[0])


def drift_to_velocity(
    drift: Drift, velocity: float, slant_range: float, wavelength: float
) -> float:
    """Assumed minus true effective velocity.

    A velocity that is dV too fast leaves the phase pi R wavelength f^2 dV / V^3, which moves what
    comes at the frequency f by R wavelength f dV / V^3 seconds to earlier times.

    Parameters
    ----------
    drift : Drift
    velocity : float
        That the image was focused with, m/s.
    slant_range : float
        m.
    wavelength : float
        m.

    Returns
    -------
    float
        m/s.
    """
    return -drift.seconds * velocity**3 / (slant_range * wavelength * drift.apart)


class Drifting(NamedTuple):
    """Where map drift ended.

    Parameters
    ----------
    speed : float
        m/s; NaN if the last correction was not smaller than the one before.
    path : tuple of float
        All speeds at which an image was focused, m/s.
    """

    speed: float
    path: tuple[float, ...]


def map_drift(
    focuser: Focuser,
    start: float,
    effective: Callable[[float], float],
    *,
    passes: int = 3,
    slope: float = 0.0,
) -> Drifting:
    """Focus, measure how far the two looks lie apart, correct the velocity, and again.

    Parameters
    ----------
    focuser : Focuser
    start : float
        In-track velocity that is predicted, m/s.
    effective : callable
        In-track velocity -> effective velocity, m/s: see ``effective_velocity``.
    passes : int
        Images that are focused.
    slope : float
        See ``Focuser.image``.

    Returns
    -------
    Drifting

    References
    ----------
    carrara1995, chapter 6.
    """
    validation.whole_number("passes", passes, 1)
    speed, path, last = float(start), list[float](), np.inf
    for _ in range(passes):
        path.append(speed)
        velocity = effective(speed)
        image = focuser.image(velocity, slope)
        error = drift_to_velocity(
            look_drift(image), velocity, image.centre_range, focuser.wavelength
        )
        correction = error / (effective(speed + 0.5) - effective(speed - 0.5))
        if not abs(correction) <= last:
            return Drifting(np.nan, tuple(path))
        speed, last = speed - correction, max(abs(correction), 1.0)
    return Drifting(speed, tuple(path))
