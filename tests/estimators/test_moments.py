"""Predicted measurements: each function against a plain loop, and sigma points against algebra."""

from fractions import Fraction
from itertools import product

import naive
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from naive import covariances, each, quadratic
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import Gaussian, Moments, SigmaPoints, linearized, second_order, unscented
from navfilters.estimators.moments import second_order_bias
from navfilters.estimators.sigma_points import sigma_points
from navfilters.models import Linear, RangeBearing

ALPHAS = [1e-3, 0.1, 1.0, 2.0]
BETAS = [0.0, 2.0, 3.0]
KAPPAS = [-0.5, 0.0, 1.0, 5.0]
ROOTS = ["cholesky", "symmetric"]
roots = pytest.mark.parametrize("root", ROOTS)


def prior(n=2, shape=(4, 3), seed=0):
    """Members somewhere in the plane, a few deviations away from the origin."""
    rng = np.random.default_rng(seed)
    mean = rng.uniform(5, 20, (*shape, n)) * rng.choice([-1, 1], (*shape, n))
    return Gaussian(mean, covariances(rng, shape, n))


def bearing_model():
    return RangeBearing(np.array([[0.5, 0.02], [0.02, 0.01]]))


PROBLEMS = {"range and bearing": (bearing_model(), 2)} | {
    f"quadratic, n={n}, m={m}": (quadratic(np.random.default_rng(7), m, n), n)
    for n, m in product([1, 2, 3], [1, 2, 3])
}
problems = pytest.mark.parametrize(("model", "n"), PROBLEMS.values(), ids=PROBLEMS)


def assert_moments(got, wanted, digits=12):
    for name, ours, theirs in zip(got._fields[:3], got[:3], wanted[:3], strict=True):
        size = np.abs(theirs).max()
        assert_allclose(ours, theirs, rtol=0, atol=10.0**-digits * size, err_msg=name)


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


# --- sigma points -------------------------------------------------------------------------------


@pytest.mark.parametrize(("alpha", "beta", "kappa"), list(product(ALPHAS, BETAS, KAPPAS)))
@pytest.mark.parametrize("n", [1, 2, 4])
def test_weights_are_the_scaled_ones(alpha, beta, kappa, n):
    """Sum to one; lambda = alpha^2 (n + kappa) - n, as in the reference that the paper cites."""
    gamma, W0_m, W0_c, W_i = SigmaPoints(alpha, beta, kappa).weights(n)
    lam = alpha**2 * (n + kappa) - n
    assert_allclose(W0_m + 2 * n * W_i, 1.0, rtol=0, atol=1e-15 * (1 + 2 * n * abs(W_i)))
    assert_allclose(gamma**2, n + lam, rtol=1e-9)
    assert_allclose(W_i, 1 / (2 * (n + lam)), rtol=1e-9)
    assert_allclose(W0_c - W0_m, 1 - alpha**2 + beta, rtol=0, atol=1e-15 * (1 + abs(W0_m)))


@pytest.mark.parametrize("n", [1, 2, 4])
def test_kappa_is_3_minus_n_by_default(n):
    assert_array_equal(SigmaPoints(0.7).weights(n), SigmaPoints(0.7, 2.0, 3.0 - n).weights(n))


@roots
@pytest.mark.parametrize(("alpha", "kappa"), list(product(ALPHAS, KAPPAS)))
@pytest.mark.parametrize("n", [1, 2, 3])
def test_sigma_points_carry_mean_and_covariance(root, alpha, kappa, n):
    points = SigmaPoints(alpha, 2.0, kappa, root)
    X = sigma_points(prior(n), points)
    mean, cov = prior(n)
    _, _, _, W = points.weights(n)
    d = X - mean
    assert X.shape == (2 * n + 1, *mean.shape)
    assert_array_equal(X[0], mean)
    assert_allclose(d.sum(axis=0), 0.0, atol=1e-13)
    spread = np.einsum("k...i,k...j->...ij", d, d)
    assert_allclose(W * spread, cov, rtol=0, atol=1e-11 / min(alpha, 1.0))


