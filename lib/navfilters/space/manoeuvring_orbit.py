"""Motion in orbit with a thrust that a filter estimates, or takes for noise."""

from copy import copy
from dataclasses import dataclass
from functools import partial
from itertools import groupby, pairwise
from typing import Literal

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.analytic import dot
from navfilters.numerics.runge_kutta import runge_kutta
from navfilters.space import sub_steps
from navfilters.space.gravity import EARTH, Gravity
from navfilters.space.inertial_orbit import Orbit
from navfilters.space.thrust import Thrust, along_velocity
from navfilters.space.variations import middle
from navfilters.types import Array

SIZES = {"none": 6, "strength": 7, "vector": 9}
"""Components of the state with each model of the thrust."""


@dataclass(frozen=True, eq=False)
class ManoeuvringOrbit:
    """Motion of a spacecraft, x = (r, v), (r, v, s) or (r, v, a): for the host.

    dr/dt = v,   dv/dt = g(r) + s v / norm(v)  or  g(r) + a  in the arcs,   da/dt = -a / memory

    Parameters
    ----------
    Q : array (..., n, n)
        Covariance of the noise that enters after every *second*: m, s and their products.
    Q_arcs : array (..., n, n), optional
        What is added to it in the arcs.
    arcs : tuple of (float, float)
        Whole seconds between which the filter thinks that the thruster may fire.
    thrust : {"none", "strength", "vector"}
        What of it is a part of the state: nothing; its strength s along the velocity, m/s^2; or its
        inertial acceleration a, m/s^2.
    memory : float
        Time in which that decays to 1 / e, s; by default it does not.
    gravity : Gravity
    step : int
        Length of a sub-step, s; arcs that begin or end within one divide it.
    interval : int
        Seconds between two measurements.
    start : float
        Time of the interval's start, s.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.

    Notes
    -----
    :class:`~navfilters.space.inertial_orbit.Orbit` does the same for n = 6 second by second. Here a
    sub-step is longer, and the noise of its seconds is summed up along a straight path: at 25 s in
    a low orbit W is right to a thousandth, and the state to 3 mm.
    """

    Q: Array
    Q_arcs: Array = None
    arcs: tuple[tuple[float, float], ...] = ()
    thrust: Literal["none", "strength", "vector"] = "none"
    memory: float = np.inf
    gravity: Gravity = EARTH
    step: int = 25
    interval: int = 100
    start: float = 0.0

    def __post_init__(self) -> None:
        if self.thrust not in SIZES:
            raise ValueError(f"thrust must be one of {sorted(SIZES)}; found {self.thrust!r}")
        Thrust(1.0, self.arcs)  # in order of time
        if any(t != int(t) for arc in self.arcs for t in arc):
            raise ValueError(f"arcs must begin and end in whole seconds; found {self.arcs}")
        if not self.memory > 0:
            raise ValueError(f"memory must be a positive number of seconds; found {self.memory}")
        for name in ("step", "interval"):
            whole = validation.whole_number(name, getattr(self, name), 1)
            object.__setattr__(self, name, whole)
        n = SIZES[self.thrust]
        Q_arcs = np.zeros((n, n)) if self.Q_arcs is None else self.Q_arcs
        for name, Q in (("Q", self.Q), ("Q_arcs", Q_arcs)):
            object.__setattr__(self, name, validation.covariance(name, Q, n, definite=False))

    def at(self, k: int) -> "ManoeuvringOrbit":
        """The orbit in the interval after k others."""
        later = copy(self)  # not replace(), which would check the values again
        object.__setattr__(later, "start", self.start + k * self.interval)
        return later

    def derivative(self, x: Array, fires: bool) -> Array:
        """dx/dt.

        Parameters
        ----------
        x : array (..., n)
            m, m/s and m/s^2.
        fires : bool
            Whether the thrust of the state acts.

        Returns
        -------
        array (..., n)
        """
        v, rest = x[..., 3:6], x[..., 6:]
        acceleration = self.gravity.acceleration(x[..., :3])
        if fires and self.thrust != "none":
            push = rest
            if self.thrust == "strength":
                push = rest * v / np.sqrt(dot(v, v))[..., None]
            acceleration = acceleration + push
        return np.concatenate([v, acceleration, -rest / self.memory], axis=-1)

    def jacobian(self, x: Array, fires: bool) -> Array:
        """A = d(dx/dt)/dx, (..., n, n)."""
        n = x.shape[-1]
        A = np.zeros((*x.shape[:-1], n, n))
        A[..., :3, 3:6] = np.eye(3)
        G = self.gravity.gradient_elements(x[..., 0], x[..., 1], x[..., 2])
        for i in range(3):
            for j in range(3):
                A[..., 3 + i, j] = G[i][j]
        A[..., 6:, 6:] = -np.eye(n - 6) / self.memory
        if fires and self.thrust == "vector":
            A[..., 3:6, 6:] = np.eye(3)
        if fires and self.thrust == "strength":
            v = x[..., 3:6]
            A[..., 3:6, 3:6] = along_velocity(v, x[..., 6])
            A[..., 3:6, 6] = v / np.sqrt(dot(v, v))[..., None]
        return A

    def f(self, x: Array) -> Array:
        """The state at the interval's end, (..., n)."""
        for a, b in pairwise(self._edges()):
            x = self._moved(x, b - a, self._fires(a))
        return x

    def transition(self, x: Array) -> tuple[Array, Array]:
        """The state at the interval's end, (..., n), and its derivative F, (..., n, n)."""
        return self.propagate(x, self.Q)[:2]

    def propagate(self, x: Array, Q: Array) -> tuple[Array, Array, Array]:
        """The same, and the covariance at the end of the noise of all seconds.

        Parameters
        ----------
        x : array (..., n)
        Q : array (..., n, n)
            In the place of the orbit's; in the arcs ``Q_arcs`` is added to it.

        Returns
        -------
        tuple of array (..., n), array (..., n, n), array (..., n, n)
            f(x), F and W.
        """
        edges, eye = self._edges(), np.eye(x.shape[-1])
        lengths, fires = np.diff(edges), [self._fires(t) for t in edges[:-1]]
        path = [x]
        for h, on in zip(lengths, fires, strict=True):
            path.append(self._moved(path[-1], h, on))
        F, W, states = eye, np.zeros_like(eye), np.stack(path)
        for on, steps in groupby(range(len(fires)), fires.__getitem__):
            some = list(steps)
            h = lengths[some].reshape(-1, *(1,) * x.ndim)
            A = self.jacobian(_middle(states[some], states[some[0] + 1 :][: len(some)], h), on)
            hA = h[..., None] * A
            Phi = eye + hA @ (eye + hA @ (eye / 2 + hA / 6))
            noise = Q + self.Q_arcs if on else Q
            for i, k in enumerate(some):
                W = Phi[i] @ W @ Phi[i].mT + _summed(noise, A[i], lengths[k])
                F = Phi[i] @ F
        return path[-1], F, W

    def _moved(self, x: Array, h: float, fires: bool) -> Array:
        """The state h seconds later, (..., n)."""
        if (fires and self.thrust != "none") or x.dtype.char not in "dD":
            return runge_kutta(partial(self.derivative, fires=fires), x, h)
        flown = x[..., :6] + sub_steps.increment(self.gravity, x[..., :6], h)
        if x.shape[-1] == 6:
            return flown
        rest = runge_kutta(lambda a: -a / self.memory, x[..., 6:], h)
        return np.concatenate([flown, rest], axis=-1)

    def _edges(self) -> Array:
        """Where the sub-steps of the interval begin, and its end."""
        end = self.start + self.interval
        inside = {t for arc in self.arcs for t in arc if self.start < t < end}
        return np.array(sorted({*np.arange(self.start, end, self.step), *inside, end}))

    def _fires(self, t: float) -> bool:
        return any(first <= t < last for first, last in self.arcs)


