"""The adaptive robust rule against the printed formulas with a matrix root, and its memory."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from ruled import (
    SIZES,
    Matched,
    Problem,
    assert_printed,
    go,
    inv,
    linear_problem,
    printed_prediction,
    printed_update,
    problem,
    ruled,
)

from navfilters import Filter, Gaussian
from navfilters.estimators.robust import AdaptiveRobust, trace_ratio
from navfilters.models import Linear


def printed_arekf(estimates, z, p, alpha=0.2, rho=0.98, gamma=7.0):
    """(24), (26) and (5) as printed, with a matrix root and a gamma."""
    P_y_bar = None
    for (x, P), measured in zip(estimates, z, strict=True):
        x, P = printed_prediction(x, P, p.dynamics)
        H = p.sensor.jacobian(x)
        y, P_y = measured - p.sensor.h(x), H @ P @ H.T + p.sensor.R
        spread = np.outer(y, y)
        P_y_bar = spread if P_y_bar is None else (rho * P_y_bar + spread) / (rho + 1)
        if not (np.linalg.eigvalsh(P_y - alpha * P_y_bar) > 0).all():
            lam = max(1.0, np.trace(P_y_bar) / np.trace(P_y))
            inside = inv(P) - inv(P) / lam
            L = gamma * (np.linalg.cholesky(inside).T if lam > 1 else inside)  # L^T L is unique
            P = inv(inv(P) - gamma**-2 * L.T @ L)
        yield printed_update(x, P, measured, p.sensor)


@pytest.mark.parametrize("form", ["joseph", "short"])
@pytest.mark.parametrize(("n", "m"), SIZES)
def test_every_step_is_the_printed_one(n, m, form):
    """Each from the library's last estimate, with the reference's own memory."""
    p = problem(n, m)
    assert_printed(printed_arekf, go(Filter(rule=AdaptiveRobust(), form=form), p), p)


def test_the_runs_above_use_both_branches():
    last = ruled(AdaptiveRobust(), problem())[-1]
    assert ((last.memory.robust > 0) & (last.memory.robust < 30)).all()


def test_the_arekf_that_never_switches_is_the_ekf():
    p = problem()
    ekf = ruled(None, p)[-1].estimate
    for alpha in (0.0, 1e-6):
        last = ruled(AdaptiveRobust(alpha=alpha), p)[-1]
        assert_array_equal(last.estimate.mean, ekf.mean)
        assert_array_equal(last.estimate.cov, ekf.cov)
        assert not last.memory.robust.any()


def test_the_paper_s_values_are_the_defaults():
    assert (AdaptiveRobust().alpha, AdaptiveRobust().rho) == (0.2, 0.98)
    assert AdaptiveRobust().lam is trace_ratio


def test_lambda_below_one_is_one_and_counted():
    """One component of the innovation is large, their sum is not, compared with P_y."""
    sensor = Linear(np.eye(2), np.diag([1.0, 99.0]))
    prior = Gaussian(np.zeros((3, 2)), np.zeros((2, 2)))
    still = Matched(np.eye(2), np.eye(2), np.eye(2))
    p = Problem(prior, np.array([[[4.0, 0], [1.0, 0], [40.0, 0]]]), still, sensor, None)
    last = ruled(AdaptiveRobust(), p)[-1]
    assert last.memory.robust.tolist() == [1, 0, 1]
    assert last.memory.clipped.tolist() == [1, 0, 0]
    ekf = ruled(None, p)[-1]
    same = (last.estimate.mean == ekf.estimate.mean).all(axis=-1)
    assert same.tolist() == [True, True, False]


def test_the_spread_of_the_innovations_remembers_about_two():
    """(27) as printed: y y^T first, then (rho old + new) / (rho + 1)."""
    p = linear_problem()
    states = ruled(AdaptiveRobust(), p, 2)
    assert states[0].memory.P_y_bar is None
    y = p.z[0] - p.sensor.h(p.dynamics.transition(p.prior.mean)[0])
    assert_allclose(states[1].memory.P_y_bar, y[:, :, None] * y[:, None, :], rtol=1e-12)
    y = p.z[1] - p.sensor.h(p.dynamics.transition(states[1].estimate.mean)[0])
    wanted = (0.98 * states[1].memory.P_y_bar + y[:, :, None] * y[:, None, :]) / 1.98
    assert_allclose(states[2].memory.P_y_bar, wanted, rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: AdaptiveRobust(alpha=-0.1), "alpha must be at least 0; found -0.1"),
        (lambda: AdaptiveRobust(rho=np.nan), "rho must be an array"),
        (lambda: AdaptiveRobust(lam=-1.0), "lam must be at least 0; found -1.0"),
    ],
)
def test_parameters_are_checked_when_a_rule_is_made(make, message):
    with pytest.raises(ValueError, match=message):
        make()
