"""Gravity, thrust and an interval of flight: against JAX, differences and naive loops."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from geopotential import J2, MU, RE, potential
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from navfilters.space import variations
from navfilters.space.gravity import EARTH, Gravity
from navfilters.space.inertial_orbit import Orbit
from navfilters.space.osculating_ellipse import perigee_apogee
from navfilters.space.thrust import COASTING, Thrust

SCALE = np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3])  # m and m/s of similar weight in an orbit
BURN = Thrust(0.45, ((30, 70),))
Q = np.diag([4e-4, 4e-4, 4e-4, 4e-8, 1e-8, 9e-8])


def low_orbit():
    i, speed = np.deg2rad(27.0), np.sqrt(MU / 6878137.0)
    return np.array([6878137.0, 0, 0, 0, speed * np.cos(i), speed * np.sin(i)])


def states(count=6):
    """Around orbits of 500 to 2700 km, in every direction."""
    rng = np.random.default_rng(0)
    r = rng.normal(size=(count, 3))
    r *= rng.uniform(6.9e6, 9.1e6, (count, 1)) / np.linalg.norm(r, axis=1, keepdims=True)
    v = np.cross(r, rng.normal(size=(count, 3)))
    v *= rng.uniform(6.5e3, 7.8e3, (count, 1)) / np.linalg.norm(v, axis=1, keepdims=True)
    return np.concatenate([r, v], axis=1)


def by_jax(function, x):
    return np.asarray(jax.jit(jax.vmap(jax.jacfwd(function)))(x))


def assert_close(got, wanted, relative):
    assert_allclose(got, wanted, rtol=0, atol=relative * np.abs(wanted).max())


def test_acceleration_is_equation_36_row_by_row():
    for x, y, z in states()[:, :3]:
        r = np.sqrt(x * x + y * y + z * z)
        k, tilt = 1.5 * J2 * (RE / r) ** 2, 5 * z * z / r**2
        wanted = [
            -MU * x / r**3 * (1 + k * (1 - tilt)),
            -MU * y / r**3 * (1 + k * (1 - tilt)),
            -MU * z / r**3 * (1 + k * (3 - tilt)),
        ]
        assert_allclose(EARTH.acceleration(np.array([x, y, z])), wanted, rtol=1e-14)


def test_acceleration_is_the_gradient_of_the_potential_with_the_second_zonal_harmonic():
    """By JAX to rounding, and by differences with a step of 10 m."""
    r = states()[:, :3]
    assert_close(EARTH.acceleration(r), by_jax(potential, r), 1e-14)
    step = 10 * np.eye(3)[:, None]
    difference = (potential(r + step) - potential(r - step)) / 20
    assert_close(np.moveaxis(difference, 0, -1), EARTH.acceleration(r), 1e-9)


def test_gravity_gradient():
    r = states()[:, :3]
    G = EARTH.gradient(r)
    assert_close(G, by_jax(EARTH.acceleration, r), 1e-14)
    step = 10 * np.eye(3)[:, None]
    difference = (EARTH.acceleration(r + step) - EARTH.acceleration(r - step)) / 20
    assert_close(np.moveaxis(difference, 0, -1), G, 1e-9)
    assert_allclose(G, G.mT, rtol=1e-14)
    assert_allclose(np.trace(G, axis1=-2, axis2=-1), 0, atol=1e-21)


def test_without_oblateness_there_are_two_bodies():
    sphere, r = Gravity(J2=0.0), states()[:, :3]
    d = np.linalg.norm(r, axis=1, keepdims=True)
    assert_allclose(sphere.acceleration(r), -MU * r / d**3, rtol=1e-14)


@pytest.mark.parametrize("thrust", [0.0, 0.45])
def test_jacobian_of_the_motion(thrust):
    x, dynamics = states(), Orbit()
    A = dynamics.jacobian(x, thrust=np.full(len(x), thrust) if thrust else None)
    wanted = by_jax(lambda x: dynamics.derivative(x, thrust), x)
    for rows in (slice(3), slice(3, 6)):
        for columns in (slice(3), slice(3, 6)):
            got, block = A[:, rows, columns], wanted[:, rows, columns]
            assert_allclose(got, block, rtol=0, atol=1e-14 * np.abs(block).max())


def test_thrust_is_along_the_velocity():
    x, dynamics = states(), Orbit()
    pushed = dynamics.derivative(x, 0.45) - dynamics.derivative(x)
    v = x[:, 3:]
    assert_array_equal(pushed[:, :3], 0)
    along = 0.45 * v / np.linalg.norm(v, axis=1, keepdims=True)
    assert_allclose(pushed[:, 3:], along, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("integrator", "relative"), [("rk4", 1e-7), ("euler", 1e-10)], ids=lambda v: str(v)
)
@pytest.mark.parametrize("thrust", [COASTING, BURN], ids=["coasting", "burn"])
def test_transition_is_the_derivative_of_the_interval(integrator, relative, thrust):
    """Differences of fourth order are good to 1e-10 themselves; Euler's F is exact."""
    x, dynamics = states(), Orbit(thrust=thrust, integrator=integrator)
    end, F = dynamics.transition(x)
    assert end.shape == (6, 6)
    steps = (np.eye(6) * 1e3 * SCALE)[:, None]
    at = {k: dynamics.f(x + k * steps) for k in (-2, -1, 1, 2)}
    difference = (8 * (at[1] - at[-1]) - (at[2] - at[-2])) / 12 / 1e3
    wanted = np.moveaxis(difference, 0, -1)  # columns already per SCALE
    assert_close(F * SCALE / SCALE[:, None], wanted / SCALE[:, None], relative)


