"""The strong tracking rule against the printed formulas, and what Xiong's recursion is of it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from ruled import SIZES, assert_printed, go, printed_update, problem, ruled

from navfilters import FILTERS, Filter, Gaussian
from navfilters.estimators.robust import AdaptiveRobust
from navfilters.estimators.strong_tracking import StrongTracking
from navfilters.models import Linear


def printed_stf(estimates, z, p, rho=0.95, beta=1.0):
    """Zhou and Frank's order: the factor from F P F^T, then the prediction and the update."""
    V = None
    for (x, P), measured in zip(estimates, z, strict=True):
        x, F = p.dynamics.transition(x)
        H, Q, R = p.sensor.jacobian(x), p.dynamics.Q, p.sensor.R
        y = measured - p.sensor.h(x)
        V = np.outer(y, y) if V is None else (rho * V + np.outer(y, y)) / (1 + rho)
        N = V - beta * R - H @ Q @ H.T
        M = H @ F @ P @ F.T @ H.T
        P = max(1.0, np.trace(N) / np.trace(M)) * F @ P @ F.T + Q
        yield printed_update(x, P, measured, p.sensor)


@pytest.mark.parametrize("form", ["joseph", "short"])
@pytest.mark.parametrize(("n", "m"), SIZES)
def test_every_step_is_the_printed_one(n, m, form):
    p = problem(n, m)
    assert_printed(printed_stf, go(Filter(rule=StrongTracking(), form=form), p), p)
    soft = StrongTracking(0.5, 3.0)
    assert_printed(
        lambda *args: printed_stf(*args, 0.5, 3.0), go(Filter(rule=soft, form=form), p), p
    )


def test_the_runs_above_fade_at_some_steps():
    last = ruled(StrongTracking(), problem())[-1]
    assert ((last.memory.faded > 0) & (last.memory.faded < 30)).all()


def test_its_spread_is_xiongs_recursion():
    """Eq. (27) of xiong2009 with the same forgetting, along the same innovations."""
    p = problem()
    own, xiong = (
        ruled(rule, p, 1)[-1].memory[0] for rule in (StrongTracking(0.98), AdaptiveRobust(rho=0.98))
    )
    assert_array_equal(own, xiong)
    prior, y = Gaussian(np.zeros(3), np.eye(3)), np.array([3.0, -1.0])
    moments = FILTERS["EKF"].moments(prior, Linear(np.eye(2, 3), np.eye(2)))
    memories = []
    for rule in (StrongTracking(0.7), AdaptiveRobust(rho=0.7)):
        memory = rule.init(prior)
        for scale in (1.0, 0.3, 5.0):
            memory = rule.enlarge(memory, prior, scale * y, moments)[1]
        memories.append(memory[0])
    assert_array_equal(*memories)


def test_without_noise_it_brings_the_predicted_spread_to_the_estimated_one():
    """With W = 0 and beta = 1: tr(lambda H P H^T + R) = tr V, whatever the moments are made of."""
    rng = np.random.default_rng(3)
    model = Linear(rng.normal(size=(2, 3)), np.diag([0.1, 0.2]))
    prior, z = Gaussian(np.zeros(3), np.diag([1.0, 2.0, 3.0])), np.array([20.0, -9.0])
    for name in ("EKF", "mtSOF", "UKF"):
        filter_ = Filter(FILTERS[name].moments, rule=StrongTracking())
        state = filter_.step(filter_.init(prior), z, model)
        assert_allclose(np.trace(state.S), np.trace(state.memory.spread), rtol=1e-10)
        assert state.memory.W is None


def test_a_second_sensor_at_the_same_time_finds_all_of_p_old():
    """W is of the prediction just before; an update without one has none."""
    p = problem()
    filter_ = Filter(rule=StrongTracking())
    first = filter_.step(filter_.init(p.prior), p.z[0], p.sensor, p.dynamics)
    assert_array_equal(first.memory.W, 0 * first.estimate.cov)
    second = filter_.update(first, p.z[1], p.sensor)
    bare = first._replace(memory=first.memory._replace(W=None))
    wanted = filter_.update(bare, p.z[1], p.sensor)
    assert_array_equal(second.estimate.cov, wanted.estimate.cov)


def test_quiet_innovations_leave_the_ekf():
    p = problem(noise=0.0)
    last, ekf = ruled(StrongTracking(beta=1e9), p)[-1], ruled(None, p)[-1]
    assert_array_equal(last.estimate.mean, ekf.estimate.mean)
    assert not last.memory.faded.any()


def test_what_is_known_without_doubt_cannot_fade():
    """H P H^T = 0: no factor exists, and none is applied."""
    prior = Gaussian(np.zeros(2), np.diag([0.0, 1.0]))
    filter_ = Filter(rule=StrongTracking())
    state = filter_.step(filter_.init(prior), np.array([9.0]), Linear([[1.0, 0.0]], [[1.0]]))
    assert state.memory.factor == 1
    assert_array_equal(state.estimate.mean, 0.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: StrongTracking(rho=-0.1), "rho must be from 0 to 1; found -0.1"),
        (lambda: StrongTracking(rho=1.1), "rho must be from 0 to 1; found 1.1"),
        (lambda: StrongTracking(rho=np.nan), "rho must be an array"),
        (lambda: StrongTracking(beta=0.5), "beta must be at least 1; found 0.5"),
    ],
)
def test_parameters_are_checked_when_a_rule_is_made(make, message):
    with pytest.raises(ValueError, match=message):
        make()
