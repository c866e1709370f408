"""Predictions of dynamics that give little: f alone, propagate alone, batch axes of their own."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Gaussian, run
from navfilters.estimators.model_parts import moved
from navfilters.models import Linear

PRIOR = Gaussian(np.array([0.3, 0.2]), np.array([[0.5, 0.1], [0.1, 0.4]]))
MODEL = Linear(np.eye(2), np.eye(2))
Q = np.diag([0.01, 0.02])
Z = np.ones(2)


def f(x):
    return np.stack([x[..., 0] + 0.1 * x[..., 1], x[..., 1] - 0.1 * np.sin(x[..., 0])], axis=-1)


def F(x):
    zero = 0 * x[..., 0]
    rows = [[zero + 1, zero + 0.1], [-0.1 * np.cos(x[..., 0]), zero + 1]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def hessian(x):
    H = np.zeros((*x.shape[:-1], 2, 2, 2))
    H[..., 1, 0, 0] = 0.1 * np.sin(x[..., 0])
    return H


WAYS = {
    "f": {"f": f},
    "transition": {"transition": lambda x: (f(x), F(x))},
    "propagate": {"propagate": lambda x, Q: (f(x), F(x), Q)},
    "f and its second derivatives": {"f": f, "hessian": hessian},
}


@pytest.mark.parametrize("way", WAYS)
def test_a_state_moves_the_same_way_by_each(way):
    x = np.array([[0.3, 0.2], [0.1, -1.0]])
    assert_array_equal(moved(SimpleNamespace(Q=Q, **WAYS[way]), x), f(x))


@pytest.mark.parametrize("name", ["EKF", "mtSOF", "UKF"])
@pytest.mark.parametrize("way", WAYS)
def test_whatever_the_dynamics_give_is_enough(name, way):
    wanted = run(
        FILTERS[name], PRIOR, Z, MODEL, 3, dynamics=SimpleNamespace(Q=Q, f=f, hessian=hessian)
    )
    got = run(FILTERS[name], PRIOR, Z, MODEL, 3, dynamics=SimpleNamespace(Q=Q, **WAYS[way]))
    assert_allclose(got.mean, wanted.mean, rtol=1e-9)
    assert_allclose(got.cov, wanted.cov, rtol=1e-9)


def test_the_second_order_prediction_line_by_line():
    """x' = f + b, P' = F P F^T + Q - b b^T with b_i = tr(f_i'' P) / 2, all by hand."""
    got = FILTERS["mtSOF"].predict(FILTERS["mtSOF"].init(PRIOR), SimpleNamespace(Q=Q, f=f))
    b = np.array([0.0, 0.05 * np.sin(0.3) * 0.5])
    at = F(PRIOR.mean)
    assert_allclose(got.estimate.mean, f(PRIOR.mean) + b, rtol=1e-10)
    assert_allclose(got.estimate.cov, at @ PRIOR.cov @ at.T + Q - np.outer(b, b), rtol=1e-10)


@dataclass(frozen=True)
class Pushed:
    """Three members of one motion, each with its own push."""

    push: np.ndarray
    Q: np.ndarray

    def f(self, x):
        return f(x) + self.push


@pytest.mark.parametrize("name", ["EKF", "mtSOF", "UKF"])
def test_dynamics_may_have_batch_axes_that_the_prior_has_not(name):
    push = np.arange(6.0).reshape(3, 2) / 10
    noise = np.array([1.0, 2.0, 3.0])[:, None, None] * Q
    got = run(FILTERS[name], PRIOR, Z, MODEL, 3, dynamics=Pushed(push, noise))
    assert got.mean.shape == (4, 3, 2)
    for i in range(3):
        alone = run(FILTERS[name], PRIOR, Z, MODEL, 3, dynamics=Pushed(push[i], noise[i]))
        assert_allclose(got.mean[:, i], alone.mean, rtol=1e-12)
        assert_allclose(got.cov[:, i], alone.cov, rtol=1e-12)


def test_the_log_likelihood_of_a_run_begins_with_its_first_update():
    """And adds up to that of all measurements at once."""
    z = np.array([[0.2, 0.4], [np.nan, 1.0], [np.nan, np.nan]])
    still = SimpleNamespace(Q=np.zeros((2, 2)), f=lambda x: x + 0.0)
    found = run(
        FILTERS["EKF"],
        PRIOR,
        z,
        MODEL,
        dynamics=still,
        z_per_step=True,
        record=lambda state: state.log_likelihood,
    )
    seen = np.array([0, 1, 1])  # which component of the state each number is of
    S = PRIOR.cov[np.ix_(seen, seen)] + np.eye(3)
    y = np.array([0.2, 0.4, 1.0]) - PRIOR.mean[seen]
    wanted = -0.5 * (y @ np.linalg.solve(S, y) + np.linalg.slogdet(2 * np.pi * S)[1])
    assert np.isnan(found[0])
    assert_array_equal(found[3], 0)
    assert_allclose(found[1:].sum(), wanted, rtol=1e-12)
