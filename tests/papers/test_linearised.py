"""The flight linearised along the truth, and filters that are told another measurement."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Filter, Gaussian
from navfilters.estimators.variants import bump_linear
from navfilters.papers.pogorelsky2020.experiment import CASES, Setup
from navfilters.papers.pogorelsky2020.linearised import Altered, linearised_flight
from navfilters.papers.pogorelsky2020.open_loop import (
    monte_carlo,
    simulate_images,
)
from navfilters.papers.pogorelsky2020.true_flight import truth
from navfilters.runs.consistency import mean_nees
from navfilters.space.pose import difference


def test_the_flight_linearised_is_the_filters_own_along_the_truth():
    """Its covariance is that of a run without errors, and its transitions carry small ones."""
    setup, flight = CASES["TC-1"], truth(CASES["TC-1"], 12)
    legs, P = linearised_flight(setup, flight, 12)
    perfect = replace(
        simulate_images(setup, 1, flight=flight), q_mu=np.tile([0, 0, 0, 1.0], (1, 13, 1))
    )
    zero = perfect.noise._replace(**{n: 0 * v for n, v in perfect.noise._asdict().items()})
    perfect = replace(perfect, noise=zero)
    cov = setup.P0
    for k, leg in enumerate(legs, start=1):
        x, before = setup.orbit.propagate(flight.x[k - 1], cov, setup.steps)
        assert_allclose(leg.F @ cov @ leg.F.T + leg.Q, before, rtol=1e-12, atol=1e-12)
        model = replace(setup.geometry, T_e_b=flight.T_e_b[k])
        b = 0.2 if k <= 10 else 0.0
        assert_allclose(leg.extra, b * leg.H @ before @ leg.H.T)
        ekf = Filter(variant=partial(bump_linear, bump=b))
        prior = Gaussian(np.concatenate([x, perfect.q_mu[0, 0]]), before)
        cov = ekf.update(ekf.init(prior), perfect(k, None).z, model).estimate.cov[0]
    assert_allclose(P, cov, rtol=1e-5, atol=1e-9)
    nudge = np.array([10.0, 0, 0, 0, 0, 0.1])
    moved = setup.orbit.path(flight.x[0] + nudge, setup.steps)[-1] - flight.x[1]
    assert_allclose(legs[0].F[:6, :6] @ nudge, moved, atol=1e-3)


@pytest.mark.parametrize("images", [0, 6])
def test_a_flight_is_linearised_as_far_as_it_goes(images):
    with pytest.raises(ValueError, match="images must be"):
        linearised_flight(Setup(), truth(Setup(), 5), images)


def test_the_curved_measurement_is_what_breaks_the_first_case():
    """With residuals that are linear in the error, about the estimate, the same filter passes."""
    images = simulate_images("TC-1", 60)

    def straight(seen):
        true = images.true_state(seen.k)
        _, H, R = seen.linearise()
        error = difference(true.x, seen.state.x)
        return seen.linearise(true)[0] + (H @ error[..., None])[..., 0], H, R

    result = monte_carlo("TC-1", runs=60, estimator=Altered(CASES["TC-1"].mekf, straight))
    total = mean_nees(result.errors[-1], result.covariances[-1], runs_axis=0)
    assert total.low < total.mean < total.high


def test_a_change_that_changes_nothing():
    """And what the change is told: the image's number, the prediction, the image, its geometry."""
    setup, flight, told = CASES["TC-1"], truth(CASES["TC-1"], 5), []

    def change(seen):
        told.append(seen)
        return seen.linearise()

    images = simulate_images(setup, 3, flight=flight)
    estimator = Altered(setup.mekf, change)
    got = monte_carlo(setup, 3, 3, flight=flight, estimator=estimator)
    wanted = monte_carlo(setup, 3, 3, flight=flight)
    sigma = np.sqrt(np.diagonal(wanted.covariances, axis1=-2, axis2=-1))
    assert_allclose(got.errors / sigma, wanted.errors / sigma, rtol=0, atol=1e-9)
    assert_allclose(got.innovations, wanted.innovations, rtol=1e-9)
    assert_allclose(got.S, wanted.S, rtol=1e-9)
    assert [seen.k for seen in told] == [1, 2, 3, 4, 5]
    for seen in told[:3]:
        assert_array_equal(seen.geometry.T_e_b, flight.T_e_b[seen.k])
        assert_array_equal(seen.image.z, images(seen.k, None).z)
    assert np.isnan(told[3].image.z).all()  # it coasts
    y, H, R = told[0].linearise(images.true_state(1))
    assert np.abs(y[:, 2]).max() < 30 < np.abs(told[0].linearise()[0][:, 2]).max()
    assert (H.shape, R.shape) == ((3, 4, 9), (3, 4, 4))


def test_the_filter_of_a_setup_is_a_bumped_ekf():
    """Lear's underweighting is the bump-up of perea2007, Eq. (14), with beta-bar for alpha."""
    setup = replace(CASES["TC-1"], underweighting=0.7, underweighted=2)
    assert setup.mekf.moments is FILTERS["B-EKF 1"].moments
    bumped, ekf = FILTERS["B-EKF 1"].having(bump=0.7), FILTERS["EKF"]
    got, held, free = (
        monte_carlo(setup, 4, 3, estimator=estimator) for estimator in (None, bumped, ekf)
    )
    for name in ("errors", "covariances", "innovations", "S"):
        assert_array_equal(getattr(got, name)[:2], getattr(held, name)[:2])
    assert_array_equal(got.errors[2], held.errors[2])
    assert (got.S[2] != held.S[2]).any(axis=(-2, -1)).all()
    assert (held.S[0] != free.S[0]).any()
    none = monte_carlo(replace(setup, underweighted=0), 4, 3)
    assert_array_equal(none.errors, free.errors)
    assert_array_equal(none.S, free.S)


@pytest.mark.parametrize("name", ["UKF", "mtSOF"])
def test_other_moments_tend_to_the_ekf_where_errors_are_small(name):
    """Estimates and covariances differ by the square of the errors' size; and both fly TC-1."""
    flown = {}
    for size in (1.0, 0.1):
        sigma = {"sigma_r": 100.0 * size, "sigma_v": size, "sigma_mu": 0.01 * size}
        setup = replace(CASES["TC-2"], **sigma, walk=False)
        ekf, other = (
            monte_carlo(setup, 3, 5, estimator=estimator) for estimator in (None, FILTERS[name])
        )
        unit = np.sqrt(np.diagonal(ekf.covariances, axis1=-2, axis2=-1))
        flown[size] = [
            np.abs((other.errors - ekf.errors) / unit).max(),
            np.abs(
                (other.covariances - ekf.covariances) / unit[..., None, :] / unit[..., None]
            ).max(),
        ]
    assert (np.array(flown[0.1]) < 0.012 * np.array(flown[1.0])).all()
    assert max(flown[1.0]) < 1e-2
    far = monte_carlo("TC-1", 3, 5, estimator=FILTERS[name])
    assert np.isfinite(far.errors).all()
    assert (np.linalg.eigvalsh(far.covariances) > 0).all()
    assert (far.errors != monte_carlo("TC-1", 3, 5).errors)[1:].all()
