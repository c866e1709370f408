"""A sweep takes the models that a run takes, however they are written, on both engines."""

from dataclasses import dataclass, field
from functools import cached_property, partial
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from polar_models import (
    MANY,
    POLAR,
    PRIORS,
    AsClass,
    AsNamedTuple,
    Polar,
    R,
    Z,
    engines,
    in_closures,
    quiet,
)

from navfilters import FILTERS, Filter, Gaussian, SweepError, run
from navfilters.runs.trees import flatten, unflatten


class Labelled(AsNamedTuple):
    """A named tuple with a constructor of its own, and with an attribute beside its fields."""

    def __new__(cls, deviations):
        made = super().__new__(cls, np.asarray(deviations))
        made.scale = 1.0
        return made

    def h(self, x):
        return POLAR.h(x) * self.scale


@dataclass(frozen=True)
class AsDataclass(Polar):
    R: Any


@dataclass
class WithMore(Polar):
    """Another attribute is made after the fields, and one when it is asked for."""

    R: Any

    def __post_init__(self):
        self.scale = 1.0

    @cached_property
    def unit(self):
        return np.ones(2)

    def h(self, x):
        return POLAR.h(x) * self.scale * self.unit


class Hidden(Polar):
    """R is computed."""

    def __init__(self, R):
        self._covariance = R

    @property
    def R(self):
        return 1.0 * self._covariance


def in_partials(R):
    def power(x, number):
        return getattr(POLAR, ("h", "jacobian", "hessian")[number])(x)

    names = ("h", "jacobian", "hessian")
    functions = {name: partial(power, number=i) for i, name in enumerate(names)}
    return SimpleNamespace(R=R, **functions)


def on_the_fly(R):
    """A class that only this function knows."""

    class Local(Polar):
        pass

    model = Local()
    model.R = R
    return model


WRITTEN = [
    AsNamedTuple,
    Labelled,
    AsDataclass,
    WithMore,
    AsClass,
    Hidden,
    in_closures,
    in_partials,
    on_the_fly,
]


@engines
@pytest.mark.parametrize("noise", [R, MANY], ids=["shared", "one each"])
@pytest.mark.parametrize("write", WRITTEN, ids=lambda w: w.__name__)
def test_a_sweep_takes_what_a_run_takes(write, noise, engine):
    for name in ("EKF", "mtSOF"):
        wanted = run(FILTERS[name], PRIORS, Z, write(noise), 3).mean[-1]
        got = quiet(FILTERS[name], PRIORS, Z, write(noise), 3, engine=engine, chunk=2).final.mean
        assert_allclose(got, wanted, rtol=1e-10)


@engines
def test_a_single_configuration_of_a_named_tuple(engine):
    prior = Gaussian(PRIORS.mean[0], PRIORS.cov)
    got = quiet(FILTERS["UKF"], prior, Z, AsNamedTuple(R), 3, engine=engine).final.mean
    assert_allclose(got, run(FILTERS["UKF"], prior, Z, AsNamedTuple(R), 3).mean[-1], rtol=1e-12)


@pytest.mark.parametrize("write", WRITTEN, ids=lambda w: w.__name__)
def test_other_processes_take_them_too(write):
    got = quiet(FILTERS["EKF"], PRIORS, Z, write(MANY), 3, workers=2, chunk=2).final.mean
    assert_allclose(got, run(FILTERS["EKF"], PRIORS, Z, write(MANY), 3).mean[-1], rtol=1e-12)


class Still(NamedTuple):
    """A motion model as a named tuple."""

    Q: Any

    def transition(self, x):
        return x, x.__array_namespace__().eye(2)


class Forgetting(NamedTuple):
    """A filter with a memory, and two numbers, as a named tuple."""

    gain: Any = 0.5
    floor: Any = 0.1

    def init(self, prior):
        return Filter().init(prior)

    def step(self, state, z, sensor, dynamics, k):
        after = Filter().step(state, z, sensor, dynamics, k)
        mean, cov = after.estimate
        gain = cov.__array_namespace__().asarray(self.gain)[..., None, None]
        return after._replace(estimate=Gaussian(mean, gain * cov + self.floor))


