"""The host's sub-steps are those of the formulas, to the last bit."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from navfilters.numerics.runge_kutta import runge_kutta_increment
from navfilters.space import Orbit
from navfilters.space.gravity import EARTH
from navfilters.space.sub_steps import increment, transitions
from navfilters.space.variations import FEW, accumulated, all_to_end, few_of, middle, third_order

CIRCULAR = np.array([5e6, 4e6, 2e6, -5e3, 5.5e3, 1.5e3])


def states(*batch):
    return CIRCULAR * (1 + 1e-2 * np.random.default_rng(1).normal(size=(*batch, 6)))


@pytest.mark.parametrize("batch", [(), (1,), (3, 7)])
@pytest.mark.parametrize("thrust", [None, 0.45])
@pytest.mark.parametrize("h", [1.0, 30.0])
def test_a_step_is_runge_kutta_of_the_derivative(batch, thrust, h):
    x = states(*batch)
    push = None if thrust is None else np.full(batch, thrust)
    wanted = runge_kutta_increment(partial(Orbit().derivative, thrust=push), x, h)
    assert_array_equal(increment(EARTH, x, h, push), wanted)


def test_the_gradient_by_elements():
    x = states(4)
    found = np.moveaxis(np.array(EARTH.gradient_elements(*x[:, :3].T)), -1, 0)
    assert_array_equal(found, EARTH.gradient(x[:, :3]))


@pytest.mark.parametrize("turned", [False, True])
def test_transitions_are_the_series_of_the_jacobian(turned):
    """Of steps that burn, to the last bit; of the others but for rounding."""
    path, h = Orbit(substeps=6).path(states(5)), 1.0
    thrust = np.array([0.0, 0.45, 0.0, 0.0, 0.45])[:, None]
    F = transitions(EARTH, path, h, thrust, turned=turned)
    F = F.mT if turned else F
    at = middle(path[:-1], path[1:], h)
    wanted = third_order(h * Orbit().jacobian(at, thrust))
    assert_array_equal(F[[1, 4]], wanted[[1, 4]])
    np.testing.assert_allclose(F, wanted, rtol=1e-13, atol=1e-16)


@pytest.mark.parametrize("axes", [(), (2, 1)])
def test_noise_is_accumulated_term_by_term(axes):
    rng = np.random.default_rng(2)
    Phi, Q = rng.normal(size=(7, 3, 6, 6)), rng.normal(size=(*axes, 6, 6))
    W = 0.0
    for one in Phi[1:]:
        W = W + one @ Q @ one.mT
    assert_array_equal(accumulated(np.ascontiguousarray(Phi.mT), Q), W)


@pytest.mark.parametrize("count", [48, 100, 1000])
def test_few_terms_have_the_sum_of_all_where_it_is_a_polynomial(count):
    at, weights, of_each = few_of(count)
    assert len(set(at.tolist())) == FEW
    assert (at[0], at[-1]) == (1, count)
    s = np.arange(1, count + 1) / count
    for power in range(FEW):
        np.testing.assert_allclose(weights @ s[at - 1] ** power, np.sum(s**power), rtol=1e-13)
        np.testing.assert_allclose(of_each @ s[at - 1] ** power, s**power, rtol=0, atol=1e-14)
    assert abs(weights @ s[at - 1] ** (2 * FEW) / np.sum(s ** (2 * FEW)) - 1) > 1e-12


@pytest.mark.parametrize("axes", [(), (2, 1)])
def test_a_few_transitions_and_terms_give_what_all_give(axes):
    """Near the Earth's surface; deep inside, where an orbit turns fast, all are computed."""
    x = np.stack([CIRCULAR, 0.9 * CIRCULAR, 0.2 * CIRCULAR])
    Q = np.random.default_rng(3).normal(size=(*axes, 6, 6))
    Q = Q @ Q.mT
    orbit = Orbit()
    all_of = all_to_end(lambda k, part: orbit.transitions(part).mT, orbit._states(x, 0.0), 6)
    _, F, W = orbit.propagate(x, Q)
    for got, wanted in ((F, all_of[0].mT), (W, accumulated(all_of, Q))):
        scale = np.abs(wanted).max(axis=(-2, -1), keepdims=True)
        np.testing.assert_allclose(got / scale, wanted / scale, rtol=0, atol=1e-13)
        assert not np.array_equal(got[..., 0, :, :], wanted[..., 0, :, :])
        assert_array_equal(got[..., 2, :, :], wanted[..., 2, :, :])
    assert_array_equal(W[..., 2, :, :], orbit.propagate(x[2], Q)[2].reshape(*axes[:-1], 6, 6))
