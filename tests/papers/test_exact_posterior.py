"""The exact posterior of a fixed point against routes that share no formula with it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import stats

from navfilters import Gaussian
from navfilters.papers.perea2007 import Setup
from navfilters.papers.perea2007.exact_posterior import ExactPosterior

SETUP = Setup()
R = np.diag([SETUP.range_variance, SETUP.bearing_variance])


def test_without_a_prior_its_moments_are_those_of_a_bent_gaussian():
    """E[r^k] and E[cos], E[cos^2] of Gaussians, with the plane's r as a weight."""
    mu, theta, n = 141.0, 0.7, np.array([1, 10, 1000])
    s2, t2 = 4.0 / n, 0.03 / n
    x = ExactPosterior([mu, theta], n, np.diag([4.0, 0.03])).moments
    shrunk, radial = np.exp(-t2 / 2), (mu**2 + s2) / mu
    mean = radial * shrunk * np.array([np.cos(theta), np.sin(theta)])[:, None]
    assert_allclose(x.mean, mean.T, rtol=1e-12)
    square, double = mu**2 + 3 * s2, np.exp(-2 * t2) * np.cos(2 * theta)
    assert_allclose(x.cov[:, 0, 0], square * (1 + double) / 2 - mean[0] ** 2, rtol=1e-8)
    assert_allclose(x.cov[:, 1, 1], square * (1 - double) / 2 - mean[1] ** 2, rtol=1e-8)


def brute_force(z, n, R, prior, size=900):
    """Mean, covariance and points of a Cartesian lattice, from SciPy's densities."""
    span = 8 * max(np.sqrt(R[0, 0]), z[0] * np.sqrt(R[1, 1])) / np.sqrt(n)
    centre = z[0] * np.array([np.cos(z[1]), np.sin(z[1])])
    x = np.stack(np.meshgrid(*(c + np.linspace(-span, span, size) for c in centre)), -1)
    log_p = stats.norm.logpdf(np.hypot(*x.T).T, z[0], np.sqrt(R[0, 0] / n))
    log_p += stats.norm.logpdf(np.arctan2(x[..., 1], x[..., 0]), z[1], np.sqrt(R[1, 1] / n))
    log_p += stats.multivariate_normal.logpdf(x, prior.mean, prior.cov)
    p = np.exp(log_p - log_p.max())
    p /= p.sum()
    mean = np.einsum("ij,ijk->k", p, x)
    cov = np.einsum("ij,ijk,ijl->kl", p, x - mean, x - mean)
    return mean, cov, p, x


PRIORS = {
    "wide": Gaussian(np.array([20.0, 80.0]), 1e4 * np.eye(2)),
    "beside": Gaussian(np.array([85.0, 110.0]), np.array([[150.0, 40.0], [40.0, 90.0]])),
}


@pytest.mark.parametrize("prior", PRIORS.values(), ids=PRIORS)
def test_it_is_what_brute_force_finds(prior):
    z, n, noise = np.array([141.4, 0.8]), 4, np.diag([9.0, 0.02])
    exact = ExactPosterior(z, n, noise, prior, step=0.125)
    mean, cov, p, x = brute_force(z, n, noise, prior)
    assert_allclose(exact.moments.mean, mean, rtol=1e-7)
    assert_allclose(exact.moments.cov, cov, rtol=1e-5)

    claimed = Gaussian(mean + np.array([2.0, -3.0]), cov / 2)
    away = x - claimed.mean
    inside = np.einsum("ijk,kl,ijl->ij", away, np.linalg.inv(claimed.cov), away) <= 4.0
    assert_allclose(exact.ellipse(claimed, 4.0), p[inside].sum(), atol=3e-3)

    at = 420, 414
    assert_allclose(exact.level(x[at]), p[p > p[at]].sum(), atol=3e-3)
    per_polar = p * np.hypot(*x.T).T
    assert_allclose(exact.level(x[at], polar=True), p[per_polar > per_polar[at]].sum(), atol=3e-3)


