"""The robust rule against the printed formulas with plain inverses, its limits and violations."""

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal
from ruled import (
    SIZES,
    Matched,
    Problem,
    assert_printed,
    go,
    inv,
    printed_prediction,
    printed_update,
    problem,
    ruled,
)

from navfilters import Filter, Gaussian
from navfilters.estimators.robust import Robust
from navfilters.models import Linear


def printed_rekf(estimates, z, p, gamma=1.5):
    for (x, P), measured in zip(estimates, z, strict=True):
        x, P = printed_prediction(x, P, p.dynamics)
        if gamma > np.sqrt(np.linalg.eigvalsh(P).max()):
            P = inv(inv(P) - gamma**-2 * np.eye(len(x)))
        yield printed_update(x, P, measured, p.sensor)


@pytest.mark.parametrize("form", ["joseph", "short"])
@pytest.mark.parametrize(("n", "m"), SIZES)
def test_every_step_is_the_printed_one(n, m, form):
    """Each from the library's last estimate."""
    p = problem(n, m)
    assert_printed(printed_rekf, go(Filter(rule=Robust(1.5), form=form), p), p)


def test_the_runs_above_use_both_branches():
    last = ruled(Robust(1.5), problem())[-1]
    assert (last.memory.violations > 0).any()
    assert (last.memory.violations < 30).all()


def test_the_rekf_tends_to_the_ekf_as_gamma_squared_grows():
    """The difference falls by 100 when gamma grows by 10."""
    p = problem()
    ekf = ruled(None, p, 5)[-1].estimate
    gammas = [1e2, 1e3, 1e4]
    off = [np.abs(ruled(Robust(g), p, 5)[-1].estimate.mean - ekf.mean).max() for g in gammas]
    assert_allclose(np.diff(np.log10(off)), -2, atol=1e-2)
    assert_array_equal(ruled(Robust(np.inf), p, 5)[-1].estimate.cov, ekf.cov)


def test_the_paper_s_values_are_the_defaults():
    assert (Robust().gamma, Robust().on_violation) == (8000.0, "skip")


def violating():
    """P of the first prediction has largest eigenvalues 1.25 and 100.25 in two members."""
    prior = Gaussian(np.zeros((2, 2)), np.eye(2) * np.array([1.0, 100.0])[:, None, None])
    dynamics = Matched(np.eye(2), np.eye(2), 0.25 * np.eye(2))
    return Problem(prior, np.ones((1, 2, 2)), dynamics, Linear(np.eye(2), np.eye(2)), None)


def test_skip_leaves_the_step_to_the_ekf():
    p = violating()
    last, ekf = ruled(Robust(4.0), p)[-1], ruled(None, p)[-1]
    assert last.memory.violations.tolist() == [0, 1]
    assert_array_equal(last.estimate.mean[1], ekf.estimate.mean[1])
    assert (last.estimate.mean[0] != ekf.estimate.mean[0]).all()


def test_nan_ends_the_member_alone_and_counts_once():
    p = violating()
    first = ruled(Robust(4.0, on_violation="nan"), p)[-1]
    assert np.isnan(first.estimate.mean).all(axis=-1).tolist() == [False, True]
    assert_array_equal(first.estimate.mean[0], ruled(Robust(4.0), p)[-1].estimate.mean[0])
    again = Filter(rule=Robust(4.0, on_violation="nan")).step(first, p.z[0], p.sensor, p.dynamics)
    assert again.memory.violations.tolist() == [0, 1]


def test_raise_names_the_smallest_admissible_gamma():
    p = violating()
    with pytest.raises(ValueError, match=r"smallest admissible gamma at this step is 10\.0125;"):
        ruled(Robust(4.0, on_violation="raise"), p)
    needed = np.sqrt(100.25)
    ruled(Robust(needed * (1 + 1e-9), on_violation="raise"), p)
    with pytest.raises(ValueError, match="must exceed"):
        ruled(Robust(needed * (1 - 1e-9), on_violation="raise"), p)


def test_the_violation_is_that_of_the_largest_eigenvalue():
    """Cholesky of gamma^2 I - P against eigenvalues, for members around the limit."""
    rng = np.random.default_rng(0)
    P = covariances(rng, (500,), 6)
    rule, prior = Robust(1.9), Gaussian(np.zeros((500, 6)), P)
    _, memory = rule.enlarge(rule.init(prior), prior, None, None)
    violated = memory.violations
    assert_array_equal(violated, np.linalg.eigvalsh(P)[:, -1] >= 1.9**2)
    assert 0 < violated.sum() < 500


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Robust(0.0), "gamma must be positive; found 0.0"),
        (lambda: Robust([1.0, np.nan]), "gamma must be positive"),
        (lambda: Robust(on_violation="ignore"), "on_violation must be .*'ignore'"),
    ],
)
def test_parameters_are_checked_when_a_rule_is_made(make, message):
    with pytest.raises(ValueError, match=message):
        make()
