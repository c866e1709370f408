"""The EKF and the UKF of filterpy 2.0.0, another implementation, over a thousand updates."""

from functools import partial

import numpy as np
import pytest
import scipy.linalg
from filterpy.kalman import ExtendedKalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter

from navfilters import FILTERS, SigmaPoints, run
from navfilters.papers.perea2007.experiment import Setup, position_error

SETUPS = {
    "baseline": Setup(),
    "fourth quadrant": Setup((150.0, -60.0), (120.0, -20.0), 30.0, 100.0, 0.01),
}
every_setup = pytest.mark.parametrize("setup", SETUPS.values(), ids=SETUPS)
ROOTS = {"cholesky": scipy.linalg.cholesky, "symmetric": lambda P: scipy.linalg.sqrtm(P).real}


def h(x):
    return np.array([np.hypot(x[0], x[1]), np.arctan2(x[1], x[0])])


def jacobian(x):
    r = np.hypot(x[0], x[1])
    return np.array([[x[0] / r, x[1] / r], [-x[1] / r**2, x[0] / r**2]])


def start(peer, setup):
    peer.x, peer.P = np.array(setup.x0), setup.sigma**2 * np.eye(2)
    peer.R = np.diag([setup.range_variance, setup.bearing_variance])
    return h(setup.x_true)


def assert_agrees(ours, x, P, setup):
    """At every step: states within 1e-6 of the position error, covariances within 1e-6."""
    error = position_error(ours.mean, setup.x_true)
    assert np.all(np.abs(ours.mean - x).max(axis=1) < 1e-6 * error)
    assert np.all(np.abs(ours.cov - P).max(axis=(1, 2)) < 1e-6 * np.abs(P).max(axis=(1, 2)))


@every_setup
def test_ekf(setup):
    """Its covariance update is Joseph's form, ours Eq. (7)."""
    peer = ExtendedKalmanFilter(dim_x=2, dim_z=2)
    z = start(peer, setup)
    x, P = [peer.x], [peer.P]
    for _ in range(1000):
        peer.update(z, jacobian, h)
        x.append(peer.x)
        P.append(peer.P)
    assert_agrees(run(FILTERS["EKF"], setup.prior, setup.z, setup.model), x, P, setup)


@every_setup
@pytest.mark.parametrize(
    ("root", "alpha", "beta", "kappa"),
    [("cholesky", 1.0, 2.0, 1.0), ("symmetric", 0.8, 2.0, 3.3), ("cholesky", 0.5, 0.0, 1.0)],
)
def test_ukf(setup, root, alpha, beta, kappa):
    """Prediction with Q = 0 makes it redraw its sigma points; their columns are our columns."""
    points = MerweScaledSigmaPoints(2, alpha, beta, kappa, sqrt_method=ROOTS[root])
    peer = UnscentedKalmanFilter(2, 2, dt=1.0, hx=h, fx=lambda x, dt: x, points=points)
    z = start(peer, setup)
    peer.Q = np.zeros((2, 2))
    x, P = [peer.x], [peer.P]
    for _ in range(1000):
        peer.predict()
        peer.update(z)
        x.append(peer.x)
        P.append(peer.P)
    estimator = partial(FILTERS["UKF"], points=SigmaPoints(alpha, beta, kappa, root))
    assert_agrees(run(estimator, setup.prior, setup.z, setup.model), x, P, setup)
