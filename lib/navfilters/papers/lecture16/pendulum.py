"""A shaken pendulum under a range finder: one system for the lecture's three filters.

The pivot is shaken sideways and up and down, which drives the bob in proportion to cos and sin of
its angle; the range finder's error is a fraction of the range. Both noises enter through gains
that depend on the state, L(x) w and M(x) v.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from navfilters.estimators.continuous import ContinuousSystem, Reference, Signal
from navfilters.estimators.discrete import DiscreteSystem
from navfilters.numerics.small_matrices import matrix, vector
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
        angle, rate, aside, up = (component(a, i) for a in (x, w) for i in (0, 1))
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
    rng = np.random.default_rng(seed)
    w = band_limited_noise(rng, np.array(setup.shaking), setup.bandwidth, setup.duration)
    v = band_limited_noise(rng, np.array([setup.ranging]), setup.bandwidth, setup.duration)
    x = _motion(setup, setup.released, w)
    return x, lambda t: setup.h(x(t), v(t), t)


def _motion(setup: Setup, angle: float, w: Signal) -> Signal:
    """The pendulum released at rest, (..., 2) at any times (...) of the experiment."""

    def rate(t: float, x: Array) -> Array:
        return setup.f(x, setup.control(t), w(t), t)

    fine = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-10, "dense_output": True}
    x = solve_ivp(rate, (0.0, setup.duration), [angle, 0.0], **fine).sol
    return lambda t: x(t).T


def component(x: Array, i: int) -> Array:
    """x_i over the batch axes; of a single vector a number, which NumPy works with faster."""
    return x[i] if x.ndim == 1 else x[..., i]


def band_limited_noise(
    rng: np.random.Generator, root: Array, bandwidth: float, duration: float
) -> Callable[[Any], Array]:
    """Gaussian noise with a flat spectrum up to a frequency, as a sum of sines.

    Parameters
    ----------
    rng : numpy.random.Generator
    root : array (w,)
        Root of the two-sided spectral density, units/sqrt(Hz).
    bandwidth : float
        Highest frequency, Hz.
    duration : float
        The lowest frequency's period, after which the noise repeats itself, s.

    Returns
    -------
    callable
        t (...) -> (..., w), of variance 2 bandwidth root^2 within half a line of the spectrum.
    """
    count = round(bandwidth * duration)
    rates = 2 * np.pi * (np.arange(count) + 0.5) / duration
    waves = rng.standard_normal((2 * count, len(root))) * root * np.sqrt(2 / duration)

    def noise(t: Any) -> Array:
        phase = np.multiply.outer(t, rates)
        both = np.empty((*phase.shape[:-1], 2 * count))
        np.cos(phase, out=both[..., :count])
        np.sin(phase, out=both[..., count:])
        # A product for each time: its digits do not depend on how many are asked for.
        return both @ waves if both.ndim == 1 else (both[..., None, :] @ waves)[..., 0, :]

    return noise


def discretised(system: ContinuousSystem, dt: float) -> DiscreteSystem:
    """Euler's rule, x + dt f, with the noise that keeps its effect as dt shrinks.

    F = I + dt A,   L_d = dt L,   Q_d = Q / dt,   R_d = R / dt

    so that L_d Q_d L_d^T = dt L Q L^T; with Q itself the process noise would vanish with dt.

    Parameters
    ----------
    system : ContinuousSystem
    dt : float
        The step, in the system's unit of time. Step k is at t = k dt.

    Returns
    -------
    DiscreteSystem
        A noise that enters h nonlinearly has no continuous limit; this supposes y = g(x) + M(x) v.
    """
    A, L, C, M = (system.jacobian(name) for name in "ALCM")

    def F(x: Array, u: Array, w: Array, k: int) -> Array:
        rate = A(x, u, w, k * dt)
        return np.eye(rate.shape[-1]) + dt * rate

    return DiscreteSystem(
        lambda x, u, w, k: x + dt * system.f(x, u, w, k * dt),
        lambda x, v, k: system.h(x, v, k * dt),
        np.asarray(system.Q) / dt,
        np.asarray(system.R) / dt,
        F=F,
        L=lambda x, u, w, k: dt * L(x, u, w, k * dt),
        H=lambda x, v, k: C(x, v, k * dt),
        M=lambda x, v, k: M(x, v, k * dt),
    )


def sampled(signal: Callable[[Any], Array], times: Array) -> Array:
    """A signal at several times.

    Parameters
    ----------
    signal : callable
        Times (k,) -> (k, m).
    times : array (K,)

    Returns
    -------
    array (K, m)
    """
    return signal(times)
