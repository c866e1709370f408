"""Earth-fixed flight: against an inertial integrator, JAX, differences and plain loops."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from geopotential import potential
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from navfilters.space import gravity
from navfilters.space.earth_fixed_orbit import EarthFixedOrbit
from navfilters.space.gravity import EARTH, Gravity
from navfilters.space.inertial_orbit import Orbit

W = 7.292115e-5
SCALE = np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3, 1e-6, 1e-6, 1e-6])  # m, m/s, rad of one size
HOUSTON = np.array(
    [-1108465.150, -6100044.949, 3397134.666, -1003.9419331, 3801.3289491, 6498.2536689]
)
Q_PSD = np.diag([3.5e-11] * 3 + [3.4e-13] * 3)
P0 = np.diag([1e6] * 3 + [100.0] * 3 + [3e-6] * 3)


def states(count=5):
    """About orbits of 500 to 900 km, in every direction."""
    rng = np.random.default_rng(0)
    r = rng.normal(size=(count, 3))
    r *= rng.uniform(6.9e6, 7.3e6, (count, 1)) / np.linalg.norm(r, axis=1, keepdims=True)
    v = np.cross(r, rng.normal(size=(count, 3)))
    v *= rng.uniform(7.2e3, 7.8e3, (count, 1)) / np.linalg.norm(v, axis=1, keepdims=True)
    return np.concatenate([r, v], axis=1)


def inertial_flight(x, seconds):
    """Two integrations of nothing in common: inertial DOP853, turned back at the end."""
    start = np.concatenate([x[:3], x[3:] + W * np.array([-x[1], x[0], 0])])
    flight = solve_ivp(
        lambda _, s: np.concatenate([s[3:], EARTH.acceleration(s[:3])]),
        (0, seconds),
        start,
        method="DOP853",
        rtol=1e-13,
        atol=1e-9,
    )
    r, v = flight.y[:3, -1], flight.y[3:, -1]
    v = v - W * np.array([-r[1], r[0], 0])
    c, s = np.cos(W * seconds), np.sin(W * seconds)
    back = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return np.concatenate([back @ r, back @ v])


def test_users_find_everything_in_orbit():
    assert EarthFixedOrbit is EarthFixedOrbit
    assert Gravity is gravity.Gravity
    assert EARTH is gravity.EARTH
    assert EarthFixedOrbit().rate == W


@pytest.mark.parametrize("x", [HOUSTON, *states(2)])
def test_flight_is_the_inertial_one_seen_from_the_earth(x):
    """600 s in steps of 0.833 s."""
    end = EarthFixedOrbit(step=600 / 720).path(x, 720)[-1]
    error = end - inertial_flight(x, 600.0)
    assert np.abs(error[:3]).max() < 1e-5
    assert np.abs(error[3:]).max() < 1e-8


def test_a_frame_that_does_not_turn_is_inertial():
    x = states()
    got = EarthFixedOrbit(rate=0.0).path(x, 100)
    assert_allclose(got[1:], Orbit().path(x), rtol=1e-14)
    F = EarthFixedOrbit(rate=0.0).transitions(got)
    wanted = Orbit().transitions(got)
    assert_allclose(
        F[..., :6, :6] * SCALE[:6] / SCALE[:6, None],
        wanted * SCALE[:6] / SCALE[:6, None],
        rtol=0,
        atol=1e-8,
    )


def test_acceleration_is_equations_8_and_9():
    w = np.array([0, 0, W])
    for x in states():
        local = EARTH.acceleration(x[:3]) - np.cross(w, np.cross(w, x[:3]))
        wanted = local - 2 * np.cross(w, x[3:])
        assert_allclose(EarthFixedOrbit().acceleration(x), wanted, rtol=1e-13)


def test_the_jacobi_integral_is_kept():
    """v^2/2 - U - |w x r|^2/2: Coriolis does no work, the centrifugal force has a potential."""
    path = EarthFixedOrbit().path(states(), 1000)
    r, v = path[..., :3], path[..., 3:]
    turning = W**2 * (r[..., 0] ** 2 + r[..., 1] ** 2) / 2
    integral = np.sum(v * v, axis=-1) / 2 - potential(r) - turning
    assert_allclose(integral, np.broadcast_to(integral[0], integral.shape), rtol=1e-12)


def test_jacobian_by_jax_and_by_blocks():
    x, dynamics = states(), EarthFixedOrbit()
    A = dynamics.jacobian(x)
    wanted = np.asarray(jax.jit(jax.vmap(jax.jacfwd(dynamics.derivative)))(x))
    scale = SCALE[:6] / SCALE[:6, None]
    assert_allclose(A[:, :6, :6] * scale, wanted * scale, rtol=0, atol=1e-13)
    assert_array_equal(A[:, 6:], 0)
    assert_array_equal(A[:, :, 6:], 0)
    w = W * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]])
    assert_allclose(A[0, 3:6, :3], EARTH.gradient(x[0, :3]) - w @ w, rtol=1e-14)
    assert_allclose(A[0, 3:6, 3:6], -2 * w)


@pytest.mark.parametrize(("integrator", "relative"), [("rk4", 1e-7), ("printed", 1e-10)])
def test_transitions_are_derivatives_of_the_flight(integrator, relative):
    """Differences over 50 s: second order in the step, and exact for the printed step."""
    x, dynamics = states(), EarthFixedOrbit(integrator=integrator)
    F = np.eye(9)
    for each in dynamics.transitions(dynamics.path(x, 50)):
        F = each @ F
    steps = np.eye(6)[:, None] * 100 * SCALE[:6]
    at = {k: dynamics.path(x + k * steps, 50)[-1] for k in (-2, -1, 1, 2)}
    difference = (8 * (at[1] - at[-1]) - (at[2] - at[-2])) / 12 / 100
    wanted = np.moveaxis(difference, 0, -1) / SCALE[:6, None]
    got = (F * SCALE / SCALE[:, None])[:, :6, :6]
    assert_allclose(got, wanted, rtol=0, atol=relative * np.abs(wanted).max())
    assert_array_equal(F[:, 6:, 6:], np.broadcast_to(np.eye(3), (5, 3, 3)))


def test_transitions_are_of_second_order():
    x = states()
    products = []
    for h in (80, 40, 20, 1):
        dynamics, F = EarthFixedOrbit(step=h), np.eye(9)
        for each in dynamics.transitions(dynamics.path(x, round(400 / h))):
            F = each @ F
        products.append(F * SCALE / SCALE[:, None])
    error = [np.abs(F - products[-1]).max() for F in products[:-1]]
    assert_allclose(np.log2(error[0] / error[1]), 2, atol=0.2)
    assert_allclose(np.log2(error[1] / error[2]), 2, atol=0.2)


def test_the_printed_integrator_is_equations_10_and_11():
    dynamics, x = EarthFixedOrbit(step=0.5, integrator="printed"), HOUSTON
    for got in dynamics.path(HOUSTON, 5)[1:]:
        r, v, a = x[:3], x[3:], dynamics.acceleration(x)
        x = np.concatenate([r + v * 0.5 + a * 0.5**2 / 2, v + a * 0.5])
        assert_allclose(got, x, rtol=1e-15)


@pytest.mark.parametrize(("rate", "drift"), [(1, 766), (10, 77)])
def test_the_printed_integrator_drifts(rate, drift):
    """766 m in 600 s at 1 Hz, 77 m at 10 Hz; Runge-Kutta does not."""
    exact = inertial_flight(HOUSTON, 600.0)[:3]
    for integrator, wanted, within in (("printed", drift, 0.5), ("rk4", 0, 1e-4)):
        dynamics = EarthFixedOrbit(step=1 / rate, integrator=integrator)
        end = dynamics.path(HOUSTON, 600 * rate)[-1, :3]
        assert_allclose(np.linalg.norm(end - exact), wanted, atol=within)


@pytest.mark.parametrize("integrator", ["rk4", "printed"])
def test_covariance_is_equation_12_step_by_step(integrator):
    dynamics = EarthFixedOrbit(Q_psd=Q_PSD, step=0.8, integrator=integrator)
    G = np.zeros((9, 6))
    G[3:6, :3] = G[6:, 3:] = np.eye(3)
    assert_array_equal(dynamics.G, G)
    x, wanted = HOUSTON, P0
    for _ in range(10):
        path = dynamics.path(x, 1)
        F = dynamics.transitions(path)[0]
        wanted = F @ wanted @ F.T + G @ Q_PSD @ G.T * 0.8
        x = path[1]
    end, P = dynamics.propagate(HOUSTON, P0, 10)
    assert_array_equal(end, x)
    assert_allclose(
        P / SCALE / SCALE[:, None], wanted / SCALE / SCALE[:, None], rtol=1e-12, atol=1e-6
    )
    assert_array_equal(P, P.T)


def test_covariance_is_that_of_many_flights():
    """Errors of the first state, flown; the misalignment's variance grows by Q_psd t."""
    rng = np.random.default_rng(3)
    flown = EarthFixedOrbit(Q_psd=Q_PSD, step=5.0)
    start = HOUSTON + rng.normal(size=(20000, 6)) * np.array([1000.0] * 3 + [10.0] * 3)
    sample = np.cov(flown.path(start, 40)[-1].T)
    _, P = flown.propagate(HOUSTON, P0, 40)
    deviation = np.sqrt(np.diag(P))[:6]
    assert_allclose(
        sample / deviation / deviation[:, None],
        P[:6, :6] / deviation / deviation[:, None],
        atol=0.03,
    )
    assert_allclose(np.diag(P)[6:], 3e-6 + 200 * 3.4e-13, rtol=1e-12)


