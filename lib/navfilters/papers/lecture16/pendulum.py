"""A shaken pendulum under a range finder: one system for the lecture's three filters.

The pivot is shaken sideways and up and down, which drives the bob in proportion to cos and sin of
its angle; the range finder's error is a fraction of the range. Both noises enter through gains
that depend on the state, L(x) w and M(x) v.
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from navfilters.estimators.continuous import ContinuousSystem, Reference, Signal
from navfilters.numerics.small_matrices import matrix, vector
from navfilters.papers.lecture16.noise import amplitudes, sum_of_sines
from navfilters.types import Array, Gaussian


@dataclass(frozen=True)
class Setup:
    """The experiment; change a field with ``dataclasses.replace`` and run again.

    Parameters
    ----------
    gravity : float
        m/s^2.
    length : float
        From pivot to bob, m.
    damping : float
        Rate at which the angular velocity decays, 1/s.
    drive, drive_rate : float
        Amplitude, rad/s^2, and angular frequency, rad/s, of the known angular acceleration u(t).
    sensor : tuple of float
        Range finder, m right of the pivot and above it. Where bob, pivot and sensor are in line,
        the range says nothing of the angle.
    shaking : tuple of float
        Root spectral density of the pivot's acceleration, sideways and upwards, m/s^2/sqrt(Hz).
    ranging : float
        Root spectral density of the range error as a fraction of the range, 1/sqrt(Hz).
    bandwidth : float
        Where the spectrum of the noise that is simulated ends, Hz: far above what the pendulum
        and the filters follow, so that it is white to them, yet smooth, so that one y(t) can feed
        filters in continuous and in discrete time.
    released : float
        True angle at t = 0, at rest, rad from the vertical.
    planned : float
        The reference's angle at t = 0, at rest, rad.
    guess : tuple of float
        The filters' first estimate minus the truth: rad, rad/s.
    deviation : tuple of float
        Standard deviations of the first estimate: rad, rad/s.
    duration : float
        s.

    Notes
    -----
    The lecture has no example; every number here is this book's.
    """

    gravity: float = 9.80665
    length: float = 1.0
    damping: float = 0.05
    drive: float = 0.3
    drive_rate: float = 2.0
    sensor: tuple[float, float] = (2.0, 0.0)
    shaking: tuple[float, float] = (0.1, 0.05)
    ranging: float = 0.02
    bandwidth: float = 5.0
    released: float = 0.5
    planned: float = 0.5
    guess: tuple[float, float] = (0.1, -0.1)
    deviation: tuple[float, float] = (0.1, 0.1)
    duration: float = 20.0

    def __post_init__(self) -> None:
        for name in ("sensor", "shaking", "guess", "deviation"):  # lists too: a set-up is a key
            object.__setattr__(self, name, tuple(getattr(self, name)))

    @property
    def prior(self) -> Gaussian:
        """The filters' first estimate."""
        mean = np.array([self.released, 0.0]) + np.array(self.guess)
        return Gaussian(mean, np.diag(np.square(self.deviation)))

    @property
    def system(self) -> ContinuousSystem:
        """The pendulum, state (angle in rad, angular velocity in rad/s), with its Jacobians."""
        return ContinuousSystem(
            self.f,
            self.h,
            np.diag(np.square(self.shaking)),
            np.array([[self.ranging**2]]),
            A=self.A,
            B=lambda x, u, w, t: np.array([[0.0], [1.0]]),
            L=self.L,
            C=self.C,
            M=self.M,
        )

    def control(self, t: float) -> Array:
        """The known angular acceleration at the pivot at times (...), (..., 1), rad/s^2."""
        return (self.drive * np.sin(self.drive_rate * t))[..., None]

    def f(self, x: Array, u: Array, w: Array, t: float) -> Array:
        """Rate of the state.

        a'' = -(g + w_y)/l sin a - w_x/l cos a - damping a' + u

        Parameters
        ----------
        x : array (..., 2)
            Angle a from the vertical, rad, and its rate, rad/s.
        u : array (..., 1)
            rad/s^2.
        w : array (..., 2)
            The pivot's acceleration, right and up, m/s^2.
        t : float
            Unused.

        Returns
        -------
        array (..., 2)
        """
        xp = x.__array_namespace__()
        angle, rate, aside, up = component(x, 0), component(x, 1), component(w, 0), component(w, 1)
        pull = (self.gravity + up) * xp.sin(angle) + aside * xp.cos(angle)
        return vector([rate, component(u, 0) - self.damping * rate - pull / self.length])

    def A(self, x: Array, u: Array, w: Array, t: float) -> Array:
        """df/dx, (..., 2, 2)."""
        xp = x.__array_namespace__()
        angle = component(x, 0)
        pull = (self.gravity + component(w, 1)) * xp.cos(angle) - component(w, 0) * xp.sin(angle)
        zero = 0 * pull
        return matrix([[zero, zero + 1], [-pull / self.length, zero - self.damping]])

    def L(self, x: Array, u: Array, w: Array, t: float) -> Array:
        """df/dw, (..., 2, 2): a gain that depends on the state."""
        xp = x.__array_namespace__()
        angle = component(x, 0)
        zero = 0 * angle
        return matrix([[zero, zero], [-xp.cos(angle) / self.length, -xp.sin(angle) / self.length]])

    def range(self, x: Array) -> Array:
        """Distance between bob and sensor, (...), m."""
        xp = x.__array_namespace__()
        angle = component(x, 0)
        right = self.length * xp.sin(angle) - self.sensor[0]
        up = -self.length * xp.cos(angle) - self.sensor[1]
        return xp.sqrt(right * right + up * up)

    def h(self, x: Array, v: Array, t: float) -> Array:
        """y = range (1 + v), (..., 1), m; v (..., 1) is the error as a fraction of the range."""
        return (self.range(x) * (1 + component(v, 0)))[..., None]

    def C(self, x: Array, v: Array, t: float) -> Array:
        """dh/dx, (..., 1, 2)."""
        xp = x.__array_namespace__()
        angle = component(x, 0)
        turn = -self.sensor[0] * xp.cos(angle) - self.sensor[1] * xp.sin(angle)
        return matrix([[self.length * turn / self.range(x) * (1 + component(v, 0)), 0 * angle]])

    def M(self, x: Array, v: Array, t: float) -> Array:
        """dh/dv, (..., 1, 1), m: the range itself."""
        return self.range(x)[..., None, None]

    def reference(self) -> Reference:
        """The planned motion: released at rest from ``planned``, driven by u(t), no noise."""
        still = np.zeros(2)
        return Reference(_motion(self, self.planned, lambda t: still), self.control)

    def experiment(self, seed: int) -> tuple[Signal, Signal]:
        """One shaken pendulum and what the range finder says of it.

        Parameters
        ----------
        seed : int
            Of the noise.

        Returns
        -------
        tuple of callable
            x(t) (..., 2) and y(t) (..., 1), smooth functions of t (...) in [0, duration].
        """
        return _experiment(self, seed)


