"""The learnt noise against the printed equations, one member at a time, and what it learns."""

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal
from polar_models import engines
from ruled import Matched, Swing

from navfilters import FILTERS, Filter, Gaussian, run, sweep
from navfilters.estimators import AdaptiveRobust, VariationalNoise
from navfilters.models import Linear, RangeBearing


def problem(steps=20, members=3, n=3, m=2):
    rng = np.random.default_rng(7)
    sensor = Linear(rng.normal(size=(m, n)), np.diag([0.5, 2.0])[:m, :m])
    dynamics = Matched(0.9 * np.linalg.qr(rng.normal(size=(n, n)))[0], np.eye(n), 0.1 * np.eye(n))
    prior = Gaussian(rng.normal(size=(members, n)), covariances(rng, (members,), n))
    return prior, 3 * rng.normal(size=(steps, members, m)), sensor, dynamics


def printed(x, P, z, sensor, dynamics, rho, alpha, iterations):
    """Sarkka and Nummenmaa's algorithm, with the variances themselves."""
    H, F, Q = sensor.H, dynamics.G, dynamics.Q
    shape = np.full(len(H), alpha)
    scale = alpha * np.diag(sensor.R)
    for k, measured in enumerate(z):
        x, P = F @ x, F @ P @ F.T + Q
        if k:  # nothing is known to be forgotten before the first
            shape, scale = rho * shape, rho * scale
        shape, before = shape + 0.5, scale
        for _ in range(iterations):
            S = H @ P @ H.T + np.diag(scale / shape)
            K = P @ H.T @ np.linalg.inv(S)
            m, C = x + K @ (measured - H @ x), P - K @ S @ K.T
            scale = before + (measured - H @ m) ** 2 / 2 + np.diag(H @ C @ H.T) / 2
        x, P = m, C
        yield x, P, shape, scale


def test_every_step_is_the_printed_one():
    """In its own units: beta is relative to the sensor's R."""
    prior, z, sensor, dynamics = problem()
    filter_ = VariationalNoise(rho=0.9, strength=3.0, iterations=4)
    states = run(filter_, prior, z, sensor, dynamics=dynamics, z_per_step=True, record=lambda s: s)
    for i in range(3):
        steps = printed(prior.mean[i], prior.cov[i], z[:, i], sensor, dynamics, 0.9, 3.0, 4)
        for k, (x, P, shape, scale) in enumerate(steps, 1):
            assert_allclose(states.estimate.mean[k, i], x, rtol=1e-9)
            assert_allclose(states.estimate.cov[k, i], P, rtol=1e-9, atol=1e-12)
            assert_allclose(states.memory.alpha[k, i], shape, rtol=1e-12)
            own = states.memory.beta[k, i] * np.diag(sensor.R)
            assert_allclose(own, scale, rtol=1e-9)


def test_it_learns_the_size_of_each_sensors_noise():
    """Sensors nine times better and 25 times worse, in variance, than their R says."""
    rng = np.random.default_rng(0)
    sensor = Linear(np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.eye(3))
    x = np.array([3.0, -4.0])
    noise = rng.normal(size=(2000, 3)) * np.sqrt([1 / 9, 25.0, 1.0])
    prior = Gaussian(np.zeros(2), 100 * np.eye(2))
    state = sweep(
        VariationalNoise(), prior, sensor.h(x) + noise, sensor, z_per_step=True, progress=False
    ).state
    ratio = state.memory.beta / state.memory.alpha
    assert_allclose(ratio, [1 / 9, 25.0, 1.0], rtol=0.15)


def test_a_certain_sensor_is_the_filter_itself():
    prior, z, sensor, dynamics = problem()
    options = {"dynamics": dynamics, "z_per_step": True}
    sure = VariationalNoise(strength=1e15, rho=1.0)
    got, wanted = (run(f, prior, z, sensor, **options) for f in (sure, FILTERS["EKF"]))
    assert_allclose(got.mean, wanted.mean, rtol=1e-10, atol=1e-12)
    assert_allclose(got.cov, wanted.cov, rtol=1e-10, atol=1e-12)


