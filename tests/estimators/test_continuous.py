"""CT-LKF and CT-EKF against the Kalman-Bucy filter, other integrations, and SciPy's Riccati."""

from dataclasses import replace
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import RK45, solve_ivp
from scipy.linalg import solve_continuous_are

from navfilters import Gaussian
from navfilters.estimators.continuous import extended_kalman_bucy, linearized_kalman_bucy
from navfilters.estimators.continuous_system import ContinuousSystem, Reference, reference_residual

# Three states, two inputs, two process noises, three measurement noises in two measurements.
A = np.array([[-0.4, 1.0, 0.2], [-1.5, -0.3, 0.0], [0.1, 0.5, -0.7]])
B = np.array([[0.0, 0.3], [1.0, 0.0], [0.2, -0.5]])
L = np.array([[0.0, 0.1], [0.8, 0.0], [0.3, -0.6]])
C = np.array([[1.0, 0.0, 0.4], [0.0, -0.5, 1.0]])
M = np.array([[0.5, 0.1, 0.0], [0.0, 0.7, -0.3]])
Q = np.array([[0.5, 0.1], [0.1, 0.3]])
R = np.diag([0.2, 0.4, 0.1])
Q_TILDE, R_TILDE = L @ Q @ L.T, M @ R @ M.T
PRIOR = Gaussian(
    np.array([1.0, -0.5, 0.3]), np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.2], [0.0, -0.2, 0.5]])
)
TIMES = np.linspace(0.5, 4.0, 12)
LINEAR = ContinuousSystem(
    lambda x, u, w, t: A @ x + B @ u + L @ w, lambda x, v, t: C @ x + M @ v, Q, R
)


def y(t):
    return np.array([np.sin(1.3 * t) + 0.2 * np.cos(9 * t), np.cos(0.7 * t)])


def u(t):
    return np.array([np.sin(2 * t), 0.5 - 0.1 * t])


def trajectory(rate, x0, times=TIMES):
    """An exact motion, from the first time to the last."""
    span = times[0], times[-1]
    return solve_ivp(rate, span, x0, "DOP853", dense_output=True, rtol=1e-11, atol=1e-11).sol


@cache
def some_reference(*, noisy=False):
    """Another input, another start and, if asked, reference noise: and it satisfies Eq. (6)."""
    other = lambda t: np.array([0.3 * t, np.cos(t)])  # noqa: E731
    w = (lambda t: np.array([0.7, np.sin(t)])) if noisy else None
    v = (lambda t: np.array([0.4, -0.9, np.cos(2 * t)])) if noisy else None
    noise = w or (lambda t: np.zeros(2))
    x = trajectory(lambda t, x: A @ x + B @ other(t) + L @ noise(t), [-2.0, 1.0, 4.0])
    return Reference(x, other, w, v)


def kalman_bucy():
    """Mean and full covariance at TIMES, the covariance from the exponential of the Hamiltonian."""
    S = C.T @ np.linalg.inv(R_TILDE) @ C
    rates, V = np.linalg.eig(np.block([[-A.T, S], [Q_TILDE, A]]))
    start = np.linalg.solve(V, np.vstack([np.eye(3), PRIOR.cov]))

    def P(t):
        X, Y = np.vsplit(((V * np.exp(rates * (t - TIMES[0]))) @ start).real, 2)
        return Y @ np.linalg.inv(X)

    def rate(t, x):
        K = P(t) @ C.T @ np.linalg.inv(R_TILDE)
        return A @ x + B @ u(t) + K @ (y(t) - C @ x)

    span = TIMES[0], TIMES[-1]
    mean = solve_ivp(rate, span, PRIOR.mean, "LSODA", t_eval=TIMES, rtol=1e-9, atol=1e-9).y.T
    return mean, np.array([P(t) for t in TIMES])


@pytest.fixture(scope="module")
def oracle():
    return kalman_bucy()


def lkf(reference=None, system=LINEAR, **options):
    reference = reference or some_reference()
    return linearized_kalman_bucy(system, reference, PRIOR, y, TIMES, u, **options)


