"""Euler's rule on a system whose every function changes with time."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from navfilters.estimators.continuous import ContinuousSystem
from navfilters.papers.lecture16.sampling import discretised

Q, R = np.array([[0.3]]), np.array([[0.02]])


def f(x, u, w, t):
    rates = [t * x[..., 0] * x[..., 1] + (1 + t) * w[..., 0], u[..., 0] - t**2 * x[..., 0]]
    return np.stack(np.broadcast_arrays(*rates), axis=-1)


def h(x, v, t):
    return (t * x[..., 0] ** 2 + (2 + t) * v[..., 0])[..., None]


@pytest.mark.parametrize("k", [0, 3, 7])
def test_step_k_is_at_k_dt_in_every_function(k):
    """Written out: the functions and their Jacobians at t = k dt."""
    dt, (p, q), u = 0.25, (0.7, -1.3), np.array([0.2])
    t, x = k * dt, np.array([p, q])
    system = discretised(ContinuousSystem(f, h, Q, R), dt)
    F, L = system.motion_jacobians(x, u, k)
    H, M = system.measurement_jacobians(x, k)
    assert_allclose(F, [[1 + dt * t * q, dt * t * p], [-dt * t**2, 1]], rtol=1e-12)
    assert_allclose(L, [[dt * (1 + t)], [0]], rtol=1e-12)
    assert_allclose(H, [[2 * t * p, 0]], rtol=1e-12)
    assert_allclose(M, [[2 + t]], rtol=1e-12)
    moved = [p + dt * (t * p * q + 1.1 * (1 + t)), q + dt * (u[0] - t**2 * p)]
    assert_allclose(system.f(x, u, np.array([1.1]), k), moved, rtol=1e-14)
    assert_allclose(system.h(x, np.array([0.4]), k), [t * p**2 + 0.4 * (2 + t)], rtol=1e-14)
    assert_allclose(system.Q, Q / dt, rtol=1e-14)
    assert_allclose(system.R, R / dt, rtol=1e-14)
