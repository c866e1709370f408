"""Discrete systems for the tests, and one filter's steps on them."""

from dataclasses import replace

import numpy as np

from navfilters import FILTERS, Gaussian, run
from navfilters.estimators.discrete import DiscreteSystem

# Three states, two inputs, two process noises, three measurement noises in two measurements.
F = np.array([[0.9, 0.2, 0.0], [-0.2, 0.95, 0.1], [0.0, 0.1, 0.8]])
B = np.array([[0.0, 0.3], [1.0, 0.0], [0.2, -0.5]])
L = np.array([[0.0, 0.1], [0.8, 0.0], [0.3, -0.6]])
H = np.array([[1.0, 0.0, 0.4], [0.0, -0.5, 1.0]])
M = np.array([[0.5, 0.1, 0.0], [0.0, 0.7, -0.3]])
Q = np.array([[0.5, 0.1], [0.1, 0.3]])
R = np.diag([0.2, 0.4, 0.1])
PRIOR = Gaussian(
    np.array([1.0, -0.5, 0.3]), np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.2], [0.0, -0.2, 0.5]])
)
STEPS = 30


def of(matrix, vector):
    return (matrix @ vector[..., None])[..., 0]


def grown(k):
    """A factor by which the matrices change from step to step; of JAX's numbers too."""
    return 1 + 0.04 * (k % 5)


LINEAR = DiscreteSystem(
    lambda x, u, w, k: grown(k) * of(F, x) + of(B, u) + of(L, w) / grown(k),
    lambda x, v, k: of(H, x) / grown(k) + grown(k) * of(M, v),
    Q,
    R,
)


def signals(seed=0, members=()):
    """Measurements and inputs, (STEPS, *members, 2) both."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(STEPS, *members, 2)), rng.normal(size=(STEPS, *members, 2))


# A nonlinear system, neither noise additive.


def f(x, u, w, k):
    xp = x.__array_namespace__()
    speed = x[..., 1] * xp.exp(w[..., 0]) + u[..., 0]
    pull = 0.1 * xp.sin(x[..., 0]) * (1 + w[..., 1])
    return xp.stack([x[..., 0] + 0.1 * speed, speed - pull + 0.01 * k], axis=-1)


def h(x, v, k):
    xp = x.__array_namespace__()
    a, b = x[..., 0], x[..., 1]
    return xp.stack(
        [xp.exp(0.3 * a) * (1 + v[..., 0]), a * b + xp.sin(v[..., 1]) + 0.1 * k], axis=-1
    )


NONLINEAR = DiscreteSystem(f, h, np.diag([0.1, 0.2]), np.diag([0.05, 0.02]))
START = Gaussian(np.array([0.8, -0.2]), np.array([[0.3, 0.05], [0.05, 0.1]]))


def fly(name, system, prior, y, u=None, **options):
    """The history of a filter of the catalogue."""
    dynamics = system.dynamics(u)
    return run(
        FILTERS[name], prior, y, system.sensor, dynamics=dynamics, z_per_step=True, **options
    )


def ekf(system, prior, y, u=None, form="joseph", **options):
    """The history of the DT-EKF."""
    return run(
        replace(FILTERS["EKF"], form=form),
        prior,
        y,
        system.sensor,
        dynamics=system.dynamics(u),
        z_per_step=True,
        **options,
    )


def predict(system, posterior, u, k):
    """One prediction, from step k to step k + 1."""
    EKF = FILTERS["EKF"]
    dynamics = system.dynamics(np.repeat(u[None], k + 1, axis=0) if u.size else None)
    return EKF.predict(EKF.init(posterior), dynamics, k).estimate


def update(system, prior, y, k):
    """One update, at step k."""
    EKF = FILTERS["EKF"]
    return EKF.update(EKF.init(prior), y, system.sensor, k - 1).estimate
