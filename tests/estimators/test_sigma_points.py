"""Sigma points and their weights against algebra at every setting, and settings refused."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from moment_problems import ROOTS, assert_moments, bearing_model, prior, roots
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import Gaussian, Moments, SigmaPoints, unscented
from navfilters.estimators.sigma_points import sigma_points

ALPHAS = [1e-3, 0.1, 1.0, 2.0]
BETAS = [0.0, 2.0, 3.0]
KAPPAS = [-0.5, 0.0, 1.0, 5.0]


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
