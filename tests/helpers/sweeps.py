"""Shared by tests of sweep."""

from functools import partial

import numpy as np
from naive import covariances
from numpy.testing import assert_array_equal

from navfilters import FILTERS, Gaussian, sweep
from navfilters.papers.perea2007.experiment import Setup

BASE = Setup()
MODEL = BASE.model
EKF = FILTERS["EKF"]
quiet = partial(sweep, progress=False)
LOCAL = {"protocol": "tcp", "host": "127.0.0.1", "dashboard_address": ":0"}
"""A LocalCluster that asks for no other address of this machine, which would need a network."""


def priors(count=11, seed=0):
    rng = np.random.default_rng(seed)
    return Gaussian(rng.normal(BASE.x0, 10.0, (count, 2)), 2e3 * covariances(rng, (count,), 2))


def assert_same(got, wanted):
    """Bit for bit."""
    for ours, theirs in zip(got, wanted, strict=True):
        assert_array_equal(ours, theirs)
