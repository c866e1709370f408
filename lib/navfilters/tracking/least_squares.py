"""A batch solution: orbit, forces and biases from all measurements at once."""

from dataclasses import dataclass, replace

import numpy as np

from navfilters.tracking.files import Observations
from navfilters.tracking.forces import Forces
from navfilters.tracking.orbit import orbit
from navfilters.tracking.stations import Sites, observe
from navfilters.types import Array

ORBIT, DRAG, LEAK, LEAK_RATE, MOTION = slice(0, 6), slice(6, 7), slice(7, 10), slice(10, 13), 13
"""Where the parameters of the motion stand; then range, azimuth and elevation of each station."""


@dataclass(frozen=True, eq=False)
class Solution:
    """A least-squares solution.

    Parameters
    ----------
    parameters : array (..., n)
        Of the motion, then 3 biases of each station.
    cov : array (..., n, n)
        By the deviations that were assumed; 0 of what was not free or not seen.
    residuals : array (..., N, 3)
        Measured minus computed, m and rad, of all measurements, those left out included.
    jacobian : array (N, 3, n)
        Of the last iteration.
    """

    parameters: Array
    cov: Array
    residuals: Array
    jacobian: Array


@dataclass(frozen=True, eq=False)
class OrbitProblem:
    """Measurements of one flight, and what is assumed of its forces and of the noise.

    Parameters
    ----------
    forces : Forces
        Its drag and leak are parameters.
    observations : Observations
    sites : Sites
        One row for each measurement.
    deviation : array (3,)
        Of range, m, azimuth and elevation, rad.
    troposphere : bool
        Whether the air delays and bends the signals.
    """

    forces: Forces
    observations: Observations
    sites: Sites
    deviation: Array
    troposphere: bool = True

    @property
    def size(self) -> int:
        """How many parameters there are."""
        return MOTION + 3 * len(self.observations.stations)

    def residuals(self, parameters: Array) -> Array:
        """Measured minus computed, (..., N, 3), azimuth in half a turn.

        Parameters
        ----------
        parameters : array (..., n)
        """
        observed = self.observations
        biases = parameters[..., MOTION:].reshape(*parameters.shape[:-1], -1, 3)
        y = observed.z - self._computed(parameters[..., :MOTION])
        y = y - biases[..., observed.station, :]
        turns = np.round(y[..., 1].real / (2 * np.pi))
        y[..., 1] -= 2 * np.pi * turns
        return y

    def jacobian(self, parameters: Array) -> Array:
        """Derivatives of what is computed, (N, 3, n), by complex step.

        Parameters
        ----------
        parameters : array (n,)
        """
        station = self.observations.station
        step = 1e-20
        moved = parameters[:MOTION] + 1j * step * np.eye(MOTION)
        of_motion = np.moveaxis(self._computed(moved, 1e-9).imag / step, 0, -1)
        of_biases = np.zeros((len(station), 3, len(self.observations.stations), 3))
        for component in range(3):
            of_biases[np.arange(len(station)), component, station, component] = 1.0
        return np.concatenate([of_motion, of_biases.reshape(len(station), 3, -1)], axis=-1)

    def _computed(self, motion: Array, rtol: float = 1e-12) -> Array:
        flight = {"leak": motion[..., LEAK], "leak_rate": motion[..., LEAK_RATE]}
        forces = replace(self.forces, drag=motion[..., DRAG.start], **flight)
        states = orbit(forces, motion[..., ORBIT], self.observations.time, rtol)
        return observe(states, self.sites, troposphere=self.troposphere)


def solve(
    problem: OrbitProblem,
    start: Array,
    *,
    free: Array | None = None,
    used: Array | None = None,
    jacobian: Array | None = None,
    iterations: int = 10,
) -> Solution:
    """The weighted least-squares solution, by Gauss-Newton steps.

    Parameters
    ----------
    problem : OrbitProblem
    start : array (..., n)
        Members may have other starts, other free parameters or other measurements.
    free : bool array (..., n), optional
        The parameters that are estimated; by default all. The others stay as they start, and so do
        biases of which no measurement is used.
    used : bool array (..., N), optional
        The measurements that count; by default all.
    jacobian : array (N, 3, n), optional
        To go on with; by default it is computed at every iteration, for a start without batch axes.
    iterations : int
        At most.

    Returns
    -------
    Solution

    Raises
    ------
    ArithmeticError
        Where the last step was not small beside the deviations of the parameters.
    """
    given = jacobian
    seen = ~np.isnan(problem.observations.z)
    if used is not None:
        seen = seen & used[..., None]
    weight = np.where(seen, 1 / problem.deviation, 0.0)
    free = np.ones(problem.size, bool) if free is None else free
    parameters = np.array(start, float)
    for _ in range(iterations):
        residuals = problem.residuals(parameters)
        if given is None:
            jacobian = problem.jacobian(parameters)
        A = weight[..., None] * jacobian * free[..., None, None, :]
        A = A.reshape(*A.shape[:-3], -1, problem.size)
        size = np.linalg.norm(A, axis=-2)
        still = (size == 0)[..., None]  # parameters that are not free, biases that are not seen
        size = np.where(size == 0, 1.0, size)
        inverse = np.linalg.pinv(A / size[..., None, :], rcond=1e-10) / size[..., None]
        inverse = np.where(still, 0.0, inverse)
        y = np.where(seen, residuals * weight, 0.0)
        change = (inverse @ y.reshape(*y.shape[:-2], -1, 1))[..., 0]
        parameters = parameters + change
        cov = inverse @ inverse.mT
        deviation = np.sqrt(np.diagonal(cov, axis1=-2, axis2=-1))
        if (np.abs(change) <= 1e-2 * deviation).all():
            break
    else:
        raise ArithmeticError(f"not converged in {iterations} iterations: a step of {change}")
    return Solution(parameters, cov, problem.residuals(parameters), jacobian)
