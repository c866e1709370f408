"""The DT-EKF against Kalman filters written another way, filterpy, and SciPy's Riccati."""

from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import block_diag, solve_discrete_are

from navfilters import Gaussian, kalman_update, linearized
from navfilters.estimators.discrete import DiscreteSystem, extended_kalman_filter, predict, update
from navfilters.models import RangeBearing

# Three states, two inputs, two process noises, three measurement noises in two measurements.
F = np.array([[0.9, 0.2, 0.0], [-0.2, 0.95, 0.1], [0.0, 0.1, 0.8]])
B = np.array([[0.0, 0.3], [1.0, 0.0], [0.2, -0.5]])
L = np.array([[0.0, 0.1], [0.8, 0.0], [0.3, -0.6]])
H = np.array([[1.0, 0.0, 0.4], [0.0, -0.5, 1.0]])
M = np.array([[0.5, 0.1, 0.0], [0.0, 0.7, -0.3]])
Q = np.array([[0.5, 0.1], [0.1, 0.3]])
R = np.diag([0.2, 0.4, 0.1])
PRIOR = Gaussian(
    np.array([1.0, -0.5, 0.3]), np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.2], [0.0, -0.2, 0.5]])
)
STEPS = 30


def of(matrix, vector):
    return (matrix @ vector[..., None])[..., 0]


def grown(k):
    """A factor by which the matrices change from step to step."""
    return 1 + 0.1 * np.sin(k)


LINEAR = DiscreteSystem(
    lambda x, u, w, k: grown(k) * of(F, x) + of(B, u) + of(L, w) / grown(k),
    lambda x, v, k: of(H, x) / grown(k) + grown(k) * of(M, v),
    Q,
    R,
)


def signals(seed=0, members=()):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(STEPS, *members, 2)), rng.normal(size=(STEPS, *members, 2))


def kalman(y, u):
    """The prior and all noises as one Gaussian, conditioned on measurements 1 to k at once.

    No recursion. What this says of the state at step k is what a filter must say.
    """
    unknowns = block_diag(PRIOR.cov, *[Q] * STEPS, *[R] * STEPS)
    size = 3 + 5 * STEPS
    x, mean = np.eye(3, size), PRIOR.mean  # the state as a linear map of all unknowns, plus a mean
    rows, expected, means, covs = [], [], [PRIOR.mean], [PRIOR.cov]
    for k in range(STEPS):
        w = np.eye(2, size, 3 + 2 * k)
        x, mean = grown(k) * F @ x + L @ w / grown(k), grown(k) * F @ mean + B @ u[k]
        v = np.eye(3, size, 3 + 2 * STEPS + 3 * k)
        rows.append(H @ x / grown(k + 1) + grown(k + 1) * M @ v)
        expected.append(H @ mean / grown(k + 1))
        G = np.vstack(rows)
        gain = x @ unknowns @ G.T @ np.linalg.inv(G @ unknowns @ G.T)
        means.append(mean + gain @ (y[: k + 1].ravel() - np.concatenate(expected)))
        covs.append(x @ unknowns @ x.T - gain @ G @ unknowns @ x.T)
    return np.array(means), np.array(covs)


def test_linear_limit():
    y, u = signals()
    got = extended_kalman_filter(LINEAR, PRIOR, y, u)
    mean, cov = kalman(y, u)
    assert_allclose(got.mean, mean, atol=1e-12)
    assert_allclose(got.cov, cov, atol=1e-12)


def test_steady_state():
    system = DiscreteSystem(lambda x, u, w, k: F @ x + L @ w, lambda x, v, k: H @ x + M @ v, Q, R)
    got = extended_kalman_filter(system, PRIOR, np.zeros((200, 2)))
    last = Gaussian(got.mean[-1], got.cov[-1])
    wanted = solve_discrete_are(F.T, H.T, L @ Q @ L.T, M @ R @ M.T)
    assert_allclose(predict(system, last, np.zeros(0), 200).cov, wanted, atol=1e-13)


def test_covariances_are_exactly_symmetric():
    got = extended_kalman_filter(LINEAR, PRIOR, *signals())
    assert_array_equal(got.cov, got.cov.mT)
    assert np.linalg.eigvalsh(got.cov).min() > 0


def test_members_do_not_mix():
    y, u = signals(members=(4,))
    prior = Gaussian(PRIOR.mean + np.arange(4.0)[:, None], PRIOR.cov)
    got = extended_kalman_filter(LINEAR, prior, y, u)
    assert got.mean.shape == (STEPS + 1, 4, 3)
    assert got.cov.shape == (STEPS + 1, 4, 3, 3)
    for i in range(4):
        alone = extended_kalman_filter(LINEAR, Gaussian(prior.mean[i], PRIOR.cov), y[:, i], u[:, i])
        assert_allclose(got.mean[:, i], alone.mean, atol=1e-14)
        assert_allclose(got.cov[:, i], alone.cov, atol=1e-14)


