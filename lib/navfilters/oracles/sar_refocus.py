"""Autofocus a second time: focused pixels are refocused by one phase; imports nothing of ours.

An image that was focused with the effective velocity V becomes that of V + dV when its azimuth
spectrum is turned by 4 pi R / wavelength (D(V + dV) - D(V)), D(V)^2 = 1 - (wavelength f / 2V)^2: no
raw data, no migration (which a metre per second changes by a hundredth of a sample), no spline, no
parabola.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

FINE = (1.0, 0.25, 0.05)
"""Steps of the search, m/s."""


class Pixels(NamedTuple):
    """A focused image and what it was focused with.

    Parameters
    ----------
    values : array (lines, samples) of complex
    prf : float
        Hz.
    wavelength : float
        m.
    slant_range : array (samples,)
        m.
    velocity : float
        Effective, m/s.
    """

    values: np.ndarray
    prf: float
    wavelength: float
    slant_range: np.ndarray
    velocity: float

    def spectrum(self, faster: float) -> tuple[np.ndarray, np.ndarray]:
        """Doppler frequencies (lines, 1), Hz, and the azimuth spectrum for another velocity."""
        f = np.fft.fftfreq(len(self.values), 1 / self.prf)[:, None]
        s = (self.wavelength * f / 2) ** 2
        D, other = (np.sqrt(1 - s / v**2) for v in (self.velocity, self.velocity + faster))
        turn = 4 * np.pi / self.wavelength * self.slant_range * (other - D)
        return f, np.fft.fft(self.values, axis=0) * np.exp(1j * turn).astype(np.complex64)


def contrast(p: Pixels, faster: float) -> float:
    """Variance over squared mean of the intensity."""
    g = np.abs(np.fft.ifft(p.spectrum(faster)[1], axis=0)) ** 2
    return float(np.var(g) / np.mean(g) ** 2)


def order(p: Pixels, faster: float) -> float:
    """Minus the entropy of the intensity, in natural units."""
    g = np.abs(np.fft.ifft(p.spectrum(faster)[1], axis=0)) ** 2
    share = g[g > 0] / g.sum()
    return float(share @ np.log(share))


def agreement(p: Pixels, faster: float) -> float:
    """Product of the intensities of two looks, of negative and of positive frequencies, as they lie.

    Its maximum over the velocity is where the looks' pictures fall on each other.
    """
    f, spectrum = p.spectrum(faster)
    looks = [np.abs(np.fft.ifft(spectrum * side, axis=0)) ** 2 for side in (f < 0, f > 0)]
    a, b = (g - g.mean(axis=0) for g in looks)
    return float(np.sum(a * b))


def best(criterion: Callable[[Pixels, float], float], p: Pixels, reach: float = 4.0) -> float:
    """Where a criterion is highest, by ever finer steps, m/s.

    Parameters
    ----------
    criterion : callable
    p : Pixels
    reach : float
        Of the search to either side, m/s.

    Returns
    -------
    float
    """
    middle, half = 0.0, reach
    for step in FINE:
        tried = np.arange(middle - half, middle + half + step / 2, step)
        middle = float(tried[np.argmax([criterion(p, dv) for dv in tried])])
        half = step
    return middle
