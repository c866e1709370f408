"""Motion in orbit in axes that turn with the Earth."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.loops import is_jax
from navfilters.numerics.runge_kutta import runge_kutta, runge_kutta_increment
from navfilters.numerics.whole_paths import whole_path
from navfilters.space.gravity import EARTH, Gravity
from navfilters.types import Array

EARTH_RATE = 7.292115e-5
"""Rotation of the Earth, WGS-84, rad/s."""


@dataclass(frozen=True, eq=False)
class EarthFixedOrbit:
    """Free flight x = (r, v) in Earth-centred, Earth-fixed axes, with nine error states.

    dr/dt = v,   dv/dt = g(r) - 2 w x v - w x (w x r),   d(misalignment)/dt = 0

    The error is of position, velocity and the antenna's misalignment, in this order.

    Parameters
    ----------
    gravity : Gravity
    rate : float
        Rotation w of the frame about its third axis, rad/s; 0 makes it inertial.
    Q_psd : array (..., 6, 6), optional
        Power spectral density of the noise in acceleration and misalignment, symmetric positive
        semidefinite: m^2/s^3, rad^2/s. None by default.
    step : float
        Length of a step, s.
    integrator : {"rk4", "printed"}
        The classical Runge-Kutta step, with F = I + A h + (A h)^2 / 2 of the midpoint's Jacobian
        A; or the step that the paper prints, with the derivative of that step.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.

    Notes
    -----
    The printed step holds the acceleration of its start for the whole step. It is of first order:
    in a low orbit it drifts by 766 m in 600 s of one-second steps, Runge-Kutta by micrometres. The
    last term of Eq. (9) is called centripetal in the text; with its sign it is the centrifugal
    acceleration, and right. The accelerometer's a_b of Eq. (8) is zero in free flight and left out.

    References
    ----------
    pogorelsky2020, Eqs. (8)-(12).
    """

    gravity: Gravity = EARTH
    rate: float = EARTH_RATE
    Q_psd: Array = None
    step: float = 1.0
    integrator: Literal["rk4", "printed"] = "rk4"

    def __post_init__(self) -> None:
        if self.integrator not in ("rk4", "printed"):
            raise ValueError(
                f"integrator must be one of ['printed', 'rk4']; found {self.integrator!r}"
            )
        rate = validation.number("rate", self.rate, needed="a finite number of rad/s")
        seconds = "a positive number of seconds"
        step = validation.number("step", self.step, above=0, needed=seconds)
        object.__setattr__(self, "rate", rate)
        object.__setattr__(self, "step", step)
        Q = np.zeros((6, 6)) if self.Q_psd is None else self.Q_psd
        object.__setattr__(self, "Q_psd", validation.covariance("Q_psd", Q, 6, definite=False))

    @property
    def G(self) -> Array:
        """Where the noise enters the error, (9, 6): velocity and misalignment. Eq. (12)."""
        return np.eye(9)[:, 3:]

    @property
    def Q(self) -> Array:
        """Covariance of the noise of one step, G Q_psd G^T h, (..., 9, 9). Eq. (12)."""
        return self.G @ self.Q_psd @ self.G.T * self.step

    def acceleration(self, x: Array) -> Array:
        """dv/dt: gravity, Coriolis and centrifugal terms.

        Parameters
        ----------
        x : array (..., 6)
            Earth-fixed position, m, and velocity, m/s.

        Returns
        -------
        array (..., 3)
            m/s^2.

        References
        ----------
        pogorelsky2020, Eqs. (8) and (9) with a_b = 0.
        """
        return self.derivative(x)[..., 3:]

    def derivative(self, x: Array) -> Array:
        """dx/dt = (v, dv/dt).

        Parameters
        ----------
        x : array (..., 6)
            Earth-fixed position, m, and velocity, m/s.

        Returns
        -------
        array (..., 6)
        """
        xp, w = x.__array_namespace__(), self.rate
        pull, twice, turned = self.gravity.acceleration(x[..., :3]), 2 * x[..., 3:5], w * x[..., :2]
        of_x, of_y = w * (turned[..., 0] + twice[..., 1]), w * (turned[..., 1] - twice[..., 0])
        if is_jax(xp):
            turning = xp.stack([of_x, of_y, xp.zeros_like(of_x)], axis=-1)
            return xp.concat([x[..., 3:], pull + turning], axis=-1)
        dx = np.empty_like(x)  # in memory as x is
        dx[..., :3], dx[..., 3:] = x[..., 3:], pull
        dx[..., 3] += of_x
        dx[..., 4] += of_y
        return dx

    def jacobian(self, x: Array) -> Array:
        """A: how the errors in position, velocity and misalignment grow.

        A = [0, I, 0; dg/dr - [w x]^2, -2 [w x], 0; 0, 0, 0]

        Parameters
        ----------
        x : array (..., 6)
            Earth-fixed position, m, and velocity, m/s.

        Returns
        -------
        array (..., 9, 9)
            s^-1, and s^-2 from position to velocity.

        References
        ----------
        pogorelsky2020, Eq. (12), which refers to a thesis for its matrices.
        """
        xp = x.__array_namespace__()
        r, v = xp.asarray(POSITION), xp.asarray(VELOCITY)
        W = self.rate * xp.asarray(TURN)
        rest = r.mT @ v - v.mT @ (W @ W @ r + 2 * W @ v)
        return rest + v.mT @ self.gravity.gradient(x[..., :3]) @ r

    def advance(self, x: Array) -> Array:
        """The state a step later.

        Parameters
        ----------
        x : array (..., 6)
            Earth-fixed position, m, and velocity, m/s.

        Returns
        -------
        array (..., 6)

        References
        ----------
        pogorelsky2020, Eqs. (10) and (11) for the printed integrator.
        """
        h = self.step
        if self.integrator == "rk4":
            return runge_kutta(self.derivative, x, h)
        xp, a, v = x.__array_namespace__(), self.acceleration(x), x[..., 3:]
        return xp.concat([x[..., :3] + h * v + (h * h / 2) * a, v + h * a], axis=-1)

    def path(self, x: Array, steps: int) -> Array:
        """The states that so many steps lead through.

        Parameters
        ----------
        x : array (..., 6)
            Earth-fixed position, m, and velocity, m/s, at the start.
        steps : int

        Returns
        -------
        array (steps + 1, ..., 6)
            The first is x.
        """
        if self.integrator == "rk4":
            longest = int(0.13 / ((self.gravity.fastest + abs(self.rate)) * self.step))
            return whole_path(self._increment, x, self.step, steps, longest)
        path = [x]
        for _ in range(steps):
            path.append(self.advance(path[-1]))
        return x.__array_namespace__().stack(path)

    def _increment(self, _: Array | slice, x: Array, h: float) -> Array:
        return runge_kutta_increment(self.derivative, x, h)

    def transitions(self, path: Array) -> Array:
        """F: derivative of each error of a path with respect to that one step before.

        Parameters
        ----------
        path : array (k + 1, ..., 6)
            States one step apart.

        Returns
        -------
        array (k, ..., 9, 9)
        """
        xp = path.__array_namespace__()
        if not is_jax(xp):
            return padded(self.flight_transitions(path))
        hA = self.step * self.jacobian(self._between(path))
        if self.integrator == "printed":
            bend = xp.asarray(POSITION.T @ POSITION) @ hA @ hA / 2  # of Eq. (11) alone
            return xp.eye(9) + hA + bend
        return xp.eye(9) + hA + hA @ hA / 2

    def _between(self, path: Array) -> Array:
        """Where the derivative of each step is taken: as printed at its beginning."""
        return path[:-1] if self.integrator == "printed" else (path[:-1] + path[1:]) / 2

    def flight_transitions(self, path: Array) -> Array:
        """As :meth:`transitions`, of position and velocity alone, (k, ..., 6, 6), under NumPy."""
        h, printed, at = self.step, self.integrator == "printed", self._between(path)
        # h A = [0, h I; G, V], V = [0, c, 0; -c, 0, 0; 0, 0, 0]. By elements: each is an array
        # over steps and members, which are many.
        G = np.moveaxis(self.gravity.gradient(at[..., :3]), (-2, -1), (0, 1)).copy()
        c = h * (2 * self.rate)
        G[0, 0] += self.rate**2
        G[1, 1] += self.rate**2
        G *= h
        bend = (h / 2) * G
        F = np.empty((6, 6, *G.shape[2:]), G.dtype)
        F[:3, :3], F[:3, 3:], F[3:, :3], F[3:, 3:] = bend, 0, G, 0
        F[0, 4], F[1, 3] = h * c / 2, -h * c / 2
        if not printed:
            F[3, :3] += (c / 2) * G[1]
            F[4, :3] -= (c / 2) * G[0]
            F[3:, 3:] = bend
            F[3, 3] -= c * c / 2
            F[4, 4] -= c * c / 2
        F[3, 4] += c
        F[4, 3] -= c
        for i in range(3):
            F[i, i] += 1
            F[3 + i, 3 + i] += 1
            F[i, 3 + i] += h
        return np.ascontiguousarray(np.moveaxis(F, (0, 1), (-2, -1)))

    def propagate(self, x: Array, P: Array, steps: int) -> tuple[Array, Array]:
        """A state and its covariance, so many steps later.

        P <- F P F^T + G Q_psd G^T h   at each step

        Parameters
        ----------
        x : array (..., 6)
            Earth-fixed position, m, and velocity, m/s.
        P : array (..., 9, 9)
            Covariance of the errors in position, velocity and misalignment, m, m/s, rad.
        steps : int

        Returns
        -------
        tuple of array (..., 6), array (..., 9, 9)

        References
        ----------
        pogorelsky2020, Eqs. (8)-(12).
        """
        path, Q = self.path(x, steps), self.Q
        for F in self.transitions(path):
            P = F @ P @ F.mT + Q
        return path[-1], (P + P.mT) / 2


POSITION, VELOCITY = np.eye(9)[:3], np.eye(9)[3:6]

TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # [w x] of a unit w


def padded(F: Array) -> Array:
    """Of position, velocity and misalignment, (..., 9, 9): F (..., 6, 6), and the last stays."""
    whole = np.zeros((*F.shape[:-2], 9, 9), F.dtype) + np.eye(9)
    whole[..., :6, :6] = F
    return whole
