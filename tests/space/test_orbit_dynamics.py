"""An orbit as a filter's dynamics: both engines, the thrust's time, the paths of many updates."""

import math
from functools import partial
from itertools import product

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.numerics.small_matrices import product_of_last
from navfilters.space import variations
from navfilters.space.inertial_orbit import Orbit
from navfilters.space.thrust import COASTING, Thrust
from navfilters.space.variations import series

BURN = Thrust(0.45, ((30, 70), (140, 220)))
Q = np.diag([4e-4, 4e-4, 4e-4, 4e-8, 1e-8, 9e-8])

each_motion = pytest.mark.parametrize(
    "orbit",
    [Orbit(thrust=t, Q=Q, integrator=i) for t in (COASTING, BURN) for i in ("rk4", "euler")],
    ids=["rk4", "euler", "rk4, burning", "euler, burning"],
)


def states(*batch):
    rng = np.random.default_rng(0)
    r = rng.normal(size=(*batch, 3))
    r *= 7.1e6 / np.linalg.norm(r, axis=-1, keepdims=True)
    v = np.cross(r, rng.normal(size=(*batch, 3)))
    v *= 7.4e3 / np.linalg.norm(v, axis=-1, keepdims=True)
    return np.concatenate([r, v], axis=-1)


def assert_close(got, wanted, relative):
    """Relative to the largest element of position or velocity, or of each block of a matrix."""
    got = np.asarray(got)
    assert got.shape == wanted.shape
    halves = (slice(3), slice(3, 6))
    for i in product(halves, repeat=2 if wanted.shape[-2:] == (6, 6) else 1):
        part = wanted[..., *i]
        assert_allclose(got[..., *i], part, rtol=0, atol=relative * np.abs(part).max())


@each_motion
@pytest.mark.parametrize("batch", [(), (3,), (2, 3), (0,)])
def test_one_integration_gives_what_the_sub_steps_give(orbit, batch):
    x = states(*batch)
    path = np.stack([x, *orbit.path(x)])
    product_of, noise = np.eye(6) + 0 * x[..., None], np.zeros((*batch, 6, 6))
    for step in orbit.transitions(path):
        product_of, noise = step @ product_of, step @ noise @ step.mT + Q
    f, F, W = orbit.propagate(x, Q)
    assert_array_equal(f, path[-1])
    if x.size:
        assert_close(F, product_of, 1e-12)
        assert_close(W, noise, 1e-12)
    assert_array_equal(orbit.f(x), f)
    for got, wanted in zip(orbit.transition(x), (f, F), strict=True):
        assert_array_equal(got, wanted)


@each_motion
def test_jax_steps_forwards_to_the_same(orbit):
    """In one loop from the first sub-step on, with a traced step, for a burn as for a coast."""

    @jax.jit
    def all_of(k, x):
        now = orbit.at(k)
        return *now.propagate(x, jnp.asarray(Q)), *now.transition(x), now.f(x)

    x, k = states(2, 3), 1
    now = orbit.at(k)
    wanted = (*now.propagate(x, Q), *now.transition(x), now.f(x))
    for got, ours in zip(all_of(k, x), wanted, strict=True):
        assert_close(got, ours, 1e-13)


@pytest.mark.parametrize("batch", [(), (0,)])
def test_jax_takes_any_batch_of_states(batch):
    x, orbit = states(*batch), Orbit(thrust=BURN, substeps=50)
    for got, ours in zip(jax.jit(orbit.transition)(x), orbit.transition(x), strict=True):
        assert got.shape == ours.shape
        assert_allclose(got, ours, rtol=0, atol=1e-12 * np.abs(ours).max(initial=0))