def manoeuvring(
    orbit: Orbit,
    thrust: Literal["none", "strength", "vector"] = "none",
    *,
    arcs: tuple[tuple[float, float], ...] = (),
    q_v: Array = 0.0,
    q_a: Array = 0.0,
    memory: float = np.inf,
) -> ManoeuvringOrbit:
    """An orbit of whose thruster the filter knows the arcs, or suspects them.

    Parameters
    ----------
    orbit : Orbit
        One sub-step of it is a second; its Q is kept.
    thrust, arcs, memory
        As of :class:`ManoeuvringOrbit`.
    q_v, q_a : float or array (..., 1)
        Deviation per second of the noise of velocity, m/s, and thrust, m/s^2, in the arcs.

    Returns
    -------
    ManoeuvringOrbit
    """
    if orbit.step != 1:
        raise ValueError(f"orbit.step must be 1 s; found {orbit.step}")
    of_v, of_a = (np.asarray(q, float)[..., None, None] ** 2 for q in (q_v, q_a))
    E = np.eye(SIZES[thrust])
    Q = E[:, :6] @ orbit.Q @ E[:6]
    Q_arcs = of_v * (E[:, 3:6] @ E[3:6]) + of_a * (E[:, 6:] @ E[6:])
    Q, Q_arcs = np.broadcast_arrays(Q, Q_arcs)
    return ManoeuvringOrbit(Q, Q_arcs, arcs, thrust, memory, orbit.gravity, interval=orbit.substeps)


def _middle(x: Array, x_next: Array, h: float) -> Array:
    """Half a step on."""
    rest = (x[..., 6:] + x_next[..., 6:]) / 2
    return np.concatenate([middle(x[..., :6], x_next[..., :6], h), rest], axis=-1)


def _summed(Q: Array, A: Array, h: float) -> Array:
    """The noise of h seconds, each carried to their end by I + j A, j = 0 to h - 1."""
    AQ = A @ Q
    first, second = h * (h - 1) / 2, (h - 1) * h * (2 * h - 1) / 6
    return h * Q + first * (AQ + AQ.mT) + second * (AQ @ A.mT)
