"""The gated rule against a root finder, its gate against chi-square, and its limits."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from ruled import SIZES, assert_printed, go, printed_prediction, printed_update, problem, ruled
from scipy.optimize import brentq
from scipy.stats import chi2

from navfilters import FILTERS, Filter, Gaussian
from navfilters.estimators.gated_inflation import GatedInflation
from navfilters.models import Linear


def square(y, S):
    return y @ np.linalg.solve(S, y)


def printed_gate(estimates, z, p, probability=0.99, fixed=None):
    """The factor by a bracket and a root finder."""
    for (x, P), measured in zip(estimates, z, strict=True):
        x, P = printed_prediction(x, P, p.dynamics)
        H, R, m = p.sensor.jacobian(x), p.sensor.R, len(measured)
        y = measured - p.sensor.h(x)
        if square(y, H @ P @ H.T + R) > chi2.ppf(probability, m):

            def excess(factor, y=y, H=H, P=P, R=R):
                return square(y, factor * H @ P @ H.T + R) - len(y)

            P = (fixed or brentq(excess, 1.0, 1e6, xtol=1e-13, rtol=1e-14)) * P
        yield printed_update(x, P, measured, p.sensor)


@pytest.mark.parametrize("fixed", [None, 7.0])
@pytest.mark.parametrize(("n", "m"), [size for size in SIZES if size[0] > 1])
def test_every_step_is_the_printed_one(n, m, fixed):
    p = problem(n, m)
    states = go(Filter(rule=GatedInflation(0.9, fixed)), p)
    assert_printed(lambda *args: printed_gate(*args, 0.9, fixed), states, p)
    assert 0 < states[-1].memory.opened.sum() < 30 * 4


@pytest.mark.parametrize("name", ["EKF", "UKF"])
def test_behind_the_gate_the_square_is_its_expectation(name):
    """Over twelve decades of noise and spread, with three sensors."""
    rng = np.random.default_rng(0)
    scales = 10.0 ** rng.uniform(-3, 3, (200, 2, 3))
    P, R = (scales[:, i, :, None] * np.eye(3) for i in (0, 1))
    prior = Gaussian(np.zeros((200, 3)), P)
    z = np.sqrt(scales.sum(axis=1)) * rng.normal(size=(200, 3)) * 5
    filter_ = Filter(FILTERS[name].moments, rule=GatedInflation(largest=1e12))
    H = np.broadcast_to(np.eye(3), (200, 3, 3))
    state = filter_.step(filter_.init(prior), z, Linear(H, R))
    opened = state.memory.opened == 1
    assert opened.sum() > 150
    after = np.array([square(y, S) for y, S in zip(state.innovation, state.S, strict=True)])
    reached = opened & (state.memory.factor < 1e12)
    assert_allclose(after[reached], 3.0, rtol=1e-8)
    assert reached.sum() > 150


def test_a_consistent_filter_opens_it_as_often_as_chi_square_says():
    rng = np.random.default_rng(1)
    model = Linear([[1.0, 0.5], [0.0, 2.0]], np.diag([1.0, 3.0]))
    prior = Gaussian(np.zeros(2), np.array([[2.0, 0.3], [0.3, 1.0]]))
    x = rng.multivariate_normal(prior.mean, prior.cov, 40000)
    z = model.h(x) + rng.multivariate_normal(np.zeros(2), model.R, 40000)
    filter_ = Filter(rule=GatedInflation(0.95))
    opened = filter_.step(filter_.init(prior), z, model).memory.opened
    assert abs(opened.mean() - 0.05) < 4 * np.sqrt(0.05 * 0.95 / 40000)


def test_a_square_that_no_factor_brings_down_is_enlarged_to_the_bound():
    """The second sensor sees nothing that varies: its residual is not P's to explain."""
    prior = Gaussian(np.zeros(2), np.eye(2))
    model = Linear([[1.0, 0.0], [0.0, 0.0]], np.eye(2))
    filter_ = Filter(rule=GatedInflation(largest=50.0))
    state = filter_.step(filter_.init(prior), np.array([1.0, 9.0]), model)
    assert state.memory.factor == 50.0
    assert np.isfinite(state.estimate.cov).all()
    blind = filter_.step(filter_.init(prior), np.array([9.0]), Linear([[0.0, 0.0]], [[1.0]]))
    assert blind.memory.factor == 1.0


def test_a_gate_that_never_opens_leaves_the_ekf():
    p = problem()
    last, ekf = ruled(GatedInflation(1 - 1e-16, 1.0), p)[-1], ruled(None, p)[-1]
    assert_array_equal(last.estimate.mean, ekf.estimate.mean)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: GatedInflation(1.0), "probability must be between 0 and 1; found 1.0"),
        (lambda: GatedInflation([0.9, 0.99]), "probability must be a finite real number"),
        (lambda: GatedInflation(factor=0.5), "factor must be at least 1; found 0.5"),
        (lambda: GatedInflation(largest=[2.0, 0.1]), "largest must be at least 1; found 0.1"),
        (lambda: GatedInflation(largest=np.inf), "largest must be an array"),
    ],
)
def test_parameters_are_checked_when_a_rule_is_made(make, message):
    with pytest.raises(ValueError, match=message):
        make()
