"""Priors and a model whose moments are known by other ways, and how they are compared."""

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose

from navfilters import Gaussian
from navfilters.models import RangeBearing

ROOTS = ["cholesky", "symmetric"]
roots = pytest.mark.parametrize("root", ROOTS)


def prior(n=2, shape=(4, 3), seed=0):
    """Members somewhere in the plane, a few deviations away from the origin."""
    rng = np.random.default_rng(seed)
    mean = rng.uniform(5, 20, (*shape, n)) * rng.choice([-1, 1], (*shape, n))
    return Gaussian(mean, covariances(rng, shape, n))


def bearing_model():
    return RangeBearing(np.array([[0.5, 0.02], [0.02, 0.01]]))


def assert_moments(got, wanted, digits=12):
    for name, ours, theirs in zip(got._fields[:3], got[:3], wanted[:3], strict=True):
        size = np.abs(theirs).max()
        assert_allclose(ours, theirs, rtol=0, atol=10.0**-digits * size, err_msg=name)
