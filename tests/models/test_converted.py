"""The converted measurement: its bias and covariance by quadrature and by Monte Carlo."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from polar_models import engines

from navfilters import Filter, Gaussian, run, sweep
from navfilters.estimators import expecting_noise
from navfilters.models import ConvertedRangeBearing, Linear, RangeBearing

R = np.diag([4.0, 0.25])
MODEL = ConvertedRangeBearing(R)


def measured(place, nodes, R=R):
    """What is measured of places (..., 2) with standard normal noise (..., 2)."""
    r, b = np.hypot(*np.moveaxis(place, -1, 0)), np.arctan2(place[..., 1], place[..., 0])
    return np.stack([r, b], axis=-1) + nodes * np.sqrt(np.diag(R))


def test_mean_and_covariance_of_a_point_by_quadrature():
    """Gauss and Hermite's points; a bearing with a deviation of half a radian."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(40)
    grid = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=-1)
    weight = np.outer(weights, weights) / (2 * np.pi)
    for place in ([30.0, 40.0], [-3.0, 0.5], [0.0, -80.0]):
        z = MODEL.given(measured(np.array(place), grid))[0]
        off = z - place
        assert_allclose(np.sum(weight[..., None] * z, axis=(0, 1)), place, rtol=1e-12, atol=1e-12)
        cov = np.einsum("ij,ija,ijb->ab", weight, off, off)
        assert_allclose(MODEL.noise(np.array(place)), cov, rtol=1e-11, atol=1e-9)


def test_without_the_factor_it_is_biased_inwards():
    """exp(-s / 2): what the plain conversion makes of a distant point."""
    z = np.array([50.0, 0.3])
    place = MODEL.given(z)[0]
    assert_allclose(np.hypot(*place), 50 * np.exp(0.125))


def test_expected_noise_over_a_prediction_by_monte_carlo():
    """Also: it is not correlated with the place, which makes the update a linear least square."""
    rng = np.random.default_rng(0)
    prior = Gaussian(np.array([25.0, 45.0]), np.array([[90.0, 20.0], [20.0, 60.0]]))
    place = rng.multivariate_normal(*prior, 400_000)
    off = MODEL.given(measured(place, rng.normal(size=place.shape)))[0] - place
    assert_allclose(np.cov(off.T), MODEL.expected_noise(prior), rtol=0.02)
    both = np.cov(off.T, place.T)[:2, 2:]
    assert np.abs(both).max() < 5 * np.sqrt(200 * 100 / 400_000)


def test_small_noise_is_the_turned_ellipse():
    """First order: R_r along the line of sight, r^2 R_b across it."""
    fine = ConvertedRangeBearing(np.diag([1e-6, 1e-10]))
    x = np.array([30.0, 40.0])
    J = np.linalg.inv(RangeBearing(np.eye(2)).jacobian(x))
    assert_allclose(fine.noise(x), J @ fine.R @ J.T, rtol=1e-6)
    sure = Gaussian(x, np.zeros((2, 2)))
    assert_allclose(fine.expected_noise(sure), fine.noise(x), rtol=1e-14)


def test_a_step_is_the_kalman_filter_of_the_converted_measurement():
    prior = Gaussian(np.array([25.0, 45.0, 1.0, 0.0]), np.diag([90.0, 60.0, 4.0, 4.0]))
    z = np.array([51.0, 1.1])
    linear = Linear(np.eye(2, 4), MODEL.expected_noise(prior))
    wanted = Filter()(prior, MODEL.given(z)[0], linear)
    got = Filter(expecting_noise)(prior, z, MODEL)
    assert_allclose(got.mean, wanted.mean, rtol=1e-12)
    assert_allclose(got.cov, wanted.cov, rtol=1e-12)


@engines
def test_run_and_sweep_with_missing_parts(engine):
    """Where one of range and bearing is missing there is no place."""
    rng = np.random.default_rng(1)
    place = np.array([30.0, 40.0])
    z = measured(place, rng.normal(size=(6, 3, 2)), R / 100)
    z[2, 0, 0] = z[3, 1] = np.nan
    model = ConvertedRangeBearing(R / 100 * np.array([1.0, 2.0, 3.0])[:, None, None])
    prior = Gaussian(np.array([20.0, 80.0]), 900 * np.eye(2))
    history = run(Filter(expecting_noise), prior, z, model, z_per_step=True)
    many = sweep(
        Filter(expecting_noise), prior, z, model, z_per_step=True, engine=engine, progress=False
    )
    assert_allclose(many.final.mean, history.mean[-1], rtol=1e-12)
    assert many.state.missed.tolist() == [1, 1, 0]
    assert_allclose(history.mean[3, 0], history.mean[2, 0], rtol=0)
    assert np.abs(history.mean[-1] - place).max() < 5


def test_noise_at_the_predicted_mean_alone_forgets_its_spread():
    """A vague prediction that looks the wrong way turns the ellipse; its expectation is round."""
    fine = ConvertedRangeBearing(np.diag([1e-4, 1e-2]))
    prior = Gaussian(np.array([0.0, 50.0]), 1e4 * np.eye(2))
    ratio = [np.linalg.cond(R) for R in (fine.noise(prior.mean), fine.expected_noise(prior))]
    assert ratio[0] > 100
    assert ratio[1] < 1.5


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (np.array([[1.0, 0.1], [0.1, 1.0]]), "R must be diagonal; found a covariance of 0.1"),
        (np.eye(3), "R must have shape"),
        (np.diag([1.0, 0.0]), "R must be symmetric positive definite"),
    ],
)
def test_a_noise_that_it_cannot_convert_is_named(given, message):
    with pytest.raises(ValueError, match=message):
        ConvertedRangeBearing(given)


def test_moments_that_need_another_model_say_so():
    prior = Gaussian(np.ones(2), np.eye(2))
    with pytest.raises(TypeError, match=r"model must have expected_noise\(prior\); found RangeB"):
        Filter(expecting_noise)(prior, np.ones(2), RangeBearing(np.eye(2)))
