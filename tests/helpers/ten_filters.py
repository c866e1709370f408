"""Shared by tests of filter."""

import numpy as np
import pytest
from naive import covariances

from navfilters import (
    FILTERS,
    Gaussian,
    SigmaPoints,
)
from navfilters.models import RangeBearing

# Every option of every filter, at every value that the tests run.
ALPHAS = np.array([1e-3, 0.1, 0.5, 1.0, 2.0])
BETAS = np.array([0.0, 1.0, 2.0, 3.0])
KAPPAS = np.array([-0.5, 0.0, 1.0, 3.3, 10.0])
BUMPS = np.array([0.0, 0.5, 1.0, 3.0])
MESH = [axis.ravel() for axis in np.meshgrid(ALPHAS, BETAS, KAPPAS, indexing="ij")]
GRID = {
    "bump": {str(bump): bump for bump in BUMPS},
    "points": {
        f"{root}, {which}": SigmaPoints(*arrays, root)
        for root in ("cholesky", "symmetric")
        for which, arrays in {
            "every alpha, beta, kappa": [axis[:, None] for axis in MESH],
            "default kappa": [ALPHAS[:, None], 2.0, None],
        }.items()
    },
}
every_filter = pytest.mark.parametrize("name", FILTERS)


def norm(A):
    return np.linalg.norm(A, 2)


def size(A):
    """What an absolute rounding error is small against."""
    return np.abs(A).max()


def nonlinear(count=6, seed=0):
    """Priors in all directions, correlated noise, residuals of several deviations."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(-2.5, 2.5, count)
    x = rng.uniform(5, 50, (count, 1)) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    model = RangeBearing(np.array([[0.5, 0.02], [0.02, 0.01]]))
    z = model.h(x) + rng.normal(size=(count, 2)) * [3.0, 0.1]
    return Gaussian(x, 4 * covariances(rng, (count,), 2)), z, model
