"""Corrections in every situation: units, missing components, engines, singular covariances."""

from dataclasses import replace
from itertools import product

import jax
import numpy as np
import pytest
from naive import Quadratic, covariances, quadratic
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Filter, Gaussian, linearized, run, sweep
from navfilters.estimators import (
    LATER_FILTERS,
    cubature,
    gaussian_second_order,
    iterated,
    once,
    recalibrated,
    recursive,
)
from navfilters.estimators.update import FORMS
from navfilters.models import RangeBearing

CORRECTIONS = {
    "iterated": iterated,
    "recursive": recursive,
    "recalibrated": recalibrated,
}
MOMENTS = {
    "linearised": linearized,
    "Gaussian second order": gaussian_second_order,
    "cubature": cubature,
}
engines = pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])


def bent(n=3, m=3, count=5, curved=0.1, seed=0):
    """A problem whose quadratic terms are felt, but do not rule."""
    rng = np.random.default_rng(seed)
    model = quadratic(rng, m, n)
    model = replace(model, A=curved * model.A)
    prior = Gaussian(rng.normal(size=(count, n)), 0.3 * covariances(rng, (count,), n))
    return prior, model.h(prior.mean) + 0.5 * rng.normal(size=(count, m)), model


def close(got, wanted, tolerance=1e-10):
    for ours, theirs in zip(got, wanted, strict=True):
        assert np.abs(ours - theirs).max() < tolerance * np.abs(theirs).max()


def scaled(prior, z, model):
    """The same problem in other units of each state and of each measurement."""
    D, E = 2.0 ** np.array([7, -4, 1]), 2.0 ** np.array([-6, 3, 9])
    H = E[:, None] * model.H / D
    A = E[:, None, None] * model.A / D[:, None] / D
    other = Quadratic(H, A, E[:, None] * model.R * E)
    return Gaussian(prior.mean * D, D[:, None] * prior.cov * D), z * E, other, D


@pytest.mark.parametrize("correction", CORRECTIONS)
@pytest.mark.parametrize("form", ["joseph", "short", "sqrt"])
@pytest.mark.parametrize("moments", MOMENTS)
def test_units_do_not_matter(moments, form, correction):
    """But for the judge of a recalibration, whose updates here are all kept."""
    prior, z, model = bent()
    filter_ = Filter(MOMENTS[moments], form=form, correction=CORRECTIONS[correction])
    wanted = filter_(prior, z, model)
    *other, D = scaled(prior, z, model)
    got = filter_(*other)
    close((got.mean / D, got.cov / D[:, None] / D), wanted, 1e-9)


def test_the_judge_of_a_recalibration_sees_the_units():
    """The trace of metres and radians is that of the metres: another unit, another verdict."""
    prior, z, model = bent(count=40, curved=0.8)
    z = z + 3 * np.random.default_rng(3).normal(size=z.shape)
    *other, _ = scaled(prior, z, model)
    here, there = (LATER_FILTERS["RC-EKF"](*problem) for problem in ((prior, z, model), other))
    assert ((here.mean == prior.mean) != (there.mean == other[0].mean)).any()


MODEL = RangeBearing(np.array([[0.5, 0.02], [0.02, 0.01]]))


class Range:
    """The first component of range and bearing."""

    R = MODEL.R[:1, :1]

    def h(self, x):
        return MODEL.h(x)[..., :1]

    def jacobian(self, x):
        return MODEL.jacobian(x)[..., :1, :]

    def hessian(self, x):
        return MODEL.hessian(x)[..., :1, :, :]


def polar(count=4):
    rng = np.random.default_rng(2)
    x = rng.uniform(20, 50, (count, 2))
    return Gaussian(x, covariances(rng, (count,), 2)), MODEL.h(x + rng.normal(size=(count, 2)))


