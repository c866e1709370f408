"""NaN in z means "not measured", by component and by member; and what a state says."""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import multivariate_normal

from navfilters import FILTERS, Filter, Gaussian, linearized, run, sweep
from navfilters.estimators.adaptive import AdaptiveNoise
from navfilters.estimators.gated_inflation import GatedInflation
from navfilters.estimators.interacting import InteractingModels, Modes
from navfilters.estimators.robust import AdaptiveRobust, Robust
from navfilters.estimators.strong_tracking import StrongTracking
from navfilters.estimators.update import FORMS
from navfilters.estimators.variational_noise import VariationalNoise
from navfilters.models import Linear, RangeBearing
from navfilters.runs import records

engines = pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])
MODEL = RangeBearing(np.array([[0.5, 0.02], [0.02, 0.01]]))
COMPONENTWISE = [name for name in FILTERS if name not in {"B-EKF 2", "B-EKF 3"}]
RULES = {
    "none": None,
    "robust": Robust(9.0),
    "adaptive robust": AdaptiveRobust(0.5),
    "adaptive": AdaptiveNoise(0.2, 1, 3, np.eye(2)),
    "strong tracking": StrongTracking(),
    "gated": GatedInflation(0.5),
}


@dataclass(frozen=True)
class Drift:
    Q: np.ndarray

    def transition(self, x):
        xp = x.__array_namespace__()
        return 1.01 * x, 1.01 * xp.eye(2)


def problem(count=4):
    rng = np.random.default_rng(2)
    x = rng.uniform(20, 50, (count, 2))
    prior = Gaussian(x, covariances(rng, (count,), 2))
    return prior, MODEL.h(x + rng.normal(size=(count, 2)))


def estimate_and_memory(state):
    return state.estimate, state.memory


class Part:
    """One component of range and bearing."""

    def __init__(self, i):
        self.i, self.R = slice(i, i + 1), MODEL.R[i : i + 1, i : i + 1]

    def h(self, x):
        return MODEL.h(x)[..., self.i]

    def residual(self, z, z_hat):
        whole = np.zeros((*np.broadcast_shapes(z.shape, z_hat.shape)[:-1], 2))
        whole[..., self.i] = z - z_hat
        return MODEL.residual(whole, 0.0)[..., self.i]

    def jacobian(self, x):
        return MODEL.jacobian(x)[..., self.i, :]

    def hessian(self, x):
        return MODEL.hessian(x)[..., self.i, :, :]


@pytest.mark.parametrize("name", COMPONENTWISE)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("i", [0, 1])
def test_what_is_not_measured_is_not_in_the_model(name, form, i):
    """As a model of the other components alone. The circular bumps weigh all sensors together."""
    filter_ = Filter(FILTERS[name].moments, FILTERS[name].variant, form=form)
    prior, z = problem()
    some = z.copy()
    some[:, 1 - i] = np.nan
    got = filter_.update(filter_.init(prior), some, MODEL)
    alone = filter_.update(filter_.init(prior), z[:, i : i + 1], Part(i))
    assert_allclose(got.estimate.mean, alone.estimate.mean, rtol=1e-12)
    assert_allclose(got.estimate.cov, alone.estimate.cov, rtol=1e-9, atol=1e-12)
    assert got.missed.tolist() == [0] * 4  # something was measured
    assert_array_equal(got.innovation[:, i], alone.innovation[:, 0])
    assert np.isnan(got.innovation[:, 1 - i]).all()
    assert_allclose(got.log_likelihood, alone.log_likelihood, rtol=1e-12)
    called = filter_(prior, some, MODEL)
    assert_array_equal(called.mean, got.estimate.mean)
    assert_array_equal(called.cov, got.estimate.cov)


@engines
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("name", FILTERS)
def test_nothing_measured_keeps_the_state_bit_for_bit(name, rule, engine):
    """Members that measured go on as if they were alone; the rule of the others does not act."""
    if engine == "jax" and name not in {"EKF", "UKF", "B-EKF 4"}:
        pytest.skip("the same code")
    filter_ = Filter(FILTERS[name].moments, FILTERS[name].variant, RULES[rule])
    prior, z = problem()
    z = np.stack([z] * 6)
    z[2:, 1] = np.nan
    go = partial(sweep, filter_, prior, z_per_step=True, progress=False, engine=engine)
    got = go(z, MODEL, record=estimate_and_memory)
    full = go(np.nan_to_num(z, nan=1.0), MODEL, record=records.estimate)
    assert got.state.missed.tolist() == [0, 4, 0, 0]
    estimate, memory = got.record
    idle = [part for part in memory or () if part is not None]
    if name != "B-EKF 4":  # its P is another before it is updated
        idle += estimate
    for series in idle:
        assert_array_equal(series[2:, 1], series[[2] * 5, 1])
    # Compiled, z without a NaN is another program.
    same = partial(assert_allclose, rtol=1e-12 if engine == "jax" else 0, atol=0)
    others = [0, 2, 3]
    same(estimate.mean[:, others], full.record.mean[:, others])
    same(estimate.cov[:, others], full.record.cov[:, others])
    assert got.state.log_likelihood[1] == 0
    assert (got.state.log_likelihood[others] != 0).all()


