"""A model's function of a wrong shape, or that mixes a batch, is named before anything is computed.

A product that broadcasts would give numbers that look like any others.
"""

from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from wrong_models import ALONE, BATCHES, PRIORS, RIGHT, WRONG, Model, Z

from navfilters import FILTERS, Gaussian, run, sweep
from navfilters.models import Linear, RangeBearing
from navfilters.numerics.probing import members, probe
from navfilters.runs.model_checks import dynamics, sensor


def never(prior, z, model):
    raise AssertionError("the estimator was called before the model was looked at")


@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize("wrong", WRONG)
def test_run_and_sweep_name_the_function(wrong, batch):
    """Whatever the batch, and on both engines: nothing is compiled."""
    prior, model, name = BATCHES[batch], Model(**WRONG[wrong]), wrong.split(":")[0]
    if "four" in wrong and batch == "one":
        pytest.skip("four configurations of one prior")
    quiet = partial(sweep, never, prior, Z, model, 3, progress=False)
    for go in (partial(run, never, prior, Z, model, 3), quiet, partial(quiet, engine="jax")):
        with pytest.raises(ValueError, match=rf"model\.{name}\b"):
            go()


def test_one_range_for_each_member():
    """h (members,) in the place of (members, 1): z - h would be (members, members)."""
    model = Model(R=[[0.25]], h=lambda x: np.hypot(x[..., 0], x[..., 1]))
    model.jacobian = lambda x: (x / np.hypot(x[..., :1], x[..., 1:]))[..., None, :]
    message = r"model.h must return shape \(..., 1\) from shapes \(2,\); found \(\)"
    with pytest.raises(ValueError, match=message):
        run(FILTERS["EKF"], PRIORS, [52.0], model)
    with pytest.raises(ValueError, match=r"from model.h, must have shape \(..., 1\); found \(3,\)"):
        FILTERS["EKF"](PRIORS, np.array([52.0]), model)


@pytest.mark.parametrize("name", FILTERS)
def test_what_is_right_is_taken_by_all(name):
    """A function that no filter asks for may be missing, or say that it is."""

    def none(x):
        raise NotImplementedError

    wanted = run(FILTERS[name], PRIORS, Z, RIGHT, 2).mean
    assert_array_equal(run(FILTERS[name], PRIORS, Z, Model(), 2).mean, wanted)
    if "SOF" not in name:
        assert_array_equal(run(FILTERS[name], PRIORS, Z, Model(hessian=none), 2).mean, wanted)


def test_a_derivative_that_does_not_exist_is_no_error():
    """At the origin: the member is NaN, alone."""
    mean = PRIORS.mean.copy()
    mean[0] = 0.0
    got = run(FILTERS["EKF"], Gaussian(mean, PRIORS.cov), Z, RIGHT, 1).mean[-1]
    assert np.isnan(got[0]).all()
    assert np.isfinite(got[1:]).all()


def test_the_state_may_be_another_models():
    for n in (1, 3, 6):
        with pytest.raises(ValueError, match=rf"prior.mean must.*found.*\({n},\)"):
            run(never, Gaussian(np.ones(n), np.eye(n)), Z, RIGHT)
    with pytest.raises(ValueError, match=r"prior.mean must have shape \(..., 3\) for this model"):
        run(never, ALONE, [1.0], Linear([[1.0, 0.0, 0.0]], [[1.0]]))


def test_a_model_is_what_has_an_R():
    for model in (object(), (RIGHT, RIGHT), None):
        with pytest.raises(ValueError, match="model must have R, and h"):
            run(never, ALONE, Z, model)


@dataclass(frozen=True)
class Spaced:
    """Batch axes of a model (2, 1) and of its states (3,): a grid."""

    R: np.ndarray

    def h(self, x):
        return RIGHT.h(x) * np.ones((*self.R.shape[:-2], 1))

    def jacobian(self, x):
        return RIGHT.jacobian(x)


