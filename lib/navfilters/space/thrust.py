"""Thrust in the local axes of an orbit."""

from dataclasses import dataclass

import numpy as np

from navfilters.numerics import validation


@dataclass(frozen=True)
class Thrust:
    """A thruster that pushes along the inertial velocity, with one strength, in given arcs.

    Parameters
    ----------
    magnitude : float
        Acceleration, m/s^2, at least 0.
    arcs : tuple of (float, float)
        First and last second of each arc, in order of time.

    Raises
    ------
    ValueError
        A negative magnitude; arcs that are empty, overlap or are not in order.
    """

    magnitude: float
    arcs: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        magnitude = validation.number("magnitude", self.magnitude, least=0, needed="at least 0")
        object.__setattr__(self, "magnitude", magnitude)
        times = validation.real_array("arcs", self.arcs, "").reshape(-1)
        if 2 * len(self.arcs) != times.size or not (np.diff(times) >= 0).all():
            raise ValueError(f"arcs must be (start, end) pairs in order of time; found {self.arcs}")

    def strength(self, t: float) -> float:
        """Acceleration at time t, m/s^2: the magnitude from an arc's start to before its end.

        Parameters
        ----------
        t : float
            Seconds.

        Returns
        -------
        float
        """
        return self.magnitude if any(start <= t < end for start, end in self.arcs) else 0.0


COASTING = Thrust(0.0, ())
