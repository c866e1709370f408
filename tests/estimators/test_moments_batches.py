"""Moments of many members at once: batch axes of prior, model and noise, together and alone."""

import naive
import numpy as np
import pytest
from moment_problems import bearing_model, prior
from naive import covariances
from numpy.testing import assert_allclose

from navfilters import Gaussian, linearized, second_order, unscented
from navfilters.models import Linear, RangeBearing


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
