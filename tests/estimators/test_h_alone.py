"""A model of h and R, and no derivative: by complex step, in JAX's forward mode, or by no means."""

from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Gaussian, run, sweep
from navfilters.estimators import LATER_FILTERS
from navfilters.models import RangeBearing
from navfilters.numerics.state_derivatives import second_derivative

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


class Beacon(NamedTuple):
    """The distance from a place far from the origin, as in a map's northing and easting."""

    place: Any
    R: Any = np.eye(1)

    def h(self, x):
        away = x - self.place
        return np.sqrt((away * away).sum(-1, keepdims=True))


class CurvedBeacon(Beacon):
    def hessian(self, x):
        r = self.h(x)[..., None]
        u = (x - self.place)[..., None] / r
        return ((np.eye(2) - u * u.mT) / r)[..., None, :, :]


@pytest.mark.parametrize("origin", [0.0, 5e3, 4.5e6])
@pytest.mark.parametrize("filter_", [FILTERS["mtSOF"], LATER_FILTERS["GSOF"]])
def test_second_derivatives_do_not_depend_on_where_the_origin_is(filter_, origin):
    """Steps of a hundredth of x passed over the beacon: the mean went the other way."""
    x = origin + np.array([[0.0, 0.0], [30.0, -5.0], [9.0, 60.0]])
    prior, place = Gaussian(x, np.diag([20.0, 30.0]) ** 2), origin + np.array([60.0, 80.0])
    got, wanted = (filter_(prior, np.array([101.0]), m(place)) for m in (Beacon, CurvedBeacon))
    assert_allclose(got.mean - x, wanted.mean - x, rtol=1e-7, atol=1e-7)
    assert_allclose(got.cov, wanted.cov, rtol=1e-7, atol=1e-7)


def test_a_step_that_is_shortened_is_so_for_one_member_alone():
    """Some need it, one is nowhere near: each has the bits that it has alone."""
    x = np.array([[4.5e6, 4.5e6], [1e3, -2e3], [np.nan, 1.0], [4.5e6 + 30, 4.5e6 + 70]])
    h = Beacon(4.5e6 + np.array([60.0, 80.0])).h
    together = second_derivative(h, x, "h")
    assert_array_equal(together, [second_derivative(h, one, "h") for one in x])
    assert np.isnan(together[2]).any()
    assert np.isfinite(together[[0, 1, 3]]).all()


def test_a_step_that_leaves_where_h_is_defined_is_shortened():
    def depth(x):
        return np.where(x.real > 1000.0, np.log(np.where(x.real > 1000.0, x - 1000.0, 1.0)), np.nan)

    got = second_derivative(depth, np.array([1000.5]), "h")
    assert_allclose(got[0, 0, 0], -4.0, rtol=1e-8)


def test_whole_numbers_are_no_other_place():
    """Half a step was rounded to none, and the second derivative was NaN."""
    got = second_derivative(lambda x: x**3, np.array([5]), "h")
    assert_allclose(got[0, 0, 0], 30.0, rtol=1e-9)
