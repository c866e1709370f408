"""What an autofocus makes as small as it can, beside what sharpness makes large."""

import numpy as np
from scipy.special import xlogy

from navfilters.numerics.doors import takes
from navfilters.types import Array


@takes(intensity="m, n")
def image_entropy(intensity: Array) -> float:
    """Entropy of the shares that pixels have of an image's whole power.

    -sum p log(p),   p = g / sum(g)

    Parameters
    ----------
    intensity : array (M, N)
        g, of single-look pixels, not negative.

    Returns
    -------
    float
        Between 0, of a single bright pixel, and log(M N), of a level image. The smaller, the
        sharper.

    Raises
    ------
    ValueError
        A mean that is not positive.

    References
    ----------
    carrara1995, chapter 6; the measure that minimum-entropy autofocus descends.
    """
    mean = np.mean(intensity, dtype=float)
    if not mean > 0:
        raise ValueError(f"intensity must have a positive mean; found {mean}")
    relative = intensity / mean  # of order one: nothing of a small share is lost
    return float(np.log(intensity.size) - np.mean(xlogy(relative, relative), dtype=float))
