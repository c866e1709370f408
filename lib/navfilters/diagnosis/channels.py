"""One component of the innovations: bias, size, colour."""

from dataclasses import dataclass

import numpy as np

from navfilters.numerics.chi_square import quantile
from navfilters.types import Array

LAGS = 10


@dataclass(frozen=True)
class Channel:
    """One component of the innovations, each over the deviation that the filter gave it.

    Parameters
    ----------
    number : int
        From 1.
    count : int
        How often it was measured.
    bias : float
        Mean, in deviations: 0 if the filter is right.
    scale : float
        Mean square: the factor on its variance in S that would make it right.
    low, high : float
        Confidence interval of ``scale``, if the innovations are white and Gaussian.
    within : tuple of float
        Shares within one, two and three deviations: 0.683, 0.954, 0.997 if the filter is right.
    correlation : float
        Of the whitened innovation with the one before: 0 if the filter is right.
    lag, at_lag : int, float
        How many updates apart, up to ten, they are most alike or opposed, and the correlation.
    biased, coloured : bool
        What was found at the stated confidence.
    """

    number: int
    count: int
    bias: float
    scale: float
    low: float
    high: float
    within: tuple[float, float, float]
    correlation: float
    lag: int
    at_lag: float
    biased: bool
    coloured: bool


def channel(number: int, y: Array, variance: Array, white: Array, tail: float) -> Channel:
    """What is found in one component.

    Parameters
    ----------
    number : int
    y, variance, white : array (k,)
        Innovations, their variances, and what is left of them once whitened; NaN where not
        measured.
    tail : float
        Probability beyond each end of each test.

    Returns
    -------
    Channel
    """
    from scipy.special import stdtrit  # see quantile

    with np.errstate(invalid="ignore"):
        r = y / np.sqrt(np.where(variance > 0, variance, np.nan))
    r = r[np.isfinite(r)]
    if not r.size:
        nothing = float("nan")
        four = (nothing,) * 4
        return Channel(number, 0, *four, (nothing,) * 3, 0.0, 0, 0.0, False, False)
    n, bias, scale = len(r), float(r.mean()), float(np.mean(r**2))
    low, high = (scale * n / quantile(p, n) for p in (1 - tail, tail))
    spread = r.std(ddof=1) if n > 1 else 1.0  # of Student's t
    limit = stdtrit(max(n - 1, 1), 1 - tail)
    biased = bool(n > 1 and abs(bias) * np.sqrt(n) > limit * spread)
    u = white[np.isfinite(white)]
    u = u - u.mean() if u.size else u
    lags = min(LAGS, len(u) // 4)
    power = float(u @ u)
    r_lag = np.array([u[k:] @ u[:-k] for k in range(1, lags + 1)]) / (power or 1.0)
    box = len(u) * (len(u) + 2) * np.sum(r_lag**2 / (len(u) - np.arange(1, lags + 1)))
    coloured = bool(lags and box > quantile(1 - 2 * tail, lags))
    one, two, three = (float(np.mean(np.abs(r) <= k)) for k in (1, 2, 3))
    within = (one, two, three)
    first = float(r_lag[0]) if lags else 0.0
    lag = int(np.argmax(np.abs(r_lag))) + 1 if lags else 0
    most = lag, float(r_lag[lag - 1]) if lags else 0.0
    of_scale = bias, scale, float(low), float(high)
    return Channel(number, n, *of_scale, within, first, *most, biased, coloured)
