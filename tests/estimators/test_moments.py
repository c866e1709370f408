"""Predicted measurements: each function against a plain loop, and what each one promises."""

from fractions import Fraction
from itertools import product

import naive
import numpy as np
import pytest
from moment_problems import assert_moments, bearing_model, prior, roots
from naive import covariances, each, quadratic
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import Gaussian, SigmaPoints, linearized, second_order, unscented
from navfilters.estimators.moments import second_order_bias
from navfilters.estimators.sigma_points import sigma_points
from navfilters.models import Linear

KAPPAS = [-0.5, 0.0, 1.0, 5.0]
PROBLEMS = {"range and bearing": (bearing_model(), 2)} | {
    f"quadratic, n={n}, m={m}": (quadratic(np.random.default_rng(7), m, n), n)
    for n, m in product([1, 2, 3], [1, 2, 3])
}
problems = pytest.mark.parametrize(("model", "n"), PROBLEMS.values(), ids=PROBLEMS)


# --- against plain loops ------------------------------------------------------------------------


@problems
def test_linearized_is_the_plain_loop(model, n):
    assert_moments(linearized(prior(n), model), each(naive.linearized, *prior(n), model))


@problems
def test_second_order_is_the_plain_loop(model, n):
    assert_moments(second_order(prior(n), model), each(naive.second_order, *prior(n), model))


@problems
@roots
@pytest.mark.parametrize(
    "options", [{}, {"alpha": 0.5, "beta": 0.0, "kappa": 2.0}, {"alpha": 2.0, "kappa": -0.5}]
)
def test_unscented_is_the_plain_loop(model, n, root, options):
    """The shifted sum of the library and the textbook's weighted sum agree to rounding."""
    got = unscented(prior(n), model, points=SigmaPoints(root=root, **options))
    wanted = each(lambda x, P: naive.unscented(x, P, model, root=root, **options), *prior(n))
    assert_moments(got, wanted)


@roots
def test_shifted_mean_equals_the_weighted_sum(root):
    """At alpha = 1e-3 the plain sum loses 1e-16 max|W|; the shifted one keeps every digit of Z."""
    points = SigmaPoints(1e-3, 2.0, 1.0, root)
    p, model = prior(shape=()), bearing_model()
    _, W0_m, _, W_i = points.weights(2)
    Z = model.h(sigma_points(p, points))
    got = unscented(p, model, points=points).z_hat
    assert_allclose(got, W0_m * Z[0] + W_i * Z[1:].sum(axis=0), atol=4e-16 * W_i * Z.max(), rtol=0)
    W = Fraction(float(W_i))
    exact = [(1 - 4 * W) * z[0] + W * sum(z[1:]) for z in ([Fraction(v) for v in c] for c in Z.T)]
    assert_allclose(got, [float(z) for z in exact], rtol=4e-16)


@problems
@pytest.mark.parametrize("function", [linearized, second_order])
def test_moments_with_an_h_say_how_they_are_made_of_it(model, n, function):
    """P_xz = P H^T and P_zz = H P H^T + R: what Joseph's update needs."""
    p = prior(n)
    got = function(p, model)
    assert_array_equal(got.H, model.jacobian(p.mean))
    assert_allclose(p.cov @ got.H.mT, got.P_xz, rtol=0, atol=1e-13 * np.abs(got.P_xz).max())
    P_zz = got.H @ p.cov @ got.H.mT + got.R
    assert_allclose(P_zz, got.P_zz, rtol=0, atol=1e-12 * np.abs(P_zz).max())
    assert got.exact is None
    assert unscented(p, model).H is unscented(p, model).R is None


# --- what each approximation promises -----------------------------------------------------------


@problems
def test_moments_of_a_linear_model_are_exact_for_all_three(model, n):
    rng = np.random.default_rng(1)
    m = model.R.shape[-1]
    linear = Linear(rng.normal(size=(m, n)), covariances(rng, (), m))
    wanted = each(naive.linearized, *prior(n), linear)
    for function in (linearized, second_order, unscented):
        assert_moments(function(prior(n), linear), wanted)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_second_order_bias_is_exact_for_a_quadratic(n):
    """E[h(x)] = h(mean) + tr(A P) / 2; the expectation by Gauss-Hermite quadrature."""
    model, p = quadratic(np.random.default_rng(n), 2, n), prior(n, shape=())
    nodes, weights = np.polynomial.hermite_e.hermegauss(3)
    weights = weights / weights.sum()
    L = np.linalg.cholesky(p.cov)
    expected = sum(
        np.prod(weights[list(i)]) * model.h(p.mean + L @ nodes[list(i)])
        for i in product(range(3), repeat=n)
    )
    assert_allclose(model.h(p.mean) + second_order_bias(p, model), expected, rtol=1e-12)
    assert_allclose(second_order(p, model).z_hat, expected, rtol=1e-12)


@roots
@pytest.mark.parametrize(("alpha", "kappa"), list(product([0.1, 1.0, 2.0], KAPPAS)))
def test_unscented_mean_and_cross_covariance_are_exact_for_a_quadratic(root, alpha, kappa):
    """Whatever the weights: the spread fixes the second moments and symmetry kills the third."""
    model, p = quadratic(np.random.default_rng(3), 2, 3), prior(3)
    got = unscented(p, model, points=SigmaPoints(alpha, 2.0, kappa, root))
    wanted = each(naive.second_order, *p, model)
    assert_allclose(got.z_hat, wanted[0], rtol=1e-10)
    assert_allclose(got.P_xz, wanted[2], rtol=0, atol=1e-10 * np.abs(wanted[2]).max())


def test_unscented_covariance_is_exact_for_a_parabola():
    """z = x^2 has P_zz = 4 x^2 P + 2 P^2 for a Gaussian; alpha 1, beta 0, kappa 2 give it."""
    model = naive.Quadratic(np.zeros((1, 1)), np.full((1, 1, 1), 2.0), np.array([[0.3]]))
    p = Gaussian(np.array([3.0]), np.array([[4.0]]))
    got = unscented(p, model, points=SigmaPoints(1.0, 0.0, 2.0))
    assert_allclose(got.P_zz, [[0.3 + 4 * 9 * 4 + 2 * 16]], rtol=1e-13)
