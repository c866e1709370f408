"""On a linear model whatever the stages compose is the Kalman filter that they declare."""

from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import naive
import numpy as np
import pytest
from naive import covariances
from scipy.stats import chi2
from untraced import untraced

from navfilters import Filter, Gaussian, SigmaPoints, linearized, run, second_order, unscented
from navfilters.estimators import (
    cubature,
    gaussian_second_order,
    iterated,
    once,
    recalibrated,
    recursive,
    variants,
)
from navfilters.estimators.adaptive import AdaptiveNoise
from navfilters.estimators.gated_inflation import GatedInflation
from navfilters.estimators.limits import LIMITS
from navfilters.estimators.robust import AdaptiveRobust, Robust
from navfilters.estimators.strong_tracking import StrongTracking
from navfilters.estimators.update import FORMS
from navfilters.models import Linear

POINTS = SigmaPoints(0.6, 1.0, 2.0, "symmetric")
# Several runs of the three members side by side: one parameter for all, each its own, violated.
GAMMA = np.array([[7.5, 7.5, 7.5], [2.5, 4.0, 1e3], [0.4, 0.4, 0.4]])
BUMP = np.array([[[0.7, 0.7, 0.7]], [[0.0, 0.3, 2.0]]])
RULES = {
    "no rule": None,
    "robust": Robust(GAMMA),
    "adaptive robust": AdaptiveRobust(0.35, 0.7, 1.8),
    "adaptive noise": AdaptiveNoise(0.3, 1, 3, np.eye(3)),
    "strong tracking": StrongTracking(),
    "gated": GatedInflation(0.5, 3.0),
}
MOMENTS = {
    "linearised": linearized,
    "second order": second_order,
    "Gaussian second order": gaussian_second_order,
    "unscented": partial(unscented, points=POINTS),
    "cubature": cubature,
}
CORRECTIONS = {
    "once": once,
    "iterated": partial(iterated, iterations=3),
    "recursive": partial(recursive, updates=4),
    "recalibrated": recalibrated,
}
VARIANTS = {
    "unchanged": variants.unchanged,
    "bump_linear": partial(variants.bump_linear, bump=BUMP),
    "bump_predicted": partial(variants.bump_predicted, bump=0.7),
    "bump_circular": variants.bump_circular,
    "bump_equivalent": variants.bump_equivalent,
    "bump_state": variants.bump_state,
    "expect_at_mean": variants.expect_at_mean,
}


@dataclass(frozen=True)
class Retracted(Linear):
    """The same model, whose states are told apart in words."""

    def retract(self, x, dx):
        return x + dx

    def difference(self, x, y):
        return x - y

    def residual(self, z, z_hat):
        return z - z_hat


@dataclass(frozen=True)
class Walk:
    """x -> F x, in words too."""

    F: np.ndarray
    Q: np.ndarray

    def f(self, x):
        return (self.F @ x[..., None])[..., 0]

    def transition(self, x):
        return self.f(x), self.F

    def retract(self, x, dx):
        return x + dx

    def difference(self, x, y):
        return x - y


def problem(kind):
    rng = np.random.default_rng(4)
    H = rng.normal(size=(3, 3)) + 2 * np.eye(3)
    model = kind(H, covariances(rng, (), 3))
    prior = Gaussian(rng.normal(size=(3, 3)), 0.5 * covariances(rng, (3,), 3))
    walk = Walk(np.linalg.qr(rng.normal(size=(3, 3)))[0], 0.2 * covariances(rng, (), 3))
    return prior, rng.normal(size=(3, 3)), model, walk


def assert_close(got, wanted, tolerance):
    """In each run by the size of its three members."""
    for ours, theirs, axes in zip(got, wanted, ((-2, -1), (-3, -2, -1)), strict=True):
        off, size = np.abs(ours - theirs).max(axes), np.abs(theirs).max(axes)
        assert (off < tolerance * size).all()


def textbook(filter_, prior, z, model, walk=None):
    """The first step of a filter, member by member: what its parts say, in covariance form."""
    means, covs = [], []
    limit = LIMITS[getattr(filter_.variant, "func", filter_.variant)]
    given = getattr(filter_.variant, "keywords", {})
    gamma = getattr(filter_.rule, "gamma", 1.0)
    shape = np.broadcast_shapes((3,), np.shape(gamma), *map(np.shape, given.values()))
    gamma, given = (
        np.broadcast_to(gamma, shape),
        {name: np.broadcast_to(value, shape) for name, value in given.items()},
    )
    priors = np.broadcast_to(prior.mean, (*shape, 3)), np.broadcast_to(prior.cov, (*shape, 3, 3))
    for i in np.ndindex(shape):
        x, P = (part[i] for part in priors)
        if walk is not None:
            x, P = walk.F @ x, walk.F @ P @ walk.F.T + walk.Q
        H, R = model.H, model.R
        y, rule = z[i[-1]] - H @ x, filter_.rule
        if isinstance(rule, Robust):
            weight = gamma[i] ** -2.0
            if weight * np.linalg.eigvalsh(P).max() < 1:
                P = np.linalg.inv(np.linalg.inv(P) - weight * np.eye(3))
        if isinstance(rule, AdaptiveRobust):
            S = H @ P @ H.T + R
            if np.linalg.eigvalsh(S - rule.alpha * np.outer(y, y)).min() <= 0:
                P = rule.lam * P
        if isinstance(rule, GatedInflation):
            square = y @ np.linalg.inv(H @ P @ H.T + R) @ y
            P = rule.factor * P if square > chi2.ppf(rule.probability, 3) else P
        if isinstance(rule, StrongTracking):
            W = np.zeros((3, 3)) if walk is None else walk.Q
            old = P - W
            excess = np.trace(np.outer(y, y) - R - H @ W @ H.T)
            P = max(1.0, excess / np.trace(H @ old @ H.T)) * old + W
        P, R = limit(P, H, R, **{name: value[i] for name, value in given.items()})
        mean, cov = naive.kalman(x, P, z[i[-1]], H, R)
        means.append(mean)
        covs.append(cov)
    return Gaussian(np.reshape(means, (*shape, 3)), np.reshape(covs, (*shape, 3, 3)))


