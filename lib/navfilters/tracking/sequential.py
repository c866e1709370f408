"""The flight for filters: one number at a time, in units of its deviation.

The state is position, m, velocity, m/s, and leak, m/s^2, in the axes of the sky; then the biases of
range, azimuth and elevation of each station, in units of the deviations.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from navfilters.numerics import validation
from navfilters.space.gravity import EARTH
from navfilters.tracking.least_squares import MOTION, OrbitProblem
from navfilters.tracking.legs import BIASES, Leg, Legs, sides
from navfilters.tracking.stations import LIGHT, Sites, observe
from navfilters.types import Array

FINENESS = 0.015
"""Longest step of the integrator, in units of sqrt(r^3 / mu)."""


@dataclass(frozen=True, eq=False)
class OneNumber:
    """A range, an azimuth or an elevation as a sensor, in units of its deviation.

    Parameters
    ----------
    site : Sites
    component, column : int
        Which of the three, and where in the state its bias stands.
    deviation : float
        m or rad.
    """

    site: Sites
    component: int
    column: int
    deviation: float

    R = np.eye(1)

    def h(self, x: Array) -> Array:
        """The number that is expected, (..., 1)."""
        seen = observe(x, self.site)[..., self.component] / self.deviation
        return (seen + x[..., self.column])[..., None]

    def residual(self, z: Array, z_hat: Array) -> Array:
        """z minus z_hat, of an azimuth in half a turn."""
        y = z - z_hat
        turn = 2 * np.pi / self.deviation
        return y if self.component != 1 else y - turn * np.round(y / turn)

    def jacobian(self, x: Array) -> Array:
        """First derivatives, (..., 1, n): by complex step, the velocity's by the signal's way."""
        position = self._slope(x)
        way = np.linalg.norm(x[..., :3] - self.site.position, axis=-1)
        H = np.zeros((*x.shape[:-1], 1, x.shape[-1]))
        H[..., 0, :3] = position
        H[..., 0, 3:6] = position * (-way / LIGHT)[..., None]
        H[..., 0, self.column] = 1.0
        return H

    def hessian(self, x: Array) -> Array:
        """Second derivatives, (..., 1, n, n), by position alone: differences of the first."""
        size, n = 1e3, x.shape[-1]
        apart = sides([size] * 3, x)
        slope = self._slope(np.stack([x + apart, x - apart]))
        second = np.zeros((*x.shape[:-1], 1, n, n))
        of_position = np.moveaxis(slope[0] - slope[1], 0, -1) / (2 * size)
        second[..., 0, :3, :3] = (of_position + of_position.mT) / 2
        return second

    def _slope(self, x: Array) -> Array:
        """Derivatives by position, (..., 3)."""
        moved = observe(x + 1j * sides([1e-20] * 3, x), self.site)
        moved = moved[..., self.component].imag / 1e-20
        return np.moveaxis(moved, 0, -1) / self.deviation


@dataclass(frozen=True, eq=False)
class Numbers:
    """The sensors of a flight.

    Parameters
    ----------
    sensor : callable
        k -> OneNumber.
    """

    sensor: Callable[[int], OneNumber]

    R = np.eye(1)

    def at(self, k: int) -> OneNumber:
        """The sensor of measurement k."""
        return self.sensor(k)


@dataclass(frozen=True, eq=False)
class Sequence:
    """A flight as a filter meets it.

    Parameters
    ----------
    time : array (K,)
        s after the epoch.
    z : array (K, 1)
        In units of the deviations.
    station, component : int array (K,)
    model : Numbers
    dynamics : Legs
        Without process noise.
    """

    time: np.ndarray
    z: np.ndarray
    station: np.ndarray
    component: np.ndarray
    model: Numbers
    dynamics: Legs

    def noisy(self, density: Array) -> Legs:
        """The dynamics with a white acceleration, alike in all directions.

        Parameters
        ----------
        density : float or array (...)
            m^2/s^3.
        """
        density = validation.real_array("density", density, "")
        return replace(self.dynamics, Q=density[..., None, None] * np.eye(3))

    def without(self, stations: Array) -> np.ndarray:
        """The measurements (K, ..., 1), NaN where a member is not to see a station.

        Parameters
        ----------
        stations : int array (...)
            One for each member; -1 leaves out none.
        """
        stations = np.asarray(stations)
        hidden = self.station.reshape(-1, *(1,) * stations.ndim) == stations
        z = self.z.reshape(-1, *(1,) * (stations.ndim + 1))
        return np.where(hidden[..., None], np.nan, z)


def sequence(problem: OrbitProblem, radius: Array) -> Sequence:
    """The measurements of a problem one number at a time, azimuth before elevation.

    Parameters
    ----------
    problem : OrbitProblem
        Its forces are the filters', but for the leak.
    radius : array (N,)
        About how far from the Earth's centre the satellite is at each measurement, m; decides the
        steps of the integrator.

    Returns
    -------
    Sequence
    """
    observed = problem.observations
    row, component = np.nonzero(~np.isnan(observed.z))
    time, deviation = observed.time[row], np.asarray(problem.deviation)
    before = np.concatenate([[0.0], time[:-1]])
    near = np.minimum(radius[row], np.concatenate([radius[:1], radius[row][:-1]]))
    longest = FINENESS * np.sqrt(near**3 / EARTH.mu)
    count = np.ceil((time - before) / longest).astype(int)
    columns = BIASES + 3 * observed.station[row] + component

    def leg(Q: Array, k: int) -> Leg:
        step = (time[k] - before[k]) / max(count[k], 1)
        return Leg(Q, problem.forces, before[k], step, int(count[k]))

    def sensor(k: int) -> OneNumber:
        c = int(component[k])
        return OneNumber(problem.sites[row[k]], c, int(columns[k]), deviation[c])

    z = (observed.z[row, component] / deviation[component])[:, None]
    model, dynamics = Numbers(sensor), Legs(np.zeros((3, 3)), leg)
    return Sequence(time, z, observed.station[row], component, model, dynamics)


def state_of(parameters: Array, deviation: Array) -> Array:
    """The state at the epoch, (..., 9 + 3 S), of parameters of the batch solution.

    Parameters
    ----------
    parameters : array (..., n)
    deviation : array (3,)
    """
    biases = parameters[..., MOTION:].reshape(*parameters.shape[:-1], -1, 3) / deviation
    biases = biases.reshape(*parameters.shape[:-1], -1)
    return np.concatenate([parameters[..., :6], parameters[..., 7:10], biases], axis=-1)