def test_transition_tends_to_the_exact_one_with_order_two():
    x = states()
    F = [Orbit(step=h, substeps=round(400 / h)).transition(x)[1] for h in (40, 20, 10, 1)]
    error = [np.abs((f - F[-1]) * SCALE / SCALE[:, None]).max() for f in F[:-1]]
    assert_allclose(np.log2(error[0] / error[1]), 2, atol=0.15)
    assert_allclose(np.log2(error[1] / error[2]), 2, atol=0.15)


@pytest.mark.parametrize("thrust", [0.0, 0.45])
def test_runge_kutta_is_exact_to_micrometres(thrust):
    dynamics = Orbit(thrust=Thrust(thrust, ((0, 100),)))
    flight = solve_ivp(
        lambda _, x: dynamics.derivative(x, thrust),
        (0, 100),
        low_orbit(),
        method="DOP853",
        rtol=1e-13,
        atol=1e-10,
    )
    error = dynamics.f(low_orbit()) - flight.y[:, -1]
    assert np.abs(error[:3]).max() < 1e-6
    assert np.abs(error[3:]).max() < 1e-9


def test_the_printed_euler_step_errs_by_hundreds_of_metres():
    """Eq. (35): 424 m and 0.47 m/s in 100 s."""
    x = low_orbit()
    error = Orbit(integrator="euler").f(x) - Orbit().f(x)
    assert_allclose(np.linalg.norm(error[:3]), 424, atol=1)
    assert_allclose(np.linalg.norm(error[3:]), 0.47, atol=0.005)


def test_runge_kutta_keeps_energy_and_momentum():
    """Both integrals of the oblate problem, over 2000 s."""
    path = Orbit(substeps=2000).path(states())
    r, v = path[..., :3], path[..., 3:]
    energy = np.sum(v * v, axis=-1) / 2 - potential(r)
    momentum = r[..., 0] * v[..., 1] - r[..., 1] * v[..., 0]
    for integral in (energy, momentum):
        assert_allclose(integral, np.broadcast_to(integral[0], integral.shape), rtol=1e-12)


@pytest.mark.parametrize("integrator", ["rk4", "euler"])
@pytest.mark.parametrize("thrust", [COASTING, BURN], ids=["coasting", "burn"])
def test_noise_accumulates_as_step_by_step(integrator, thrust):
    """P <- F P F^T + Q over each sub-step is F P F^T + W over the interval."""
    whole = Orbit(thrust=thrust, Q=Q, integrator=integrator)
    start = x = states()
    P0 = P = np.diag([25e6] * 3 + [100.0] * 3)
    for k in range(100):
        x, F, W = replace(whole, substeps=1, start=float(k)).propagate(x, Q)
        assert_array_equal(W, np.broadcast_to(Q, W.shape))
        P = F @ P @ F.mT + Q
    end, F, W = whole.propagate(start, Q)
    assert_array_equal(end, x)
    assert_close(F @ P0 @ F.mT + W, P, 1e-13)
    assert_close(W, W.mT, 1e-14)


def test_noise_may_be_a_batch():
    x = states(4)
    many = Q * np.array([1.0, 4.0, 9.0])[:, None, None, None]
    _, _, W = Orbit(Q=many).propagate(x, many)
    assert W.shape == (3, 4, 6, 6)
    assert_allclose(W[2, 1], 9 * Orbit().propagate(x[1], Q)[2], rtol=1e-9)


@pytest.mark.parametrize("batch", [(), (1,), (5,), (2, 3), (0,)])
def test_batch_axes_come_first_and_members_do_not_meet(batch):
    x, orbit = np.resize(states(), (*batch, 6)), Orbit(thrust=BURN, Q=Q)
    path, (_, F, W) = orbit.path(x), orbit.propagate(x, Q)
    assert path.shape == (100, *batch, 6)
    assert F.shape == W.shape == (*batch, 6, 6)
    for i in np.ndindex(batch):
        assert_array_equal(path[(slice(None), *i)], orbit.path(x[i]))
        for whole, one in zip((F, W), orbit.propagate(x[i], Q)[1:], strict=True):
            assert_array_equal(whole[i], one)