def test_what_is_missing_tells_nothing_of_its_sensor():
    prior, z, sensor, dynamics = problem()
    z[0, 1] = z[4, 0] = z[6, 2, 1] = np.nan
    filter_ = VariationalNoise(rho=0.9)
    states = run(filter_, prior, z, sensor, dynamics=dynamics, z_per_step=True, record=lambda s: s)
    ratio = states.memory.beta / states.memory.alpha
    assert np.isfinite(states.estimate.mean).all()
    assert_allclose(ratio[1, 1], 1.0)
    assert_allclose(ratio[5, 0], ratio[4, 0], rtol=1e-14)
    assert_allclose(ratio[7, 2, 1], ratio[6, 2, 1], rtol=1e-14)
    assert (ratio[7, 2, 0] != ratio[6, 2, 0]).all()
    assert states.missed[-1].tolist() == [1, 1, 0]


@engines
@pytest.mark.parametrize("moments", ["EKF", "mtSOF", "UKF"])
def test_run_and_sweep_on_both_engines(moments, engine):
    """Range and bearing, one rho for each member, and a rule inside that keeps its memory."""
    rng = np.random.default_rng(3)
    model = RangeBearing(np.diag([0.5, 1e-3]))
    prior = Gaussian(np.array([30.0, 40.0]) + rng.normal(size=(4, 2)), 4 * np.eye(2))
    dynamics = Swing(np.eye(2), 0.1 * np.eye(2))
    z = model.h(np.array([30.0, 41.0])) + rng.normal(size=(12, 4, 2)) * [1.5, 0.02]
    z[3, 1] = z[5, 2, 0] = np.nan
    inner = Filter(FILTERS[moments].moments, rule=AdaptiveRobust())
    filter_ = VariationalNoise(inner, rho=np.array([0.8, 0.9, 0.95, 1.0]), strength=2.0)
    options = {"dynamics": dynamics, "z_per_step": True}
    one = run(filter_, prior, z, model, record=lambda s: s, **options)
    many = sweep(filter_, prior, z, model, engine=engine, progress=False, **options)
    assert_allclose(many.final.mean, one.estimate.mean[-1], rtol=1e-9)
    assert_allclose(many.state.memory.beta, one.memory.beta[-1], rtol=1e-8)
    assert_array_equal(many.state.memory.rule.robust, one.memory.rule.robust[-1])
    alone = VariationalNoise(inner, rho=0.95, strength=2.0)
    third = run(alone, Gaussian(prior.mean[2], prior.cov), z[:, 2], model, **options)
    assert_allclose(one.estimate.mean[:, 2], third.mean, rtol=1e-9)


def test_an_outlier_is_taken_for_noise():
    """One measurement a hundred deviations off moves it less than the filter that is sure of R."""
    prior = Gaussian(np.zeros(1), np.eye(1))
    sensor, z = Linear([[1.0]], [[1.0]]), np.array([100.0])
    sure = FILTERS["EKF"](prior, z, sensor).mean[0]
    filter_ = VariationalNoise(strength=2.0, iterations=20)
    learnt = filter_.step(filter_.init(prior), z, sensor)
    assert learnt.estimate.mean[0] < 0.1 * sure


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: VariationalNoise(rho=0.0), ValueError, "rho must be above 0 and at most 1"),
        (lambda: VariationalNoise(rho=1.1), ValueError, "rho must be above 0 and at most 1"),
        (lambda: VariationalNoise(strength=0.0), ValueError, "strength must be positive"),
        (lambda: VariationalNoise(iterations=0), ValueError, "iterations must be an integer"),
        (lambda: VariationalNoise("EKF"), TypeError, "estimator must be a Filter; found str"),
    ],
)
def test_parameters_are_checked_when_it_is_made(make, error, message):
    with pytest.raises(error, match=message):
        make()
