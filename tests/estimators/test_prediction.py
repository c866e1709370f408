"""Predictions: the textbook's, exact moments of a quadratic, and derivatives not given."""

from dataclasses import dataclass

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Filter, Gaussian, SigmaPoints, run, second_order, sweep, unscented
from navfilters.models import Linear

engines = pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])


@dataclass(frozen=True)
class Bent:
    """f_i(x) = F_i x + x^T A_i x / 2, and nothing but f and Q."""

    F: np.ndarray
    A: np.ndarray  # (n, n, n), symmetric in the last two
    Q: np.ndarray

    def f(self, x):
        return ((self.F + (self.A @ x[..., None, :, None])[..., 0] / 2) @ x[..., None])[..., 0]


class WithF(Bent):
    """The same with its Jacobian."""

    def transition(self, x):
        return self.f(x), self.F + (self.A @ x[..., None, :, None])[..., 0]


class WithPath(WithF):
    """The same, its noise entering once at the end, by propagate."""

    def propagate(self, x, Q):
        return *self.transition(x), Q


class WithHessian(WithF):
    def hessian(self, x):
        return self.A + 0 * x[..., None, None, :1]


def problem(kind=WithF, n=3, count=4, curved=0.2):
    rng = np.random.default_rng(n)
    A = curved * rng.normal(size=(n, n, n))
    motion = kind(rng.normal(size=(n, n)), A + A.mT, 0.3 * covariances(rng, (), n))
    return Gaussian(rng.normal(size=(count, n)), covariances(rng, (count,), n)), motion


def predicted(filter_, prior, motion):
    return filter_.predict(filter_.init(prior), motion).estimate


def test_linearised_is_the_textbooks():
    prior, motion = problem()
    got = predicted(Filter(), prior, motion)
    for i, (x, P) in enumerate(zip(*prior, strict=True)):
        F = motion.F + motion.A @ x
        assert_allclose(got.mean[i], motion.F @ x + x @ motion.A @ x / 2, rtol=1e-12)
        assert_allclose(
            got.cov[i], F @ P @ F.T + motion.Q, rtol=0, atol=1e-12 * np.abs(P).max() * 9
        )
    assert_array_equal(got.cov, got.cov.mT)


def exact(prior, motion):
    """Mean, and the part of the covariance that curvature adds, of a quadratic of a Gaussian."""
    x, P = prior
    b = np.einsum("ijk,...jk->...i", motion.A, P) / 2
    AP = motion.A @ P[..., None, :, :]
    return motion.f(x) + b, b, np.einsum("...ijk,...lkj->...il", AP, AP) / 2


@pytest.mark.parametrize("kind", [WithF, WithHessian])
def test_second_order_has_the_exact_mean_and_its_own_covariance(kind):
    """F P F^T + Q - b b^T: the truncation that costs the mtSOF its definiteness, here too."""
    prior, motion = problem(kind)
    got, first = predicted(Filter(second_order), prior, motion), predicted(Filter(), prior, motion)
    mean, b, _ = exact(prior, motion)
    assert_allclose(got.mean, mean, rtol=1e-10, atol=1e-10)
    assert_allclose(got.cov, first.cov - b[..., :, None] * b[..., None, :], rtol=0, atol=1e-9)


@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
@pytest.mark.parametrize(("alpha", "kappa"), [(1.0, None), (0.3, 1.0), (2.0, -0.5)])
def test_unscented_has_the_exact_mean_whatever_its_weights(alpha, kappa, root):
    prior, motion = problem()
    filter_ = FILTERS["UKF"].having(points=SigmaPoints(alpha, 2.0, kappa, root))
    assert_allclose(predicted(filter_, prior, motion).mean, exact(prior, motion)[0], rtol=1e-10)