def test_one_input_serves_all_members():
    y, u = signals(members=(4,))
    got = extended_kalman_filter(LINEAR, PRIOR, y, u[:, :1])
    wanted = extended_kalman_filter(LINEAR, PRIOR, y, np.repeat(u[:, :1], 4, axis=1))
    assert_array_equal(got.mean, wanted.mean)


# A nonlinear system, neither noise additive.


def f(x, u, w, k):
    speed = x[1] * np.exp(w[0]) + u[0]
    return np.stack([x[0] + 0.1 * speed, speed - 0.1 * np.sin(x[0]) * (1 + w[1]) + 0.01 * k])


def h(x, v, k):
    return np.stack([np.exp(0.3 * x[0]) * (1 + v[0]), x[0] * x[1] + np.sin(v[1]) + 0.1 * k])


NONLINEAR = DiscreteSystem(f, h, np.diag([0.1, 0.2]), np.diag([0.05, 0.02]))
START = Gaussian(np.array([0.8, -0.2]), np.array([[0.3, 0.05], [0.05, 0.1]]))


def differences(function, x):
    step = 1e-6
    return np.stack(
        [(function(x + step * e) - function(x - step * e)) / (2 * step) for e in np.eye(len(x))], -1
    )


def test_a_step_of_the_algorithm_box():
    """Eqs. (81)-(91) line by line, with difference quotients and a Joseph-form covariance."""
    u, y, zero = np.array([0.3]), np.array([1.1, 0.4]), np.zeros(2)
    x, P = START
    F_0 = differences(lambda x: f(x, u, zero, 6), x)
    L_0 = differences(lambda w: f(x, u, w, 6), zero)
    x_prior, P_prior = f(x, u, zero, 6), F_0 @ P @ F_0.T + L_0 @ NONLINEAR.Q @ L_0.T
    H_1 = differences(lambda x: h(x, zero, 7), x_prior)
    M_1 = differences(lambda v: h(x_prior, v, 7), zero)
    noise = M_1 @ NONLINEAR.R @ M_1.T
    K = P_prior @ H_1.T @ np.linalg.inv(H_1 @ P_prior @ H_1.T + noise)
    rest = np.eye(2) - K @ H_1

    prior = predict(NONLINEAR, START, u, 6)
    assert_allclose(prior.mean, x_prior, rtol=1e-15)
    assert_allclose(prior.cov, P_prior, rtol=1e-8)
    posterior = update(NONLINEAR, prior, y, 7)
    assert_allclose(posterior.mean, x_prior + K @ (y - h(x_prior, zero, 7)), rtol=1e-8)
    assert_allclose(posterior.cov, rest @ P_prior @ rest.T + K @ noise @ K.T, rtol=1e-7)


def test_the_filter_is_predict_then_update():
    """Step k - 1 and its input give the prior of step k, measurement k the posterior."""
    y, u = signals()
    got = extended_kalman_filter(NONLINEAR, START, y, u[:, :1])
    state = START
    for k in range(1, STEPS + 1):
        state = update(NONLINEAR, predict(NONLINEAR, state, u[k - 1, :1], k - 1), y[k - 1], k)
        assert_array_equal(got.mean[k], state.mean)
        assert_array_equal(got.cov[k], state.cov)
    assert_array_equal(got.mean[0], START.mean)


def test_the_noise_gain_is_at_the_estimate():
    """Range noise in proportion to the range: far away, the same P falls less."""
    system = DiscreteSystem(
        lambda x, u, w, k: x + w, lambda x, v, k: x * (1 + v), np.eye(1), 0.01 * np.eye(1)
    )
    for x in (0.5, 1.0, 20.0):
        got = update(system, Gaussian(np.array([x]), np.eye(1)), np.array([x]), 0)
        assert_allclose(got.cov, [[1 - 1 / (1 + 0.01 * x**2)]], rtol=1e-13)


def test_additive_noise_gives_the_update_of_every_other_filter():
    """With M = I: the moments of navfilters.linearized, to the last bit."""
    model = RangeBearing(np.diag([0.5, 0.01]))
    system = DiscreteSystem(
        lambda x, u, w, k: x + w,
        lambda x, v, k: model.h(x) + v,
        np.eye(2),
        model.R,
        H=lambda x, v, k: model.jacobian(x),
        M=lambda x, v, k: np.eye(2),
    )
    prior, z = Gaussian(np.array([20.0, 80.0]), 100 * np.eye(2)), np.array([90.0, 1.2])
    got, wanted = update(system, prior, z, 1), kalman_update(prior, z, linearized(prior, model))
    assert_array_equal(got.mean, wanted.mean)
    assert_allclose(got.cov, wanted.cov, rtol=1e-14)


