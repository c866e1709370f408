"""CT-LKF and CT-EKF against the Kalman-Bucy filter, other integrations, and SciPy's Riccati."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from continuous_systems import (
    LINEAR,
    NONLINEAR,
    PRIOR,
    Q_TILDE,
    R_TILDE,
    SPAN,
    START,
    TIMES,
    A,
    B,
    C,
    L,
    M,
    Q,
    R,
    ekf,
    f,
    h,
    lkf,
    nonlinear_y,
    some_reference,
    trajectory,
    u,
    y,
)
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp
from scipy.linalg import solve_continuous_are

from navfilters import Gaussian
from navfilters.estimators.continuous import (
    ContinuousSystem,
    Reference,
    extended_kalman_bucy,
    linearized_kalman_bucy,
)


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