def ekf(system=LINEAR, **options):
    return extended_kalman_bucy(system, PRIOR, y, TIMES, u, **options)


def assert_agree(got, mean, cov, atol=1e-7):
    assert_allclose(got.mean, mean, rtol=0, atol=atol)
    assert_allclose(got.cov, cov, rtol=0, atol=atol)


def test_linear_limit_of_the_ekf(oracle):
    assert_agree(ekf(), *oracle)


@pytest.mark.parametrize("noisy", [False, True], ids=["w_ref = 0", "w_ref and v_ref not 0"])
def test_linear_limit_of_the_lkf(oracle, noisy):
    """The reference, its input and its noise drop out; (28) as printed is off by 0.2 and more."""
    assert_agree(lkf(some_reference(noisy=noisy)), *oracle)


def test_the_reference_noise_matters(oracle):
    """The same trajectory without its noise is not a reference; with the check off, it is wrong."""
    silent = replace(some_reference(noisy=True), w=None, v=None)
    with pytest.raises(ValueError, match="reference must satisfy"):
        lkf(silent)
    assert np.abs(lkf(silent, residual_tol=np.inf).mean - oracle[0]).max() > 0.2


def test_by_default_the_input_is_the_references():
    reference = some_reference()
    got = linearized_kalman_bucy(LINEAR, reference, PRIOR, y, TIMES)
    wanted = extended_kalman_bucy(LINEAR, PRIOR, y, TIMES, reference.u)
    assert_agree(got, wanted.mean, wanted.cov)


@pytest.mark.parametrize("method", ["LSODA", "Radau"])
def test_another_integrator(oracle, method):
    assert_agree(ekf(method=method), *oracle, atol=1e-5)


@pytest.mark.parametrize("run", [lkf, ekf])
def test_tolerances_are_kept(oracle, run):
    error = [np.abs(run(rtol=e, atol=e).cov - oracle[1]).max() for e in (1e-3, 1e-6, 1e-9)]
    assert error[0] > 10 * error[1] > 100 * error[2]
    assert error[2] < 1e-8


@pytest.mark.parametrize("run", [lkf, ekf])
def test_the_covariance_is_exactly_symmetric(run):
    got = run()
    assert_array_equal(got.cov, got.cov.mT)
    between = got.at(np.linspace(TIMES[0], TIMES[-1], 77)).cov
    assert_array_equal(between, between.mT)
    assert np.linalg.eigvalsh(between).min() > 0


def test_steady_state():
    times = np.array([0.0, 30.0])
    got = extended_kalman_bucy(LINEAR, PRIOR, lambda t: np.zeros(2), times, lambda t: np.zeros(2))
    assert_allclose(got.cov[-1], solve_continuous_are(A.T, C.T, Q_TILDE, R_TILDE), atol=1e-8)


def test_dense_output():
    got = lkf()
    assert_array_equal(got.t, TIMES)
    assert got.mean.shape == (12, 3)
    assert got.cov.shape == (12, 3, 3)
    assert_array_equal(got.at(TIMES).mean, got.mean)
    assert_array_equal(got.at(TIMES[3]).cov, got.cov[3])
    assert got.at(TIMES.reshape(3, 4)).cov.shape == (3, 4, 3, 3)
    assert_allclose(got.mean[0], PRIOR.mean, atol=1e-14)
    assert_array_equal(got.cov[0], PRIOR.cov)
    finer = linearized_kalman_bucy(LINEAR, some_reference(), PRIOR, y, np.linspace(0.5, 4.0, 40), u)
    assert_allclose(finer.mean, got.at(finer.t).mean, atol=1e-12)
    assert got.at(4.0 + 1e-15).mean.shape == (3,)
    for outside in (0.49, [1.0, 4.1]):
        with pytest.raises(ValueError, match=r"times must be within 0\.5 to 4; found"):
            got.at(outside)


