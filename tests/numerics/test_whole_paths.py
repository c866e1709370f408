"""All steps of a path at once are the steps one by one, to the last bit."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from navfilters.numerics.runge_kutta import runge_kutta
from navfilters.numerics.whole_paths import _guess, in_steps, whole_path
from navfilters.space import Orbit
from navfilters.space.thrust import Thrust

CIRCULAR = np.array([7e6, 0.0, 1e5, 0.0, 7.5e3, 30.0])


def circling(*batch):
    return CIRCULAR * (1 + 1e-3 * np.random.default_rng(1).normal(size=(*batch, 6)))


@pytest.mark.parametrize("batch", [(), (1,), (7,), (2, 3), (60,), (0,)])
@pytest.mark.parametrize("integrator", ["rk4", "euler"])
def test_an_orbit_step_by_step(integrator, batch):
    orbit, x = Orbit(integrator=integrator, substeps=130), circling(*batch)
    found = orbit.path(x)
    for k in range(130):
        x = Orbit(integrator=integrator, substeps=1).f(x)
        assert_array_equal(found[k], x)


def test_a_burn_that_begins_in_between():
    burn, x = Thrust(0.5, ((33, 61),)), circling(5)
    found = Orbit(thrust=burn).path(x)
    for k in range(100):
        x = Orbit(thrust=burn, substeps=1, start=float(k)).f(x)
        assert_array_equal(found[k], x)


def test_a_member_that_is_nan_stops_no_other():
    x = circling(4)
    wanted = Orbit().path(x)
    x[2, 1] = np.nan
    found = Orbit().path(x)
    assert np.isnan(found[:, 2]).all()
    assert_array_equal(found[:, [0, 1, 3]], wanted[:, [0, 1, 3]])


def test_few_sweeps_do():
    """With a number of evaluations that does not grow with the number of steps."""
    orbit, calls = Orbit(), []

    def increment(steps, x, h):
        calls.append(len(x))
        return runge_kutta(orbit.derivative, x, h) - x

    whole_path(increment, CIRCULAR, 1.0, 100, 100)
    assert len(calls) < 20


def test_the_first_guess_is_near():
    """A quintic through 100 s of an orbit: a metre, and two centimetres a second."""
    orbit = Orbit()

    def increment(steps, x, h):
        return runge_kutta(orbit.derivative, x, h) - x

    path = in_steps(increment, CIRCULAR, 1.0, 100)
    guess = np.concatenate([path[:1], np.zeros((100, 6))])
    _guess(increment, guess, 1.0)
    assert np.abs(guess - path)[:, :3].max() < 1.0
    assert np.abs(guess - path)[:, 3:].max() < 0.02


def test_where_no_sweep_comes_to_rest_the_steps_are_taken_one_by_one():
    """A map that folds: what it gives far on hangs on every bit before."""

    def folding(steps, x, h):
        a = np.sin(300.0 * x[..., :3])
        return np.concatenate([h * x[..., 3:] + a, a], axis=-1)

    x = np.arange(12.0).reshape(2, 6)
    found = whole_path(folding, x, 1.0, 60, 60)
    assert_array_equal(found, in_steps(folding, x, 1.0, 60))
