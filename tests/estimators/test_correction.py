"""Iterated, recursive, recalibrated: each against its source written plainly, or another route."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import scipy.optimize
from naive import covariances, kalman, linearized, quadratic, unscented
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import Filter, Gaussian, SigmaPoints
from navfilters.estimators import (
    LATER_FILTERS,
    cubature,
    gaussian_second_order,
    iterated,
    recursive,
)
from navfilters.estimators import moments as ours
from navfilters.models import RangeBearing

MOMENTS = {
    "linearised": ours.linearized,
    "Gaussian second order": gaussian_second_order,
    "cubature": cubature,
}


def bent(n=3, m=3, count=5, curved=0.1, seed=0):
    """A problem whose quadratic terms are felt, but do not rule."""
    rng = np.random.default_rng(seed)
    model = quadratic(rng, m, n)
    model = replace(model, A=curved * model.A)
    prior = Gaussian(rng.normal(size=(count, n)), 0.3 * covariances(rng, (count,), n))
    return prior, model.h(prior.mean) + 0.5 * rng.normal(size=(count, m)), model


def size(A):
    return np.abs(A).max()


def close(got, wanted, tolerance=1e-10):
    for ours_, theirs in zip(got, wanted, strict=True):
        assert size(ours_ - theirs) < tolerance * size(theirs)


def test_the_iterated_ekf_ends_at_the_most_probable_state():
    """scipy's least squares of the whitened residuals; its Hessian is the information."""
    prior, z, model = bent()
    got = LATER_FILTERS["IEKF"](prior, z, model, iterations=60)
    noise = np.linalg.inv(np.linalg.cholesky(model.R))
    for i, (x, P) in enumerate(zip(*prior, strict=True)):
        root = np.linalg.inv(np.linalg.cholesky(P))

        def residuals(y, x=x, root=root, i=i):
            return np.concatenate([root @ (y - x), noise @ (z[i] - model.h(y))])

        best = scipy.optimize.least_squares(residuals, x, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        assert_allclose(got.mean[i], best.x, atol=1e-7)
        assert_allclose(got.cov[i], np.linalg.inv(best.jac.T @ best.jac), atol=1e-6)


def zanetti(x, P, z, model, N):
    """The recursion as it is printed, with the covariance C of error and noise."""
    C = np.zeros((len(x), len(z)))
    for i in range(1, N + 1):
        H = model.jacobian(x)
        S = H @ P @ H.T + H @ C + C.T @ H.T + model.R
        K = (P @ H.T + C) @ np.linalg.inv(S) / (N + 1 - i)
        A = np.eye(len(x)) - K @ H
        x = x + K @ (z - model.h(x))
        P, C = (
            A @ P @ A.T + K @ model.R @ K.T - A @ C @ K.T - K @ C.T @ A.T,
            A @ C - K @ model.R,
        )
    return x, P


@pytest.mark.parametrize("N", [1, 2, 7])
def test_the_recursive_update_is_its_recursion(N):
    prior, z, model = bent()
    got = LATER_FILTERS["RUF"](prior, z, model, updates=N)
    close(got, _rows(prior, z, partial(zanetti, model=model, N=N)))


def _rows(prior, z, function):
    pairs = [function(x, P, z[i]) for i, (x, P) in enumerate(zip(*prior, strict=True))]
    return tuple(map(np.stack, zip(*pairs, strict=True)))


def dense(x, P, model, order=12):
    """H, b and Omega of the best affine fit of h under N(x, P), by Gauss and Hermite's points."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(order)
    n = len(x)
    grid = np.stack(np.meshgrid(*[nodes] * n, indexing="ij"), -1).reshape(-1, n)
    w = np.prod(np.stack(np.meshgrid(*[weights] * n, indexing="ij"), -1).reshape(-1, n), axis=1)
    w = w / w.sum()
    X = x + grid @ np.linalg.cholesky(P).T
    Z = model.h(X)
    z_hat = w @ Z
    H = np.linalg.solve(P, (w[:, None] * (X - x)).T @ (Z - z_hat)).T
    rest = Z - z_hat - (X - x) @ H.T
    return H, z_hat - H @ x, (w[:, None] * rest).T @ rest


def posterior_linearisation(x, P, z, model, iterations):
    m, S = x, P
    for _ in range(iterations):
        H, b, Omega = dense(m, S, model)
        m, S = kalman(x, P, z - b, H, model.R + Omega)
    return m, S


@pytest.mark.parametrize("iterations", [1, 3, 40])
@pytest.mark.parametrize(
    ("moments", "n"),
    [
        (gaussian_second_order, 2),
        (gaussian_second_order, 3),
        (partial(ours.unscented, points=SigmaPoints(1.0, 0.0, 2.0)), 1),
    ],
)
def test_posterior_linearisation_by_dense_quadrature(moments, n, iterations):
    """Where the moments are exact, every iterate and the fixed point are those of quadrature."""
    prior, z, model = bent(n=n, m=2)
    filter_ = Filter(moments, correction=partial(iterated, iterations=iterations))
    wanted = _rows(prior, z, partial(posterior_linearisation, model=model, iterations=iterations))
    close(filter_(prior, z, model), wanted, 1e-9)


def test_posterior_linearisation_by_few_points_is_near():
    """Range and bearing at 50 with five units of doubt: 2 n points for 144, to 2 % of a sigma."""
    rng = np.random.default_rng(1)
    model = RangeBearing(np.diag([0.04, 1e-3]))
    truth = np.array([30.0, 40.0])
    prior = Gaussian(truth + 3 * rng.normal(size=(5, 2)), 25 * covariances(rng, (5,), 2) / 4)
    z = np.broadcast_to(model.h(truth), (5, 2))
    got = LATER_FILTERS["IPLF"](prior, z, model)
    mean, cov = _rows(prior, z, partial(posterior_linearisation, model=model, iterations=10))
    sigma = np.sqrt(np.linalg.eigvalsh(cov)[:, -1])
    assert (np.linalg.norm(got.mean - mean, axis=-1) < 0.02 * sigma).all()
    assert_allclose(got.cov, cov, atol=0.02 * size(cov))


def recalibration(x, P, z, model, moments):
    z_hat, S, C = moments(x, P, model)
    K = C @ np.linalg.inv(S)
    after = x + K @ (z - z_hat)
    _, S, C = moments(after, P, model)
    cov = P - K @ C.T - C @ K.T + K @ S @ K.T
    return (after, cov) if np.trace(cov) < np.trace(P) else (x, P)


@pytest.mark.parametrize("form", ["joseph", "short", "sqrt"])
@pytest.mark.parametrize(("name", "moments"), [("RC-EKF", linearized), ("RC-UKF", unscented)])
def test_recalibration_is_its_source(name, moments, form):
    """In strong curvature, so that some updates are taken back and others are not."""
    prior, z, model = bent(count=40, curved=0.8)
    z = z + 3 * np.random.default_rng(3).normal(size=z.shape)
    got = replace(LATER_FILTERS[name], form=form)(prior, z, model)
    close(got, _rows(prior, z, partial(recalibration, model=model, moments=moments)), 1e-9)
    back = (got.mean == prior.mean).all(axis=-1)
    assert 3 < back.sum() < 37
    assert_array_equal(got.cov[back], prior.cov[back])


@pytest.mark.parametrize("moments", MOMENTS)
def test_once_is_the_plain_update(moments):
    prior, z, model = bent()
    plain = Filter(MOMENTS[moments])(prior, z, model)
    for correction in (partial(iterated, iterations=1), partial(recursive, updates=1)):
        close(Filter(MOMENTS[moments], correction=correction)(prior, z, model), plain, 1e-11)