@pytest.mark.parametrize("scale", [(1e-3, 1.0, 1e6), (1e-6, 1e-6, 1e-6)])
def test_units_do_not_decide(scale):
    """The same system in kilometres and in microns takes the same steps."""
    D, D_inv = np.diag(scale), np.diag(1 / np.array(scale))
    system = ContinuousSystem(
        lambda x, u, w, t: D @ (A @ (D_inv @ x) + B @ u + L @ w),
        lambda x, v, t: C @ (D_inv @ x) + M @ v,
        Q,
        R,
    )
    prior = Gaussian(D @ PRIOR.mean, D @ PRIOR.cov @ D)
    got, wanted = extended_kalman_bucy(system, prior, y, TIMES, u), ekf()
    assert_allclose(got.mean / scale, wanted.mean, atol=1e-11)
    assert_allclose(D_inv @ got.cov @ D_inv, wanted.cov, atol=1e-11)


# A nonlinear system with gains that depend on state and time, and no input.


def f(x, u, w, t, xp=np):
    return xp.stack([x[1] + 0.1 * t, -xp.sin(x[0]) + (1 + x[0] ** 2) * w[0] + x[1] * w[1] ** 2])


def h(x, v, t, xp=np):
    return xp.stack([xp.exp(0.3 * x[0]) * (1 + v[0]) + 0.01 * t * v[1]])


NONLINEAR = ContinuousSystem(f, h, np.diag([0.1, 0.2]), np.diag([0.05, 0.02]))
START = Gaussian(np.array([0.8, -0.2]), np.diag([0.3, 0.1]))
SPAN = np.linspace(0.0, 3.0, 6)


def nonlinear_y(t):
    return np.array([1.2 + 0.3 * np.sin(2 * t)])


def test_ekf_against_an_independent_integration():
    """Eqs. (36)-(37) with Jacobians by hand, the whole of P, another integrator."""

    def rate(t, s):
        (a, b), P = s[:2], s[2:].reshape(2, 2)
        F = np.array([[0, 1], [-np.cos(a), 0]])
        G = np.array([0, 1 + a**2])  # the second noise enters squared: no gain at w = 0
        e = np.exp(0.3 * a)
        c, r = np.array([0.3 * e, 0]), e**2 * 0.05 + (0.01 * t) ** 2 * 0.02
        K = P @ c / r
        x = np.array([b + 0.1 * t, -np.sin(a)]) + K * (nonlinear_y(t)[0] - e)
        P_dot = F @ P + P @ F.T - np.outer(K, K) * r + 0.1 * np.outer(G, G)
        return np.concatenate([x, P_dot.ravel()])

    s0 = np.concatenate([START.mean, START.cov.ravel()])
    s = solve_ivp(rate, (0, 3), s0, "LSODA", t_eval=SPAN, rtol=1e-11, atol=1e-11).y.T
    got = extended_kalman_bucy(NONLINEAR, START, nonlinear_y, SPAN)
    assert_agree(got, s[:, :2], s[:, 2:].reshape(-1, 2, 2))


def test_lkf_against_an_independent_integration():
    """Eqs. (15), (28)-(30), with the means of w~ and v~, by automatic differentiation, all of P."""

    def w(t):
        return np.array([0.2 * np.cos(t), 0.3])

    def v(t):
        return np.array([0.1, np.sin(t)])

    x_ref = trajectory(lambda t, x: f(x, None, w(t), t), [0.5, 0.1], SPAN)
    F, G = (jax.jit(jax.jacfwd(lambda x, w, t: f(x, None, w, t, jnp), i)) for i in (0, 1))
    H, N = (jax.jit(jax.jacfwd(lambda x, v, t: h(x, v, t, jnp), i)) for i in (0, 1))

    def rate(t, s):
        z, P, at, sensing = s[:2], s[2:].reshape(2, 2), (x_ref(t), w(t), t), (x_ref(t), v(t), t)
        a, g, c, m = map(np.asarray, (F(*at), G(*at), H(*sensing), N(*sensing)))
        r = (m @ NONLINEAR.R @ m.T).item()
        K = P @ c[0] / r
        residual = nonlinear_y(t) - h(*sensing) - c @ z + m @ v(t)
        P_dot = a @ P + P @ a.T - np.outer(K, K) * r + g @ NONLINEAR.Q @ g.T
        return np.concatenate([a @ z - g @ w(t) + K * residual, P_dot.ravel()])

    s0 = np.concatenate([START.mean - x_ref(0.0), START.cov.ravel()])
    s = solve_ivp(rate, (0, 3), s0, "LSODA", t_eval=SPAN, rtol=1e-9, atol=1e-9).y.T
    got = linearized_kalman_bucy(NONLINEAR, Reference(x_ref, w=w, v=v), START, nonlinear_y, SPAN)
    assert_agree(got, s[:, :2] + x_ref(SPAN).T, s[:, 2:].reshape(-1, 2, 2), atol=1e-6)