@engines
@pytest.mark.parametrize("gain", [0.5, np.linspace(0.1, 0.5, 5)], ids=["one", "each its own"])
def test_filters_of_others_and_their_models_as_named_tuples(gain, engine):
    filter_, sensor, motion = Forgetting(gain), AsNamedTuple(R), Still(MANY)
    options = {"dynamics": motion, "engine": engine, "chunk": 2}
    got = quiet(filter_, PRIORS, Z, sensor, 3, **options).final
    state = filter_.init(PRIORS)
    for k in range(3):
        state = filter_.step(state, Z, sensor, motion, k)
    assert_allclose(got.mean, state.estimate.mean, rtol=1e-12)
    assert_allclose(got.cov, state.estimate.cov, rtol=1e-12)
    wanted = run(filter_, PRIORS, Z, sensor, 3, dynamics=motion)
    assert_allclose(got.mean, wanted.mean[-1], rtol=1e-12)


# --- what would be dealt out wrongly ------------------------------------------------------------


@dataclass(frozen=True)
class Shifted(Polar):
    """The offsets do not say that they are vectors: taken for one matrix, which all share."""

    R: Any
    offset: Any

    def h(self, x):
        return POLAR.h(x) + self.offset


@dataclass(frozen=True)
class Declared(Shifted):
    offset: Any = field(default=0.0, metadata={"axes": 1})


@pytest.mark.parametrize("count", [2, 3, 5])
def test_arrays_that_cannot_be_dealt_out_are_refused(count):
    """Also where there are as many of them as in a chunk that is probed."""
    offsets = 0.01 * np.arange(2.0 * count).reshape(count, 2)
    prior = Gaussian(PRIORS.mean[:count], PRIORS.cov)
    wanted = run(FILTERS["EKF"], prior, Z, Shifted(MANY[:count], offsets), 2).mean[-1]
    got = quiet(FILTERS["EKF"], prior, Z, Declared(MANY[:count], offsets), 2, chunk=2).final.mean
    assert_allclose(got, wanted, rtol=1e-12)
    closed = in_closures(MANY[:count])
    closed.h = lambda x: POLAR.h(x) + offsets
    unshared = Shifted(R, offsets)  # a model's batch axes are those of its R
    for model in (Shifted(MANY[:count], offsets), closed, unshared):
        for engine in ("numpy", "jax"):
            with pytest.raises(ValueError, match=r"model.h must"):
                quiet(FILTERS["EKF"], prior, Z, model, 2, engine=engine)


def test_an_option_in_a_closure_cannot_be_dealt_out():
    bumps = np.linspace(0.5, 1.0, 5)

    def closed(prior, z, model):
        return FILTERS["B-EKF 1"](prior, z, model, bump=bumps)

    with pytest.raises(ValueError, match="estimator must return arrays whose first axis"):
        quiet(closed, PRIORS, Z, AsDataclass(R), 2)
    dealt = quiet(partial(FILTERS["B-EKF 1"], bump=bumps), PRIORS, Z, AsDataclass(R), 2, chunk=2)
    wanted = run(closed, PRIORS, Z, AsDataclass(R), 2).mean[-1]
    assert_allclose(dealt.final.mean, wanted, rtol=1e-12)


# --- taken apart and put together ---------------------------------------------------------------


def test_named_tuples_keep_their_class_and_what_they_have_beside_fields():
    model = Labelled([[1.0, 2.0], [3.0, 4.0]])
    tree, leaves = flatten("model", model, None)
    assert [leaf.name for leaf in leaves] == ["model.R"]
    again = unflatten(tree, [leaf.array for leaf in leaves])
    assert type(again) is Labelled
    assert again.scale == 1.0
    assert_array_equal(again.R, model.R)


def test_a_named_tuple_of_numbers_is_no_array():
    tree, leaves = flatten("estimator", Forgetting(1.0, 2.0), 0)
    assert not leaves
    assert unflatten(tree, []) == Forgetting(1.0, 2.0)


@pytest.mark.parametrize(
    "bad", [np.ma.masked_less(R, 1e-3), R.view(type("Odd", (np.ndarray,), {}))]
)
def test_arrays_in_a_model_or_a_filter_are_looked_at(bad):
    model = Shifted(R, bad)
    with pytest.raises(ValueError, match=r"(model.offset|the value of model.h) must"):
        quiet(FILTERS["EKF"], PRIORS, Z, model, 2)
    with pytest.raises(ValueError, match=r"estimator.variant.bump must"):
        quiet(partial(FILTERS["B-EKF 1"], bump=bad), PRIORS, Z, AsDataclass(R), 2)


def test_an_exception_still_names_the_configuration():
    class Picky(AsClass):
        def h(self, x):
            if (x == PRIORS.mean[3]).all(axis=-1).any():
                raise ZeroDivisionError("not here")
            return POLAR.h(x)

    with pytest.raises(SweepError, match="configuration 3: ZeroDivisionError"):
        quiet(FILTERS["EKF"], PRIORS, Z, Picky(R), 2)