@pytest.mark.parametrize("integrator", ["rk4", "printed"])
@pytest.mark.parametrize("batch", [(), (1,), (5,), (2, 3), (0,)])
def test_batch_axes_come_first_and_members_do_not_meet(batch, integrator):
    x = np.resize(states(), (*batch, 6))
    dynamics = EarthFixedOrbit(Q_psd=Q_PSD, integrator=integrator)
    end, P = dynamics.propagate(x, P0, 3)
    assert end.shape == (*batch, 6)
    assert P.shape == (*batch, 9, 9)
    for i in np.ndindex(batch):
        alone = dynamics.propagate(x[i], P0, 3)
        assert_array_equal(end[i], alone[0])
        assert_array_equal(P[i], alone[1])


def test_a_member_that_fails_stays_alone():
    x, dynamics = states(), EarthFixedOrbit()
    wanted = dynamics.propagate(x, P0, 3)
    x[2] = np.nan
    got, others = dynamics.propagate(x, P0, 3), [0, 1, 3, 4]
    assert np.isnan(got[1][2]).any()
    for a, b in zip(got, wanted, strict=True):
        assert_array_equal(a[others], b[others])


def test_the_same_source_compiles_under_jax():
    dynamics, x = EarthFixedOrbit(Q_psd=Q_PSD), states()
    step = jax.jit(lambda x, P: dynamics.propagate(x, P, 2))
    got = step(jnp.asarray(x), jnp.asarray(np.broadcast_to(P0, (5, 9, 9))))
    wanted = dynamics.propagate(x, P0, 2)
    assert_allclose(got[0], wanted[0], rtol=1e-14)
    assert_allclose(got[1], wanted[1], rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("integrator", ["rk4", "printed"])
def test_transitions_by_elements_are_the_series_of_the_jacobian(integrator):
    dynamics = EarthFixedOrbit(step=8.0, integrator=integrator)
    path = dynamics.path(states(), 3)
    wanted = np.asarray(dynamics.transitions(jnp.asarray(path)))  # JAX multiplies the matrices
    got = dynamics.transitions(path)
    assert_allclose(got * SCALE / SCALE[:, None], wanted * SCALE / SCALE[:, None], rtol=1e-13)


def test_noise_may_be_a_batch():
    many = Q_PSD * np.array([1.0, 4.0])[:, None, None]
    _, P = EarthFixedOrbit(Q_psd=many).propagate(HOUSTON, 0 * P0, 4)
    assert_allclose(P[1], 4 * P[0], rtol=1e-12)


REFUSED = {
    "integrator": ({"integrator": "euler"}, r"one of \['printed', 'rk4'\]; found 'euler'"),
    "rate": ({"rate": np.inf}, "rate must be a finite number of rad/s; found inf"),
    "step": ({"step": -1.0}, "step must be a positive number of seconds; found -1"),
    "Q_psd: size": ({"Q_psd": np.eye(9)}, r"Q_psd must have shape .*6, 6.*found \(9, 9\)"),
    "Q_psd: sign": ({"Q_psd": -np.eye(6)}, "Q_psd must be symmetric positive semi.*found"),
}


@pytest.mark.parametrize(("options", "message"), REFUSED.values(), ids=REFUSED)
def test_bad_input_is_refused_by_name(options, message):
    with pytest.raises(ValueError, match=message):
        replace(EarthFixedOrbit(), **options)