def test_jacobians_given_are_used_and_agree_with_those_computed():
    def with_jax(function, position):
        J = jax.jit(jax.jacfwd(lambda *a: function(*a, jnp), position))
        return lambda *a: np.asarray(J(*a))

    given = {"A": (f, 0), "L": (f, 2), "C": (h, 0), "M": (h, 1)}
    system = replace(NONLINEAR, **{name: with_jax(*args) for name, args in given.items()})
    got = extended_kalman_bucy(system, START, nonlinear_y, SPAN)
    wanted = extended_kalman_bucy(NONLINEAR, START, nonlinear_y, SPAN)
    assert_agree(got, wanted.mean, wanted.cov, atol=1e-12)
    wrong = replace(system, L=lambda *a: 2 * system.L(*a))
    assert extended_kalman_bucy(wrong, START, nonlinear_y, SPAN).cov[-1, 1, 1] > got.cov[-1, 1, 1]


def test_a_replaced_function_takes_its_own_jacobian():
    changed = replace(NONLINEAR, h=lambda x, v, t: 2 * h(x, v, t))
    at = START.mean, np.zeros(2), 1.0
    assert_allclose(changed.jacobian("C")(*at), 2 * NONLINEAR.jacobian("C")(*at))


# The reference's own dynamics.


def fall(t):
    """Ten units per time squared, where f says nine."""
    return np.array([5 * t**2, 10 * t])


FALLING = ContinuousSystem(
    lambda x, u, w, t: np.stack([x[1] + 0 * w[0], 9.0 + w[0]]),
    lambda x, v, t: x[:1] + v,
    [[1]],
    [[1]],
)


def falling(reference, **options):
    prior = Gaussian(np.zeros(2), np.eye(2))
    times = np.linspace(0, 2, 3)
    return linearized_kalman_bucy(
        FALLING, reference, prior, lambda t: np.zeros(1), times, **options
    )


def test_the_residual_is_what_is_missing():
    times, residual = reference_residual(FALLING, Reference(fall), np.linspace(0, 2, 3))
    assert times.shape == (200,)
    assert_allclose(residual, np.tile([0.0, 1.0], (200, 1)), atol=1e-11)


@pytest.mark.parametrize("t", [np.arange(0, 2.05, 0.1), [0, 1, 1 + 1e-12, 2], [0, 0.1, 2]])
def test_output_times_do_not_decide_the_residual(t):
    times, residual = reference_residual(FALLING, Reference(fall), np.array(t))
    assert len(times) >= 200
    assert_allclose(residual, np.tile([0.0, 1.0], (len(times), 1)), atol=1e-9)


def test_a_false_reference_is_rejected_with_the_residual_found():
    message = (
        r"reference must satisfy dx/dt = f\(x, u, w, t\) to 1e-06 of its rates; found a residual "
        r"of 1 in component 1 at t = .*, where at most 9e-06 is allowed"
    )
    with pytest.raises(ValueError, match=message):
        falling(Reference(fall))


def test_the_worst_time_is_named():
    def kicked(t):
        late = max(t - 1.5, 0)
        return np.array([4.5 * t**2 + late**3, 9 * t + 3 * late**2])

    with pytest.raises(ValueError, match=r"residual of 2\.9\d in component 1 at t = 1\.99"):
        falling(Reference(kicked))