def test_the_two_roots_place_their_points_differently():
    cholesky, symmetric = (sigma_points(prior(), SigmaPoints(root=root)) for root in ROOTS)
    assert np.abs(cholesky - symmetric).max() > 0.1


@roots
def test_an_array_of_options_is_each_option_alone(root):
    """alpha, beta and kappa as arrays over the batch, one setting per member."""
    a, b, k = (np.ravel(x) for x in np.meshgrid([0.1, 1.0, 2.0], BETAS, KAPPAS))
    p = prior(shape=a.shape)
    model = bearing_model()
    got = unscented(p, model, points=SigmaPoints(a, b, k, root))
    for i in range(a.size):
        alone = Gaussian(p.mean[i], p.cov[i])
        wanted = unscented(alone, model, points=SigmaPoints(a[i], b[i], k[i], root))
        assert_moments(Moments(*(part[i] for part in got[:3])), wanted)


@roots
@pytest.mark.parametrize("name", ["alpha", "beta", "kappa"])
def test_an_array_of_options_broadcasts_with_one_prior(root, name):
    """A scan: one prior, many settings, in more than one batch axis."""
    p, model = prior(shape=()), bearing_model()
    values = np.array([[0.5, 1.0, 1.5], [2.0, 2.5, 3.0]])
    got = unscented(p, model, points=SigmaPoints(**{name: values}, root=root))
    for i in np.ndindex(values.shape):
        wanted = unscented(p, model, points=SigmaPoints(**{name: values[i]}, root=root))
        assert_allclose(got.P_zz[i], wanted.P_zz, rtol=1e-12)
        z_hat = np.broadcast_to(got.z_hat, (*values.shape, 2))
        assert_allclose(z_hat[i], wanted.z_hat, rtol=1e-12)


@roots
def test_a_prior_without_root_is_nan_alone(root):
    p = prior(shape=(5,))
    bad = p.cov.copy()
    bad[1], bad[3] = -np.eye(2), np.nan
    points = SigmaPoints(root=root)
    healthy = unscented(p, bearing_model(), points=points)
    with np.errstate(all="ignore"):
        got = unscented(Gaussian(p.mean, bad), bearing_model(), points=points)
    for ours, wanted in zip(got[:3], healthy[:3], strict=True):
        assert_array_equal(ours[[0, 2, 4]], wanted[[0, 2, 4]])
        assert np.isnan(ours[[1, 3]]).all()


FINITE = r"must be an array \(\.\.\.\) of finite real numbers"


@pytest.mark.parametrize(
    ("options", "named", "found"),
    [
        ({"root": "qr"}, r"root must be one of .'cholesky', 'symmetric'.", "'qr'"),
        ({"alpha": 0.0}, "alpha must be positive", "0.0"),
        ({"alpha": -1.0}, "alpha must be positive", "-1.0"),
        ({"alpha": np.nan}, rf"alpha {FINITE}", "nan"),
        ({"alpha": np.inf}, rf"alpha {FINITE}", "inf"),
        ({"alpha": "a"}, rf"alpha {FINITE}", "dtype <U1"),
        ({"alpha": [1.0, 0.0]}, "alpha must be positive", "0.0"),
        ({"beta": np.nan}, rf"beta {FINITE}", "nan"),
        ({"beta": np.inf}, rf"beta {FINITE}", "inf"),
        ({"kappa": np.nan}, rf"kappa {FINITE}", "nan"),
        ({"kappa": [1.0, -np.inf]}, rf"kappa {FINITE}", "-inf at index"),
    ],
)
def test_bad_options_are_refused_by_name(options, named, found):
    with pytest.raises(ValueError, match=f"{named}; found {found}"):
        SigmaPoints(**options)