def test_batch_axes_of_model_and_state_form_a_grid():
    model = Spaced(RIGHT.R * np.array([1.0, 4.0])[:, None, None, None])
    got = run(FILTERS["UKF"], PRIORS, Z, model, 2).mean[-1]
    for i in range(2):
        alone = run(FILTERS["UKF"], PRIORS, Z, RangeBearing(model.R[i, 0]), 2).mean[-1]
        np.testing.assert_allclose(got[i], alone, rtol=1e-12)


# --- the probes themselves ----------------------------------------------------------------------


def test_probe_returns_the_value():
    assert_array_equal(probe("f", lambda x: 2 * x, (np.ones(2),), (2,)), [2.0, 2.0])


@pytest.mark.parametrize(
    ("f", "message"),
    [
        (lambda x: x[:1], r"f must return shape \(\.\.\., 2\) from shapes \(2,\); found \(1,\)"),
        (lambda x: x[0], r"f must return shape .*; found \(\)"),
        (lambda x: x[5], r"f must return shape .*; found IndexError"),
        (lambda x: x @ np.ones(3), r"f must return shape .*; found ValueError"),
        (lambda x: x * np.nan, "the value of f must be .* finite"),
        (lambda x: x + 1j, "the value of f must be .* real"),
    ],
)
def test_probe_refuses(f, message):
    with pytest.raises(ValueError, match=message):
        probe("f", f, (np.ones(2),), (2,))


def test_probe_looks_at_the_axes_in_front():
    probe("f", lambda x: x, (np.ones((3, 2)),), (2,), (3,), least=(3,))
    probe("f", lambda x: x[0], (np.ones((3, 2)),), (2,), (3,))
    for batch, least in (((4,), ()), ((2, 3), (2, 3)), ((), ())):
        with pytest.raises(ValueError, match=r"f must return shape .*found \(3, 2\)"):
            probe("f", lambda x: x, (np.ones((3, 2)),), (2,), batch, least=least)


@pytest.mark.parametrize("corner", [0, -1])
def test_the_first_and_the_last_member_are_compared(corner):
    def f(x):
        y = x.copy()
        y[corner] += x.ndim - 1  # in a batch only
        return y

    x = np.linspace(1.0, 2.0, 6).reshape(3, 2)
    with pytest.raises(ValueError, match="f must give a state in a batch what it gives it alone"):
        members("f", f, (x,), 1, (2,), (3,), whole=True)


def test_members_are_compared_to_a_part_in_a_million():
    x = np.linspace(1.0, 2.0, 6).reshape(3, 2)
    near = members("f", lambda x: x * (1 + 1e-9 * x.ndim), (x,), 1, (2,), (3,), whole=True)
    assert near.shape == (3, 2)
    with pytest.raises(ValueError, match="f must give a state in a batch what it gives it alone"):
        members("f", lambda x: x * (1 + 1e-4 * x.ndim), (x,), 1, (2,), (3,), whole=True)


def test_an_empty_batch_is_looked_at_with_ones():
    empty = Gaussian(np.ones((0, 2)), np.eye(2))
    sensor(RIGHT, empty)
    still = SimpleNamespace(Q=np.eye(2), transition=lambda x: (x, np.eye(2)))
    dynamics(still, empty)
    with pytest.raises(ValueError, match=r"model.h must"):
        sensor(Model(h=lambda x: x[..., :1]), empty)


def test_what_has_three_values_is_asked_once_at_each_state():
    """Propagation may cost as much as a step of the filter, and its parts are looked at in turn."""
    asked = []

    def propagate(x, Q):
        asked.append((x.shape, x.tobytes()))
        F = np.broadcast_to(np.eye(2), (*x.shape, 2))
        return x, F, F + Q

    means = np.random.default_rng(0).normal(size=(3, 2))
    moving = SimpleNamespace(Q=np.eye(2), propagate=propagate)
    dynamics(moving, Gaussian(means, np.eye(2)))
    assert len(asked) == len(set(asked)) > 1