def test_the_tolerance_is_an_argument():
    assert falling(Reference(fall), residual_tol=0.2).mean.shape == (3, 2)


def test_the_reference_noise_may_be_what_was_missing():
    assert falling(Reference(fall, w=lambda t: np.ones(1))).mean.shape == (3, 2)


@pytest.mark.parametrize("angle", [0.0, np.pi, 3 * np.pi])
def test_an_equilibrium_is_a_reference(angle):
    """f is 1e-16 there, not 0: the lecture's own example of a nominal trajectory."""
    pendulum = ContinuousSystem(
        lambda x, u, w, t: np.stack([x[1], -10 * np.sin(x[0]) + w[0]]),
        lambda x, v, t: x[:1] + v,
        [[0.1]],
        [[0.1]],
    )
    still = np.array([angle, 0.0])
    got = linearized_kalman_bucy(
        pendulum,
        Reference(lambda t: still),
        Gaussian(still, 0.01 * np.eye(2)),
        lambda t: still[:1],
        [0.0, 1.0],
    )
    assert_allclose(got.mean, [still, still], atol=1e-12)


def test_a_reference_integrated_carelessly_is_caught():
    careless = solve_ivp(
        lambda t, x: f(x, None, np.zeros(2), t), (0, 3), [0.5, 0.1], dense_output=True
    )
    with pytest.raises(ValueError, match="reference must satisfy"):
        linearized_kalman_bucy(NONLINEAR, Reference(careless.sol), START, nonlinear_y, SPAN)


# Bad input.

GOOD = {"system": LINEAR, "prior": PRIOR, "y": y, "t": TIMES, "u": u}
BAD = [
    ({"system": "s"}, TypeError, "system must be a ContinuousSystem; found str"),
    ({"prior": (1, 2)}, ValueError, r"prior must be a Gaussian\(mean, cov\); found tuple"),
    ({"prior": Gaussian(np.ones(2), np.eye(2))}, ValueError, r"must return shape .* \(2,\)"),
    (
        {"prior": Gaussian(np.ones((4, 3)), np.eye(3))},
        ValueError,
        r"prior must have shapes \(n,\) and \(n, n\), no batch axes; found \(4, 3\)",
    ),
    ({"prior": Gaussian(np.ones(3), -np.eye(3))}, ValueError, "prior.cov must be symmetric pos"),
    ({"prior": Gaussian(np.array([0, np.nan, 0]), np.eye(3))}, ValueError, "prior.mean must be"),
    ({"y": np.ones(2)}, TypeError, "y must be a function of time; found ndarray"),
    ({"y": None}, TypeError, "y must be a function of time; found NoneType"),
    ({"y": lambda t: 1.0}, ValueError, r"y must return shape \(m,\), finite; found shape \(\)"),
    ({"y": lambda t: np.ones(3)}, ValueError, r"system.h must return shape \(\.\.\., 3\)"),
    (
        {"y": lambda t: np.array([1, np.nan])},
        ValueError,
        r"y must return .* found .*nan.* t = 0\.5",
    ),
    ({"y": lambda t: np.ones(2) * (t < 3) / (t < 3)}, ValueError, "y must return .* at t = [3-6]"),
    ({"y": lambda t: np.ones(2 + (t > 3))}, ValueError, r"y must return shape \(2,\).*\(3,\) at t"),
    ({"t": 1.0}, ValueError, r"t must be an array \(\.\.\., k\)"),
    ({"t": [1.0]}, ValueError, "t must be at least two increasing times"),
    ({"t": [1.0, 1.0]}, ValueError, "t must be at least two increasing times"),
    ({"t": [0.0, np.inf]}, ValueError, "t must be .* finite"),
    ({"t": np.ones((2, 2))}, ValueError, "t must be at least two increasing times"),
    ({"u": np.ones(2)}, TypeError, "u must be a function of time; found ndarray"),
    ({"u": lambda t: np.ones(2, complex)}, ValueError, "u must return shape"),
    ({"rtol": 0.0}, ValueError, "rtol must be in"),
    ({"rtol": np.nan}, ValueError, "rtol must be in"),
    ({"atol": -1.0}, ValueError, "atol must be a finite positive"),
    ({"method": "Euler"}, ValueError, "method"),
    ({"system": replace(LINEAR, R=np.zeros((3, 3)))}, ValueError, "M R M.*system.M and system.R"),
    ({"system": replace(LINEAR, R=np.eye(2))}, ValueError, "system.h must return"),
    ({"system": replace(LINEAR, Q=np.eye(3))}, ValueError, "system.f must return"),
    ({"system": replace(LINEAR, A=lambda *a: np.eye(2))}, ValueError, r"system.A .*found \(2, 2\)"),
    ({"system": replace(LINEAR, L=lambda *a: A)}, ValueError, r"system.L must .*found \(3, 3\)"),
    ({"system": replace(LINEAR, C=lambda *a: C.T)}, ValueError, r"system.C must .*\(3, 2\)"),
    ({"system": replace(LINEAR, M=lambda *a: C[0])}, ValueError, r"system.M must .*found \(3,\)"),
    ({"system": replace(LINEAR, h=lambda x, v, t: abs(x[:2] + v[:2]))}, TypeError, "system.h must"),
]