def test_the_papers_thin_arc_is_what_weighted_draws_find():
    """Draws from the measurements alone, weighted by the prior's density and the area."""
    z, n = SETUP.z + np.array([0.002, -0.05]), 2
    rng = np.random.default_rng(0)
    r, theta = z[:, None] + rng.normal(size=(2, 400_000)) * np.sqrt(np.diag(R) / n)[:, None]
    x = np.stack([r * np.cos(theta), r * np.sin(theta)], -1)
    w = r * stats.multivariate_normal.pdf(x, SETUP.x0, 1e4)
    w /= w.sum()
    exact = ExactPosterior(z, n, R, SETUP.prior).moments
    mean = w @ x
    cov = (w[:, None] * (x - mean)).T @ (x - mean)
    spread = np.sqrt(np.diag(cov) / len(r))
    assert (np.abs(exact.mean - mean) < 5 * spread).all()
    assert_allclose(exact.cov, cov, rtol=0.02)
    thin = np.linalg.eigvalsh(exact.cov) / np.linalg.eigvalsh(cov)
    assert_allclose(thin, 1.0, rtol=0.02)


def test_levels_are_uniform_over_truths_and_data():
    """Truths from the prior, data from the truths: the levels of the truths are uniform."""
    rng = np.random.default_rng(1)
    prior = Gaussian(np.array([100.0, 100.0]), 900.0 * np.eye(2))
    truth = rng.multivariate_normal(prior.mean, prior.cov, 400)
    z = np.stack([np.hypot(*truth.T), np.arctan2(truth[:, 1], truth[:, 0])], -1)
    z += rng.normal(size=z.shape) * np.sqrt(np.diag(R) / 3)
    exact = ExactPosterior(z, 3, R, prior, step=0.25)
    for polar in (False, True):
        assert stats.kstest(exact.level(truth, polar=polar), "uniform").pvalue > 0.01


def test_batches_are_their_members():
    rng = np.random.default_rng(2)
    z, n = SETUP.z + rng.normal(size=(5, 2)) * [0.005, 0.05], np.array([[1], [30]])
    both = ExactPosterior(z, n, R, SETUP.prior)
    one = ExactPosterior(z[3], 30, R, SETUP.prior)
    assert_allclose(both.moments.mean[1, 3], one.moments.mean, rtol=1e-13)
    assert_allclose(both.moments.cov[1, 3], one.moments.cov, rtol=1e-9)
    assert both.level(np.array([100.0, 100.0])).shape == (2, 5)


def test_an_indefinite_covariance_holds_nothing():
    exact = ExactPosterior(SETUP.z, 10, R)
    x = exact.moments.mean
    assert exact.ellipse(Gaussian(x, np.diag([1e4, -1.0])), 6.0) == 0.0
    assert exact.ellipse(Gaussian(x, np.full((2, 2), np.nan)), 6.0) == 0.0
    assert exact.ellipse(Gaussian(x, 1e6 * np.eye(2)), 6.0) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"updates": 0}, "updates must be at least 1; found 0"),
        ({"R": np.diag([1.0, 0.09])}, r"at most 0\.2 rad, from R and updates; found 0\.3"),
        ({"step": 2.0}, r"step must be above 0 and at most 1; found 2\.0"),
        ({"z_mean": [1.0, 2.0, 3.0]}, "z_mean"),
        (
            {"prior": Gaussian(np.array([-100.0, -100.0]), 0.01 * np.eye(2))},
            "prior and measurements must agree",
        ),
    ],
)
def test_it_refuses_what_it_cannot_be(changed, message):
    given = {"z_mean": SETUP.z, "updates": 1, "R": R} | changed
    with pytest.raises(ValueError, match=message):
        ExactPosterior(**given)


def test_the_widest_bearing_that_it_takes_is_the_one_that_it_names():
    assert ExactPosterior(SETUP.z, 1, np.diag([1.0, 0.2**2])).moments.cov.shape == (2, 2)


@pytest.mark.parametrize("polar", [False, True])
def test_bearings_that_are_turned_have_the_level_of_the_problem_turned(polar):
    """A mean bearing beyond half a turn, where the point's own is on the other branch."""
    n, noise = 4, np.diag([4.0, 0.03])
    place = np.array([[142.0, 0.4], [140.5, 0.15], [141.0, 0.32]])

    def points(turned):
        bearing = place[:, 1] + turned
        return place[:, :1] * np.stack([np.cos(bearing), np.sin(bearing)], axis=1)

    wanted = ExactPosterior([141.0, 0.3], n, noise).level(points(0.0), polar=polar)
    assert ((wanted > 0) & (wanted < 1)).all()
    for turns in (-1, 0, 1):
        turned = ExactPosterior([141.0, 3.3 + 2 * np.pi * turns], n, noise)
        assert_allclose(turned.level(points(3.0), polar=polar), wanted, rtol=1e-6)
