"""Shared by tests of small_matrices."""

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from naive import covariances
from numpy.testing import assert_array_equal

entries = st.floats(-10, 10).map(lambda value: round(value, 6))  # no subnormal numbers
sizes = pytest.mark.parametrize("n", [1, 2, 3, 4])


def square(n):
    return arrays(np.float64, (n, n), elements=entries)


def symmetric(rng, shape, n):
    """Random symmetric matrices with eigenvalues of both signs, none near zero."""
    V, _ = np.linalg.qr(rng.normal(size=(*shape, n, n)))
    w = rng.uniform(0.5, 2.0, (*shape, 1, n)) * np.where(np.arange(n) % 2, 1, -1)
    A = (V * w) @ V.mT
    return (A + A.mT) / 2


BROKEN = {
    "NaN": lambda n: np.full((n, n), np.nan),
    "one NaN": lambda n: np.where(np.arange(n * n).reshape(n, n) == n * n - 1, np.nan, np.eye(n)),
    "infinite": lambda n: np.diag(np.full(n, np.inf)),
    "zero": lambda n: np.zeros((n, n)),
    "negative": lambda n: -np.eye(n),
    "indefinite": lambda n: np.diag([1.0] * (n - 1) + [-1.0]),
    "semidefinite": lambda n: np.ones((n, n)) - (n == 1),
}
broken = pytest.mark.parametrize("kind", BROKEN)


def stacks(n, kind):
    """Five healthy members, and the same stack with the third one broken."""
    healthy = covariances(np.random.default_rng(n), (5,), n)
    bad = healthy.copy()
    bad[2] = BROKEN[kind](n)
    return healthy, bad


def assert_alone(function, healthy, bad, member=2):
    """The broken member is NaN, the others are what they are without it, to the last bit."""
    with np.errstate(all="ignore"):
        got, wanted = function(bad), function(healthy)
    others = np.arange(len(healthy)) != member
    assert_array_equal(got[others], wanted[others])
    assert np.isfinite(wanted).all()
    return got[member]