@pytest.mark.parametrize("filter_", [linearized_kalman_bucy, extended_kalman_bucy])
@pytest.mark.parametrize(("change", "error", "message"), BAD)
def test_bad_input(filter_, change, error, message):
    arguments = GOOD | change
    if filter_ is linearized_kalman_bucy:
        arguments["reference"] = some_reference()
        if "prior" in change and "return" in message:
            message = r"reference.x must return shape \(2,\), finite; found shape \(3,\)"
    with np.errstate(all="ignore"), pytest.raises(error, match=message):
        filter_(**arguments)


@pytest.mark.parametrize(
    ("reference", "error", "message"),
    [
        (None, TypeError, "reference must be a Reference; found NoneType"),
        (Reference(None), TypeError, "reference.x must be a function of time"),
        (Reference(lambda t: np.ones(2)), ValueError, r"reference.x must return shape \(3,\)"),
        (replace(some_reference(), u=3.0), TypeError, "reference.u must be a function of time"),
        (replace(some_reference(), u=None), ValueError, r"u must return shape \(0,\)"),
        (replace(some_reference(), w=lambda t: np.ones(3)), ValueError, r"reference.w .*\(2,\)"),
        (replace(some_reference(), v=lambda t: np.ones(2)), ValueError, r"reference.v .*\(3,\)"),
    ],
)
def test_bad_reference(reference, error, message):
    with pytest.raises(error, match=message):
        linearized_kalman_bucy(LINEAR, reference, PRIOR, y, TIMES, u)


def test_only_the_lkf_needs_the_inputs_jacobian():
    wrong = replace(LINEAR, B=lambda *a: A)
    with pytest.raises(
        ValueError, match=r"system.B must return .*\(\.\.\., 3, 2\).*found \(3, 3\)"
    ):
        lkf(system=wrong)
    assert_array_equal(ekf(wrong).mean, ekf().mean)


def test_a_gain_that_vanishes_on_the_way_is_reported_with_its_time():
    system = replace(LINEAR, M=lambda x, v, t: M * (t < 2))
    with pytest.raises(
        ValueError, match=r"M R M\^T, .* must be positive definite; found .* t = [2-6]"
    ):
        ekf(system)


def test_an_integration_that_stops_says_where():
    """dx/dt = x^2 from 1 escapes at t = 1; the measurement says nothing."""
    escape = ContinuousSystem(lambda x, u, w, t: x**2 + w, lambda x, v, t: 0 * x + v, [[0]], [[1]])
    prior = Gaussian(np.ones(1), np.zeros((1, 1)))
    with pytest.raises(RuntimeError, match=r"integration stopped at t = (1|0\.99)"):
        extended_kalman_bucy(escape, prior, lambda t: np.zeros(1), [0.0, 2.0])


