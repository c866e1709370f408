"""What JAX compiled is used again only where it would be compiled the same."""

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from polar_models import POLAR, PRIORS, AsClass, AsNamedTuple, R, Z, in_closures, quiet

from navfilters import FILTERS, run


def test_a_model_that_was_changed_is_compiled_anew():
    """As an attribute, in place, in a closure, and in a dictionary: not the program of before."""
    noise, table = R.copy(), {"scale": 1.0}
    models = [AsClass(R.copy()), in_closures(R), in_closures(R), in_closures(R)]
    models[2].h = lambda x: POLAR.h(x) * noise[0, 0] / 0.04
    models[3].h = functools.partial(lambda x, table: POLAR.h(x) * table["scale"], table=table)
    for model in models:
        quiet(FILTERS["EKF"], PRIORS, Z, model, 2, engine="jax")
    models[0].R[...] = 100 * R
    models[1].R = 100 * R
    noise *= 1.5
    table["scale"] = 1.5
    for model in models:
        got = quiet(FILTERS["EKF"], PRIORS, Z, model, 2, engine="jax").final.mean
        assert_allclose(got, run(FILTERS["EKF"], PRIORS, Z, model, 2).mean[-1], rtol=1e-10)


def test_no_step_is_none():
    got = quiet(FILTERS["EKF"], PRIORS, Z, POLAR, 0, engine="jax")
    assert_array_equal(got.final.mean, PRIORS.mean)


def test_what_cannot_change_is_compiled_once():
    from navfilters.runs import compiled

    compiled._program.cache_clear()
    for factor in (1.0, 2.0):
        quiet(FILTERS["EKF"], PRIORS, Z, AsNamedTuple(factor * R), 2, engine="jax")
    assert compiled._program.cache_info().misses == 1


class InJax(NamedTuple):
    """Written for JAX alone."""

    R: Any

    def h(self, x):
        return jnp.stack([jnp.hypot(x[..., 0], x[..., 1]), jnp.arctan2(x[..., 1], x[..., 0])], -1)

    def jacobian(self, x):
        a, b = x[..., 0], x[..., 1]
        r2 = a * a + b * b
        r = jnp.sqrt(r2)
        rows = [jnp.stack([a / r, b / r], -1), jnp.stack([-b / r2, a / r2], -1)]
        return jnp.stack(rows, -2)


def test_a_model_of_jax_is_computed_in_doubles_or_not_at_all():
    """The result of a sweep under JAX is of doubles even where JAX itself is not."""
    wanted = run(FILTERS["EKF"], PRIORS, Z, AsNamedTuple(R), 5).mean[-1]
    with jax.enable_x64(False):
        got = quiet(FILTERS["EKF"], PRIORS, Z, InJax(R), 5, engine="jax").final.mean
        assert got.dtype == np.float64
        assert_allclose(got, wanted, rtol=1e-10)
        for go in (quiet, run):
            with pytest.raises(ValueError, match=r"model.h must return doubles; found float32"):
                go(FILTERS["EKF"], PRIORS, Z, InJax(R), 5)
    with jax.enable_x64(True):
        assert_allclose(run(FILTERS["EKF"], PRIORS, Z, InJax(R), 5).mean[-1], wanted, rtol=1e-10)
