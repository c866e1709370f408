"""Batches of priors: a member is what it is alone."""

from dataclasses import replace
from operator import itemgetter

import numpy as np
import pytest
from naive import covariances, quadratic
from numpy.testing import assert_allclose, assert_array_equal
from ten_filters import every_filter, nonlinear, size

from navfilters import (
    FILTERS,
    Gaussian,
    SigmaPoints,
    run,
)
from navfilters.estimators import LATER_FILTERS
from navfilters.models import RangeBearing


def scalar_settings(name, count):
    """One scalar setting per member, and the same as arrays over the batch."""
    rng = np.random.default_rng(5)
    drawn = {
        key: rng.uniform(low, high, count)
        for key, low, high in [("bump", 0, 3), ("alpha", 0.1, 2), ("beta", 0, 3), ("kappa", -1, 3)]
    }

    def options(pick):
        values = {key: pick(value) for key, value in drawn.items()}
        whole = {"bump": values.pop("bump"), "points": SigmaPoints(**values)}
        return {key: whole[key] for key in FILTERS[name].options}

    return options(lambda value: value), [options(itemgetter(i)) for i in range(count)]


@every_filter
def test_a_batch_is_its_members_alone(name):
    """Options given as arrays over the batch included."""
    prior, z, model = nonlinear()
    together, alone = scalar_settings(name, len(z))
    got = FILTERS[name](prior, z, model, **together)
    for i, options in enumerate(alone):
        wanted = FILTERS[name](Gaussian(prior.mean[i], prior.cov[i]), z[i], model, **options)
        assert_allclose(got.mean[i], wanted.mean, rtol=1e-13)
        assert_allclose(got.cov[i], wanted.cov, rtol=0, atol=1e-13 * size(prior.cov[i]))


@every_filter
def test_batch_axes_broadcast(name):
    """Priors (6,), measurements (4, 1), noises (3, 1, 1): twenty-four members three times."""
    prior, z, model = nonlinear()
    z = z[:4, None, :]
    noises = model.R * np.array([1.0, 2.0, 0.5])[:, None, None, None, None]
    got = FILTERS[name](prior, z, RangeBearing(noises))
    cov = np.broadcast_to(got.cov, (3, 4, 6, 2, 2))
    for r, j, i in np.ndindex(3, 4, 6):
        alone = Gaussian(prior.mean[i], prior.cov[i])
        wanted = FILTERS[name](alone, z[j, 0], RangeBearing(noises[r, 0, 0]))
        assert_allclose(got.mean[r, j, i], wanted.mean, rtol=1e-12)
        assert_allclose(cov[r, j, i], wanted.cov, rtol=0, atol=1e-13 * size(alone.cov))


def three_dimensional(count=6):
    rng = np.random.default_rng(8)
    model = quadratic(rng, 3, 3)
    prior = Gaussian(rng.normal(size=(count, 3)), covariances(rng, (count,), 3))
    return prior, rng.normal(size=(count, 3)), model


@every_filter
@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
@pytest.mark.parametrize("problem", [nonlinear, three_dimensional])
def test_a_member_without_covariance_stays_alone(name, root, problem):
    """The others do not notice, to the last bit; the member itself is NaN in every entry."""
    prior, z, model = problem()
    options = {"points": SigmaPoints(root=root)} if "points" in FILTERS[name].options else {}
    healthy = FILTERS[name](prior, z, model, **options)
    bad = prior.cov.copy()
    bad[2] = np.nan
    with np.errstate(all="ignore"):
        got = FILTERS[name](Gaussian(prior.mean, bad), z, model, **options)
    for ours, wanted in zip(got, healthy, strict=True):
        others = [0, 1, 3, 4, 5]
        assert_array_equal(ours[others], wanted[others])
        assert np.isnan(ours[2]).all()
        assert np.isfinite(wanted).all()


@every_filter
def test_a_member_at_the_origin_stays_alone(name):
    """Range and bearing have no derivatives there: what needs them is NaN, the unscented go on."""
    prior, z, model = nonlinear()
    mean = prior.mean.copy()
    mean[2] = 0.0
    healthy = FILTERS[name](prior, z, model)
    with np.errstate(all="ignore"):
        got = FILTERS[name](Gaussian(mean, prior.cov), z, model)
    for ours, wanted in zip(got, healthy, strict=True):
        others = [0, 1, 3, 4, 5]
        assert_array_equal(ours[others], wanted[others])
        assert np.isfinite(ours[2]).all() == ("UKF" in name)


@pytest.mark.parametrize("name", ["UKF", "B-UKF", "UKFz"])
@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
def test_an_indefinite_prior_stops_the_unscented_alone(name, root):
    prior, z, model = nonlinear()
    bad = prior.cov.copy()
    bad[2] = np.diag([1.0, -1.0])
    options = {"points": SigmaPoints(root=root)}
    healthy = FILTERS[name](prior, z, model, **options)
    got = FILTERS[name](Gaussian(prior.mean, bad), z, model, **options)
    for ours, wanted in zip(got, healthy, strict=True):
        assert_array_equal(ours[[0, 1, 3, 4, 5]], wanted[[0, 1, 3, 4, 5]])
        assert np.isnan(ours[2]).all()


@pytest.mark.parametrize("name", [name for name in FILTERS if "UKF" not in name])
def test_an_indefinite_prior_does_not_stop_the_others(name):
    """As the paper's filters went on: the update needs no root of P."""
    prior, z, model = nonlinear()
    indefinite = Gaussian(prior.mean, np.broadcast_to(np.diag([1.0, -1e-3]), prior.cov.shape))
    got = FILTERS[name](indefinite, z, model)
    assert np.isfinite(got.mean).all()
    assert np.isfinite(got.cov).all()


@pytest.mark.parametrize("form", ["joseph", "short"])
@pytest.mark.parametrize("name", [*FILTERS, *LATER_FILTERS])
def test_two_states_have_the_same_bits_alone_and_in_any_company(name, form):
    """One or two members are computed in floats, more of them by NumPy."""
    prior, z, model = nonlinear()
    estimator = replace({**FILTERS, **LATER_FILTERS}[name], form=form)
    whole = run(estimator, prior, z, model, steps=5)
    for some in (0, slice(1), slice(2)):
        part = run(estimator, Gaussian(prior.mean[some], prior.cov[some]), z[some], model, steps=5)
        assert_array_equal(part.mean, whole.mean[:, some])
        assert_array_equal(part.cov, whole.cov[:, some])
