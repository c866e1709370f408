"""The flight for filters: one number at a time, in units of its deviation.

The state is position, m, velocity, m/s, and leak, m/s^2, in the axes of the sky; then the biases of
range, azimuth and elevation of each station, in units of the deviations.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from navfilters.numerics import validation
from navfilters.space.gravity import EARTH
from navfilters.tracking.forces import Forces
from navfilters.tracking.least_squares import MOTION, OrbitProblem
from navfilters.tracking.stations import LIGHT, Sites, observe
from navfilters.types import Array

LEAK, BIASES = slice(6, 9), 9
"""Where leak and biases stand in the state."""

FINENESS = 0.015
"""Longest step of the integrator, in units of sqrt(r^3 / mu)."""


@dataclass(frozen=True, eq=False)
class Leg:
    """The motion between two measurements.

    Parameters
    ----------
    Q : array (..., 3, 3)
        Spectral density of a white acceleration, m^2/s^3.
    forces : Forces
    start, step : float
        s after the epoch, and s.
    count : int
        Steps; 0 where no time passes.
    """

    Q: Array
    forces: Forces
    start: float
    step: float
    count: int

    def f(self, x: Array) -> Array:
        """The state at the end, (..., n), by the Runge-Kutta rule of fourth order."""
        for i in range(self.count):
            x = self._step(self.start + i * self.step, x)
        return x

    def propagate(self, x: Array, Q: Array) -> tuple[Array, Array, Array]:
        """The state at the end, its Jacobian (..., n, n), and what Q amounts to, (..., n, n).

        The Jacobian is that of the gravity of an oblate Earth alone, in the middle of each step.
        """
        n = x.shape[-1]
        F, W = np.eye(9), np.zeros((9, 9))
        h = self.step
        grown = np.zeros((*Q.shape[:-2], 9, 9))
        grown[..., :3, :3], grown[..., 3:6, 3:6] = Q * (h**3 / 3), Q * h
        grown[..., :3, 3:6] = grown[..., 3:6, :3] = Q * (h**2 / 2)
        for i in range(self.count):
            before, x = x, self._step(self.start + i * h, x)
            over = _transition((before[..., :3] + x[..., :3]) / 2, h)
            F, W = over @ F, over @ W @ over.mT + grown
        members = np.broadcast_shapes(x.shape[:-1], W.shape[:-2])
        whole = np.zeros((2, *members, n, n))
        whole[0] = np.eye(n)
        whole[0, ..., :9, :9], whole[1, ..., :9, :9] = F, W
        return x, whole[0], whole[1]

    def hessian(self, x: Array) -> Array:
        """Second derivatives of the end, (..., n, n, n): differences of the Jacobian."""
        n = x.shape[-1]
        second = np.zeros((*x.shape[:-1], n, n, n))
        if self.count:
            size = np.array([1e4] * 3 + [1.0] * 3)
            sides = _sides(size, x)
            F = self.propagate(np.stack([x + sides, x - sides]), np.zeros((3, 3)))[1]
            second[..., :6] = np.moveaxis(F[0] - F[1], 0, -1) / (2 * size)
            second = (second + second.mT) / 2
        return second

    def _step(self, t: float, x: Array) -> Array:
        r, v, leak, h = x[..., :3], x[..., 3:6], x[..., LEAK], self.step
        a1 = self.forces.acceleration(t, r, v) + leak
        v2 = v + (h / 2) * a1
        a2 = self.forces.acceleration(t + h / 2, r + (h / 2) * v, v2) + leak
        v3 = v + (h / 2) * a2
        a3 = self.forces.acceleration(t + h / 2, r + (h / 2) * v2, v3) + leak
        v4 = v + h * a3
        a4 = self.forces.acceleration(t + h, r + h * v3, v4) + leak
        r = r + (h / 6) * (v + 2 * (v2 + v3) + v4)
        v = v + (h / 6) * (a1 + 2 * (a2 + a3) + a4)
        return np.concatenate([r, v, x[..., 6:]], axis=-1)


def _transition(r: Array, h: float) -> Array:
    """The transition over a step at r, (..., 9, 9), the gravity gradient being constant."""
    G = EARTH.gradient(r)
    one = np.eye(3)
    total = np.zeros((*G.shape[:-2], 9, 9))
    square = G @ G
    total[..., :3, :3] = total[..., 3:6, 3:6] = one + h**2 / 2 * G + h**4 / 24 * square
    total[..., :3, 3:6] = total[..., 3:6, 6:] = h * one + h**3 / 6 * G
    total[..., 3:6, :3] = h * G + h**3 / 6 * square
    total[..., :3, 6:] = h**2 / 2 * one + h**4 / 24 * G
    total[..., 6:, 6:] = one
    return total


def _sides(size: Array, x: Array) -> Array:
    """A step along each of the first components of x, (len(size), 1, ..., n)."""
    steps = np.zeros((len(size), *(1,) * (x.ndim - 1), x.shape[-1]))
    for j, length in enumerate(size):
        steps[j, ..., j] = length
    return steps


@dataclass(frozen=True, eq=False)
class Legs:
    """Dynamics from measurement to measurement.

    Parameters
    ----------
    Q : array (..., 3, 3)
        Spectral density of a white acceleration, m^2/s^3.
    leg : callable
        The leg that ends at measurement k, for a Q: (Q, k) -> Leg.
    """

    Q: Array
    leg: Callable[[Array, int], Leg]

    def at(self, k: int) -> Leg:
        """The leg that ends at measurement k."""
        return self.leg(self.Q, k)


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
        sides = _sides([size] * 3, x)
        slope = self._slope(np.stack([x + sides, x - sides]))
        second = np.zeros((*x.shape[:-1], 1, n, n))
        of_position = np.moveaxis(slope[0] - slope[1], 0, -1) / (2 * size)
        second[..., 0, :3, :3] = (of_position + of_position.mT) / 2
        return second

    def _slope(self, x: Array) -> Array:
        """Derivatives by position, (..., 3)."""
        moved = observe(x + 1j * _sides([1e-20] * 3, x), self.site)
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
