"""Continuous systems for the tests: linear and not, with their signals and references."""

from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

from navfilters import Gaussian
from navfilters.estimators.continuous import (
    ContinuousSystem,
    Reference,
    extended_kalman_bucy,
    linearized_kalman_bucy,
)

# Three states, two inputs, two process noises, three measurement noises in two measurements.
A = np.array([[-0.4, 1.0, 0.2], [-1.5, -0.3, 0.0], [0.1, 0.5, -0.7]])
B = np.array([[0.0, 0.3], [1.0, 0.0], [0.2, -0.5]])
L = np.array([[0.0, 0.1], [0.8, 0.0], [0.3, -0.6]])
C = np.array([[1.0, 0.0, 0.4], [0.0, -0.5, 1.0]])
M = np.array([[0.5, 0.1, 0.0], [0.0, 0.7, -0.3]])
Q = np.array([[0.5, 0.1], [0.1, 0.3]])
R = np.diag([0.2, 0.4, 0.1])
Q_TILDE, R_TILDE = L @ Q @ L.T, M @ R @ M.T
PRIOR = Gaussian(
    np.array([1.0, -0.5, 0.3]), np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.2], [0.0, -0.2, 0.5]])
)
TIMES = np.linspace(0.5, 4.0, 12)
LINEAR = ContinuousSystem(
    lambda x, u, w, t: A @ x + B @ u + L @ w, lambda x, v, t: C @ x + M @ v, Q, R
)


def y(t):
    return np.array([np.sin(1.3 * t) + 0.2 * np.cos(9 * t), np.cos(0.7 * t)])


def u(t):
    return np.array([np.sin(2 * t), 0.5 - 0.1 * t])


def trajectory(rate, x0, times=TIMES):
    """An exact motion, from the first time to the last."""
    span = times[0], times[-1]
    return solve_ivp(rate, span, x0, "DOP853", dense_output=True, rtol=1e-11, atol=1e-11).sol


@cache
def some_reference(*, noisy=False):
    """Another input, another start and, if asked, reference noise: and it satisfies Eq. (6)."""
    other = lambda t: np.array([0.3 * t, np.cos(t)])  # noqa: E731
    w = (lambda t: np.array([0.7, np.sin(t)])) if noisy else None
    v = (lambda t: np.array([0.4, -0.9, np.cos(2 * t)])) if noisy else None
    noise = w or (lambda t: np.zeros(2))
    x = trajectory(lambda t, x: A @ x + B @ other(t) + L @ noise(t), [-2.0, 1.0, 4.0])
    return Reference(x, other, w, v)


def lkf(reference=None, system=LINEAR, **options):
    reference = reference or some_reference()
    return linearized_kalman_bucy(system, reference, PRIOR, y, TIMES, u, **options)


def ekf(system=LINEAR, **options):
    return extended_kalman_bucy(system, PRIOR, y, TIMES, u, **options)


# A nonlinear system with gains that depend on state and time, and no input.


def f(x, u, w, t, xp=np):
    return xp.stack([x[1] + 0.1 * t, -xp.sin(x[0]) + (1 + x[0] ** 2) * w[0] + x[1] * w[1] ** 2])


def h(x, v, t, xp=np):
    return xp.stack([xp.exp(0.3 * x[0]) * (1 + v[0]) + 0.01 * t * v[1]])


NONLINEAR = ContinuousSystem(f, h, np.diag([0.1, 0.2]), np.diag([0.05, 0.02]))
START = Gaussian(np.array([0.8, -0.2]), np.diag([0.3, 0.1]))
SPAN = np.linspace(0.0, 3.0, 6)


def nonlinear_y(t):
    return np.array([1.2 + 0.3 * np.sin(2 * t)])
