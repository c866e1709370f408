"""One interval of an orbit, flown in advance."""

from dataclasses import dataclass
from typing import Any

from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class Interval:
    """One sampling interval of an orbit, linearised about the estimate it starts from.

    Made by :meth:`Orbit.interval`; it is the dynamics that a filter asks for in one step.

    Parameters
    ----------
    orbit : Orbit
    start : array (..., 6)
        State at the start: position, m, and velocity, m/s.
    t : float
        Time of the start, s.
    path : array (substeps, ..., 6)
        State after each sub-step.
    F : array (..., 6, 6)
        Derivative of the last state with respect to the first.
    to_end : list of array (..., 6, 6)
        Derivative of the last state with respect to that after each sub-step.
    """

    orbit: Any
    start: Array
    t: float
    path: Array
    F: Array
    to_end: list[Array]

    @property
    def Q(self) -> Array:
        """Covariance of the noise of *one sub-step*, (..., 6, 6): see ``accumulate``."""
        return self.orbit.Q

    def transition(self, x: Array) -> tuple[Array, Array]:
        """The state at the interval's end, and its derivative with respect to x.

        Parameters
        ----------
        x : array (..., 6)
            State at the start. Another object than ``start`` is propagated anew.

        Returns
        -------
        tuple of array (..., 6), array (..., 6, 6)
            f(x) and F.

        References
        ----------
        xiong2009, Eqs. (3)-(4).
        """
        if x is not self.start:
            return self.orbit.interval(x, self.t).transition(x)
        return self.path[-1], self.F

    def accumulate(self, Q: Array, x: Array) -> Array:
        """Covariance at the interval's end of a noise that enters after every sub-step.

        sum_k Phi_k Q Phi_k^T,   Phi_k = d x(end) / d x(after sub-step k):
        exactly what repeating P <- F P F^T + Q sub-step by sub-step adds to F P F^T.

        Parameters
        ----------
        Q : array (..., 6, 6)
            Covariance of each sub-step's noise: m^2, m^2/s, m^2/s^2.
        x : array (..., 6)
            As in ``transition``.

        Returns
        -------
        array (..., 6, 6)

        References
        ----------
        xiong2009, Eqs. (4) and (41).
        """
        if x is not self.start:
            return self.orbit.interval(x, self.t).accumulate(Q, x)
        return sum(Phi @ Q @ Phi.mT for Phi in self.to_end)
