"""The velocity that makes an image sharpest, by climbing."""

from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

import numpy as np

from navfilters.numerics.doors import takes
from navfilters.sar.images.focuser import Focuser
from navfilters.types import Array


@takes(intensity="m, n")
def sharpness(intensity: Array) -> float:
    """Normalized variance.

    sum (g - mean(g))^2 / (M N mean(g)^2)

    Parameters
    ----------
    intensity : array (M, N)
        g, of single-look pixels: multilooking averages away what distinguishes a sharp image.

    Returns
    -------
    float
        About 1 for the speckle of uniform ground, sharp or not: what grows is the contrast of the
        ground.

    Raises
    ------
    ValueError
        A mean that is not positive.

    References
    ----------
    pogorelsky2020, Eq. (3).
    """
    mean = np.mean(intensity, dtype=float)
    if not mean > 0:
        raise ValueError(f"intensity must have a positive mean; found {mean}")
    square = np.einsum("ij,ij->", intensity, intensity, dtype=float, casting="safe")
    return float(square / intensity.size / mean**2 - 1)


class Climb(NamedTuple):
    """Where a climb ended, and why.

    Parameters
    ----------
    speed : float
        Highest point, m/s; NaN unless ``ended`` is "peak".
    value : float
        There, or at the last point.
    ended : {"peak", "plateau", "limit"}
        Neither neighbour is higher, and one at least is lower; both are as high, so that there is
        nothing to climb; or a neighbour is beyond the limits, and the peak may be too.
    path : tuple of float
        All points at which it stood, m/s.
    """

    speed: float
    value: float
    ended: Literal["peak", "plateau", "limit"]
    path: tuple[float, ...]


def hill_climb(
    function: Callable[[float], float],
    start: float,
    steps: Sequence[float] = (4.0, 1.0),
    limits: tuple[float, float] = (-np.inf, np.inf),
) -> Climb:
    """Step in the direction that is higher until no neighbour is, with each step length in turn.

    Parameters
    ----------
    function : callable
        Sharpness of a speed, m/s.
    start : float
        m/s.
    steps : sequence of float
        Lengths, the last one sets the precision: an error uniform within half of it, m/s.
    limits : tuple of float
        Lowest and highest speed at which the function may be asked, m/s.

    Returns
    -------
    Climb
        The climb does not look beyond its neighbours: of several peaks it finds the one uphill from
        its start. A tie between higher neighbours is decided for the smaller speed. A value that is
        NaN is lower than any other; a climb that starts there ends as a plateau.

    Raises
    ------
    ValueError
        Steps that are not positive, or limits that are not in order.

    References
    ----------
    pogorelsky2020, section "SAR image formation". The text gives one step, of 1 m/s closed-loop.
    """
    low, high = limits
    if not steps or not all(np.isfinite(step) and step > 0 for step in steps):
        raise ValueError(f"steps must be positive numbers of m/s; found {steps}")
    if not low < high:
        raise ValueError(f"limits must be in order; found {limits}")
    known: dict[float, float] = {}

    def at(speed: float) -> float:
        if speed not in known:
            value = function(speed)
            known[speed] = -np.inf if np.isnan(value) else float(value)
        return known[speed]

    here, path = float(start), [float(start)]
    if not low <= here <= high:
        return Climb(np.nan, np.nan, "limit", tuple(path))
    for step in steps:
        while True:
            sides = [side for side in (here - step, here + step) if low <= side <= high]
            best = max(sides, key=at, default=here)
            if not at(best) > at(here):
                break
            here = best
            path.append(here)
    if len(sides) < 2:  # the peak may be beyond the limit
        return Climb(np.nan, at(here), "limit", tuple(path))
    if all(at(side) == at(here) for side in sides):
        return Climb(np.nan, at(here), "plateau", tuple(path))
    return Climb(here, at(here), "peak", tuple(path))


def autofocus(
    focuser: Focuser,
    start: float,
    effective: Callable[[float], float],
    *,
    steps: Sequence[float] = (4.0, 1.0),
    limits: tuple[float, float] = (-np.inf, np.inf),
    slope: float = 0.0,
    criterion: Callable[[Array], float] = sharpness,
) -> Climb:
    """Climb to the in-track velocity that focuses raw data.

    Parameters
    ----------
    focuser : Focuser
        Or a patch of it: see ``Focuser.patch``. The fewer ranges, the rougher the curve.
    start : float
        In-track velocity that is predicted, m/s.
    effective : callable
        In-track velocity -> effective velocity, m/s: see ``effective_velocity``.
    steps : sequence of float
        See ``hill_climb``.
    limits : tuple of float
        Of the in-track velocity, m/s.
    slope : float
        See ``Focuser.image``.
    criterion : callable
        Intensity (lines, samples) -> what is made large: by default the paper's.

    Returns
    -------
    Climb

    References
    ----------
    pogorelsky2020, Eq. (3) and Fig. 4.
    """

    def of(speed: float) -> float:
        pixels = focuser.image(effective(speed), slope).pixels
        return criterion(pixels.real**2 + pixels.imag**2)

    return hill_climb(of, start, steps, limits)