# Functions that no complex step goes through.

PLAIN = ContinuousSystem(lambda x, u, w, t: -x + w, lambda x, v, t: x + v, [[0.1]], [[0.1]])
HIDDEN = {
    "A": {"f": lambda x, u, w, t: -x - 0.1 * x * abs(x) + w},
    "L": {"f": lambda x, u, w, t: -x + w + 0.1 * np.linalg.norm(w + 1)},
    "C": {"h": lambda x, v, t: x + 0.1 * np.sqrt(np.vecdot(x + 2, x + 2)) + v},
    "M": {"h": lambda x, v, t: x + v + 0.1 * (v + 1).real},
    "A, where it ends": {
        "f": lambda x, u, w, t: np.where(x.real < 5, 3 + 0 * x, 3 + abs(x - 5)) + w
    },
}


@pytest.mark.parametrize("case", HIDDEN)
def test_a_function_that_is_not_analytic_is_refused(case):
    system = replace(PLAIN, **HIDDEN[case])
    prior = Gaussian(np.zeros(1), np.eye(1))
    with pytest.raises(TypeError, match=r"system\.[fh] must be analytic"):
        extended_kalman_bucy(system, prior, lambda t: 8 * np.ones(1), [0.0, 3.0])


@pytest.mark.parametrize("case", ["A", "L", "C", "M"])
def test_it_is_refused_about_a_reference(case):
    system = replace(PLAIN, **HIDDEN[case])
    x = solve_ivp(
        lambda t, x: system.f(x, np.zeros(0), np.zeros(1), t),
        (0, 3),
        [2.0],
        rtol=1e-10,
        atol=1e-10,
        dense_output=True,
    ).sol
    prior = Gaussian(np.zeros(1), np.eye(1))
    with pytest.raises(TypeError, match=r"system\.[fh] must be analytic"):
        linearized_kalman_bucy(system, Reference(x), prior, lambda t: np.ones(1), [0.0, 3.0])


def test_the_inputs_jacobian_too():
    system = replace(PLAIN, f=lambda x, u, w, t: -x + w + 0.1 * abs(u) + u)
    u = lambda t: np.ones(1)  # noqa: E731
    x = solve_ivp(lambda t, x: -x + 1.1, (0, 3), [2.0], "DOP853", dense_output=True, rtol=1e-11).sol
    prior = Gaussian(np.zeros(1), np.eye(1))
    with pytest.raises(TypeError, match=r"system\.f must be analytic"):
        linearized_kalman_bucy(system, Reference(x, u), prior, lambda t: np.ones(1), [0.0, 3.0])


# A covariance that falls, or rises, by many decades.


def scalar(a, q, r):
    """dx/dt = a x + w,   y = x + v."""
    return ContinuousSystem(lambda x, u, w, t: a * x + w, lambda x, v, t: x + v, [[q]], [[r]])


def scalar_riccati(a, q, r, p, t):
    """The variance, in closed form."""
    rate = np.sqrt(a * a + q / r)
    th = np.tanh(rate * t) / rate if rate else t
    return (p + (a * p + q) * th) / (1 + (p / r - a) * th)


@pytest.mark.parametrize("p", [0.0, 1e-12, 1.0, 1e6, 1e9, 1e12])
@pytest.mark.parametrize("r", [1e-6, 1e-2])
@pytest.mark.parametrize(("a", "q"), [(0.0, 0.0), (-1.0, 1e-8), (0.5, 1.0)])
@pytest.mark.parametrize("start", [0.0, 0.5])
def test_a_variance_over_many_decades(a, q, r, p, start):
    """Digits of the variance that is asked for, not of the prior's, from a microsecond on."""
    after = np.array([0.0, 1e-6, 1e-3, 0.1, 1.0])
    prior = Gaussian(np.zeros(1), np.array([[p]]))
    got = extended_kalman_bucy(scalar(a, q, r), prior, lambda t: np.ones(1), start + after)
    wanted = scalar_riccati(a, q, r, p, after)
    assert_allclose(got.cov[:, 0, 0], wanted, rtol=1e-5, atol=0)
    if a == q == 0 and p > 0:
        mean = after / (r / p + after)
        assert (np.abs(got.mean[:, 0] - mean) <= 1e-5 * np.sqrt(wanted) + 1e-7).all()


