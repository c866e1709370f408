"""Autofocus a second time: focused pixels are refocused by one phase; imports nothing of ours.

An image that was focused with the effective velocity V becomes that of V + dV when its azimuth
spectrum is turned by 4 pi R / wavelength (D(V + dV) - D(V)), D(V)^2 = 1 - (wavelength f / 2V)^2: no
raw data, no migration (which a metre per second changes by a hundredth of a sample), no spline, no
parabola.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

FINE = (1.0, 0.25, 0.1)
"""Steps of the search, m/s."""


@dataclass(frozen=True, eq=False)
class Pixels:
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

    def faded(self, lines: int) -> "Pixels":
        """The same, fading over so many lines at both ends as (1 - cos) / 2."""
        rise = (1 - np.cos(np.pi * (np.arange(lines) + 0.5) / lines)) / 2
        weight = np.concatenate([rise, np.ones(len(self.values) - 2 * lines), rise[::-1]])
        return replace(self, values=(self.values * weight[:, None]).astype(np.complex64))

    @cached_property
    def azimuth(self) -> np.ndarray:
        """The azimuth spectrum (lines, samples) at the velocity it was focused with."""
        return np.fft.fft(self.values, axis=0)

    def spectrum(self, faster: float) -> tuple[np.ndarray, np.ndarray]:
        """Doppler frequencies (lines, 1), Hz, and the azimuth spectrum for another velocity."""
        lines = len(self.values)
        f = np.fft.fftfreq(lines, 1 / self.prf)[:, None]
        s = (self.wavelength * f[: lines // 2 + 1] / 2) ** 2  # the same for negative frequencies
        D, other = (np.sqrt(1 - s / v**2) for v in (self.velocity, self.velocity + faster))
        less = (4 * np.pi / self.wavelength * (other - D)).astype(np.float32)  # some rad in all
        angle = less * self.slant_range.astype(np.float32)
        turn = np.empty(angle.shape, np.complex64)
        turn.real, turn.imag = np.cos(angle), np.sin(angle)  # a third of a complex exponential
        turn = np.concatenate([turn, turn[1 : (lines + 1) // 2][::-1]])
        return f, self.azimuth * turn


ASKED = 64
"""Velocities at which what the criteria share is kept: all of one block's."""


@lru_cache(ASKED)
def _spectrum(p: Pixels, faster: float) -> tuple[np.ndarray, np.ndarray]:
    return p.spectrum(faster)


@lru_cache(ASKED)
def _intensity(p: Pixels, faster: float) -> np.ndarray:
    return np.abs(np.fft.ifft(_spectrum(p, faster)[1], axis=0)) ** 2


def contrast(p: Pixels, faster: float) -> float:
    """Variance over squared mean of the intensity."""
    g = _intensity(p, faster)
    return float(np.var(g) / np.mean(g) ** 2)


def order(p: Pixels, faster: float) -> float:
    """Minus the entropy of the intensity, in natural units."""
    g = _intensity(p, faster)
    share = g[g > 0] / g.sum()
    return float(share @ np.log(share))


def agreement(p: Pixels, faster: float) -> float:
    """Product of the intensities of two looks, of negative and of positive frequencies.

    Its maximum over the velocity is where the looks' pictures fall on each other.
    """
    f, spectrum = _spectrum(p, faster)
    looks = [np.abs(np.fft.ifft(spectrum * side, axis=0)) ** 2 for side in (f < 0, f > 0)]
    a, b = (g - g.mean(axis=0) for g in looks)
    return float(np.sum(a * b))


CRITERIA = (contrast, order, agreement)


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