@pytest.mark.parametrize("form", ["joseph", "short", "sqrt"])
@pytest.mark.parametrize("correction", CORRECTIONS)
@pytest.mark.parametrize("moments", MOMENTS)
def test_what_is_not_measured_is_not_in_the_model(moments, correction, form):
    prior, z = polar()
    filter_ = Filter(MOMENTS[moments], form=form, correction=CORRECTIONS[correction])
    z[:, 1] = np.nan
    got, alone = filter_(prior, z, MODEL), filter_(prior, z[:, :1], Range())
    close(got, alone, 1e-10)
    z[1] = np.nan
    got = filter_(prior, z, MODEL)
    assert_array_equal(got.mean[1], prior.mean[1])
    assert_array_equal(got.cov[1], prior.cov[1])
    close((got.mean[2:], got.cov[2:]), (alone.mean[2:], alone.cov[2:]), 1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("correction", ["once", *CORRECTIONS])
def test_compiled_is_the_same_for_all_moments_and_forms(correction):
    prior, z, model = bent()
    filters = [
        Filter(moments, form=form, correction=CORRECTIONS.get(correction, once))
        for moments, form in product(MOMENTS.values(), FORMS)
    ]
    compiled = jax.jit(lambda prior, z: [f(prior, z, model) for f in filters])
    for got, filter_ in zip(compiled(prior, z), filters, strict=True):
        close(got, filter_(prior, z, model), 1e-10)


@engines
@pytest.mark.parametrize("name", LATER_FILTERS)
def test_engines_members_and_bearings_that_jump(name, engine):
    """A target behind the sensor, seen across the jump; one member is NaN, and stays alone."""
    truth = 80 * np.array([np.cos(3.13), -np.sin(3.13)])
    rng = np.random.default_rng(5)
    cov = 9 * covariances(rng, (6,), 2)
    prior = Gaussian(truth + rng.normal(size=(6, 2)), cov)
    bad = prior._replace(cov=np.where(np.arange(6)[:, None, None] == 2, np.nan, cov))
    model = RangeBearing(np.diag([0.01, 1e-4]))
    z = model.h(truth) + 0.01 * rng.normal(size=(3, 6, 2))
    filter_ = LATER_FILTERS[name]
    wanted = run(filter_, prior, z, model, z_per_step=True)
    got = sweep(filter_, prior, z, model, z_per_step=True, engine=engine, progress=False).final
    close(got, (wanted.mean[-1], wanted.cov[-1]), 1e-9)
    assert np.linalg.norm(got.mean - truth, axis=-1).max() < 2.0
    others = [0, 1, 3, 4, 5]
    state = filter_.init(bad)
    for now in z:
        state = filter_.step(state, now, model)
    close(
        (state.estimate.mean[others], state.estimate.cov[others]),
        (got.mean[others], got.cov[others]),
        1e-9,
    )
    assert np.isnan(state.estimate.cov[2]).all()


@pytest.mark.parametrize("correction", CORRECTIONS)
@pytest.mark.parametrize("moments", MOMENTS)
def test_what_is_known_exactly_stays_known(moments, correction):
    """The second state is twice the first minus one: a singular P, kept through ten updates."""
    *_, model = bent(n=3, m=2, count=1)
    T = np.array([[1.0, 0.0], [2.0, 0.0], [0.0, 1.0]])
    P = T @ covariances(np.random.default_rng(7), (), 2) @ T.T
    x = np.array([0.5, 0.0, 0.3])
    filter_ = Filter(MOMENTS[moments], correction=CORRECTIONS[correction])
    got = run(filter_, Gaussian(x, 0.1 * P), model.h(x + 0.05), model, 10)
    assert np.isfinite(got.mean).all()
    assert_allclose(got.mean[:, 1], 2 * got.mean[:, 0] - 1, atol=1e-9)
    free = np.array([2.0, -1.0, 0.0])
    assert_allclose(np.einsum("i,kij,j->k", free, got.cov, free), 0.0, atol=1e-12)


@pytest.mark.parametrize(("name", "option"), [("IEKF", "iterations"), ("RUF", "updates")])
def test_a_count_is_a_count(name, option):
    prior, z, model = bent()
    assert LATER_FILTERS[name].options == (option,)
    for wrong in (0, 1.5, np.array([1, 2])):
        with pytest.raises((ValueError, TypeError), match=option):
            LATER_FILTERS[name](prior, z, model, **{option: wrong})
    with pytest.raises(TypeError, match=rf"unknown options \['{option}'\]"):
        FILTERS["EKF"](prior, z, model, **{option: 3})
