"""Motion in orbit in inertial axes."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.analytic import dot
from navfilters.numerics.loops import is_jax, repeat
from navfilters.numerics.runge_kutta import euler_increment, runge_kutta_increment
from navfilters.numerics.small_matrices import members_last, product_of_last, stacked
from navfilters.numerics.whole_paths import whole_path
from navfilters.space import sub_steps, variations
from navfilters.space.gravity import EARTH, Gravity
from navfilters.space.thrust import COASTING, Thrust, along_velocity
from navfilters.types import Array


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
    start : float
        Time of the interval's start, s, for the thrust.

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
    start: float = 0.0

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
        start = validation.number("start", self.start, needed="a finite number of seconds")
        object.__setattr__(self, "start", start)
        object.__setattr__(self, "Q", validation.covariance("Q", Q, 6, definite=False))

    def at(self, k: Array) -> "Orbit":
        """The orbit in the interval after k others.

        Parameters
        ----------
        k : int
            From 0; under JAX it may be traced.

        Returns
        -------
        Orbit
            Itself, if it coasts: time matters to the thrust alone.
        """
        if self.thrust.coasts:
            return self
        later = copy(self)  # not replace(), which would check the values again
        object.__setattr__(later, "start", self.start + k * (self.substeps * self.step))
        return later

    def derivative(self, x: Array, thrust: Array | None = None) -> Array:
        """dx/dt: velocity, and gravity with a thrust along the velocity.

        Parameters
        ----------
        x : array (..., 6)
            Position, m, and velocity, m/s.
        thrust : array (...), optional
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
        if thrust is not None:
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
        G = self.gravity.gradient(x[..., :3])
        V = xp.zeros_like(G) if thrust is None else along_velocity(x[..., 3:], thrust)
        same = xp.zeros_like(G) + xp.eye(3)
        return xp.concat([xp.concat([xp.zeros_like(G), same], -1), xp.concat([G, V], -1)], -2)

    def f(self, x: Array) -> Array:
        """The state at the interval's end.

        Parameters
        ----------
        x : array (..., 6)
            Position, m, and velocity, m/s, at its start.

        Returns
        -------
        array (..., 6)
        """
        pushes = self._pushes(self.start, self.substeps, x)
        return repeat(partial(self._advance, pushes), x, self.substeps, x.__array_namespace__())

    def transition(self, x: Array) -> tuple[Array, Array]:
        """The state at the interval's end, and its derivative with respect to x.

        Parameters
        ----------
        x : array (..., 6)

        Returns
        -------
        tuple of array (..., 6), array (..., 6, 6)
            f(x) and F.

        References
        ----------
        xiong2009, Eqs. (3)-(4).
        """
        if is_jax(x.__array_namespace__()):
            return self._forwards(x)
        states = self._states(x, self.start)
        return states[-1], np.ascontiguousarray(self._to_end(states)[0][0].mT)

    def propagate(self, x: Array, Q: Array) -> tuple[Array, Array, Array]:
        """The same, and the covariance at the end of a noise that enters after every sub-step.

        W = sum_k Phi_k Q Phi_k^T,   Phi_k = d x(end) / d x(after sub-step k):
        exactly what repeating P <- F P F^T + Q sub-step by sub-step adds to F P F^T.

        Parameters
        ----------
        x : array (..., 6)
        Q : array (..., 6, 6)
            Covariance of each sub-step's noise: m^2, m^2/s, m^2/s^2.

        Returns
        -------
        tuple of array (..., 6), array (..., 6, 6), array (..., 6, 6)
            f(x), F and W.

        References
        ----------
        xiong2009, Eqs. (4) and (41).
        """
        if is_jax(x.__array_namespace__()):
            return self._forwards(x, Q)
        states = self._states(x, self.start)
        turned, fast = self._to_end(states)
        return states[-1], np.ascontiguousarray(turned[0].mT), sub_steps.noise(turned, fast, Q)

    def path(self, x: Array, t: Array | None = None) -> Array:
        """The states after every sub-step.

        Parameters
        ----------
        x : array (..., 6)
            Position, m, and velocity, m/s, at the interval's start.
        t : float or array, optional
            Time of the start, s: an array of the leading axes of x has one for each. By default
            ``start``.

        Returns
        -------
        array (substeps, ..., 6)
        """
        return self._states(x, self.start if t is None else t)[1:]

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
        thrust = self._pushes(t, path.shape[0] - 1, path[0])
        if self.integrator == "euler":
            return xp.eye(6) + self.step * self.jacobian(path[:-1], thrust)
        if is_jax(xp):
            at = variations.middle(path[:-1], path[1:], self.step)
            return variations.third_order(self.step * self.jacobian(at, thrust))
        return sub_steps.transitions(self.gravity, path, self.step, thrust)

    def _pushes(self, t: Array, count: int, x: Array) -> Array | None:
        """Strength in the middle of each sub-step from t, (count, ...), for such states as x."""
        middles = (np.arange(count) + 0.5).reshape(-1, *(1,) * np.ndim(t))
        return self.thrust.strengths(t + self.step * middles, x)

    def _advance(self, pushes: Array | None, k: Array, x: Array) -> Array:
        """The state after sub-step k."""
        return x + self._increment(pushes, k, x, self.step)

    def _increment(self, pushes: Array | None, k: Array | slice, x: Array, h: float) -> Array:
        """What h seconds of sub-step k add to a state; of a slice, to a state for each."""
        thrust = None if pushes is None else pushes[k]
        if isinstance(thrust, np.ndarray | np.generic) and not thrust.any():
            thrust = None  # saves its term
        if self.integrator == "rk4" and isinstance(x, np.ndarray) and x.dtype.char in "dD":
            return sub_steps.increment(self.gravity, x, h, thrust)
        return INTEGRATORS[self.integrator](partial(self.derivative, thrust=thrust), x, h)

    def _states(self, x: Array, t: Array) -> Array:
        increment = partial(self._increment, self._pushes(t, self.substeps, x))
        longest = int(0.13 / (self.gravity.fastest * self.step))
        return whole_path(increment, x, self.step, self.substeps, longest)

    def _to_end(self, states: Array) -> tuple[np.ndarray, np.ndarray]:
        if self.integrator == "rk4" and self._pushes(self.start, self.substeps, states[0]) is None:
            return sub_steps.smooth_to_end(self.gravity, states, self.step)

        def turned(k: int, part: Array) -> np.ndarray:
            if self.integrator == "euler":
                return self.transitions(part, self.start + k * self.step).mT
            thrust = self._pushes(self.start + k * self.step, len(part) - 1, part[0])
            return sub_steps.transitions(self.gravity, part, self.step, thrust, turned=True)

        return variations.all_to_end(turned, states, 6), np.ones(states.shape[1:-1], bool)

    def _forwards(self, x: Array, Q: Array | None = None) -> tuple[Array, ...]:
        """f(x), F and, given Q, W, for JAX."""
        pushes = self._pushes(self.start, self.substeps, x)

        def sub_step(k: Array, x: Array) -> tuple[Array, Callable[..., Array]]:
            x_next, at, order = self._advance(pushes, k, x), x, 1
            if self.integrator == "rk4":
                at, order = variations.middle(x, x_next, self.step), 3
            of_v = None
            if pushes is not None:
                V = members_last(along_velocity(at[..., 3:], pushes[k]))
                of_v = partial(product_of_last, V)
            G = self.gravity.gradient_elements(at[..., 0], at[..., 1], at[..., 2])
            A = partial(variations.rates, stacked(G), of_v)
            return x_next, partial(variations.series, A, self.step, order)

        return variations.forwards(sub_step, x, self.substeps, 6, Q)


INTEGRATORS = {"rk4": runge_kutta_increment, "euler": euler_increment}  # Eq. (35)