@pytest.mark.parametrize("cached", [1, 13, 10**6])
def test_the_size_of_the_cache_changes_nothing(monkeypatch, cached):
    _, wanted = Orbit(thrust=BURN).transition(states())
    monkeypatch.setattr(variations, "CACHED", cached)
    assert_array_equal(Orbit(thrust=BURN).transition(states())[1], wanted)


def test_a_member_that_fails_stays_alone():
    x = states()
    x[2] = np.nan
    (_, got), (_, wanted) = Orbit().transition(x), Orbit().transition(states())
    others = [0, 1, 3, 4, 5]
    assert np.isnan(got[2]).any()
    assert_array_equal(got[others], wanted[others])


def test_the_same_source_compiles_under_jax():
    dynamics, x = Orbit(thrust=Thrust(0.45, ((1, 3),)), Q=Q, substeps=4), states()
    step = jax.jit(lambda x: dynamics.propagate(x, jnp.asarray(Q)))
    for got, ours in zip(step(jnp.asarray(x)), dynamics.propagate(x, Q), strict=True):
        assert_close(np.asarray(got), ours, 1e-13)


def test_arcs_of_thrust():
    thrust = Thrust(0.5, ((10, 20), (30, 40)))
    times = [0, 10, 19.9, 20, 29, 30, 39.5, 40]
    assert [thrust.strength(t) for t in times] == [0, 0.5, 0.5, 0, 0, 0.5, 0.5, 0]
    assert COASTING.strength(0.0) == 0


def test_thrust_acts_in_its_sub_steps_only():
    x = low_orbit()
    burn, coast = (Orbit(thrust=t).path(x) for t in (BURN, COASTING))
    assert_array_equal(burn[:30], coast[:30])
    assert (burn[30] != coast[30]).any()
    gained = np.linalg.norm(burn[69, 3:]) - np.linalg.norm(coast[69, 3:])
    assert_allclose(gained, 40 * 0.45, rtol=0.01)
    late = Orbit(thrust=BURN).path(x, 70.0)
    assert_array_equal(late, coast)


def test_perigee_and_apogee():
    assert_allclose(perigee_apogee(low_orbit()), [500e3, 500e3], atol=1e-6)
    low, high = 6.9e6, 9.2e6
    speed = np.sqrt(MU * (2 / low - 2 / (low + high)))
    x = np.array([[0, low, 0, 0, 0, speed], [0, -high, 0, speed * low / high, 0, 0]])
    assert_allclose(perigee_apogee(x)[0], low - RE, atol=1e-6)
    assert_allclose(perigee_apogee(x)[1], high - RE, atol=1e-6)


REFUSED = {
    "mu": (lambda: Gravity(mu=0.0), "mu must be a positive number; found 0"),
    "radius": (lambda: Gravity(radius=-1.0), "radius must be a positive number; found -1"),
    "J2": (lambda: Gravity(J2=np.nan), "J2 must be .*found nan"),
    "magnitude": (lambda: Thrust(-0.1, ()), "magnitude must be at least 0; found -0.1"),
    "NaN thrust": (lambda: Thrust(np.nan, ()), "magnitude must be at least 0; found nan"),
    "reversed": (lambda: Thrust(1.0, ((20, 10),)), "arcs must be .*in order.*found"),
    "overlapping": (lambda: Thrust(1.0, ((0, 10), (5, 20))), "arcs must be .*in order.*found"),
    "integrator": (lambda: Orbit(integrator="rk5"), r"one of \['euler', 'rk4'\]; found 'rk5'"),
    "step": (lambda: Orbit(step=0.0), "step must be a positive number of seconds; found 0"),
    "substeps": (lambda: Orbit(substeps=0), "substeps must be an integer .*found 0"),
    "substeps: half": (lambda: Orbit(substeps=1.5), "substeps must be an integer .*found 1.5"),
    "Q: size": (lambda: Orbit(Q=np.eye(3)), r"Q must have shape .*6, 6.*found \(3, 3\)"),
    "Q: indefinite": (lambda: Orbit(Q=-np.eye(6)), "Q must be symmetric positive semi.*found"),
}


@pytest.mark.parametrize(("make", "message"), REFUSED.values(), ids=REFUSED)
def test_bad_input_is_refused_by_name(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_no_orbit_is_faster_than_the_one_on_the_ground():
    """Its pull is what keeps a point that turns so fast on the circle."""
    round_earth = replace(EARTH, J2=0.0)
    pull = round_earth.acceleration(np.array([EARTH.radius, 0.0, 0.0]))
    assert_allclose(pull, [-(EARTH.fastest**2) * EARTH.radius, 0, 0], rtol=1e-12)
