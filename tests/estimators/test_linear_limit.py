"""On a linear model every filter is a Kalman filter, at every option."""

from itertools import product

import naive
import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose
from ten_filters import GRID, norm, size

from navfilters import (
    FILTERS,
    Gaussian,
)
from navfilters.models import Linear


def settings_of(name):
    """Every combination of the grid's values for one filter, as (label, options)."""
    grids = [
        [(f"{key}={label}", (key, value)) for label, value in GRID[key].items()]
        for key in FILTERS[name].options
    ]
    return [
        ("; ".join(label for label, _ in combination), dict(pair for _, pair in combination))
        for combination in product(*grids)
    ]


CASES = [
    pytest.param(name, options, id=f"{name} {label}".strip())
    for name in FILTERS
    for label, options in settings_of(name)
]
every_setting = pytest.mark.parametrize(("name", "options"), CASES)
# What the textbook's Kalman filter is given in place of (P, R).
LIMIT = {
    "EKF": lambda P, H, R: (P, R),
    "B-EKF 1": lambda P, H, R, bump: (P, R + bump * H @ P @ H.T),
    "B-EKF 2": lambda P, H, R: (P, R + norm(P) * H @ H.T),
    "B-EKF 3": lambda P, H, R: (P, norm(np.linalg.inv(H) @ R @ np.linalg.inv(H).T) * H @ H.T),
    "B-EKF 4": lambda P, H, R: (norm(P) * np.eye(len(P)), R),
    "mtSOF": lambda P, H, R: (P, R),
    "B-mtSOF": lambda P, H, R, bump: (P, R + bump * H @ P @ H.T),
    "UKF": lambda P, H, R: (P, R),
    "B-UKF": lambda P, H, R, bump: (P, R + bump * H @ P @ H.T),
    "UKFz": lambda P, H, R: (P, R),
}


def linear_problems(n, m, count=4):
    rng = np.random.default_rng(10 * n + m)
    H = rng.normal(size=(count, m, n)) + 2 * np.eye(m, n)
    prior = Gaussian(rng.normal(size=(count, n)), covariances(rng, (count,), n))
    return prior, 3 * rng.normal(size=(count, m)), Linear(H, covariances(rng, (count,), m))


def largest_weight(options, n):
    if "points" not in options:
        return 1.0
    return np.max([np.max(np.abs(w)) for w in options["points"].weights(n)[1:]])


@every_setting
@pytest.mark.parametrize("n", [1, 2, 3, 4])
@pytest.mark.parametrize("m", [1, 2, 3])
def test_on_a_linear_model_it_is_its_kalman_filter(name, options, n, m):
    """An independent Kalman filter with the stated P and R, and Filter.linear_limit, agree with it.

    The tolerance is 1e-15 max|W| for the sigma points' weights, plus 1e-12 for everything else.
    """
    if name == "B-EKF 3" and m != n:
        with pytest.raises(ValueError, match="B-EKF 3 inverts"):
            FILTERS[name](*linear_problems(n, m))
        return
    prior, z, model = linear_problems(n, m)
    bump = {key: value for key, value in options.items() if key == "bump"}
    got = FILTERS[name](prior, z, model, **options)
    stated = FILTERS[name].linear_limit(prior, z, model, **options)
    tolerance = 1e-12 + 1e-15 * largest_weight(options, n)
    for i, (x, P) in enumerate(zip(*prior, strict=True)):
        H, R = model.H[i], model.R[i]
        P_stated, R_stated = LIMIT[name](P, H, R, **bump)
        mean, cov = naive.kalman(x, P_stated, z[i], H, R_stated)
        scale = size(cov)
        assert_allclose(stated.cov[i], cov, rtol=0, atol=1e-11 * scale)
        assert_allclose(stated.mean[i], mean, rtol=0, atol=1e-11 * (1 + size(mean)))
        assert size(got.cov[..., i, :, :] - cov) < tolerance * size(P)
        assert size(got.mean[..., i, :] - mean) < tolerance * (size(x) + size(mean))
