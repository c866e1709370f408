"""Gaussian second order, cubature and square roots, against quadrature and filterpy 2.0.0."""

from itertools import product

import mpmath
import numpy as np
import pytest
from filterpy.kalman import CubatureKalmanFilter, SquareRootKalmanFilter
from naive import covariances, quadratic
from numpy.testing import assert_allclose

from navfilters import Filter, Gaussian, run, second_order
from navfilters.estimators import LATER_FILTERS, cubature, gaussian_second_order, second_order_bias
from navfilters.models import Linear, RangeBearing


def by_quadrature(function, x, P, order=6):
    """Mean and covariance of a function of N(x, P), exact for polynomials of degree 5."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(order)
    index = list(product(range(order), repeat=len(x)))
    w = np.array([np.prod(weights[list(i)]) for i in index])
    w /= w.sum()
    X = x + np.array([nodes[list(i)] for i in index]) @ np.linalg.cholesky(P).T
    Z = function(X)
    mean = w @ Z
    return mean, (w[:, None] * (Z - mean)).T @ (Z - mean), (w[:, None] * (X - x)).T @ (Z - mean)


@pytest.mark.parametrize(("m", "n"), [(1, 1), (2, 3), (3, 2)])
def test_gaussian_second_order_has_the_exact_moments_of_a_quadratic(m, n):
    rng = np.random.default_rng(10 * m + n)
    model = quadratic(rng, m, n)
    prior = Gaussian(rng.normal(size=(4, n)), covariances(rng, (4,), n))
    got = gaussian_second_order(prior, model)
    for i, (x, P) in enumerate(zip(*prior, strict=True)):
        z_hat, P_zz, P_xz = by_quadrature(model.h, x, P)
        scale = np.abs(P_zz).max()
        assert_allclose(got.z_hat[i], z_hat, atol=1e-11 * scale)
        assert_allclose(got.P_zz[i], P_zz + model.R, atol=1e-11 * scale)
        assert_allclose(got.P_xz[i], P_xz, atol=1e-11 * scale)


def test_the_two_second_order_filters_differ_by_the_fourth_moments():
    """b b^T + C: what the mtSOF subtracts, and what it does not add."""
    rng = np.random.default_rng(0)
    model, prior = quadratic(rng, 2, 3), Gaussian(rng.normal(size=3), covariances(rng, (), 3))
    more = gaussian_second_order(prior, model).P_zz - second_order(prior, model).P_zz
    b = second_order_bias(prior, model)
    bent = by_quadrature(
        lambda X: model.h(X) - (X - prior.mean) @ model.jacobian(prior.mean).T, *prior
    )
    assert_allclose(more, np.outer(b, b) + bent[1], rtol=1e-10)


class Bent:
    """x -> a quadratic of x."""

    def __init__(self, model):
        self.model, self.Q = model, 0.1 * model.R

    def f(self, x):
        return self.model.h(x)


@pytest.mark.parametrize("moments", [gaussian_second_order, cubature])
def test_predictions_are_the_moments_of_f(moments):
    rng = np.random.default_rng(3)
    motion = Bent(quadratic(rng, 3, 3))
    prior = Gaussian(rng.normal(size=3), 0.1 * covariances(rng, (), 3))
    filter_ = Filter(moments)
    got = filter_.predict(filter_.init(prior), motion).estimate
    mean, cov, _ = by_quadrature(motion.f, *prior)
    assert_allclose(got.mean, mean, rtol=1e-10)
    if moments is cubature:  # exact to the third degree: its covariance is that of its points
        root = np.sqrt(3) * np.linalg.cholesky(prior.cov)
        Y = motion.f(prior.mean + np.concatenate([root.T, -root.T]))
        cov = (Y - mean).T @ (Y - mean) / 6
    assert_allclose(got.cov, cov + motion.Q, rtol=1e-9, atol=1e-12)


def h(x):
    return np.array([np.hypot(x[0], x[1]), np.arctan2(x[1], x[0])])


class Spiral:
    """A turn and a push; nothing linear."""

    Q = np.diag([0.2, 0.1])

    def f(self, x):
        xp = x.__array_namespace__()
        return xp.stack([x[..., 0] + 0.01 * x[..., 1] ** 2, x[..., 1] - 3 * xp.sin(x[..., 0])], -1)


def test_cubature_is_filterpys():
    """Its points are drawn again from what they predict, as ours are."""
    model = RangeBearing(np.diag([0.04, 1e-3]))
    rng = np.random.default_rng(4)
    prior = Gaussian(np.array([30.0, 40.0]), np.array([[9.0, 2.0], [2.0, 4.0]]))
    z = h(prior.mean) + rng.normal(size=(20, 2)) * [0.2, 0.03]
    peer = CubatureKalmanFilter(2, 2, 1.0, hx=h, fx=lambda x, dt: Spiral().f(x))
    peer.x, peer.P, peer.R, peer.Q = prior.mean[:, None], prior.cov, model.R, Spiral.Q
    filter_ = LATER_FILTERS["CKF"]
    state = filter_.init(prior)
    for k in range(3):
        peer.predict()
        state = filter_.predict(state, Spiral(), k)
        assert_allclose(state.estimate.mean, np.ravel(peer.x), rtol=1e-10)
        assert_allclose(state.estimate.cov, peer.P, rtol=1e-9)
        # filterpy does not draw its points again: let both begin from the same Gaussian
        own = LATER_FILTERS["CKF"](state.estimate, z[k], model)
        root = np.sqrt(2) * np.linalg.cholesky(state.estimate.cov)
        peer.sigmas_f = state.estimate.mean + np.concatenate([root.T, -root.T])
        peer.update(z[k][:, None])
        assert_allclose(own.mean, np.ravel(peer.x), rtol=1e-10)
        assert_allclose(own.cov, peer.P, rtol=1e-8, atol=1e-12)
        state = filter_.update(state, z[k], model, k)


def test_square_root_is_filterpys():
    rng = np.random.default_rng(5)
    H, R = rng.normal(size=(2, 3)), covariances(rng, (), 2)
    prior = Gaussian(rng.normal(size=3), covariances(rng, (), 3))
    F, Q = np.linalg.qr(rng.normal(size=(3, 3)))[0], 0.2 * covariances(rng, (), 3)
    z = rng.normal(size=(30, 2))
    peer = SquareRootKalmanFilter(3, 2)
    peer.x, peer.P, peer.F, peer.Q, peer.H, peer.R = prior.mean[:, None], prior.cov, F, Q, H, R

    class Turn:
        def transition(self, x):
            return (F @ x[..., None])[..., 0], F

    Turn.Q = Q
    got = run(LATER_FILTERS["SR-EKF"], prior, z, Linear(H, R), dynamics=Turn(), z_per_step=True)
    for k in range(30):
        peer.predict()
        peer.update(z[k][:, None])
    assert_allclose(got.mean[-1], peer.x[:, 0], rtol=1e-10)
    assert_allclose(got.cov[-1], peer.P, rtol=1e-10)


def test_what_rounding_costs_the_other_forms():
    """Two nearly equal sums of three states, measured to 1e-9: in P_zz, 3 + (1e-9)^2 is 3.

    The exact covariance is mpmath's, of the same binary numbers, in the information form.
    """
    d = 1e-9
    model = Linear(np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0 + d]]), d**2 * np.eye(2))
    with mpmath.workdps(60):
        H = mpmath.matrix(model.H.tolist())
        information = mpmath.eye(3) + H.T * H / mpmath.mpf(model.R[0, 0])
        exact = np.array((information**-1).tolist(), dtype=float)
    prior = Gaussian(np.zeros(3), np.eye(3))
    cov = LATER_FILTERS["SR-EKF"](prior, np.zeros(2), model).cov
    assert_allclose(cov, exact, atol=1e-6)
    assert np.linalg.eigvalsh(cov)[0] > -1e-16
    for form in ("short", "joseph"):
        with np.errstate(all="ignore"):
            assert not np.isfinite(Filter(form=form)(prior, np.zeros(2), model).cov).any()
