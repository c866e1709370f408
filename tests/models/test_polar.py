"""Polar states: there and back, a linear measurement, and motion seen in polar coordinates."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from polar_models import engines

from navfilters import FILTERS, Gaussian, run, sweep
from navfilters.models import InPolar, PolarState, RangeBearing, to_cartesian, to_polar

R = np.diag([0.25, 1e-4])


@dataclass(frozen=True, eq=False)
class Straight:
    """Constant velocity in the plane, with noise in it."""

    Q: np.ndarray

    def f(self, x):
        xp = x.__array_namespace__()
        return x + xp.concat([x[..., 2:], 0 * x[..., 2:]], axis=-1)


STRAIGHT = Straight(np.diag([0.01, 0.02, 0.003, 0.004]))


def states(count=50):
    return np.random.default_rng(0).normal(size=(count, 4)) * [50.0, 50.0, 2.0, 2.0]


@pytest.mark.parametrize("n", [2, 4])
def test_there_and_back(n):
    x = states()[:, :n]
    assert_allclose(to_cartesian(to_polar(x)), x, rtol=1e-11, atol=1e-12)


def test_rates_are_the_derivatives():
    x, h = states(), 1e-6
    ahead, behind = (
        to_polar((x + s * h * np.roll(x, 2, -1) * [1, 1, 0, 0])[:, :2]) for s in (1, -1)
    )
    assert_allclose(to_polar(x)[:, 2:], (ahead - behind) / (2 * h), rtol=1e-5, atol=1e-6)


def test_a_static_point_is_the_mean_of_what_was_measured():
    """Closed form: inverse variances add, range and bearing apart; across the jump of 2 pi."""
    rng = np.random.default_rng(1)
    truth = np.array([80.0, np.pi])
    z = truth + rng.normal(size=(100, 20, 2)) * np.sqrt(np.diag(R))
    wrapped = np.stack([z[..., 0], np.arctan2(np.sin(z[..., 1]), np.cos(z[..., 1]))], axis=-1)
    prior = Gaussian(np.array([60.0, 3.0]), np.diag([400.0, 0.5]))
    got = run(FILTERS["EKF"], prior, wrapped, PolarState(R), z_per_step=True)
    weight = 1 / np.diag(prior.cov) + 100 / np.diag(R)
    mean = (prior.mean / np.diag(prior.cov) + z.sum(axis=0) / np.diag(R)) / weight
    assert_allclose(got.mean[-1], mean, rtol=1e-10)
    assert_allclose(got.cov[-1, 0], np.diag(1 / weight), rtol=1e-9, atol=1e-16)


def test_motion_is_the_cartesian_one():
    x = states()
    p = to_polar(x)
    assert_allclose(to_cartesian(InPolar(STRAIGHT).f(p)), STRAIGHT.f(x), rtol=1e-9, atol=1e-9)


def test_a_bearing_goes_on_through_the_jump():
    """Twice around: the state counts the turns."""
    p, dynamics = np.array([10.0, 3.0, 0.0, 0.3]), InPolar(STRAIGHT)
    after = dynamics.f(p)
    assert np.pi < after[1] < 3.4
    far = p + np.array([0.0, 4 * np.pi, 0.0, 0.0])
    assert_allclose(dynamics.f(far) - after, [0, 4 * np.pi, 0, 0], atol=1e-12)


def test_noise_and_derivative_are_the_spread_of_samples():
    """Predicted covariance against samples that are moved in the plane and measured in polar."""
    rng = np.random.default_rng(2)
    p = to_polar(np.array([-40.0, 1.0, 1.0, -2.0]))
    P = np.diag([1e-2, 1e-5, 1e-4, 1e-6])
    x, F, W = InPolar(STRAIGHT).propagate(p, STRAIGHT.Q)
    start = rng.multivariate_normal(p, P, 200_000)
    moved = STRAIGHT.f(to_cartesian(start))
    moved = moved + rng.multivariate_normal(np.zeros(4), STRAIGHT.Q, len(moved))
    off = to_polar(moved) - x
    off[:, 1] -= 2 * np.pi * np.round(off[:, 1] / (2 * np.pi))
    wanted = np.cov(off.T)
    scale = np.sqrt(np.diag(wanted))
    assert np.abs((F @ P @ F.T + W - wanted) / np.outer(scale, scale)).max() < 0.02


@engines
@pytest.mark.parametrize("name", ["EKF", "UKF"])
def test_run_and_sweep_with_a_moving_point(name, engine):
    """It agrees with what the plane's filter would know of a distant point, and with itself."""
    rng = np.random.default_rng(3)
    x = np.array([-100.0, 3.0, 1.0, -2.0]) + np.zeros((3, 4))
    z = []
    for _ in range(15):
        x = STRAIGHT.f(x) + rng.multivariate_normal(np.zeros(4), STRAIGHT.Q, 3)
        z.append(RangeBearing(R).h(x[:, :2]) + rng.normal(size=(3, 2)) * np.sqrt(np.diag(R)))
    z = np.stack(z)
    z[4, 1] = z[6, 2, 0] = np.nan
    prior = Gaussian(to_polar(np.array([-98.0, 5.0, 0.0, -1.0])), np.diag([9.0, 1e-3, 4.0, 1e-3]))
    options = {"dynamics": InPolar(STRAIGHT), "z_per_step": True}
    history = run(FILTERS[name], prior, z, PolarState(R), **options)
    last = sweep(
        FILTERS[name], prior, z, PolarState(R), engine=engine, progress=False, **options
    ).final
    assert_allclose(last.mean, history.mean[-1], rtol=1e-8)
    assert np.abs(to_cartesian(last.mean) - x)[:, :2].max() < 3


def test_its_derivatives_are_constant():
    x, model = states(), PolarState(R)
    assert_array_equal(model.h(x), x[:, :2])
    assert_array_equal(model.jacobian(x), np.broadcast_to(np.eye(2, 4), (50, 2, 4)))
    assert not model.hessian(x).any()
    assert_allclose(
        model.residual(np.array([1.0, 3.1]), np.array([1.0, -3.1])), [0, 6.2 - 2 * np.pi]
    )
