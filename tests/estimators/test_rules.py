"""What every filter with a rule promises: batches, missing measurements, sub-steps, engines."""

import jax
import numpy as np
import pytest
from moving import Swing
from naive import kalman
from numpy.testing import assert_allclose, assert_array_equal
from ruled import (
    RULES,
    SIZES,
    Problem,
    SubStepped,
    assert_printed,
    go,
    linear_problem,
    printed_prediction,
    printed_update,
    problem,
    ruled,
)

from navfilters import FILTERS, Filter, Gaussian, run, sweep
from navfilters.estimators.adaptive import AdaptiveNoise
from navfilters.estimators.robust import AdaptiveRobust, Robust

every_rule = pytest.mark.parametrize("name", RULES)
forms = pytest.mark.parametrize("form", ["joseph", "short"])


@forms
@pytest.mark.parametrize(("n", "m"), SIZES)
def test_without_a_rule_it_is_the_printed_ekf(n, m, form):
    def printed(estimates, z, p):
        for (x, P), measured in zip(estimates, z, strict=True):
            yield printed_update(*printed_prediction(x, P, p.dynamics), measured, p.sensor)

    p = problem(n, m)
    assert_printed(printed, go(Filter(form=form), p), p)


@pytest.mark.parametrize(
    ("rule", "enlarged"),
    [
        (None, lambda P: P),
        (Robust(9.0), lambda P: np.linalg.inv(np.linalg.inv(P) - np.eye(4) / 81)),
        (Robust(np.inf), lambda P: P),
        (AdaptiveRobust(alpha=1e9, lam=2.5), lambda P: 2.5 * P),
        (AdaptiveRobust(alpha=1e9, lam=0.5), lambda P: P),
        (AdaptiveRobust(alpha=1e9, lam=lambda P_y_bar, P_y: 4.0), lambda P: 4 * P),
        (AdaptiveRobust(alpha=0.0), lambda P: P),
        (AdaptiveNoise(directions=np.ones((4, 3))), lambda P: P),
    ],
)
def test_linear_limit(rule, enlarged):
    """Each is the textbook's Kalman filter with a stated P."""
    p = linear_problem()
    got = ruled(rule, p, 1)[-1].estimate
    for i in range(4):
        x, P = printed_prediction(p.prior.mean[i], p.prior.cov[i], p.dynamics)
        mean, cov = kalman(x, enlarged(P), p.z[0, i], p.sensor.H, p.sensor.R)
        assert_allclose(got.mean[i], mean, rtol=1e-10)
        assert_allclose(got.cov[i], cov, rtol=1e-10, atol=1e-14)


@every_rule
def test_a_missing_measurement_is_its_member_s_alone(name):
    """There the rule does not act and its memory stays; a part that was measured is used."""
    p = problem()
    z = p.z.copy()
    z[5, 2, 0] = z[5, 3] = np.nan
    states, clean = (ruled(RULES[name](p), p, z=measured) for measured in (z, p.z))
    others = [0, 1]
    assert_array_equal(states[-1].estimate.mean[others], clean[-1].estimate.mean[others])
    assert np.isfinite(states[-1].estimate.mean).all()
    assert states[-1].missed.tolist() == [0, 0, 0, 1]
    assert np.isnan(states[6].innovation[2:]).tolist() == [[True, False], [True, True]]
    alone = Filter(rule=RULES[name](p)).predict(states[5], p.dynamics)
    before, after = alone.memory or (), states[6].memory or ()
    for a, b, whole in zip(before, after, clean[6].memory or (), strict=True):
        assert_array_equal(b[2:], a[2:])
        assert_array_equal(b[others], whole[others])
    assert_array_equal(states[6].estimate.mean[3], alone.estimate.mean[3])
    assert_array_equal(states[6].estimate.cov[3], alone.estimate.cov[3])


@every_rule
def test_a_measurement_that_is_no_number_in_the_model_stays_with_its_member(name):
    """An h that is NaN for one member leaves the others as they are."""
    p = problem()
    prior = Gaussian(np.where(np.arange(4)[:, None] == 2, np.nan, p.prior.mean), p.prior.cov)
    got, clean = (ruled(RULES[name](p), p, prior=x)[-1] for x in (prior, p.prior))
    others = [0, 1, 3]
    assert_array_equal(got.estimate.mean[others], clean.estimate.mean[others])
    assert np.isnan(got.estimate.mean[2]).all()
    for a, b in zip(got.memory or (), clean.memory or (), strict=True):
        assert_array_equal(a[others], b[others])