def test_unscented_has_the_exact_covariance_of_one_state():
    """kappa = 2, beta = 0 fit the fourth moment: P' = F P F + Q + (A P)^2 / 2."""
    prior, motion = problem(n=1, curved=0.7)
    filter_ = FILTERS["UKF"].having(points=SigmaPoints(1.0, 0.0, 2.0))
    got, first = predicted(filter_, prior, motion), predicted(Filter(), prior, motion)
    assert_allclose(got.cov, first.cov + exact(prior, motion)[2], rtol=1e-12)


def test_each_against_a_million_draws():
    """Weak curvature: all three means and covariances within six standard errors, or its bias."""
    prior, motion = problem(count=1, curved=0.05)
    draws, rng = 1_000_000, np.random.default_rng(0)
    L, LQ = np.linalg.cholesky(prior.cov[0]), np.linalg.cholesky(motion.Q)
    y = motion.f(prior.mean[0] + rng.normal(size=(draws, 3)) @ L.T)
    y = y + rng.normal(size=(draws, 3)) @ LQ.T
    mean, cov = y.mean(axis=0), np.cov(y.T)
    error = 6 * np.sqrt(np.diag(cov) / draws)
    spread = 6 * np.sqrt(2 * np.outer(np.diag(cov), np.diag(cov)) / draws)
    _, b, curvature = exact(prior, motion)
    for moments, bias, missing in (
        (None, np.abs(b[0]), curvature[0]),
        (second_order, 0.0, curvature[0] + np.outer(b[0], b[0])),
        (unscented, 0.0, np.abs(curvature[0]).max()),
    ):
        got = predicted(Filter(moments) if moments else Filter(), prior, motion)
        assert (np.abs(got.mean[0] - mean) < error + bias).all()
        assert (np.abs(got.cov[0] - cov) < spread + np.abs(missing)).all()


@pytest.mark.parametrize("name", ["EKF", "mtSOF", "UKF"])
@pytest.mark.parametrize("kind", [Bent, WithPath, WithHessian])
def test_however_the_motion_is_written_it_is_the_same(name, kind):
    """f alone by complex step; propagate with its noise at the end; with a Hessian."""
    prior, motion = problem(kind)
    got = predicted(FILTERS[name], prior, motion)
    wanted = predicted(FILTERS[name], prior, WithF(motion.F, motion.A, motion.Q))
    assert_allclose(got.mean, wanted.mean, rtol=1e-9, atol=1e-9)
    assert_allclose(got.cov, wanted.cov, rtol=1e-8, atol=1e-8)


@engines
@pytest.mark.parametrize("name", ["EKF", "mtSOF", "UKF"])
def test_f_and_q_alone_are_enough_for_a_run(name, engine):
    """On the host by complex step, compiled in forward mode."""
    prior, motion = problem(Bent, curved=0.02)
    sensor, z = Linear(np.eye(2, 3), 0.1 * np.eye(2)), np.ones(2)
    got = sweep(
        FILTERS[name], prior, z, sensor, 4, dynamics=motion, engine=engine, progress=False
    ).final
    full = WithHessian(motion.F, motion.A, motion.Q)
    wanted = run(FILTERS[name], prior, z, sensor, 4, dynamics=full)
    assert_allclose(got.mean, wanted.mean[-1], rtol=1e-8, atol=1e-8)
    assert_allclose(got.cov, wanted.cov[-1], rtol=1e-7, atol=1e-7)


class Absolute(Bent):
    def f(self, x):
        return np.abs(x)


def test_a_motion_that_is_not_analytic_needs_its_jacobian():
    prior, motion = problem(Absolute)
    sensor, z = Linear(np.eye(3), np.eye(3)), np.ones(3)
    with pytest.raises(TypeError, match=r"dynamics.f must .*Give its Jacobian instead"):
        run(FILTERS["EKF"], prior, z, sensor, 2, dynamics=motion)
    got = run(FILTERS["UKF"], prior, z, sensor, 2, dynamics=motion)
    assert np.isfinite(got.mean).all()
