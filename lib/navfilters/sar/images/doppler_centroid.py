"""The middle of the Doppler frequencies that raw data hold."""

import numpy as np

from navfilters.sar.images.raw_data import RawData


def doppler_centroid(raw: RawData) -> float:
    """By the phase from each pulse to the next.

    f = prf / (2 pi) arg sum conj(s(t)) s(t + 1 / prf)

    Parameters
    ----------
    raw : RawData
        At least two pulses.

    Returns
    -------
    float
        Hz, within half the pulse rate of zero: whole pulse rates cannot be told.

    Raises
    ------
    ValueError
        Fewer than two pulses, or none that hold an echo.

    References
    ----------
    madsen1989, the correlation Doppler estimator.
    """
    samples = np.asarray(raw.samples)
    if samples.ndim != 2 or len(samples) < 2:
        raise ValueError(f"raw.samples must hold two pulses; found shape {samples.shape}")
    along = sum(complex(np.vdot(samples[i], samples[i + 1])) for i in range(len(samples) - 1))
    if not abs(along) > 0:
        raise ValueError("raw.samples must hold echoes in neighbouring pulses; found none")
    return float(raw.prf * np.angle(along) / (2 * np.pi))
