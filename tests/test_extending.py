"""What a reader brings in ten lines each, a filter, a rule, a model, goes wherever ours go."""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Filter, Gaussian, kalman_update, linearized, run, sweep
from navfilters.estimators.rule import Rule
from navfilters.papers.perea2007.divergence_maps import indicator, over_noises, over_starts, starts
from navfilters.runs.consistency import nees

engines = pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])


def cautious(prior, z, model):
    """A filter: the EKF, whose covariance never falls below a thousandth of its prior's."""
    mean, cov = kalman_update(prior, z, linearized(prior, model), model=model)
    return Gaussian(mean, cov + 1e-3 * prior.cov)


@dataclass(frozen=True)
class Fading(Rule):
    """A rule: the past counts less, by a factor of each member."""

    factor: object = 1.05

    def enlarge(self, memory, prior, y, moments):
        scale = prior.cov.__array_namespace__().asarray(self.factor)[..., None, None]
        return Gaussian(prior.mean, scale * prior.cov), memory

    def limit(self, P):
        return np.asarray(self.factor)[..., None, None] * P


class Ranges(NamedTuple):
    """A model: the squared distances to three beacons; h and R, no derivative."""

    R: np.ndarray
    beacons: tuple = ((0.0, 0.0), (100.0, 0.0), (0.0, 100.0))

    def h(self, x):
        xp = x.__array_namespace__()
        return xp.stack([((x - xp.asarray(b)) ** 2).sum(-1) for b in self.beacons], -1)


class Circling:
    """A motion: f and Q, no derivative; it turns and is braked by its distance."""

    Q = 0.1 * np.eye(2)

    def f(self, x):
        xp = x.__array_namespace__()
        slow = 0.1 * xp.exp(-(x**2).sum(-1, keepdims=True) / 5000)
        return x + slow * xp.stack([-x[..., 1], x[..., 0]], -1)


MODEL = Ranges(25.0 * np.eye(3))
NEW = {
    "a function": cautious,
    "a rule": Filter(rule=Fading(1.02)),
    "a rule on sigma points": Filter(FILTERS["UKF"].moments, rule=Fading(1.02)),
    "a rule, each its own": Filter(rule=Fading(np.linspace(1.0, 1.1, 200))),
}


def runs(count=200, steps=12):
    rng = np.random.default_rng(0)
    truth = np.array([30.0, 40.0])
    prior = Gaussian(truth + rng.normal(size=(count, 2)), np.eye(2))
    return truth, prior, MODEL.h(truth) + 5 * rng.normal(size=(steps, count, 3))


@engines
@pytest.mark.parametrize("name", NEW)
def test_run_sweep_and_consistency(name, engine):
    truth, prior, z = runs()
    wanted = run(NEW[name], prior, z, MODEL, z_per_step=True)
    got = sweep(
        NEW[name], prior, z, MODEL, z_per_step=True, progress=False, engine=engine, chunk=64
    )
    assert_allclose(got.final.mean, wanted.mean[-1], rtol=1e-10)
    assert_allclose(got.final.cov, wanted.cov[-1], rtol=1e-8)
    each = nees(truth - got.final.mean, got.final.cov)
    assert each.shape == (200,)
    assert 0.5 < each.mean() < 2.5  # they believe a little less than they know


@engines
@pytest.mark.parametrize("name", ["EKF", "mtSOF", "UKF"])
def test_a_motion_without_derivatives(name, engine):
    """With the reader's sensor; the Jacobian of f is central differences'."""
    _, prior, z = runs(20)
    wanted = run(FILTERS[name], prior, z, MODEL, dynamics=Circling(), z_per_step=True)
    got = sweep(
        FILTERS[name], prior, z, MODEL, dynamics=Circling(), z_per_step=True, progress=False,
        engine=engine,
    )  # fmt: skip
    assert_allclose(got.final.mean, wanted.mean[-1], rtol=1e-10)
    x, P = prior.mean[0], prior.cov
    ekf = FILTERS["EKF"]
    f, h = Circling().f, 1e-5
    F = np.stack([(f(x + h * e) - f(x - h * e)) / (2 * h) for e in np.eye(2)], -1)
    predicted = ekf.predict(ekf.init(Gaussian(x, P)), Circling()).estimate
    assert_allclose(predicted.mean, f(x))
    assert_allclose(predicted.cov, F @ P @ F.T + Circling.Q, atol=1e-8)  # of differences


def test_a_rule_declares_its_linear_limit():
    _, prior, z = runs(200, 1)
    rule = NEW["a rule, each its own"]
    doubled = Gaussian(prior.mean, rule.rule.limit(np.eye(2)))
    got = rule.update(rule.init(prior), z[0], MODEL).estimate
    assert_array_equal(got.mean, FILTERS["EKF"](doubled, z[0], MODEL).mean)


@engines
@pytest.mark.parametrize(
    "new", [cautious, Filter(rule=Fading(1.02)), partial(FILTERS["B-UKF"], bump=0.5)],
    ids=["a function", "a rule", "a partial"],
)  # fmt: skip
def test_a_divergence_map(new, engine):
    """Any filter; a name is short for one of the paper's."""
    I = over_starts(new, 6, steps=30, engine=engine)
    assert I.shape == (6, 6)
    alone = indicator(new, starts(6)[2, 3], steps=30, engine=engine)
    assert_allclose(alone, I[2, 3], rtol=1e-6)
    assert over_noises(new, 4, steps=5, engine=engine).shape == (4, 4)