@every_rule
def test_a_covariance_that_is_nan_stays_with_its_member(name):
    p = problem()
    prior = Gaussian(p.prior.mean, np.where(np.arange(4)[:, None, None] == 1, np.nan, p.prior.cov))
    last = ruled(RULES[name](p), p, prior=prior)[-1]
    assert np.isnan(last.estimate.mean).any(axis=-1).tolist() == [False, True, False, False]
    if name == "REKF":
        assert last.memory.violations[1] == 0
    if name == "AREKF":
        assert (last.memory.robust[1], last.memory.clipped[1]) == (0, 0)


@pytest.mark.parametrize(
    ("name", "option", "values"),
    [
        ("REKF", "gamma", [2.0, 3.0, 8.0, np.inf]),
        ("AEKF", "a", [0.0, 0.2, 0.4, 0.5]),
        ("AREKF", "alpha", [0.0, 0.1, 0.5, 1.0]),
        ("AREKF", "rho", [0.0, 0.5, 0.98, 5.0]),
        ("AREKF", "lam", [1.0, 2.0, 5.0, 9.0]),
        ("strong tracking", "rho", [0.0, 0.5, 0.9, 1.0]),
        ("strong tracking", "beta", [1.0, 2.0, 5.0, 9.0]),
        ("gated", "factor", [1.0, 2.0, 5.0, 9.0]),
        ("gated", "largest", [1.0, 2.0, 5.0, 9.0]),
    ],
)
def test_each_member_may_have_its_own_parameter(name, option, values):
    """One prior for all: the batch axes come from the parameter and the measurement."""
    p = problem()
    prior = Gaussian(p.prior.mean[0], p.prior.cov[0])
    kind = type(RULES[name](p))
    others = {"N": 8, "directions": p.directions} if name == "AEKF" else {}
    last = ruled(kind(**{option: np.array(values)}, **others), p, prior=prior)[-1]
    for i, value in enumerate(values):
        rule = kind(**{option: value}, **others)
        alone = ruled(rule, p, prior=prior, z=p.z[:, i])[-1]
        assert_allclose(last.estimate.mean[i], alone.estimate.mean, rtol=1e-10)
        for counter, single in zip(last.memory[1:], alone.memory[1:], strict=True):
            assert_allclose(counter[i], single, rtol=1e-10)


@every_rule
def test_noise_may_be_added_at_sub_steps(name):
    p = problem(dynamics=SubStepped)
    whole = Problem(p.prior, p.z, Swing(p.dynamics.G, 3 * p.dynamics.Q), p.sensor, p.directions)
    got, wanted = (ruled(RULES[name](q), q)[-1].estimate for q in (p, whole))
    assert_allclose(got.mean, wanted.mean, rtol=1e-9)


@every_rule
def test_the_same_source_compiles_under_jax(name):
    p = problem(steps=20)
    estimator = Filter(rule=RULES[name](p))
    dynamics = Swing(jax.numpy.asarray(p.dynamics.G), jax.numpy.asarray(p.dynamics.Q))
    step = jax.jit(lambda state, z: estimator.step(state, z, p.sensor, dynamics))
    state = estimator.init(Gaussian(*map(jax.numpy.asarray, p.prior)))
    for z in p.z:
        state = step(state, jax.numpy.asarray(z))
    wanted = go(estimator, p)[-1]
    assert_allclose(state.estimate.mean, wanted.estimate.mean, rtol=1e-9)
    for a, b in zip(state.memory or (), wanted.memory or (), strict=True):
        assert_allclose(a, b, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])
@pytest.mark.parametrize("moments", ["EKF", "mtSOF", "UKF"])
@every_rule
def test_run_and_sweep_take_any_moments_with_any_rule(name, moments, engine):
    """Equal to each other, on both engines, with measurements missing."""
    p = problem(steps=20, noise=2.0)
    z = p.z.copy()
    z[7, 1] = z[12:15, 2, 0] = np.nan
    estimator = Filter(FILTERS[moments].moments, rule=RULES[name](p))
    options = {"dynamics": p.dynamics, "z_per_step": True}
    one = run(estimator, p.prior, z, p.sensor, record=lambda state: state, **options)
    many = sweep(estimator, p.prior, z, p.sensor, engine=engine, progress=False, **options)
    for got, wanted in zip(many.final, one.estimate, strict=True):
        assert_allclose(got, wanted[-1], rtol=0, atol=1e-9 * np.abs(wanted[-1]).max())
    for got, wanted in zip(many.state.memory or (), one.memory or (), strict=True):
        assert_allclose(got, wanted[-1], rtol=1e-8, atol=1e-10)
    assert many.state.missed.tolist() == [0, 1, 0, 0]
