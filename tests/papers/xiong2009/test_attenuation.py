"""Limits of gamma and lambda, and what gamma bounds."""

import numpy as np
from mismatched import TURN, Q
from naive import covariances
from numpy.testing import assert_allclose
from ruled import Matched, inv

from navfilters import Filter, Gaussian
from navfilters.estimators.robust import Robust, trace_ratio
from navfilters.models import Linear
from navfilters.papers import xiong2009


def test_the_limits_of_gamma_are_those_of_the_two_inequalities():
    """(22): Sigma > Sigma_bar just below it and not just above; infinite where P is enough."""
    rng = np.random.default_rng(3)
    P, Sigma_bar = covariances(rng, (200,), 3), covariances(rng, (200,), 3)
    Sigma_bar[0] = P[0] / 2
    lower, upper = xiong2009.gamma_limits(P, Sigma_bar)
    assert_allclose(lower, np.sqrt(np.linalg.eigvalsh(P)[:, -1]))
    assert upper[0] == np.inf
    open_ = np.isfinite(upper) & (upper > lower * 1.001)
    assert 5 < open_.sum() < 195  # and for the others no gamma exists
    for factor, holds in ((1 - 1e-6, True), (1 + 1e-6, False)):
        gamma = (factor * upper)[open_, None, None]
        Sigma = inv(inv(P[open_]) - np.eye(3) / gamma**2)
        least = np.linalg.eigvalsh(Sigma - Sigma_bar[open_])[:, 0]
        assert ((least > 0) == holds).all()


def test_one_gamma_cannot_serve_two_units():
    """Metres and metres per second: a velocity wrong by 2 leaves no gamma, but lambda = 4."""
    P, Sigma_bar = np.diag([1e6, 1e-2]), np.diag([1e6, 4e-2])
    lower, upper = xiong2009.gamma_limits(P, Sigma_bar)
    assert_allclose([lower, upper], [1e3, 75**-0.5])
    assert_allclose(xiong2009.smallest_lambda(P, Sigma_bar), 4.0)


def test_the_smallest_lambda_is_that_of_25():
    rng = np.random.default_rng(4)
    P, Sigma_bar = covariances(rng, (50,), 4), covariances(rng, (50,), 4)
    lam = xiong2009.smallest_lambda(P, Sigma_bar)[:, None, None]
    least = [np.linalg.eigvalsh(f * lam * P - Sigma_bar)[:, 0] for f in (1 - 1e-9, 1 + 1e-9)]
    assert (least[0] < 0).all()
    assert (least[1] > 0).all()


def test_the_trace_ratio_never_satisfies_25_where_it_asks_for_something():
    """Theorem 2 with (47), even with the true covariance of the innovations and rank H = n."""
    rng = np.random.default_rng(5)
    P, Sigma_bar = covariances(rng, (5000,), 3), covariances(rng, (5000,), 3)
    H, R = rng.normal(size=(5000, 3, 3)), 0.1 * covariances(rng, (5000,), 3)
    lam = trace_ratio(H @ Sigma_bar @ H.mT + R, H @ P @ H.mT + R)
    needed = xiong2009.smallest_lambda(P, Sigma_bar)
    asked = needed > 1
    assert asked.sum() > 4000
    assert (lam < needed)[asked].all()


def worst_attenuation(gamma, steps=40):
    """Largest singular value, squared, from all disturbances of a run to its predicted errors.

    The members of a batch are the unit disturbances: an error map by running the filter on them.
    The first prediction is the initial error, (10) with whitened disturbances.
    """
    R, H = np.eye(1), np.array([[1.0, 0.2]])
    sensor, dynamics = Linear(H, R), Matched(TURN, np.eye(2), Q)
    count = 2 + 3 * steps
    unit = np.eye(count)
    x = np.linalg.cholesky(np.eye(2) + Q) @ unit[:2]  # P of the first prediction
    estimator = Filter(rule=Robust(gamma, on_violation="raise"))
    state = estimator.init(Gaussian(np.zeros((count, 2)), np.eye(2)))
    rows = []
    for t in range(steps):
        w, v = unit[2 + 3 * t : 4 + 3 * t], unit[4 + 3 * t]
        predicted = dynamics.transition(state.estimate.mean)[0]
        rows.append((x.T - predicted).T)
        state = estimator.step(state, (H @ x + np.sqrt(R) * v).T, sensor, dynamics)
        x = TURN @ x + np.sqrt(Q) @ w
    return np.linalg.norm(np.concatenate(rows), 2) ** 2, np.array(rows)


def test_the_rekf_attenuates_every_disturbance_below_gamma_squared():
    """Eq. (10) in the form that the recursion guarantees; the EKF lets more through."""
    worst, errors = worst_attenuation(2.6)
    ekf, _ = worst_attenuation(np.inf)
    assert worst < 2.6**2 < ekf
    assert_allclose([worst, ekf], [5.9452, 8.0630], rtol=1e-4)
    units = np.eye(errors.shape[-1])[None]
    each = xiong2009.attenuation_ratio(errors.mT, units)
    assert each.shape == (122,)
    assert each.max() < worst
    some = np.random.default_rng(0).normal(size=(1, 50, 122))
    assert (xiong2009.attenuation_ratio((errors @ some[0].T).mT, some) < worst).all()


def test_the_printed_attenuation_ratio_depends_on_units():
    """sum |x|^2 / sum (|w|^2 + |v|^2) > gamma^2 in a run that satisfies (23) at every step."""
    rng = np.random.default_rng(1)
    unit = 1e-3
    sensor = Linear(np.eye(2), unit**2 * np.eye(2))
    dynamics = Matched(TURN, np.eye(2), unit**2 * Q)
    estimator = Filter(rule=Robust(2.0 * unit, on_violation="raise"))
    state, x = estimator.init(Gaussian(np.zeros(2), unit**2 * np.eye(2))), np.zeros(2)
    w, v = unit * np.sqrt(0.2) * rng.normal(size=(50, 2)), unit * rng.normal(size=(50, 2))
    error = []
    for t in range(50):
        x = TURN @ x + w[t]
        state = estimator.step(state, x + v[t], sensor, dynamics)
        error.append(x - state.estimate.mean)
    assert state.memory.violations == 0
    assert xiong2009.attenuation_ratio(np.array(error), w, v) > 1e3 * estimator.rule.gamma**2


def test_the_attenuation_ratio_sums_over_time():
    error = np.arange(12.0).reshape(3, 2, 2)
    w, start = np.ones((3, 2, 1)), np.full((1, 2, 4), 2.0)
    got = xiong2009.attenuation_ratio(error, w, start)
    wanted = [sum(error[t, i] @ error[t, i] for t in range(3)) / (3 + 16) for i in range(2)]
    assert_allclose(got, wanted)
