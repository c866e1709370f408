"""Earth-fixed flight with an attitude: against the orbit's own covariance, differences and JAX."""

import jax
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.space.earth_fixed_navigation import EarthFixedNavigation
from navfilters.space.earth_fixed_orbit import EarthFixedOrbit
from navfilters.space.pose import difference, retract

SCALE = np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3, 1e-6, 1e-6, 1e-6])  # m, m/s, rad of one size
P0 = np.diag([1e6] * 3 + [100.0] * 3 + [3e-6] * 3)
rng = np.random.default_rng(5)
root = rng.normal(size=(6, 6)) * np.array([6e-6] * 3 + [6e-7] * 3)[:, None]
FULL = root @ root.T
STEPS = 10

each_integrator = pytest.mark.parametrize("integrator", ["rk4", "printed"])


def states(*batch):
    rng = np.random.default_rng(0)
    r = rng.normal(size=(*batch, 3))
    r *= 7.0e6 / np.linalg.norm(r, axis=-1, keepdims=True)
    v = np.cross(r, rng.normal(size=(*batch, 3)))
    v *= 7.5e3 / np.linalg.norm(v, axis=-1, keepdims=True)
    q = rng.normal(size=(*batch, 4))
    return np.concatenate([r, v, q / np.linalg.norm(q, axis=-1, keepdims=True)], axis=-1)


def navigation(integrator, Q_psd=FULL):
    orbit = EarthFixedOrbit(Q_psd=Q_psd, step=0.83, integrator=integrator)
    return EarthFixedNavigation(orbit, STEPS)


def in_deviations(P, of):
    deviation = np.sqrt(np.diagonal(of, axis1=-2, axis2=-1))
    return P / deviation[..., :, None] / deviation[..., None, :]


@each_integrator
@pytest.mark.parametrize("batch", [(), (3,), (2, 3), (0,)])
@pytest.mark.parametrize("P", [P0, 1e-9 * P0], ids=["first", "small"])
def test_covariance_is_that_of_the_orbit_step_by_step(integrator, batch, P):
    dynamics, x = navigation(integrator), states(*batch)
    end, F, W = dynamics.propagate(x, dynamics.Q)
    got = F @ P @ F.mT + W
    at, wanted = dynamics.orbit.propagate(x[..., :6], P, STEPS)
    assert_allclose(end[..., :6], at, rtol=0, atol=1e-9)
    assert_array_equal(end[..., 6:], x[..., 6:])
    got = in_deviations((got + got.mT) / 2, wanted)
    assert_allclose(got, in_deviations(wanted, wanted), rtol=0, atol=1e-12)


@each_integrator
def test_a_noise_that_is_full_spreads_as_step_by_step(integrator):
    """One that joins position, velocity and misalignment, larger than what was known."""
    dynamics, x = navigation(integrator), states(3)
    root = np.random.default_rng(1).normal(size=(9, 9)) * SCALE[:, None]
    Q, wanted = root @ root.T, np.zeros((9, 9))
    for F in dynamics.orbit.transitions(dynamics.orbit.path(x[..., :6], STEPS)):
        wanted = F @ wanted @ F.mT + Q
    W = dynamics.propagate(x, Q)[2]
    assert_allclose(in_deviations(W, wanted), in_deviations(wanted, wanted), rtol=0, atol=1e-13)


@each_integrator
def test_one_integration_gives_what_f_and_transition_give(integrator):
    dynamics, x = navigation(integrator), states(3)
    end, F, _ = dynamics.propagate(x, dynamics.Q)
    assert_array_equal(dynamics.f(x), end)
    for got, wanted in zip(dynamics.transition(x), (end, F), strict=True):
        assert_array_equal(got, wanted)


@each_integrator
def test_transition_is_the_derivative_on_the_manifold(integrator):
    """By differences of fourth order in error coordinates."""
    dynamics, x = navigation(integrator), states()
    end, F = dynamics.transition(x)
    step = 1e3 * SCALE * np.array([1.0] * 6 + [1e2] * 3)
    at = {k: difference(dynamics.f(retract(x, k * np.diag(step))), end) for k in (-2, -1, 1, 2)}
    slope = ((8 * (at[1] - at[-1]) - (at[2] - at[-2])) / 12 / step[:, None]).T
    scale = SCALE / SCALE[:, None]
    assert_allclose(F * scale, slope * scale, rtol=0, atol=1e-7)


@pytest.mark.parametrize(
    ("integrator", "batch"), [("rk4", (2, 3)), ("rk4", ()), ("printed", (3,))], ids=str
)
def test_jax_steps_forwards_to_the_same(integrator, batch):
    dynamics, x = navigation(integrator), states(*batch)
    end, F, W = jax.jit(lambda x: dynamics.propagate(x, dynamics.Q))(x)
    wanted = dynamics.propagate(x, dynamics.Q)
    scale = SCALE / SCALE[:, None]
    assert_allclose(end, wanted[0], rtol=1e-14, atol=1e-8)
    assert_allclose(F * scale, wanted[1] * scale, rtol=0, atol=1e-12)
    assert_allclose(
        in_deviations(W, wanted[2]), in_deviations(wanted[2], wanted[2]), rtol=0, atol=1e-12
    )
    for got, ours in zip(jax.jit(dynamics.transition)(x), (end, F), strict=True):
        assert_allclose(got, ours, rtol=1e-14, atol=1e-8)
    assert_allclose(jax.jit(dynamics.f)(x), end, rtol=1e-14, atol=1e-8)


@pytest.mark.parametrize("engine", [lambda f: f, jax.jit], ids=["NumPy", "JAX"])
def test_noise_may_be_a_batch(engine):
    dynamics, x = navigation("rk4"), states(2)
    many = dynamics.Q * np.array([1.0, 4.0, 9.0])[:, None, None, None]
    end, F, W = engine(dynamics.propagate)(x, many)
    assert (end.shape, F.shape, W.shape) == ((2, 10), (2, 9, 9), (3, 2, 9, 9))
    alone = dynamics.propagate(x[1], dynamics.Q)[2]
    assert_allclose(in_deviations(W[2, 1], alone), 9 * in_deviations(alone, alone), atol=1e-11)


def test_a_member_that_fails_stays_alone():
    dynamics, x = navigation("rk4"), states(4)
    wanted = dynamics.propagate(x, dynamics.Q)
    x[2] = np.nan
    got = dynamics.propagate(x, dynamics.Q)
    assert np.isnan(got[1][2]).any()
    for a, b in zip(got, wanted, strict=True):
        assert_array_equal(a[[0, 1, 3]], b[[0, 1, 3]])


@pytest.mark.parametrize("steps", [0, 1.5, True])
def test_bad_steps_are_refused(steps):
    with pytest.raises(ValueError, match=f"steps must be an integer .*found {steps}"):
        EarthFixedNavigation(EarthFixedOrbit(), steps)
