"""Lear's underweighting: the bump-up of the first updates, by the number of the update."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from naive import covariances, kalman
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Filter, Gaussian, run, sweep
from navfilters.estimators.moments import linearized
from navfilters.estimators.variants import Underweighting, bump_linear, unchanged
from navfilters.models import Linear


def problem(steps=5, count=3):
    rng = np.random.default_rng(0)
    model = Linear(rng.normal(size=(2, 4)), covariances(rng, (), 2))
    prior = Gaussian(rng.normal(size=(count, 4)), covariances(rng, (count,), 4))
    return prior, rng.normal(size=(steps, count, 2)), model


def test_the_first_updates_are_the_kalman_filters_with_more_noise():
    prior, z, model = problem()
    got = run(Filter(variant=Underweighting(0.5, 2)), prior, z, model, z_per_step=True)
    for i in range(3):
        x, P = prior.mean[i], prior.cov[i]
        for k in range(5):
            more = (0.5 if k < 2 else 0.0) * model.H @ P @ model.H.T
            x, P = kalman(x, P, z[k, i], model.H, model.R + more)
            assert_allclose(got.mean[k + 1, i], x, rtol=1e-10, atol=1e-12)
            assert_allclose(got.cov[k + 1, i], P, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("bump", [0.2, np.array([0.0, 0.2, 3.0])], ids=["all", "each"])
def test_it_is_the_bumped_filter_and_then_the_ekf(bump):
    """To the bit, and a call without a number is the first update."""
    prior, z, model = problem()
    held = Filter(variant=Underweighting(bump, 2))
    bumped, ekf = FILTERS["B-EKF 1"].having(bump=bump), FILTERS["EKF"]
    options = {"z_per_step": True}
    got, always, never = (run(f, prior, z, model, **options) for f in (held, bumped, ekf))
    for ours, theirs in zip(got, always, strict=True):
        assert_array_equal(ours[:3], theirs[:3])
        assert (ours[3] != theirs[3]).any()
    none = run(Filter(variant=Underweighting(bump, 0)), prior, z, model, **options)
    assert_array_equal(none.cov, never.cov)
    for ours, theirs in zip(held(prior, z[0], model), bumped(prior, z[0], model), strict=True):
        assert_array_equal(ours, theirs)


def test_the_variant_of_each_update():
    held = Underweighting(0.3, 2)
    assert [getattr(held.at(k), "func", held.at(k)) for k in range(4)] == [
        bump_linear,
        bump_linear,
        unchanged,
        unchanged,
    ]
    prior, _, model = problem()
    moments = linearized(prior, model)
    traceable = jax.tree.map(jnp.asarray, moments)
    for k in (1, 2):
        traced = jax.jit(lambda k: held.at(k)(prior, model, traceable)[1].P_zz)(jnp.asarray(k))
        assert_allclose(traced, held.at(k)(prior, model, moments)[1].P_zz, rtol=1e-14)


def test_both_engines_agree():
    prior, z, model = problem()
    held = Filter(variant=Underweighting(np.array([0.0, 0.2, 3.0]), 2))
    options = {"z_per_step": True, "progress": False}
    one, other = (sweep(held, prior, z, model, engine=e, **options) for e in ("numpy", "jax"))
    assert_allclose(one.final.mean, other.final.mean, rtol=1e-11)
    assert_allclose(one.final.cov, other.final.cov, rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (partial(Underweighting, -0.1), "bump must be at least 0; found -0.1"),
        (partial(Underweighting, [0.5, np.nan]), "bump must be .*nan"),
        (partial(Underweighting, True), "bump must be .*bool"),
        (partial(Underweighting, 0.2, -1), "updates must be an integer of at least 0; found -1"),
        (partial(Underweighting, 0.2, 1.5), "updates must be an integer of at least 0; found 1.5"),
    ],
)
def test_bad_input_is_refused_by_name(make, message):
    with pytest.raises(ValueError, match=message):
        make()
