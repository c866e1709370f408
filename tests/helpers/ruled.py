"""Problems for filters with a rule, and the formulas that xiong2009 prints for all of them.

The references run one member at a time, with numpy.linalg and no line of the library.
"""

from dataclasses import dataclass

import numpy as np
from moving import Swing
from naive import covariances, quadratic

from navfilters import Filter, Gaussian
from navfilters.estimators.adaptive import AdaptiveNoise
from navfilters.estimators.gated_inflation import GatedInflation
from navfilters.estimators.robust import AdaptiveRobust, Robust
from navfilters.estimators.strong_tracking import StrongTracking
from navfilters.models import Linear

inv = np.linalg.inv


@dataclass(frozen=True, eq=False)
class Matched:
    """f(x) = G x, with a Jacobian that is off by beta: Eq. (15) holds with this beta, exactly."""

    G: np.ndarray
    beta: np.ndarray
    Q: np.ndarray

    def transition(self, x):
        return (self.G @ x[..., None])[..., 0], inv(self.beta) @ self.G + 0 * x[..., None]


class SubStepped(Swing):
    """Three sub-steps' worth of noise."""

    def propagate(self, x, Q):
        return *self.transition(x), 3 * Q


@dataclass(frozen=True, eq=False)
class Problem:
    prior: Gaussian
    z: np.ndarray  # (steps, members, m)
    dynamics: Swing
    sensor: object
    directions: np.ndarray


def problem(n=3, m=2, members=4, steps=30, noise=4.0, dynamics=Swing):
    """Measurements that wander, so that innovations are correlated and sometimes large."""
    rng = np.random.default_rng(10 * n + m)
    G = 0.9 * np.linalg.qr(rng.normal(size=(n, n)))[0]
    sensor = quadratic(rng, m, n)
    sensor = type(sensor)(sensor.H, 0.02 * sensor.A, sensor.R)
    z = noise * np.cumsum(rng.normal(size=(steps, members, m)), axis=0) / 2
    prior = Gaussian(rng.normal(size=(members, n)), covariances(rng, (members,), n))
    moved = dynamics(G, 0.2 * covariances(rng, (), n))
    return Problem(prior, z, moved, sensor, rng.normal(size=(n, m)) / np.sqrt(n))


def linear_problem():
    p = problem(4, 3)
    sensor = Linear(p.sensor.H, p.sensor.R)
    return Problem(p.prior, p.z, Matched(p.dynamics.G, np.eye(4), p.dynamics.Q), sensor, None)


def go(estimator, p, steps=None, prior=None, z=None):
    """Every state of a run."""
    states = [estimator.init(prior or p.prior)]
    z = p.z if z is None else z
    for measured in z[:steps]:
        states.append(estimator.step(states[-1], measured, p.sensor, p.dynamics))
    return states


def ruled(rule, p, steps=None, **given):
    """The same of the EKF with a rule."""
    return go(Filter(rule=rule), p, steps, **given)


RULES = {
    "EKF": lambda p: None,
    "REKF": lambda p: Robust(1.5),
    "AEKF": lambda p: AdaptiveNoise(a=0.5, N=8, directions=p.directions),
    "AREKF": lambda p: AdaptiveRobust(),
    "strong tracking": lambda p: StrongTracking(),
    "gated": lambda p: GatedInflation(),
}
SIZES = [(1, 1), (3, 2), (6, 2), (4, 3)]


def printed_prediction(x, P, dynamics, Q=None):
    """Eqs. (3), (4)."""
    x, F = dynamics.transition(x)
    return x, F @ P @ F.T + (dynamics.Q if Q is None else Q)


def printed_update(x, Sigma, z, sensor):
    """Eqs. (6)-(9), the covariance by (9) itself."""
    H = sensor.jacobian(x)
    K = Sigma @ H.T @ inv(H @ Sigma @ H.T + sensor.R)
    return x + K @ (z - sensor.h(x)), inv(inv(Sigma) + H.T @ inv(sensor.R) @ H)


def printed_steps(printed, states, p):
    """Pairs (got, wanted): each step from the library's last estimate, with its own memory.

    ``printed`` is a generator function (estimates, z, p) of one member.
    """
    for i in range(p.z.shape[1]):
        estimates = [(s.estimate.mean[i], s.estimate.cov[i]) for s in states]
        steps = printed(estimates[:-1], p.z[:, i], p)
        for got, wanted in zip(estimates[1:], steps, strict=True):
            yield from zip(got, wanted, strict=True)


def assert_printed(printed, states, p):
    """To 1e-10 of the largest element."""
    for a, b in printed_steps(printed, states, p):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-10 * np.abs(b).max())
