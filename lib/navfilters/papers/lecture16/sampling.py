"""The pendulum in steps: Euler's rule, and signals at its times."""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters.estimators.continuous import ContinuousSystem
from navfilters.estimators.discrete import DiscreteSystem
from navfilters.types import Array


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
