"""What is known exactly stays so."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import (
    FILTERS,
    Gaussian,
    SigmaPoints,
    run,
)
from navfilters.models import Linear, RangeBearing

UNSCENTED = ["UKF", "B-UKF", "UKFz"]


def exact_priors():
    """Covariances without full rank: zero rows, known combinations, nothing unknown at all."""
    rng = np.random.default_rng(5)
    v = np.array([3.0, -0.7, 1.1])
    B = rng.normal(size=(3, 2))
    units = np.array([1.0, 1e2, 1e-3])
    return {
        "one state": np.diag([2.0, 0.0, 1.0]),
        "the first state": np.array([[0.0, 0.0, 0.0], [0.0, 2.0, 0.3], [0.0, 0.3, 1.0]]),
        "all states": np.zeros((3, 3)),
        "a sum": np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 4.0]]),
        "all but a direction": np.outer(v, v),
        "all but a plane": B @ B.T,
        "all but a direction, vague": 1e6 * np.outer(v, v),
        "all but a plane, in other units": np.outer(units, units) * (B @ B.T),
    }


def sensor_of_three():
    H = np.array([[1.0, 0.5, -0.2], [0.3, 1.0, 0.8]])
    return Linear(H, [[0.2, 0.05], [0.05, 0.1]])


@pytest.mark.parametrize("name", UNSCENTED)
@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
@pytest.mark.parametrize("case", exact_priors())
def test_on_a_line_what_is_exact_costs_nothing(name, root, case):
    """The unscented filters are the Kalman filter in the coordinates of what is not known."""
    P = exact_priors()[case]
    model, z, x = sensor_of_three(), np.array([4.0, -1.0]), np.array([3.0, -1.0, 2.0])
    got = run(partial(FILTERS[name], points=SigmaPoints(root=root)), Gaussian(x, P), z, model, 5)
    d = unit(P)
    w, V = np.linalg.eigh(P / np.outer(d, d))
    B = d[:, None] * V[:, w > 1e-12] * np.sqrt(w[w > 1e-12])
    weight = np.linalg.inv(model.R)
    information, pulled = np.eye(B.shape[1]), np.zeros(B.shape[1])
    for _ in range(5):
        G = model.H @ B
        noise = model.R
        if name == "B-UKF":
            noise = noise + G @ np.linalg.inv(information) @ G.T
        weight = np.linalg.inv(noise)
        information = information + G.T @ weight @ G
        pulled = pulled + G.T @ weight @ (z - model.H @ x)
    wanted = x + B @ np.linalg.solve(information, pulled)
    cov = B @ np.linalg.inv(information) @ B.T
    size = np.sqrt(np.diagonal(P))
    tolerance = 1e-9 if "vague" in case or "units" in case else 1e-12
    assert (np.abs(got.mean[-1] - wanted) <= tolerance * size + 1e-14).all()
    assert (np.abs(got.cov[-1] - cov) <= tolerance * np.outer(size, size)).all()
    ekf = run(FILTERS["EKF"], Gaussian(x, P), z, model, 5)
    if name != "B-UKF":
        assert (np.abs(got.mean[-1] - ekf.mean[-1]) <= 1e-5 * size + 1e-12).all()


def unit(P):
    deviation = np.sqrt(np.diagonal(P))
    return np.where(deviation > 0, deviation, 1.0)


@pytest.mark.parametrize("name", UNSCENTED)
@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
def test_members_that_know_something_do_not_disturb_the_others(name, root):
    prior, z = Gaussian(np.ones((8, 3)), np.stack([*exact_priors().values()])), np.ones(2)
    definite = np.eye(3) + np.arange(8)[:, None, None]
    mixed = np.where((np.arange(8) % 2 == 0)[:, None, None], definite, prior.cov)
    update = partial(FILTERS[name], points=SigmaPoints(root=root))
    got = run(update, Gaussian(prior.mean, mixed), z, sensor_of_three(), 4)
    plain = run(update, Gaussian(prior.mean, definite), z, sensor_of_three(), 4)
    exact = run(update, prior, z, sensor_of_three(), 4)
    assert_array_equal(got.mean[:, ::2], plain.mean[:, ::2])
    assert_array_equal(got.cov[:, ::2], plain.cov[:, ::2])
    assert_allclose(got.mean[:, 1::2], exact.mean[:, 1::2], rtol=1e-12)


@pytest.mark.parametrize("name", UNSCENTED)
@pytest.mark.parametrize("angle", [0.0, 0.3, 1.0, np.pi / 2, 2.0])
def test_along_a_line_the_filter_stays_on_it(name, angle):
    """A vague prior along a line, a sharp sensor and three hundred curved updates."""
    model = RangeBearing(np.diag([2.5e-5, 6e-3]))
    v = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-v[1], v[0]])
    start = np.array([120.0, 80.0])
    prior = Gaussian(start, 1e4 * np.outer(v, v))
    got = run(FILTERS[name], prior, model.h(start + 10 * v), model, 300)
    assert np.isfinite(got.mean).all()
    assert_allclose((got.mean - start) @ across, 0.0, atol=1e-9)
    variance = np.einsum("i,kij,j->k", across, got.cov, across)
    along = np.einsum("i,kij,j->k", v, got.cov, v)
    assert (np.abs(variance) <= 1e-13 * along).all()
    assert (along > 0).all()


@pytest.mark.parametrize("name", UNSCENTED)
def test_an_exact_state_is_the_limit_of_a_nearly_exact_one(name):
    """On a curved model, with the state that is known first and last."""
    model = RangeBearing(np.diag([0.5, 0.01]))
    z = model.h(np.array([30.0, 40.0]))
    for i in (0, 1):
        P = np.diag([20.0, 20.0])
        P[i, i] = 0
        exact = FILTERS[name](Gaussian(np.array([32.0, 37.0]), P), z, model)
        P[i, i] = 1e-9
        nearly = FILTERS[name](Gaussian(np.array([32.0, 37.0]), P), z, model)
        assert_allclose(exact.mean, nearly.mean, rtol=1e-9)
        assert_allclose(exact.cov, nearly.cov, atol=1e-8)


@pytest.mark.parametrize("name", UNSCENTED)
def test_what_is_indefinite_is_still_nan(name):
    prior = Gaussian(np.ones((2, 3)), np.stack([np.eye(3), np.diag([1.0, -1e-6, 1.0])]))
    with np.errstate(all="ignore"):
        got = FILTERS[name](prior, np.ones(2), sensor_of_three())
    assert np.isfinite(got.mean[0]).all()
    assert np.isnan(got.mean[1]).all()