@engines
@pytest.mark.parametrize("rule", ["none", "adaptive robust"])
def test_with_dynamics_it_is_a_prediction_alone(rule, engine):
    filter_, drift = Filter(rule=RULES[rule]), Drift(0.1 * np.eye(2))
    prior, z = problem()
    z = np.full((3, *z.shape), np.nan)
    got = sweep(
        filter_, prior, z, MODEL, dynamics=drift, z_per_step=True, progress=False, engine=engine
    )
    wanted = filter_.init(prior)
    for k in range(3):
        wanted = filter_.predict(wanted, drift, k)
    assert_allclose(got.final.mean, wanted.estimate.mean, rtol=1e-15)
    assert_allclose(got.final.cov, wanted.estimate.cov, rtol=1e-14)
    assert got.state.missed.tolist() == [3] * 4
    assert np.isnan(got.state.innovation).all()


def test_a_plain_function_keeps_its_state_where_anything_is_missing():
    def function(prior, z, model):
        return FILTERS["EKF"](prior, z, model)

    prior, z = problem()
    z[1, 0] = np.nan
    got = run(function, prior, z, MODEL, 2)
    assert_array_equal(got.mean[:, 1], prior.mean[[1] * 3])
    assert_array_equal(got.mean[:, 2], run(FILTERS["EKF"], prior, z, MODEL, 2).mean[:, 2])


# --- what a state says --------------------------------------------------------------------------


@pytest.mark.parametrize("m", [1, 2, 4])
def test_the_log_likelihood_is_scipys(m):
    rng = np.random.default_rng(m)
    model = Linear(rng.normal(size=(m, 3)), covariances(rng, (), m))
    prior, z = Gaussian(rng.normal(size=(5, 3)), covariances(rng, (5,), 3)), rng.normal(size=(5, m))
    state = Filter().update(Filter().init(prior), z, model)
    S = linearized(prior, model).P_zz
    wanted = [
        multivariate_normal.logpdf(y, np.zeros(m), C)
        for y, C in zip(z - model.h(prior.mean), S, strict=True)
    ]
    assert_allclose(state.log_likelihood, wanted, rtol=1e-12)
    assert state.healthy.all()


def test_healthy_is_finite_and_definite():
    prior = Gaussian(np.ones((4, 2)), np.stack([np.eye(2)] * 4))
    prior.mean[1, 0], prior.cov[2, 1, 1], prior.cov[3, 0, 0] = np.inf, -1.0, np.nan
    with np.errstate(all="ignore"):
        assert Filter().init(prior).healthy.tolist() == [True, False, False, False]


def test_a_failed_member_has_no_log_likelihood():
    """NaN, and not 0, which is that of a member that measured nothing."""
    prior, z = problem()
    prior.mean[2] = 0.0
    with np.errstate(all="ignore"):
        state = Filter().update(Filter().init(prior), z, MODEL)
        assert np.isnan(state.log_likelihood).tolist() == [False, False, True, False]
    assert state.missed.tolist() == [0] * 4


ESTIMATORS = {name: Filter(rule=rule) for name, rule in RULES.items()} | {
    "a function": lambda prior, z, model: FILTERS["EKF"](prior, z, model),
    "UKF": FILTERS["UKF"],
    "learnt noise": VariationalNoise(),
    "models": InteractingModels(),
}


@pytest.mark.parametrize("lead", [(), (3, 1), (3, 5), (5, 5)])
@pytest.mark.parametrize("name", ESTIMATORS)
def test_members_of_a_grid_miss_their_own_measurements(name, lead):
    """A z of five members for a grid of five by five: rows were kept where columns were meant."""
    rng = np.random.default_rng(2)
    prior, model = Gaussian(rng.normal(size=(*lead, 2)), np.eye(2)), Linear(np.eye(2), np.eye(2))
    z = 3 * rng.normal(size=(6, 5, 2))
    z[rng.random(z.shape) < 0.4] = np.nan
    motion = Drift(0.1 * np.eye(2))
    motion = Modes((motion, motion)) if name == "models" else motion
    options = {"dynamics": motion, "z_per_step": True}
    found = run(ESTIMATORS[name], prior, z, model, **options)
    means = np.broadcast_to(prior.mean, (*np.broadcast_shapes(lead, (5,)), 2))
    for index in np.ndindex(means.shape[:-1]):
        alone = Gaussian(means[index], prior.cov)
        wanted = run(ESTIMATORS[name], alone, z[:, index[-1]], model, **options)
        for ours, theirs in zip(found, wanted, strict=True):
            assert_allclose(ours[:, *index], theirs, rtol=1e-9, atol=1e-12)