@pytest.mark.parametrize("method", ["RK45", "LSODA", "Radau", "BDF"])
def test_every_integrator_follows(method):
    prior = Gaussian(np.zeros(1), np.array([[1e12]]))
    options = {"rtol": 1e-6, "atol": 1e-6, "method": method}
    times = np.array([0.0, 1e-3, 1.0])
    got = extended_kalman_bucy(scalar(0, 0, 1e-3), prior, lambda t: np.ones(1), times, **options)
    assert_allclose(got.cov[:, 0, 0], scalar_riccati(0, 0, 1e-3, 1e12, times), rtol=1e-2)


@pytest.mark.parametrize("vague", [1e3, 1e6, 1e9, 1e12])
@pytest.mark.parametrize("r", [1e-6, 1e-2])
def test_position_and_velocity_from_a_vague_prior(vague, r):
    """P^-1 = F^-T (P_0^-1 + W) F^-1: what the measurements of the position add up to."""
    system = ContinuousSystem(
        lambda x, u, w, t: np.stack([x[1] + 0 * w[0], 0 * x[0] + 0 * w[0]]),
        lambda x, v, t: x[:1] + v,
        [[0.0]],
        [[r]],
    )
    prior = Gaussian(np.zeros(2), vague * np.eye(2))
    times = np.array([0.0, 0.01, 1.0, 10.0])
    got = extended_kalman_bucy(system, prior, lambda t: np.ones(1), times)
    for t, P in zip(times[1:], got.cov[1:], strict=True):
        F = np.array([[1, t], [0, 1]])
        W = np.array([[t, t**2 / 2], [t**2 / 2, t**3 / 3]]) / r
        wanted = F @ np.linalg.inv(np.eye(2) / vague + W) @ F.T
        size = np.sqrt(np.diagonal(wanted))
        assert_allclose(P / np.outer(size, size), wanted / np.outer(size, size), atol=1e-4)
        assert np.linalg.eigvalsh(P / np.outer(size, size)).min() > 0


def test_a_state_known_exactly_in_tiny_units():
    """Position known, in a unit in which the noise is 1e-24: the variance grows as q t^3 / 3."""
    system = ContinuousSystem(
        lambda x, u, w, t: np.stack([x[1] + 0 * w[0], 0 * x[0] + w[0]]),
        lambda x, v, t: x[:1] + v,
        [[1e-24]],
        [[1e6]],
    )
    prior = Gaussian(np.zeros(2), np.zeros((2, 2)))
    got = extended_kalman_bucy(system, prior, lambda t: np.zeros(1), [0.0, 1.0, 2.0])
    t = got.t[:, None, None]
    wanted = 1e-24 * np.block([[t**3 / 3, t**2 / 2], [t**2 / 2, t]])
    assert_allclose(got.cov, wanted, rtol=1e-5)


class Faulty(RK45):
    """An integrator that takes too much from a variance in the fourth step."""

    def _step_impl(self):
        done = super()._step_impl()
        self.steps = getattr(self, "steps", 0) + 1
        if self.steps == 4:
            self.y[1] = -1e-3 * abs(self.y[1])
        return done


def test_a_covariance_that_is_lost_is_reported():
    """Also where no output is asked for, with the time and what to do."""
    prior = Gaussian(np.zeros(1), np.ones((1, 1)))
    message = r"covariance is lost at t = 0\..* eigenvalue is -.*Reduce rtol and atol \(now 1e-08"
    with pytest.raises(RuntimeError, match=message):
        extended_kalman_bucy(
            scalar(0, 1, 1), prior, lambda t: np.zeros(1), [0.0, 3.0], method=Faulty
        )
