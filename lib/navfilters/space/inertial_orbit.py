"""Motion in orbit in inertial axes."""

from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.analytic import dot
from navfilters.numerics.runge_kutta import runge_kutta
from navfilters.space.gravity import EARTH, Gravity
from navfilters.space.thrust import COASTING, Thrust
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

    orbit: "Orbit"
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


@dataclass(frozen=True, eq=False)
class Orbit:
    """Motion of a spacecraft, x = (r, v), in sub-steps of a sampling interval.

    Parameters
    ----------
    gravity : Gravity
    thrust : Thrust
        What the model knows of the thruster; by default nothing.
    Q : array (..., 6, 6), optional
        Covariance of the noise of *one sub-step*, symmetric positive semidefinite: m^2, m^2/s,
        m^2/s^2. None by default.
    step : float
        Length of a sub-step, s. Thrust is constant within it, so its arcs should begin and end
        with one.
    substeps : int
        Sub-steps of an interval between two measurements.
    integrator : {"rk4", "euler"}
        The classical Runge-Kutta step, with the exponential of the midpoint's Jacobian to third
        order for F; or the step that the paper prints.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.

    Notes
    -----
    At one second Runge-Kutta is exact to micrometres per interval. The printed Euler step is off by
    424 m and 0.47 m/s after 100 s in a low orbit, far more than the filter's noise admits.

    References
    ----------
    xiong2009, Eqs. (34)-(36); the text does not give the sub-step.
    """

    gravity: Gravity = EARTH
    thrust: Thrust = COASTING
    Q: Array = None
    step: float = 1.0
    substeps: int = 100
    integrator: Literal["rk4", "euler"] = "rk4"

    def __post_init__(self) -> None:
        if self.integrator not in INTEGRATORS:
            known = sorted(INTEGRATORS)
            raise ValueError(f"integrator must be one of {known}; found {self.integrator!r}")
        seconds = "a positive number of seconds"
        step = validation.number("step", self.step, above=0, needed=seconds)
        object.__setattr__(self, "step", step)
        substeps = validation.whole_number("substeps", self.substeps, 1)
        object.__setattr__(self, "substeps", substeps)
        Q = np.zeros((6, 6)) if self.Q is None else self.Q
        object.__setattr__(self, "Q", validation.covariance("Q", Q, 6, definite=False))

    def derivative(self, x: Array, thrust: float = 0.0) -> Array:
        """dx/dt: velocity, and gravity with a thrust along the velocity.

        Parameters
        ----------
        x : array (..., 6)
            Position, m, and velocity, m/s.
        thrust : float
            Acceleration of the thruster, m/s^2.

        Returns
        -------
        array (..., 6)

        References
        ----------
        xiong2009, Eq. (36).
        """
        xp = x.__array_namespace__()
        v = x[..., 3:]
        a = self.gravity.acceleration(x[..., :3])
        if thrust:
            a = a + v * (thrust / xp.sqrt(dot(v, v)))[..., None]
        return xp.concat([v, a], axis=-1)

    def jacobian(self, x: Array, thrust: Array | None = None) -> Array:
        """A = d(dx/dt)/dx.

        Parameters
        ----------
        x : array (..., 6)
            Position, m, and velocity, m/s.
        thrust : array (...), optional
            Acceleration of the thruster, m/s^2.

        Returns
        -------
        array (..., 6, 6)
            s^-2 by position and s^-1 by velocity in the last three rows.
        """
        xp = x.__array_namespace__()
        E_r, E_v = xp.asarray(POSITION), xp.asarray(VELOCITY)
        of_x = self.gravity.gradient(x[..., :3]) @ E_r
        if thrust is not None:
            v = x[..., 3:]
            speed = xp.sqrt(dot(v, v))
            u = v / speed[..., None]
            across = xp.eye(3) - u[..., :, None] * u[..., None, :]
            of_x = of_x + (xp.asarray(thrust) / speed)[..., None, None] * (across @ E_v)
        return E_r.mT @ E_v + E_v.mT @ of_x

    def interval(self, x: Array, t: float = 0.0) -> Interval:
        """Propagate a state over one sampling interval, and linearise about its path.

        Parameters
        ----------
        x : array (..., 6)
            Position, m, and velocity, m/s, at the interval's start.
        t : float
            Time of the start, s, for the thrust.

        Returns
        -------
        Interval
        """
        xp = x.__array_namespace__()
        advance = INTEGRATORS[self.integrator]
        path = [x]
        for thrust in self._thrusts(t, self.substeps):
            path.append(advance(partial(self.derivative, thrust=thrust), path[-1], self.step))
        states = xp.stack(path)
        to_end = [xp.zeros_like(x)[..., None] + xp.eye(6)]
        size = max(1, CACHED // max(1, x[..., 0].size))
        for first in reversed(range(0, self.substeps, size)):
            steps = self.transitions(states[first : first + size + 1], t + first * self.step)
            for k in reversed(range(steps.shape[0])):
                to_end.append(to_end[-1] @ steps[k])
        F = to_end.pop()
        return Interval(self, x, t, states[1:], F, to_end[::-1])

    def transitions(self, path: Array, t: float = 0.0) -> Array:
        """Derivative of each state of a path with respect to the one a sub-step before.

        Parameters
        ----------
        path : array (k + 1, ..., 6)
            States one sub-step apart.
        t : float
            Time of the first, s, for the thrust.

        Returns
        -------
        array (k, ..., 6, 6)
        """
        xp = path.__array_namespace__()
        thrusts = self._thrusts(t, path.shape[0] - 1)
        thrust = None
        if any(thrusts):
            thrust = xp.reshape(xp.asarray(thrusts), (-1, *(1,) * (path.ndim - 2)))
        h, x, x_next = self.step, path[:-1], path[1:]
        if self.integrator == "euler":
            return xp.eye(6) + h * self.jacobian(x, thrust)
        middle = (x + x_next) / 2
        bend = (x[..., 3:] - x_next[..., 3:]) * (h / 8)  # of the cubic through both velocities
        middle = xp.concat([middle[..., :3] + bend, middle[..., 3:]], axis=-1)
        hA = h * self.jacobian(middle, thrust)
        return xp.eye(6) + hA @ (xp.eye(6) + hA @ (xp.eye(6) / 2 + hA / 6))

    def _thrusts(self, t: float, count: int) -> list[float]:
        """Strength in the middle of each of so many sub-steps."""
        return [self.thrust.strength(t + self.step * (k + 0.5)) for k in range(count)]


POSITION, VELOCITY = np.eye(6)[:3], np.eye(6)[3:]  # r = POSITION @ x; constants, not concat: faster

CACHED = 2000
"""Matrices worked on at a time: enough to amortise a call, few enough for the cache."""


def _euler(derivative, x: Array, h: float) -> Array:
    return x + h * derivative(x)  # Eq. (35)


INTEGRATORS = {"rk4": runge_kutta, "euler": _euler}


def perigee_apogee(x: Array, gravity: Gravity = EARTH) -> tuple[Array, Array]:
    """Heights of the osculating ellipse's perigee and apogee above the equatorial radius.

    Parameters
    ----------
    x : array (..., 6)
        Position, m, and velocity, m/s.
    gravity : Gravity
        Gives mu and the radius; J2 takes no part.

    Returns
    -------
    tuple of array (...)
        Metres.
    """
    xp = x.__array_namespace__()
    r, v = x[..., :3], x[..., 3:]
    distance = xp.sqrt(dot(r, r))
    v2, rv = dot(v, v), dot(r, v)
    a = 1 / (2 / distance - v2 / gravity.mu)
    ev = (v2 / gravity.mu - 1 / distance)[..., None] * r - (rv / gravity.mu)[..., None] * v
    e = xp.sqrt(dot(ev, ev))
    return a * (1 - e) - gravity.radius, a * (1 + e) - gravity.radius