def test_filterpy():
    """Additive noise, nonlinear f and h, two hundred steps."""

    def motion(x):
        return np.stack([x[0] + 0.1 * x[1], x[1] - np.sin(x[0]) / 10])

    def sensor(x):
        return np.stack([np.sin(x[0]), x[0] + x[1] ** 2])

    class Peer(ExtendedKalmanFilter):
        def predict_x(self, u=0):
            self.x = motion(self.x)

    additive = DiscreteSystem(
        lambda x, u, w, k: motion(x) + w,
        lambda x, v, k: sensor(x) + v,
        np.diag([0.01, 0.02]),
        np.diag([0.1, 0.3]),
    )
    peer = Peer(dim_x=2, dim_z=2)
    peer.x, peer.P, peer.Q, peer.R = START.mean, START.cov, additive.Q, additive.R
    y = np.random.default_rng(3).normal(size=(200, 2))
    got = extended_kalman_filter(additive, START, y)
    for k in range(200):
        peer.F = np.array([[1, 0.1], [-np.cos(peer.x[0]) / 10, 1]])
        peer.predict()
        peer.update(
            y[k], lambda x: np.array([[np.cos(x[0]), 0], [1, 2 * x[1]]]), lambda x: sensor(x)
        )
        assert_allclose(got.mean[k + 1], peer.x, atol=1e-11)
        assert_allclose(got.cov[k + 1], peer.P, atol=1e-11)


def test_jacobians_given_are_used():
    y, u = signals()
    wanted = extended_kalman_filter(LINEAR, PRIOR, y, u)
    given = replace(
        LINEAR,
        F=lambda x, u, w, k: grown(k) * F,
        L=lambda x, u, w, k: L / grown(k),
        H=lambda x, v, k: H / grown(k),
        M=lambda x, v, k: grown(k) * M,
    )
    got = extended_kalman_filter(given, PRIOR, y, u)
    assert_allclose(got.cov, wanted.cov, atol=1e-14)
    for name in "FLHM":
        doubled = replace(given, **{name: lambda *a, J=getattr(given, name): 2 * J(*a)})
        assert np.abs(extended_kalman_filter(doubled, PRIOR, y, u).cov - got.cov).max() > 0.1


def test_a_singular_innovation_is_nan_in_that_member_alone():
    system = DiscreteSystem(
        lambda x, u, w, k: x + w, lambda x, v, k: x + v, np.zeros((1, 1)), np.zeros((1, 1))
    )
    prior = Gaussian(np.zeros((2, 1)), np.array([[[0.0]], [[1.0]]]))
    got = extended_kalman_filter(system, prior, np.ones((1, 2, 1)))
    assert np.isnan(got.mean[1, 0]).all()
    assert_array_equal(got.mean[1, 1], [1.0])


GOOD = dict(zip(("y", "u"), signals(), strict=True)) | {"system": LINEAR, "prior": PRIOR}
BAD = [
    ({"system": 1}, TypeError, "system must be a DiscreteSystem; found int"),
    ({"prior": PRIOR.mean}, ValueError, r"prior must be a Gaussian\(mean, cov\); found ndarray"),
    ({"prior": Gaussian(np.ones(2), np.eye(2))}, ValueError, "system.f must return"),
    ({"prior": Gaussian(np.ones(3), -np.eye(3))}, ValueError, "prior.cov must be symmetric pos"),
    (
        {"prior": Gaussian(np.ones((4, 3)), np.eye(3)), "y": np.ones((STEPS, 5, 2))},
        ValueError,
        "bro",
    ),
    ({"y": 1.0}, ValueError, r"y must have shape \(K, \.\.\., p\); found \(\)"),
    ({"y": np.ones(STEPS)}, ValueError, r"y must have shape \(K, \.\.\., p\); found \(30,\)"),
    ({"y": np.ones((0, 2))}, ValueError, r"y must have shape .* found \(0, 2\)"),
    ({"y": np.ones((STEPS, 3))}, ValueError, r"system.h must return shape \(\.\.\., 3\)"),
    (
        {"y": np.full((STEPS, 2), np.nan)},
        ValueError,
        r"y must be .* finite .*nan at index \(0, 0\)",
    ),
    (
        {"u": np.ones((STEPS - 1, 2))},
        ValueError,
        "u must have one input per measurement, 30; f.* 29",
    ),
    ({"u": np.ones((STEPS, 3))}, ValueError, "system.f must return"),
    ({"u": None}, ValueError, r"system.f must return .* shapes \(3,\), \(0,\)"),
    ({"u": [["a"]]}, ValueError, "u must be an array .* of finite real numbers"),
    ({"system": replace(LINEAR, Q=np.eye(3))}, ValueError, "system.f must return"),
    ({"system": replace(LINEAR, R=np.eye(2))}, ValueError, "system.h must return"),
    ({"system": replace(LINEAR, F=lambda *a: L)}, ValueError, r"system.F must .*found \(3, 2\)"),
    ({"system": replace(LINEAR, L=lambda *a: F)}, ValueError, r"system.L must .*found \(3, 3\)"),
    ({"system": replace(LINEAR, H=lambda *a: M.T)}, ValueError, r"system.H must .*found \(3, 2\)"),
    ({"system": replace(LINEAR, M=lambda *a: Q[0])}, ValueError, r"system.M must .*found \(2,\)"),
    ({"system": replace(LINEAR, h=lambda x, v, k: x[:2].real + v[:2].real)}, TypeError, "system.h"),
]