def test_jax_takes_a_batch_of_noise():
    x, many = states(4), Q * np.array([1.0, 4.0, 9.0])[:, None, None, None]
    orbit = Orbit(thrust=BURN, substeps=50)
    got = jax.jit(orbit.propagate)(x, many)
    wanted = orbit.propagate(x, many)
    assert wanted[2].shape == (3, 4, 6, 6)
    for ours, theirs in zip(got, wanted, strict=True):
        assert_close(ours, theirs, 1e-13)


def test_what_jax_compiles_does_not_grow_with_the_sub_steps():
    long = Orbit(thrust=BURN, substeps=1000)
    assert len(jax.make_jaxpr(long.transition)(states()).eqns) < 100


def test_a_later_interval_burns_at_its_own_time():
    orbit, x = Orbit(thrust=BURN, Q=Q), states(2)
    for k in range(3):
        later = Orbit(thrust=BURN, Q=Q, start=100.0 * k)
        for got, wanted in zip(orbit.at(k).propagate(x, Q), later.propagate(x, Q), strict=True):
            assert_array_equal(got, wanted)
        assert_array_equal(orbit.at(k).f(x), orbit.path(x, 100.0 * k)[-1])
    twice = orbit.at(1).at(1)
    assert_array_equal(twice.f(x), orbit.at(2).f(x))
    assert_array_equal(Orbit(thrust=BURN, start=200.0).f(x), twice.f(x))


@pytest.mark.parametrize("thrust", [COASTING, Thrust(0.0, ((1, 2),)), Thrust(1.0, ())])
def test_an_orbit_that_coasts_does_not_count(thrust):
    orbit = Orbit(thrust=thrust)
    assert orbit.at(7) is orbit


def test_the_paths_of_all_updates_in_one_call():
    """One time for each of the leading axes, and as from each update alone."""
    orbit, x, times = Orbit(thrust=BURN), states(4, 3), np.array([0.0, 100.0, 200.0, 300.0])
    path = orbit.path(x, times)
    assert path.shape == (100, 4, 3, 6)
    for k, t in enumerate(times):
        assert_array_equal(path[:, k], orbit.path(x[k], float(t)))
        assert_array_equal(path[:, k], orbit.at(k).path(x[k]))
    compiled = jax.jit(lambda x, t: Orbit(thrust=BURN, substeps=4).path(x, t))(x, times + 28)
    assert_close(compiled, Orbit(thrust=BURN, substeps=4).path(x, times + 28), 1e-15)


def test_strength_takes_arrays_of_times():
    thrust = Thrust(0.5, ((10, 20), (30, 40)))
    times = np.array([[0, 10, 19.9, 20], [29, 30, 39.5, 40]])
    wanted = [[0, 0.5, 0.5, 0], [0, 0.5, 0.5, 0]]
    assert_array_equal(thrust.strength(times), wanted)
    assert_array_equal(jax.jit(thrust.strength)(times), wanted)
    assert_array_equal(COASTING.strength(times), np.zeros((2, 4)))


@pytest.mark.parametrize("order", [1, 2, 3])
def test_series_is_the_exponential_to_an_order(order):
    """Of members behind the matrices; of no V without one."""
    rng = np.random.default_rng(1)
    G, V = rng.normal(size=(2, 3, 3, 4))
    M = rng.normal(size=(6, 5, 4))
    for of_v in (None, partial(product_of_last, V)):
        got = np.concatenate(series(partial(variations.rates, G, of_v), 0.1, order, M[:3], M[3:]))
        for i in range(4):
            A = np.block(
                [[np.zeros((3, 3)), np.eye(3)], [G[..., i], V[..., i] * (of_v is not None)]]
            )
            terms = [M[..., i] / math.factorial(k) for k in range(order + 1)]
            wanted = sum(np.linalg.matrix_power(A / 10, k) @ terms[k] for k in range(order + 1))
            assert_allclose(got[..., i], wanted, rtol=1e-12)


def test_a_bad_start_is_refused():
    with pytest.raises(ValueError, match="start must be a finite number of seconds; found nan"):
        Orbit(start=np.nan)
