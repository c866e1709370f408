"""Jacobians that a filter makes itself are compared with differences before the first step."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from navfilters import FILTERS, Gaussian, run, sweep
from navfilters.models import Linear

PRIOR = Gaussian(np.array([1.0, 2.0]), np.eye(2))
SEEN = Linear(np.eye(2), np.eye(2))
LOOPS = [run, partial(sweep, progress=False)]


def length(x):
    """Without its phase: no complex step goes through it."""
    return np.stack([x[..., 0] + 0.1 * np.linalg.norm(x, axis=-1), x[..., 1]], axis=-1)


NORM = SimpleNamespace(h=length, R=np.eye(2))
DRIFT = SimpleNamespace(f=length, Q=np.eye(2))


@pytest.mark.parametrize("name", ["EKF", "B-EKF 1"])
@pytest.mark.parametrize("loop", LOOPS)
def test_what_is_not_analytic_is_refused(loop, name):
    with pytest.raises(TypeError, match=r"model\.h must be analytic"):
        loop(FILTERS[name], PRIOR, np.ones(2), NORM, 1)
    with pytest.raises(TypeError, match=r"dynamics\.f must be analytic"):
        loop(FILTERS[name], PRIOR, np.ones(2), SEEN, 1, dynamics=DRIFT)


@pytest.mark.parametrize("loop", LOOPS)
def test_sigma_points_need_no_derivative(loop):
    loop(FILTERS["UKF"], PRIOR, np.ones(2), NORM, 1, dynamics=DRIFT)


@pytest.mark.parametrize("loop", LOOPS)
def test_a_jacobian_that_is_given_is_taken(loop):
    given = SimpleNamespace(h=length, R=np.eye(2), jacobian=lambda x: np.eye(2) + 0 * x[..., None])
    loop(FILTERS["EKF"], PRIOR, np.ones(2), given, 1)