@pytest.mark.parametrize(("change", "error", "message"), BAD)
def test_bad_input(change, error, message):
    with pytest.raises(error, match=message):
        extended_kalman_filter(**GOOD | change)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"f": 1}, TypeError, "f must be callable; found 1"),
        ({"h": None}, TypeError, "h must be callable; found None"),
        ({"M": np.eye(2)}, TypeError, "M must be callable"),
        ({"Q": -Q}, ValueError, "Q must be symmetric positive semidefinite"),
        ({"R": [1.0]}, ValueError, r"R must be an array \(\.\.\., n, n\)"),
    ],
)
def test_bad_system(change, error, message):
    with pytest.raises(error, match=message):
        replace(LINEAR, **change)


# Functions that no complex step goes through: refused before the first step, or in it.


def slowed(x, u, w, k):
    """Drag, which has the derivative 0 at rest, by any method."""
    return np.stack([x[..., 0] - 0.1 * x[..., 0] * abs(x[..., 0]) + w[..., 0]], -1)


def pushed(x, u, w, k):
    """The noise enters by its size, twice."""
    return np.stack([x[..., 0] + w[..., 0] + 0.3 * np.sqrt(np.vecdot(w + 1, w + 1))], -1)


def far(x, v, k):
    return np.stack([x[..., 0] + 0.01 * np.linalg.norm(x + 3, axis=-1) + v[..., 0]], -1)


def coloured(x, v, k):
    return np.stack([x[..., 0] + v[..., 0] + 0.5 * (v[..., 0] + 1).real], -1)


def bent_later(x, v, k):
    """Analytic at the prior, not where the filter ends."""
    x = x[..., :1]
    return np.where(x.real < 5, x, x + 0.1 * np.abs(x)) + v


SCALAR = DiscreteSystem(lambda x, u, w, k: x + w, lambda x, v, k: x + v, [[0.1]], [[0.1]])
AT_REST = Gaussian(np.zeros(1), np.eye(1))
HIDDEN = {
    "F": ({"f": slowed}, "system.f must be analytic .* component 0 in column 0"),
    "L": ({"f": pushed}, "system.f must be analytic"),
    "H": ({"h": far}, "system.h must be analytic"),
    "M": ({"h": coloured}, "system.h must be analytic"),
    "the last": ({"h": bent_later}, "system.h must be analytic"),
}


@pytest.mark.parametrize("case", HIDDEN)
@pytest.mark.parametrize("members", [(), (3,)])
def test_a_function_that_is_not_analytic_is_refused(case, members):
    change, message = HIDDEN[case]
    y = np.full((4, *members, 1), 8.0)
    with pytest.raises(TypeError, match=message):
        extended_kalman_filter(replace(SCALAR, **change), AT_REST, y)


def test_a_single_prediction_or_update_looks_too():
    state = Gaussian(np.ones(1), np.eye(1))
    with pytest.raises(TypeError, match=r"system\.f must be analytic"):
        predict(replace(SCALAR, f=slowed), state, np.zeros(0), 0)
    with pytest.raises(TypeError, match=r"system\.h must be analytic"):
        update(replace(SCALAR, h=far), state, np.ones(1), 1)


def test_with_its_jacobians_any_function_is_taken():
    system = replace(
        SCALAR,
        f=slowed,
        h=far,
        F=lambda x, u, w, k: 1 - 0.2 * np.abs(x[..., None]),
        H=lambda x, v, k: 1 + 0.01 * np.sign(x[..., None] + 3),
    )
    assert np.isfinite(extended_kalman_filter(system, AT_REST, np.ones((4, 1))).cov).all()


def test_the_steps_do_not_look_again():
    """Each further step costs the same few calls, for one member as for many."""
    calls = []

    def count(steps, members=()):
        def f(x, u, w, k):
            calls.append(k)
            return x + w

        calls.clear()
        extended_kalman_filter(replace(SCALAR, f=f), AT_REST, np.ones((steps, *members, 1)))
        return len(calls)

    for members in ((), (50,)):  # f itself, and a column of each of F and L
        assert count(30, members) - count(20, members) == 10 * 3