@lru_cache(maxsize=64)
def _experiment(setup: Setup, seed: int) -> tuple[Signal, Signal]:
    w, v = _spectra(setup, seed)
    x = _motion(setup, setup.released, sum_of_sines(w, setup.duration))
    return x, _seen(setup, x, v)


def experiments(setups: Sequence[Setup], seeds: Sequence[int]) -> list[tuple[Signal, Signal]]:
    """Several experiments, which the integrator steps through together.

    Parameters
    ----------
    setups : sequence of Setup
        Of one pendulum; the angles of release may differ.
    seeds : sequence of int
        One for each.

    Returns
    -------
    list of (x, y)
        As of :meth:`Setup.experiment`, within the integrator's tolerance.

    Raises
    ------
    ValueError
        Set-ups that differ in more than ``released``.
    """
    first, *others = setups
    for other in others:
        if replace(other, released=first.released) != first:
            raise ValueError(f"setups must differ in released alone; found {first} and {other}")
    spectra = [_spectra(setup, seed) for setup, seed in zip(setups, seeds, strict=True)]
    angles = np.array([setup.released for setup in setups])
    w = sum_of_sines(np.stack([w for w, _ in spectra]), first.duration)
    together = _motion(first, angles, w)

    def one(i: int) -> tuple[Signal, Signal]:
        def x(t: Any) -> Array:
            return together(t)[..., i, :]

        return x, _seen(first, x, spectra[i][1])

    return [one(i) for i in range(len(spectra))]


def _spectra(setup: Setup, seed: int) -> tuple[Array, Array]:
    """Amplitudes of the pivot's noise and of the range finder's."""
    rng = np.random.default_rng(seed)
    roots = np.array(setup.shaking), np.array([setup.ranging])
    w, v = (amplitudes(rng, root, setup.bandwidth, setup.duration) for root in roots)
    return w, v


def _seen(setup: Setup, x: Signal, v: Array) -> Signal:
    """What the range finder says."""
    noise = sum_of_sines(v, setup.duration)
    return lambda t: setup.h(x(t), noise(t), t)


def _motion(setup: Setup, angle: Any, w: Signal) -> Signal:
    """Pendulums released at rest, (..., k, 2) at any times (...) of the experiment; or one."""
    start = np.stack([angle, np.zeros_like(angle)], axis=-1)

    def rate(t: float, x: Array) -> Array:
        return setup.f(x.reshape(start.shape), setup.control(t), w(t), t).ravel()

    fine = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-10, "dense_output": True}
    x = solve_ivp(rate, (0.0, setup.duration), start.ravel(), **fine).sol
    ends, last = x.ts[1:].tolist(), len(x.interpolants) - 1

    def at(t: Any) -> Array:
        if isinstance(t, float):  # to the last bit what x gives, without its sorting
            return x.interpolants[min(bisect_left(ends, t), last)](t).reshape(start.shape)
        return x(t).T.reshape(*np.shape(t), *start.shape)

    return at


def component(x: Array, i: int) -> Array:
    """x_i over the batch axes; of a single vector a number, which NumPy works with faster."""
    return x[i] if x.ndim == 1 else x[..., i]