def test_the_grid_covers_every_variant():
    assert {getattr(v, "func", v) for v in VARIANTS.values()} == set(LIMITS)


@pytest.mark.parametrize("moments", MOMENTS)
@pytest.mark.parametrize(("rule", "variant"), list(product(RULES, VARIANTS)))
@untraced()
def test_on_a_linear_model_every_combination_is_its_kalman_filter(rule, variant, moments):
    """Without dynamics against ``linear_limit`` too; with dynamics against the textbook's step."""
    prior, z, model, walk = problem(Retracted)
    filter_ = Filter(MOMENTS[moments], VARIANTS[variant], RULES[rule])
    for dynamics in (None, walk):
        wanted = textbook(filter_, prior, z, model, dynamics)
        for form, correction in product(FORMS, CORRECTIONS.values()):
            filter_ = replace(filter_, form=form, correction=correction)
            kinds = (Linear, Retracted) if correction is once else (Retracted,)
            for kind in kinds:
                sensor = kind(model.H, model.R)
                got = filter_.step(filter_.init(prior), z, sensor, dynamics).estimate
                assert_close(got, wanted, 1e-11)
    if rule not in ("adaptive robust", "strong tracking", "gated"):  # their first steps depend on z
        limit = filter_.linear_limit(prior, z, model)
        assert_close(limit, textbook(filter_, prior, z, model), 1e-11)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("moments", MOMENTS)
@untraced()
def test_twenty_steps_are_the_textbooks(moments, variant):
    """A Kalman filter of the declared P and R, again and again; no rule, and one that is idle."""
    prior, _, model, walk = problem(Retracted)
    z = np.random.default_rng(5).normal(size=(20, 3, 3))
    idle = {"once": (None, AdaptiveRobust(0.0, 0.5), Robust(np.inf))}
    grid = [(c, rule) for c in CORRECTIONS for rule in idle.get(c, (None,))]
    for correction, rule in grid:
        filter_ = Filter(
            MOMENTS[moments], VARIANTS[variant], rule, correction=CORRECTIONS[correction]
        )
        got = run(filter_, prior, z, model, dynamics=walk, z_per_step=True)
        wanted = prior
        for k in range(20):
            plain = replace(filter_, rule=None)
            wanted = textbook(plain, wanted, z[k], model, walk)
            assert_close((got.mean[k + 1], got.cov[k + 1]), wanted, 1e-10)


class HAlone:
    """h(x) = H x and R, whose h does not take complex numbers."""

    def __init__(self, H, R):
        self.H, self.R = H, R

    def h(self, x):
        if np.iscomplexobj(x):
            raise TypeError("real numbers only")
        return (self.H @ x[..., None])[..., 0]


NEEDS_H = ["bump_linear", "bump_circular", "bump_equivalent", "bump_state"]


@pytest.mark.parametrize("variant", NEEDS_H)
def test_a_variant_that_needs_a_jacobian_says_so(variant):
    """Sigma points have none: before the run, and where the filter is called."""
    prior, z, model, _ = problem(Linear)
    alone = HAlone(model.H, model.R)
    filter_ = Filter(unscented, VARIANTS[variant])
    for go in (lambda: filter_(prior, z, alone), lambda: run(filter_, prior, z, alone, 1)):
        with pytest.raises(TypeError, match=r"model.h must accept complex numbers.*Give its Jac"):
            go()
    got = Filter(unscented, VARIANTS["bump_predicted"])(prior, z, alone)
    assert np.isfinite(got.mean).all()


@pytest.mark.parametrize("moments", MOMENTS)
@pytest.mark.parametrize(("m", "n"), [(1, 2), (2, 3), (3, 2)])
def test_a_measurement_without_an_inverse_cannot_be_bumped_by_it(moments, m, n):
    model = Linear(np.ones((m, n)), np.eye(m))
    prior, filter_ = (
        Gaussian(np.zeros(n), np.eye(n)),
        Filter(MOMENTS[moments], variants.bump_equivalent),
    )
    message = f"as many components as the state has; found {m} measurements of {n} states"
    for go in (
        lambda: filter_(prior, np.zeros(m), model),
        lambda: run(filter_, prior, np.zeros(m), model, 1),
    ):
        with pytest.raises(ValueError, match=message):
            go()


@pytest.mark.parametrize(
    "rule", [Robust(9.0), AdaptiveRobust(), AdaptiveNoise(directions=np.eye(3))]
)
def test_a_filter_with_a_rule_is_not_called(rule):
    prior, z, model, _ = problem(Linear)
    with pytest.raises(TypeError, match=f"has a memory: use run.*found {type(rule).__name__}"):
        Filter(rule=rule)(prior, z, model)
