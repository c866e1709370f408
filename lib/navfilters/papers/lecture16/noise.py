"""Noise that is white to whatever is slower than its bandwidth, and smooth."""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters.types import Array


def amplitudes(
    rng: np.random.Generator, root: Array, bandwidth: float, duration: float
) -> np.ndarray:
    """Of the cosines, and behind them of the sines, with :func:`band_limited_noise`'s arguments.

    Returns
    -------
    array (2 k, w)
    """
    count = round(bandwidth * duration)
    return rng.standard_normal((2 * count, len(root))) * root * np.sqrt(2 / duration)


def sum_of_sines(waves: Array, duration: float) -> Callable[[Any], Array]:
    """A noise from its amplitudes.

    Parameters
    ----------
    waves : array (..., 2 k, w)
        Of :func:`amplitudes`. Several of them are asked for one time only.
    duration : float
        s.

    Returns
    -------
    callable
        t -> (..., w)
    """
    count = waves.shape[-2] // 2
    rates = 2 * np.pi * (np.arange(count) + 0.5) / duration

    def noise(t: Any) -> Array:
        if isinstance(t, float):  # as an integrator asks
            phase = t * rates
            return np.concatenate([np.cos(phase), np.sin(phase)]) @ waves
        phase = np.multiply.outer(t, rates)
        both = np.empty((*phase.shape[:-1], 2 * count))
        np.cos(phase, out=both[..., :count])
        np.sin(phase, out=both[..., count:])
        # A product for each time: its digits do not depend on how many are asked for.
        return both @ waves if both.ndim == 1 else (both[..., None, :] @ waves)[..., 0, :]

    return noise


def band_limited_noise(
    rng: np.random.Generator, root: Array, bandwidth: float, duration: float
) -> Callable[[Any], Array]:
    """Gaussian noise with a flat spectrum up to a frequency, as a sum of sines.

    Parameters
    ----------
    rng : numpy.random.Generator
    root : array (w,)
        Root of the two-sided spectral density, units/sqrt(Hz).
    bandwidth : float
        Highest frequency, Hz.
    duration : float
        The lowest frequency's period, after which the noise repeats itself, s.

    Returns
    -------
    callable
        t (...) -> (..., w), of variance 2 bandwidth root^2 within half a line of the spectrum.
    """
    return sum_of_sines(amplitudes(rng, root, bandwidth, duration), duration)