@pytest.mark.parametrize("kappa", [-2.0, -7.0, [1.0, -2.0]])
def test_kappa_must_exceed_minus_n(kappa):
    """Only known once the state's size is: -2 serves three states, not two."""
    points = SigmaPoints(kappa=kappa)
    with pytest.raises(ValueError, match="kappa must be larger than -2 for a state of size 2"):
        unscented(prior(2), bearing_model(), points=points)
    if np.min(kappa) == -2.0:
        assert np.all(np.isfinite(points.weights(3)[0]))


@given(st.floats(1e-3, 2.0), st.floats(0.0, 3.0), st.floats(-1.9, 10.0), st.sampled_from(ROOTS))
def test_unscented_covariance_exceeds_the_noise_when_weights_are_positive(alpha, beta, kappa, root):
    """With W0_c >= 0, P_zz - R is a sum of squares."""
    points = SigmaPoints(alpha, beta, kappa, root)
    _, _, W0_c, _ = points.weights(2)
    p = prior(shape=(3,))
    got = unscented(p, bearing_model(), points=points)
    assert_array_equal(np.isfinite(got.P_zz), True)
    if W0_c >= 0:
        smallest = np.linalg.eigvalsh(got.P_zz - bearing_model().R).min()
        assert smallest >= -1e-12 * np.abs(got.P_zz).max()


# --- batch axes ---------------------------------------------------------------------------------


@pytest.mark.parametrize("function", [linearized, second_order, unscented])
@pytest.mark.parametrize("of_prior", [(), (1,), (5,), (2, 1), (2, 5)])
@pytest.mark.parametrize("of_model", [(1,), (5,), (2, 5), (3, 1, 5)])
def test_a_batch_of_models_broadcasts_with_the_prior(function, of_prior, of_model):
    """More, fewer or other batch axes than the prior's, of length 2 n + 1 = 5 included."""
    rng = np.random.default_rng(0)
    model = Linear(rng.normal(size=(*of_model, 3, 2)), covariances(rng, of_model, 3))
    p = prior(shape=of_prior)
    got = function(p, model)
    batch = np.broadcast_shapes(of_prior, of_model)

    def members(array, core):
        return np.broadcast_to(array, (*batch, *array.shape[array.ndim - core :]))

    parts = [members(part, core) for part, core in zip(got[:3], (1, 2, 2), strict=True)]
    mean, cov, H, R = (
        members(p.mean, 1),
        members(p.cov, 2),
        members(model.H, 2),
        members(model.R, 2),
    )
    for i in np.ndindex(batch):
        wanted = naive.linearized(mean[i], cov[i], Linear(H[i], R[i]))
        for ours, theirs in zip(parts, wanted, strict=True):
            assert_allclose(ours[i], theirs, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("function", [linearized, second_order, unscented])
def test_a_batch_of_noises_broadcasts_with_the_prior(function):
    R = covariances(np.random.default_rng(0), (5,), 2)
    p = prior(shape=(4, 1))
    got = function(p, RangeBearing(R))
    for i, j in np.ndindex(4, 5):
        wanted = function(Gaussian(p.mean[i, 0], p.cov[i, 0]), RangeBearing(R[j]))
        assert_allclose(got.P_zz[i, j], wanted.P_zz, rtol=1e-12)


@pytest.mark.parametrize("function", [linearized, second_order, unscented])
@pytest.mark.parametrize("batched", ["mean", "cov"])
@pytest.mark.parametrize("members", [3, 5])
def test_a_batch_of_means_or_of_covariances_alone(function, batched, members):
    """One half of the prior shared by all members, 2 n + 1 = 5 of them included."""
    many, model = prior(shape=(members,)), bearing_model()
    shared = Gaussian(many.mean[0], many.cov[0])
    got = function(shared._replace(**{batched: getattr(many, batched)}), model)
    for i in range(members):
        single = function(shared._replace(**{batched: getattr(many, batched)[i]}), model)
        for ours, theirs in zip(got[:3], single[:3], strict=True):
            stacked = np.broadcast_to(ours, (members, *theirs.shape))
            assert_allclose(stacked[i], theirs, rtol=1e-11, atol=1e-12)
