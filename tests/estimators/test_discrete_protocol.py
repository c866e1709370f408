"""A discrete system under all that the protocol has: moments, engines, drop-outs, forms."""

from dataclasses import replace

import numpy as np
import pytest
from discrete_systems import (
    LINEAR,
    NONLINEAR,
    PRIOR,
    START,
    H,
    M,
    R,
    ekf,
    f,
    fly,
    grown,
    h,
    predict,
    signals,
)
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Gaussian, SigmaPoints, sweep
from navfilters.estimators.discrete import DiscreteSystem


def quotients(function, x):
    """Differences of second order, of real or complex numbers."""
    step = 1e-5 * np.eye(2)
    return np.stack([(function(x + e) - function(x - e)) / 2e-5 for e in step], axis=-1)


def test_the_unscented_filter_sees_the_noises_linearised():
    """One step with the sigma points by hand: additive noise L Q L^T at the prior's mean."""
    UKF = FILTERS["UKF"].having(points=SigmaPoints(beta=0.0, kappa=0.0))  # W_0 = 0, W_i = 1/4
    got = UKF.predict(UKF.init(START), NONLINEAR.dynamics([[0.3]])).estimate
    root = np.linalg.cholesky(2 * START.cov)
    points = START.mean + np.vstack([root.T, -root.T])
    moved = f(points, np.array([0.3]), np.zeros(2), 0)
    noise = quotients(lambda w: f(START.mean, np.array([0.3]), w, 0), np.zeros(2))
    off = moved - moved.mean(axis=0)
    assert_allclose(got.mean, moved.mean(axis=0), rtol=1e-12)
    assert_allclose(got.cov, off.T @ off / 4 + noise @ NONLINEAR.Q @ noise.T, rtol=1e-8)


def test_the_second_order_filter_takes_its_hessians_from_f_and_h():
    y, u = signals()
    got = fly("mtSOF", NONLINEAR, START, y[:4], u[:4, :1])
    by_hand = replace(
        NONLINEAR,
        F=lambda x, u, w, k: quotients(lambda z: f(z, u, w, k), x),
        H=lambda x, v, k: quotients(lambda z: h(z, v, k), x),
    )
    assert np.isfinite(got.mean).all()
    assert_allclose(fly("mtSOF", by_hand, START, y[:4], u[:4, :1]).mean, got.mean, rtol=1e-8)
    assert np.abs(got.mean - ekf(NONLINEAR, START, y[:4], u[:4, :1]).mean).max() > 1e-3


@pytest.mark.parametrize("engine", ["numpy", "jax"])
@pytest.mark.parametrize("name", ["EKF", "UKF", "mtSOF"])
def test_a_sweep_flies_it(engine, name):
    """Members, inputs of their own, on both engines; Jacobians by complex step, or by JAX."""
    y, u = signals(members=(4,))
    prior = Gaussian(START.mean + 0.1 * np.arange(4.0)[:, None], START.cov)
    wanted = fly(name, NONLINEAR, prior, y[:6], u[:6, :, :1])
    for inputs, members in ((u[:6, :, :1], 4), (u[:6, 0, :1], 1)):
        got = sweep(
            FILTERS[name],
            prior,
            y[:6],
            NONLINEAR.sensor,
            dynamics=NONLINEAR.dynamics(inputs),
            z_per_step=True,
            chunk=3,
            engine=engine,
            progress=False,
        ).final
        assert_allclose(got.mean[:members], wanted.mean[-1, :members], rtol=1e-7, atol=1e-9)
        assert_allclose(got.cov[:members], wanted.cov[-1, :members], rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("name", ["EKF", "UKF", "mtSOF"])
def test_what_was_not_measured_is_predicted_through(name):
    """Case 07: a drop-out leaves the state finite, where the motion takes it, and less known."""
    system = DiscreteSystem(lambda x, u, w, k: x + w, lambda x, v, k: x + v, [[0.01]], [[1.0]])
    got = fly(name, system, Gaussian([0.0], [[4.0]]), [[1.0], [np.nan], [3.0]])
    assert np.isfinite(got.mean).all()
    assert_array_equal(got.mean[2], got.mean[1])
    assert_allclose(got.cov[2], got.cov[1] + 0.01, rtol=1e-15)
    gain = got.cov[2] + 0.01
    gain = gain / (gain + 1)
    assert_allclose(got.mean[3], got.mean[2] + gain[0] * (3 - got.mean[2]), rtol=1e-12)


def test_one_component_may_be_missing():
    """An update by the other one alone."""
    y, u = signals()
    y[3, 0] = np.nan
    got = ekf(LINEAR, PRIOR, y, u)
    prior = predict(LINEAR, Gaussian(got.mean[3], got.cov[3]), u[3], 3)
    row, noise = H[1:] / grown(4), (grown(4) ** 2 * M @ R @ M.T)[1:, 1:]
    K = prior.cov @ row.T / (row @ prior.cov @ row.T + noise)
    assert_allclose(got.mean[4], prior.mean + K @ (y[3, 1:] - row @ prior.mean), rtol=1e-12)


def test_both_forms_are_one_filter():
    y, u = signals()
    short, joseph = (ekf(NONLINEAR, START, y, u[:, :1], form=form) for form in ("short", "joseph"))
    assert_allclose(short.mean, joseph.mean, rtol=1e-11)
    assert_allclose(short.cov, joseph.cov, rtol=1e-9, atol=1e-14)
