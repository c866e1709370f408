"""A model of h and R, and no derivative: by complex step, in JAX's forward mode, or by no means."""

from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Gaussian, run, sweep
from navfilters.models import RangeBearing

engines = pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])
POLAR = RangeBearing(np.array([[0.5, 0.02], [0.02, 0.01]]))


class Bare(NamedTuple):
    R: Any = POLAR.R

    def h(self, x):
        return POLAR.h(x)


class Sloped(Bare):
    """With a Jacobian, without a Hessian."""

    def jacobian(self, x):
        return POLAR.jacobian(x)


def problem(count=5):
    rng = np.random.default_rng(0)
    x = rng.uniform(20, 50, (count, 2)) * [1, -1]
    return Gaussian(x, 4 * covariances(rng, (count,), 2)), POLAR.h(x + rng.normal(size=(count, 2)))


@pytest.mark.parametrize("model", [Bare(), Sloped()], ids=["h", "h and H"])
@pytest.mark.parametrize("name", FILTERS)
def test_it_is_the_model_with_its_derivatives(name, model):
    prior, z = problem()
    got, wanted = (
        run(FILTERS[name], prior, z, m, 5) for m in (model, RangeBearing(POLAR.R, False))
    )
    assert_allclose(got.mean, wanted.mean, rtol=1e-8)
    assert_allclose(got.cov, wanted.cov, rtol=0, atol=1e-8 * np.abs(wanted.cov).max())
    if name in {"UKF", "B-UKF", "UKFz"}:
        assert_array_equal(got.mean, wanted.mean)


@engines
@pytest.mark.parametrize("name", ["EKF", "mtSOF", "UKF"])
def test_on_both_engines(name, engine):
    prior, z = problem()
    got = sweep(FILTERS[name], prior, z, Bare(), 5, engine=engine, progress=False).final
    wanted = run(FILTERS[name], prior, z, RangeBearing(POLAR.R, False), 5)
    assert_allclose(got.mean, wanted.mean[-1], rtol=1e-8)
    assert_allclose(got.cov, wanted.cov[-1], rtol=0, atol=1e-8 * np.abs(wanted.cov).max())


def squared(x):
    """Not analytic, and complex step does not notice: the derivative comes out as zero."""
    return np.stack([(x * np.conj(x)).sum(-1), x[..., 0]], -1)


ROUGH = {
    "hypot": lambda x: np.stack([np.hypot(x[..., 0], x[..., 1]), x[..., 0]], -1),
    "real": lambda x: np.stack([np.abs(x[..., 0]), x[..., 1]], -1),
    "conj": squared,
}


@pytest.mark.parametrize("rough", ROUGH)
@pytest.mark.parametrize("name", FILTERS)
def test_an_h_that_is_not_analytic_is_refused_where_its_derivative_is_needed(name, rough):
    """Before the run, by comparison with differences; the unscented filters need none."""
    prior, z = problem()
    model = SimpleNamespace(R=POLAR.R, h=ROUGH[rough])
    if name in {"UKF", "B-UKF", "UKFz"}:
        assert np.isfinite(run(FILTERS[name], prior, z, model, 2).mean).all()
        assert np.isfinite(
            sweep(FILTERS[name], prior, z, model, 2, progress=False).final.mean
        ).all()
        return
    message = r"model\.h must .*Give its Jacobian instead"
    with pytest.raises(TypeError, match=message):
        run(FILTERS[name], prior, z, model, 2)
    with pytest.raises(TypeError, match=message):
        sweep(FILTERS[name], prior, z, model, 2, progress=False)
