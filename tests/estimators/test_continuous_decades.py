"""Kalman-Bucy filters whose covariance falls, or rises, by many decades."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import RK45
from untraced import untraced

from navfilters import Gaussian
from navfilters.estimators.continuous import ContinuousSystem, extended_kalman_bucy

# A covariance that falls, or rises, by many decades.


def scalar(a, q, r, **jacobians):
    """dx/dt = a x + w,   y = x + v."""
    f, h = lambda x, u, w, t: a * x + w, lambda x, v, t: x + v
    return ContinuousSystem(f, h, [[q]], [[r]], **jacobians)


def constant(value):
    return lambda *_: np.array([[value]])


def scalar_riccati(a, q, r, p, t):
    """The variance, in closed form."""
    rate = np.sqrt(a * a + q / r)
    th = np.tanh(rate * t) / rate if rate else t
    return (p + (a * p + q) * th) / (1 + (p / r - a) * th)


@pytest.mark.parametrize("p", [0.0, 1e-12, 1.0, 1e6, 1e9, 1e12])
@pytest.mark.parametrize("r", [1e-6, 1e-2])
@pytest.mark.parametrize(("a", "q"), [(0.0, 0.0), (-1.0, 1e-8), (0.5, 1.0)])
@pytest.mark.parametrize("start", [0.0, 0.5])
@untraced()
def test_a_variance_over_many_decades(a, q, r, p, start):
    """Digits of the variance that is asked for, not of the prior's, from a microsecond on.

    With the Jacobians given: the tests below compute the same ones, which takes longer than the
    filter does.
    """
    after = np.array([0.0, 1e-6, 1e-3, 0.1, 1.0])
    prior = Gaussian(np.zeros(1), np.array([[p]]))
    system = scalar(a, q, r, A=constant(a), L=constant(1.0), C=constant(1.0), M=constant(1.0))
    got = extended_kalman_bucy(system, prior, lambda t: np.ones(1), start + after)
    wanted = scalar_riccati(a, q, r, p, after)
    assert_allclose(got.cov[:, 0, 0], wanted, rtol=1e-5, atol=0)
    if a == q == 0 and p > 0:
        mean = after / (r / p + after)
        assert (np.abs(got.mean[:, 0] - mean) <= 1e-5 * np.sqrt(wanted) + 1e-7).all()


@pytest.mark.parametrize("method", ["RK45", "LSODA", "Radau", "BDF"])
def test_every_integrator_follows(method):
    prior = Gaussian(np.zeros(1), np.array([[1e12]]))
    options = {"rtol": 1e-6, "atol": 1e-6, "method": method}
    times = np.array([0.0, 1e-3, 1.0])
    got = extended_kalman_bucy(scalar(0, 0, 1e-3), prior, lambda t: np.ones(1), times, **options)
    assert_allclose(got.cov[:, 0, 0], scalar_riccati(0, 0, 1e-3, 1e12, times), rtol=1e-2)


@pytest.mark.parametrize("vague", [1e3, 1e6, 1e9, 1e12])
@pytest.mark.parametrize("r", [1e-6, 1e-2])
@untraced()
def test_position_and_velocity_from_a_vague_prior(vague, r):
    """P^-1 = F^-T (P_0^-1 + W) F^-1: what the measurements of the position add up to."""
    system = ContinuousSystem(
        lambda x, u, w, t: np.stack([x[1] + 0 * w[0], 0 * x[0] + 0 * w[0]]),
        lambda x, v, t: x[:1] + v,
        [[0.0]],
        [[r]],
    )
    prior = Gaussian(np.zeros(2), vague * np.eye(2))
    times = np.array([0.0, 0.01, 1.0, 10.0])
    got = extended_kalman_bucy(system, prior, lambda t: np.ones(1), times)
    for t, P in zip(times[1:], got.cov[1:], strict=True):
        F = np.array([[1, t], [0, 1]])
        W = np.array([[t, t**2 / 2], [t**2 / 2, t**3 / 3]]) / r
        wanted = F @ np.linalg.inv(np.eye(2) / vague + W) @ F.T
        size = np.sqrt(np.diagonal(wanted))
        assert_allclose(P / np.outer(size, size), wanted / np.outer(size, size), atol=1e-4)
        assert np.linalg.eigvalsh(P / np.outer(size, size)).min() > 0


def test_a_state_known_exactly_in_tiny_units():
    """Position known, in a unit in which the noise is 1e-24: the variance grows as q t^3 / 3."""
    system = ContinuousSystem(
        lambda x, u, w, t: np.stack([x[1] + 0 * w[0], 0 * x[0] + w[0]]),
        lambda x, v, t: x[:1] + v,
        [[1e-24]],
        [[1e6]],
    )
    prior = Gaussian(np.zeros(2), np.zeros((2, 2)))
    got = extended_kalman_bucy(system, prior, lambda t: np.zeros(1), [0.0, 1.0, 2.0])
    t = got.t[:, None, None]
    wanted = 1e-24 * np.block([[t**3 / 3, t**2 / 2], [t**2 / 2, t]])
    assert_allclose(got.cov, wanted, rtol=1e-5)


class Faulty(RK45):
    """An integrator that takes too much from a variance in the fourth step."""

    def _step_impl(self):
        done = super()._step_impl()
        self.steps = getattr(self, "steps", 0) + 1
        if self.steps == 4:
            self.y[1] = -1e-3 * abs(self.y[1])
        return done


def test_a_covariance_that_is_lost_is_reported():
    """Also where no output is asked for, with the time and what to do."""
    prior = Gaussian(np.zeros(1), np.ones((1, 1)))
    message = r"covariance is lost at t = 0\..* eigenvalue is -.*Reduce rtol and atol \(now 1e-08"
    with pytest.raises(RuntimeError, match=message):
        extended_kalman_bucy(
            scalar(0, 1, 1), prior, lambda t: np.zeros(1), [0.0, 3.0], method=Faulty
        )
