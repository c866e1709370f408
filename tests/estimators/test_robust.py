"""xiong2009's filters against the printed formulas with plain inverses, and the theory's bounds.

The references here run one member at a time, with numpy.linalg and no line of the library.
"""

from dataclasses import dataclass

import jax
import numpy as np
import pytest
import scipy.linalg
from naive import covariances, kalman, quadratic
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import Gaussian
from navfilters.estimators.adaptive import AdaptiveEKF, _expm
from navfilters.estimators.extended import ExtendedKalman
from navfilters.estimators.robust import AdaptiveRobustEKF, RobustEKF, trace_ratio
from navfilters.models import Linear
from navfilters.papers import xiong2009

inv = np.linalg.inv


@dataclass(frozen=True, eq=False)
class Swing:
    """f(x) = G x + sin(x) / 5: any size, a Jacobian that depends on the state."""

    G: np.ndarray
    Q: np.ndarray

    def transition(self, x):
        xp = x.__array_namespace__()
        F = self.G + xp.cos(x)[..., None] * xp.eye(x.shape[-1]) / 5
        return (self.G @ x[..., None])[..., 0] + xp.sin(x) / 5, F


@dataclass(frozen=True, eq=False)
class Matched:
    """f(x) = G x, with a Jacobian that is off by beta: Eq. (15) holds with this beta, exactly."""

    G: np.ndarray
    beta: np.ndarray
    Q: np.ndarray

    def transition(self, x):
        return (self.G @ x[..., None])[..., 0], inv(self.beta) @ self.G + 0 * x[..., None]


class SubStepped(Swing):
    """Three sub-steps' worth of noise."""

    def accumulate(self, Q, x):
        return 3 * Q


@dataclass(frozen=True, eq=False)
class Problem:
    prior: Gaussian
    z: np.ndarray  # (steps, members, m)
    dynamics: Swing
    sensor: object
    directions: np.ndarray


def problem(n=3, m=2, members=4, steps=30, noise=4.0, dynamics=Swing):
    """Measurements that wander, so that innovations are correlated and sometimes large."""
    rng = np.random.default_rng(10 * n + m)
    G = 0.9 * np.linalg.qr(rng.normal(size=(n, n)))[0]
    sensor = quadratic(rng, m, n)
    sensor = type(sensor)(sensor.H, 0.02 * sensor.A, sensor.R)
    z = noise * np.cumsum(rng.normal(size=(steps, members, m)), axis=0) / 2
    prior = Gaussian(rng.normal(size=(members, n)), covariances(rng, (members,), n))
    moved = dynamics(G, 0.2 * covariances(rng, (), n))
    return Problem(prior, z, moved, sensor, rng.normal(size=(n, m)) / np.sqrt(n))


def go(estimator, p, steps=None, prior=None, z=None):
    """Every state of a run."""
    states = [estimator.init(prior or p.prior)]
    z = p.z if z is None else z
    for measured in z[:steps]:
        states.append(estimator.step(states[-1], measured, p.dynamics, p.sensor))
    return states


FILTERS = {
    "EKF": lambda p: ExtendedKalman(),
    "REKF": lambda p: RobustEKF(gamma=1.5),
    "AEKF": lambda p: AdaptiveEKF(a=0.5, N=8, directions=p.directions),
    "AEKF, current": lambda p: AdaptiveEKF(a=0.5, N=8, directions=p.directions, current=True),
    "AREKF": lambda p: AdaptiveRobustEKF(),
}
every_filter = pytest.mark.parametrize("name", FILTERS)
sizes = pytest.mark.parametrize(("n", "m"), [(1, 1), (3, 2), (6, 2), (4, 3)])


# --- the printed formulas, one member and one step at a time ------------------------------------


def printed_prediction(x, P, dynamics, Q=None):
    """Eqs. (3), (4)."""
    x, F = dynamics.transition(x)
    return x, F @ P @ F.T + (dynamics.Q if Q is None else Q)


def printed_update(x, Sigma, z, sensor):
    """Eqs. (6)-(9), the covariance by (9) itself."""
    H = sensor.jacobian(x)
    K = Sigma @ H.T @ inv(H @ Sigma @ H.T + sensor.R)
    return x + K @ (z - sensor.h(x)), inv(inv(Sigma) + H.T @ inv(sensor.R) @ H)


def printed_ekf(estimates, z, p):
    for (x, P), measured in zip(estimates, z, strict=True):
        yield printed_update(*printed_prediction(x, P, p.dynamics), measured, p.sensor)


def printed_rekf(estimates, z, p, gamma=1.5):
    for (x, P), measured in zip(estimates, z, strict=True):
        x, P = printed_prediction(x, P, p.dynamics)
        if gamma > np.sqrt(np.linalg.eigvalsh(P).max()):
            P = inv(inv(P) - gamma**-2 * np.eye(len(x)))
        yield printed_update(x, P, measured, p.sensor)


def printed_aekf(estimates, z, p, a=0.5, k=2, N=8, current=False):
    """(46) with its sums over indices, (A.16), and the congruence with SciPy's exponential."""
    y = []
    A = a * p.directions
    for (x, P), measured in zip(estimates, z, strict=True):
        y.append(measured - p.sensor.h(p.dynamics.transition(x)[0]))
        t, Q = len(y) - (1 if current else 2), p.dynamics.Q
        if t + 1 >= N + k:
            C = [
                sum(np.outer(y[j], y[j - i]) for j in range(t - N + 1, t + 1)) / (N - 1)
                for i in range(k + 1)
            ]
            E = scipy.linalg.expm(A @ sum(C[1:]) @ inv(C[0]) @ A.T / 2)
            Q = E @ Q @ E.T
        yield printed_update(*printed_prediction(x, P, p.dynamics, Q), measured, p.sensor)


def printed_arekf(estimates, z, p, alpha=0.2, rho=0.98, gamma=7.0):
    """(24), (26) and (5) as printed, with a matrix root and a gamma."""
    P_y_bar = None
    for (x, P), measured in zip(estimates, z, strict=True):
        x, P = printed_prediction(x, P, p.dynamics)
        H = p.sensor.jacobian(x)
        y, P_y = measured - p.sensor.h(x), H @ P @ H.T + p.sensor.R
        spread = np.outer(y, y)
        P_y_bar = spread if P_y_bar is None else (rho * P_y_bar + spread) / (rho + 1)
        if not (np.linalg.eigvalsh(P_y - alpha * P_y_bar) > 0).all():
            lam = max(1.0, np.trace(P_y_bar) / np.trace(P_y))
            inside = inv(P) - inv(P) / lam
            L = gamma * (np.linalg.cholesky(inside).T if lam > 1 else inside)  # L^T L is unique
            P = inv(inv(P) - gamma**-2 * L.T @ L)
        yield printed_update(x, P, measured, p.sensor)


def printed_aekf_current(estimates, z, p):
    return printed_aekf(estimates, z, p, current=True)


PRINTED = {
    "EKF": printed_ekf,
    "REKF": printed_rekf,
    "AEKF": printed_aekf,
    "AEKF, current": printed_aekf_current,
    "AREKF": printed_arekf,
}


@every_filter
@sizes
def test_every_step_is_the_printed_one(name, n, m):
    """Each from the library's last estimate, with the reference's own memory."""
    p = problem(n, m)
    states = go(FILTERS[name](p), p)
    for i in range(4):
        estimates = [(s.estimate.mean[i], s.estimate.cov[i]) for s in states]
        steps = PRINTED[name](estimates[:-1], p.z[:, i], p)
        for got, wanted in zip(estimates[1:], steps, strict=True):
            for a, b in zip(got, wanted, strict=True):
                assert_allclose(a, b, rtol=0, atol=1e-10 * np.abs(b).max())


def test_the_runs_above_use_every_branch():
    p = problem()
    rekf, arekf = (go(FILTERS[name](p), p)[-1] for name in ("REKF", "AREKF"))
    assert (rekf.violations > 0).any()
    assert (rekf.violations < 30).all()
    assert ((arekf.robust > 0) & (arekf.robust < 30)).all()


# --- limits -------------------------------------------------------------------------------------


def test_the_rekf_tends_to_the_ekf_as_gamma_squared_grows():
    """The difference falls by 100 when gamma grows by 10."""
    p = problem()
    ekf = go(ExtendedKalman(), p, 5)[-1].estimate
    gammas = [1e2, 1e3, 1e4]
    off = [np.abs(go(RobustEKF(g), p, 5)[-1].estimate.mean - ekf.mean).max() for g in gammas]
    assert_allclose(np.diff(np.log10(off)), -2, atol=1e-2)
    assert_array_equal(go(RobustEKF(np.inf), p, 5)[-1].estimate.cov, ekf.cov)


def test_the_arekf_that_never_switches_is_the_ekf():
    p = problem()
    ekf = go(ExtendedKalman(), p)[-1].estimate
    for alpha in (0.0, 1e-6):
        last = go(AdaptiveRobustEKF(alpha=alpha), p)[-1]
        assert_array_equal(last.estimate.mean, ekf.mean)
        assert_array_equal(last.estimate.cov, ekf.cov)
        assert not last.robust.any()


def test_the_aekf_with_no_feedback_is_the_ekf():
    p = problem()
    ekf = go(ExtendedKalman(), p)[-1].estimate
    got = go(AdaptiveEKF(a=0.0, N=4, directions=p.directions), p)[-1].estimate
    assert_array_equal(got.mean, ekf.mean)


def linear_problem():
    p = problem(4, 3)
    sensor = Linear(p.sensor.H, p.sensor.R)
    return Problem(p.prior, p.z, Matched(p.dynamics.G, np.eye(4), p.dynamics.Q), sensor, None)


@pytest.mark.parametrize(
    ("estimator", "rule"),
    [
        (ExtendedKalman(), lambda P: P),
        (RobustEKF(9.0), lambda P: inv(inv(P) - np.eye(4) / 81)),
        (RobustEKF(np.inf), lambda P: P),
        (AdaptiveRobustEKF(alpha=1e9, lam=2.5), lambda P: 2.5 * P),
        (AdaptiveRobustEKF(alpha=1e9, lam=0.5), lambda P: P),
        (AdaptiveRobustEKF(alpha=1e9, lam=lambda P_y_bar, P_y: 4.0), lambda P: 4 * P),
        (AdaptiveRobustEKF(alpha=0.0), lambda P: P),
        (AdaptiveEKF(directions=np.ones((4, 3))), lambda P: P),
    ],
)
def test_linear_limit(estimator, rule):
    """Each is the textbook's Kalman filter with a stated P."""
    p = linear_problem()
    got = go(estimator, p, 1)[-1].estimate
    for i in range(4):
        x, P = printed_prediction(p.prior.mean[i], p.prior.cov[i], p.dynamics)
        mean, cov = kalman(x, rule(P), p.z[0, i], p.sensor.H, p.sensor.R)
        assert_allclose(got.mean[i], mean, rtol=1e-10)
        assert_allclose(got.cov[i], cov, rtol=1e-10, atol=1e-14)


# --- memory, counters and what happens at a violation -------------------------------------------


def test_the_aekf_waits_for_seventeen_innovations():
    """N + k = 17 by default; with ``current`` the seventeenth takes part in its own step."""
    p = problem(6, 2)
    cases = ((AdaptiveEKF(), 17), (AdaptiveEKF(k=3, N=7), 10), (AdaptiveEKF(current=True), 16))
    for estimator, steps in cases:
        ekf, aekf = (go(e, p) for e in (ExtendedKalman(), estimator))
        pairs = zip(ekf, aekf, strict=True)
        same = [np.array_equal(a.estimate.cov, b.estimate.cov) for a, b in pairs]
        assert same == [True] * (steps + 1) + [False] * (30 - steps)
        assert (aekf[-1].count == 30).all()


def test_the_aekf_with_memory_multiplies_its_factors_up_to_the_cap():
    """The same window as without memory gives the same factor, times that of the step before."""
    p = problem(6, 2)
    options = {"a": 0.5, "N": 4, "directions": np.eye(6)[:, :2]}
    first = go(AdaptiveEKF(**options), p)
    states = go(AdaptiveEKF(**options, memory=True), p)
    eye = np.eye(6) + np.zeros_like(states[0].factor)
    assert_array_equal(states[6].factor, eye)
    assert_array_equal(first[-1].factor, eye)
    assert_array_equal(states[7].estimate.cov, first[7].estimate.cov)  # one factor as yet
    assert not np.allclose(states[-1].factor, eye)
    Q = p.dynamics.Q
    growth = np.trace(states[-1].factor @ Q @ states[-1].factor.mT, axis1=-2, axis2=-1)
    capped = go(AdaptiveEKF(**options, memory=True, cap=1.01), p)
    for state in capped[1:]:
        spread = np.trace(state.factor @ Q @ state.factor.mT, axis1=-2, axis2=-1)
        assert (spread <= 1.01 * np.trace(Q) * (1 + 1e-12)).all()
    assert growth.max() > 1.01 * np.trace(Q)


def test_the_aekf_keeps_the_papers_pattern():
    """Eq. (44): star directions (1, 0, 1) / sqrt 2 and (0, 1, 0) in the velocity components."""
    pattern = AdaptiveEKF().directions
    assert_allclose(pattern.T @ pattern, np.eye(2), atol=1e-15)
    assert not pattern[:3].any()


def test_the_paper_s_values_are_the_defaults():
    assert (RobustEKF().gamma, RobustEKF().on_violation) == (8000.0, "skip")
    assert (AdaptiveEKF().a, AdaptiveEKF().k, AdaptiveEKF().N) == (1.5, 2, 15)
    assert (AdaptiveRobustEKF().alpha, AdaptiveRobustEKF().rho) == (0.2, 0.98)
    assert AdaptiveRobustEKF().lam is trace_ratio


def violating():
    """P of the first prediction has largest eigenvalues 1.25 and 100.25 in two members."""
    prior = Gaussian(np.zeros((2, 2)), np.eye(2) * np.array([1.0, 100.0])[:, None, None])
    dynamics = Matched(np.eye(2), np.eye(2), 0.25 * np.eye(2))
    return Problem(prior, np.ones((1, 2, 2)), dynamics, Linear(np.eye(2), np.eye(2)), None)


def test_skip_leaves_the_step_to_the_ekf():
    p = violating()
    last, ekf = go(RobustEKF(4.0), p)[-1], go(ExtendedKalman(), p)[-1]
    assert last.violations.tolist() == [0, 1]
    assert_array_equal(last.estimate.mean[1], ekf.estimate.mean[1])
    assert (last.estimate.mean[0] != ekf.estimate.mean[0]).all()


def test_nan_ends_the_member_alone_and_counts_once():
    p = violating()
    first = go(RobustEKF(4.0, on_violation="nan"), p)[-1]
    assert np.isnan(first.estimate.mean).all(axis=-1).tolist() == [False, True]
    assert_array_equal(first.estimate.mean[0], go(RobustEKF(4.0), p)[-1].estimate.mean[0])
    again = RobustEKF(4.0, on_violation="nan").step(first, p.z[0], p.dynamics, p.sensor)
    assert again.violations.tolist() == [0, 1]


def test_raise_names_the_smallest_admissible_gamma():
    p = violating()
    with pytest.raises(ValueError, match=r"smallest admissible gamma at this step is 10\.0125;"):
        go(RobustEKF(4.0, on_violation="raise"), p)
    needed = np.sqrt(100.25)
    go(RobustEKF(needed * (1 + 1e-9), on_violation="raise"), p)
    with pytest.raises(ValueError, match="must exceed"):
        go(RobustEKF(needed * (1 - 1e-9), on_violation="raise"), p)


def test_the_violation_is_that_of_the_largest_eigenvalue():
    """Cholesky of gamma^2 I - P against eigenvalues, for members around the limit."""
    rng = np.random.default_rng(0)
    P = covariances(rng, (500,), 6)
    _, violated = RobustEKF(1.9)._enlarge(P)
    assert_array_equal(violated, np.linalg.eigvalsh(P)[:, -1] >= 1.9**2)
    assert 0 < violated.sum() < 500


def test_lambda_below_one_is_one_and_counted():
    """One component of the innovation is large, their sum is not, compared with P_y."""
    sensor = Linear(np.eye(2), np.diag([1.0, 99.0]))
    prior = Gaussian(np.zeros((3, 2)), np.zeros((2, 2)))
    still = Matched(np.eye(2), np.eye(2), np.eye(2))
    p = Problem(prior, np.array([[[4.0, 0], [1.0, 0], [40.0, 0]]]), still, sensor, None)
    last = go(AdaptiveRobustEKF(), p)[-1]
    assert last.robust.tolist() == [1, 0, 1]
    assert last.clipped.tolist() == [1, 0, 0]
    ekf = go(ExtendedKalman(), p)[-1]
    same = (last.estimate.mean == ekf.estimate.mean).all(axis=-1)
    assert same.tolist() == [True, True, False]


def test_the_spread_of_the_innovations_remembers_about_two():
    """(27) as printed: y y^T first, then (rho old + new) / (rho + 1)."""
    p = linear_problem()
    states = go(AdaptiveRobustEKF(), p, 2)
    assert states[0].P_y_bar is None
    y = p.z[0] - p.sensor.h(p.dynamics.transition(p.prior.mean)[0])
    assert_allclose(states[1].P_y_bar, y[:, :, None] * y[:, None, :], rtol=1e-12)
    y = p.z[1] - p.sensor.h(p.dynamics.transition(states[1].estimate.mean)[0])
    wanted = (0.98 * states[1].P_y_bar + y[:, :, None] * y[:, None, :]) / 1.98
    assert_allclose(states[2].P_y_bar, wanted, rtol=1e-12)


# --- batches ------------------------------------------------------------------------------------


@every_filter
def test_a_nan_stays_with_its_member(name):
    p = problem()
    z = p.z.copy()
    z[5, 2, 0] = np.nan
    got, clean = (go(FILTERS[name](p), p, z=measured)[-1] for measured in (z, p.z))
    others = [0, 1, 3]
    assert_array_equal(got.estimate.mean[others], clean.estimate.mean[others])
    assert np.isnan(got.estimate.mean[2]).all()
    for a, b in zip(got[1:], clean[1:], strict=True):
        assert_array_equal(a[others], b[others])


@every_filter
def test_a_covariance_that_is_nan_stays_with_its_member(name):
    p = problem()
    prior = Gaussian(p.prior.mean, np.where(np.arange(4)[:, None, None] == 1, np.nan, p.prior.cov))
    last = go(FILTERS[name](p), p, prior=prior)[-1]
    assert np.isnan(last.estimate.mean).any(axis=-1).tolist() == [False, True, False, False]
    if not name.startswith("AEKF"):
        assert not any(counter[1].any() for counter in last[2 if name == "AREKF" else 1 :])


@pytest.mark.parametrize(
    ("name", "option", "values"),
    [
        ("REKF", "gamma", [2.0, 3.0, 8.0, np.inf]),
        ("AEKF", "a", [0.0, 0.2, 0.4, 0.5]),
        ("AREKF", "alpha", [0.0, 0.1, 0.5, 1.0]),
        ("AREKF", "rho", [0.0, 0.5, 0.98, 5.0]),
        ("AREKF", "lam", [1.0, 2.0, 5.0, 9.0]),
    ],
)
def test_each_member_may_have_its_own_parameter(name, option, values):
    """One prior for all: the batch axes come from the parameter and the measurement."""
    p = problem()
    prior = Gaussian(p.prior.mean[0], p.prior.cov[0])
    kind = type(FILTERS[name](p))
    others = {"N": 8, "directions": p.directions} if name == "AEKF" else {}
    last = go(kind(**{option: np.array(values)}, **others), p, prior=prior)[-1]
    for i, value in enumerate(values):
        alone = go(kind(**{option: value}, **others), p, prior=prior, z=p.z[:, i])[-1]
        assert_allclose(last.estimate.mean[i], alone.estimate.mean, rtol=1e-10)
        for counter, single in zip(last[2:], alone[2:], strict=True):
            assert_allclose(counter[i], single, rtol=1e-10)


@every_filter
def test_noise_may_be_added_at_sub_steps(name):
    p = problem(dynamics=SubStepped)
    whole = Problem(p.prior, p.z, Swing(p.dynamics.G, 3 * p.dynamics.Q), p.sensor, p.directions)
    got, wanted = (go(FILTERS[name](q), q)[-1].estimate for q in (p, whole))
    assert_allclose(got.mean, wanted.mean, rtol=1e-9)


@pytest.mark.parametrize("name", ["REKF", "AEKF", "AREKF"])
def test_the_same_source_compiles_under_jax(name):
    p = problem(steps=8)
    estimator = FILTERS[name](p)
    dynamics = Swing(jax.numpy.asarray(p.dynamics.G), jax.numpy.asarray(p.dynamics.Q))
    step = jax.jit(lambda state, z: estimator.step(state, z, dynamics, p.sensor))
    state = estimator.init(Gaussian(*map(jax.numpy.asarray, p.prior)))
    for z in p.z:
        state = step(state, jax.numpy.asarray(z))
    wanted = go(estimator, p)[-1]
    assert_allclose(state.estimate.mean, wanted.estimate.mean, rtol=1e-9)
    for a, b in zip(state[1:], wanted[1:], strict=True):
        assert_allclose(a, b, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("size", [1e-9, 0.3, 0.5, 3.0, 40.0])
def test_matrix_exponential(size):
    A = size * np.random.default_rng(1).normal(size=(20, 5, 5)) / 5
    A = A * 10.0 ** np.linspace(-2, 0, 20)[:, None, None]
    wanted = scipy.linalg.expm(A)
    scale = np.abs(wanted).max(axis=(1, 2), keepdims=True)
    assert_allclose(_expm(A) / scale, wanted / scale, atol=2e-13)


def test_matrix_exponential_that_overflows_or_is_nan():
    A = np.stack([np.eye(2), 2e3 * np.eye(2), np.full((2, 2), np.nan), np.zeros((2, 2))])
    got = _expm(A)
    assert_allclose(got[[0, 3]], [np.e * np.eye(2), np.eye(2)])
    assert np.isnan(got[[1, 2]]).all()


# --- bad input ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RobustEKF(0.0), "gamma must be positive; found 0.0"),
        (lambda: RobustEKF([1.0, np.nan]), "gamma must be positive"),
        (lambda: RobustEKF(on_violation="ignore"), "on_violation must be .*'ignore'"),
        (lambda: AdaptiveEKF(k=0), "k must be an integer of at least 1; found 0"),
        (lambda: AdaptiveEKF(N=1), "N must be an integer of at least 2; found 1"),
        (lambda: AdaptiveEKF(N=15.0), "N must be an integer of at least 2; found 15.0"),
        (lambda: AdaptiveEKF(a=np.inf), "a must be an array"),
        (lambda: AdaptiveEKF(cap=0.0), "cap must be positive; found 0.0"),
        (lambda: AdaptiveEKF(directions=[1.0, 2.0]), "directions must be an array"),
        (lambda: AdaptiveRobustEKF(alpha=-0.1), "alpha must be at least 0; found -0.1"),
        (lambda: AdaptiveRobustEKF(rho=np.nan), "rho must be an array"),
        (lambda: AdaptiveRobustEKF(lam=-1.0), "lam must be at least 0; found -1.0"),
    ],
)
def test_parameters_are_checked_when_a_filter_is_made(make, message):
    with pytest.raises(ValueError, match=message):
        make()


# --- the theory ---------------------------------------------------------------------------------

TURN = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
Q = 0.2 * np.eye(2)
TIMES = np.arange(61)


@dataclass(frozen=True, eq=False)
class Run:
    """A run of the REKF on a system that meets Eq. (15) with a known beta; rank H = n = 2."""

    a: xiong2009.Assumptions
    rate: np.ndarray  # by which V contracts, at every step
    error: np.ndarray  # mean square, at every time
    P: np.ndarray  # predicted
    Sigma: np.ndarray
    Sigma_bar: np.ndarray
    lam: np.ndarray  # the smallest that (A.11) takes, whatever the error's direction

    @property
    def condition_19(self):
        return np.linalg.eigvalsh(self.Sigma - self.Sigma_bar)[:, 0] > 0

    def bound(self, **options):
        return xiong2009.theorem_bound(self.a, self.error[0], TIMES, **options)


def theory(growth, beta, gamma=np.inf, lam=None, unit=1.0, members=2000):
    """unit is the size of the state's unit: the same run, in metres or in centimetres.

    With lam, the AREKF whose P_y_bar never lets it be an EKF.
    """
    rng = np.random.default_rng(7)
    G, beta, P0 = growth * TURN, np.diag(beta), unit**2 * np.eye(2)
    R, H, w = np.diag([1.0, 0.5]), np.array([[1.0, 0.2], [0, 0.8]]) / unit, unit**2 * Q
    dynamics, sensor = Matched(G, beta, w), Linear(H, R)
    estimator = RobustEKF(gamma * unit, on_violation="raise")
    if lam is not None:
        estimator = AdaptiveRobustEKF(alpha=1e9, lam=lam)
    x = np.zeros((members, 2))
    state = estimator.init(Gaussian(unit * rng.normal(size=(members, 2)), P0))
    error, cov = [x - state.estimate.mean], [P0]
    for _ in TIMES[1:]:
        x = x @ G.T + rng.normal(size=x.shape) @ np.sqrt(w)
        z = sensor.h(x) + rng.normal(size=x.shape) @ np.sqrt(R)
        state = estimator.step(state, z, dynamics, sensor)
        error.append(x - state.estimate.mean)
        cov.append(state.estimate.cov if state.estimate.cov.ndim == 2 else state.estimate.cov[0])
    F, cov = inv(beta) @ G, np.array(cov)
    P = F @ cov[:-1] @ F.T + w
    Sigma = inv(inv(P) - np.eye(2) / (gamma * unit) ** 2) if lam is None else lam * P
    a = xiong2009.assumptions(F, beta, H, cov, R, w)
    K = Sigma @ H.T @ inv(H @ Sigma @ H.T + R)
    rate = xiong2009.contraction((np.eye(2) - K @ H) @ G, cov[:-1], cov[1:])
    seen = np.linalg.cholesky(cov[:-1]).mT @ G.T @ H.T
    least = np.linalg.eigvalsh(seen @ inv(H @ Sigma @ H.T + R) @ seen.mT)[:, 0]
    mean_square = np.mean(np.sum(np.square(error), axis=-1), axis=-1)
    return Run(
        a, rate, mean_square, P, Sigma, xiong2009.real_covariance(F, beta, cov[:-1], w), least
    )


MILD = (1.0, (1.2, 1.1))  # the Jacobian is 10 to 20 % too small, the system marginally stable
WILD = (1.3, (4.0, 4.0))  # it is a quarter of the truth, and the system unstable


@pytest.mark.parametrize(("system", "gamma"), [(MILD, 1.2), (WILD, 0.575)])
def test_theorem_1_bounds_the_error_where_its_assumptions_hold(system, gamma):
    run = theory(*system, gamma)
    lower, upper = xiong2009.gamma_limits(run.P, run.Sigma_bar)
    assert run.condition_19.all()
    assert ((lower < gamma) & (upper > gamma)).all()
    lam, mu = xiong2009.theorem_constants(run.a)
    assert 0 < lam <= run.rate.min() < 1
    assert mu > 0
    assert (run.error < run.bound()).all()
    assert 50 < run.bound()[-1] / run.error[-1] < 500


def test_theorem_2_bounds_the_error_where_lambda_satisfies_25():
    """The true P_y_bar exceeds P_y at every step here, so (26) is lambda P throughout.

    lambda = beta^2 satisfies (25) at every step; (47) with the true P_y_bar would not, at any.
    """
    run = theory(*WILD, lam=16.0)
    H, R = np.array([[1.0, 0.2], [0, 0.8]]), np.diag([1.0, 0.5])
    P_y, P_y_bar = (H @ A @ H.T + R for A in (run.P, run.Sigma_bar))
    assert (np.linalg.eigvalsh(P_y - P_y_bar) < 0).any(axis=-1).all()
    assert run.condition_19.all()
    needed = xiong2009.smallest_lambda(run.P, run.Sigma_bar)
    assert (needed < 16).all()
    assert (trace_ratio(P_y_bar, P_y) < needed).all()
    assert (run.error < run.bound()).all()


def test_the_same_system_under_the_ekf_violates_19_and_exceeds_the_bound():
    """gamma at infinity: the gain is too small to hold the unstable system."""
    run = theory(*WILD, np.inf)
    _, upper = xiong2009.gamma_limits(run.P, run.Sigma_bar)
    assert not run.condition_19.any()
    assert (upper < np.inf).all()
    assert run.error[-1] > 3 * run.bound()[-1]
    assert (np.diff(run.error)[5:] > 0).all()


def test_the_limits_of_gamma_are_those_of_the_two_inequalities():
    """(22): Sigma > Sigma_bar just below it and not just above; infinite where P is enough."""
    rng = np.random.default_rng(3)
    P, Sigma_bar = covariances(rng, (200,), 3), covariances(rng, (200,), 3)
    Sigma_bar[0] = P[0] / 2
    lower, upper = xiong2009.gamma_limits(P, Sigma_bar)
    assert_allclose(lower, np.sqrt(np.linalg.eigvalsh(P)[:, -1]))
    assert upper[0] == np.inf
    open_ = np.isfinite(upper) & (upper > lower * 1.001)
    assert 5 < open_.sum() < 195  # and for the others no gamma exists
    for factor, holds in ((1 - 1e-6, True), (1 + 1e-6, False)):
        gamma = (factor * upper)[open_, None, None]
        Sigma = inv(inv(P[open_]) - np.eye(3) / gamma**2)
        least = np.linalg.eigvalsh(Sigma - Sigma_bar[open_])[:, 0]
        assert ((least > 0) == holds).all()


def test_one_gamma_cannot_serve_two_units():
    """Metres and metres per second: a velocity wrong by 2 leaves no gamma, but lambda = 4."""
    P, Sigma_bar = np.diag([1e6, 1e-2]), np.diag([1e6, 4e-2])
    lower, upper = xiong2009.gamma_limits(P, Sigma_bar)
    assert_allclose([lower, upper], [1e3, 75**-0.5])
    assert_allclose(xiong2009.smallest_lambda(P, Sigma_bar), 4.0)


def test_the_smallest_lambda_is_that_of_25():
    rng = np.random.default_rng(4)
    P, Sigma_bar = covariances(rng, (50,), 4), covariances(rng, (50,), 4)
    lam = xiong2009.smallest_lambda(P, Sigma_bar)[:, None, None]
    least = [np.linalg.eigvalsh(f * lam * P - Sigma_bar)[:, 0] for f in (1 - 1e-9, 1 + 1e-9)]
    assert (least[0] < 0).all()
    assert (least[1] > 0).all()


def test_the_trace_ratio_never_satisfies_25_where_it_asks_for_something():
    """Theorem 2 with (47), even with the true covariance of the innovations and rank H = n."""
    rng = np.random.default_rng(5)
    P, Sigma_bar = covariances(rng, (5000,), 3), covariances(rng, (5000,), 3)
    H, R = rng.normal(size=(5000, 3, 3)), 0.1 * covariances(rng, (5000,), 3)
    lam = trace_ratio(H @ Sigma_bar @ H.mT + R, H @ P @ H.mT + R)
    needed = xiong2009.smallest_lambda(P, Sigma_bar)
    asked = needed > 1
    assert asked.sum() > 4000
    assert (lam < needed)[asked].all()


def test_the_printed_bounds_are_not_bounds():
    """Lemma 1 without i = 0; (20) with mu / p_min, in another unit."""
    lam, mu, start = 0.1, 2.0, 3.0
    V = start  # V = xi^2 with E[V_t | xi] = (1 - lam) V + mu
    for t in range(1, 30):
        V = (1 - lam) * V + mu
        assert_allclose(xiong2009.lemma_bound(1, 1, mu, lam, start, t), V)
        assert xiong2009.lemma_bound(1, 1, mu, lam, start, t, as_printed=True) < V
    fine, coarse = theory(*MILD, 1.2), theory(*MILD, 1.2, unit=100.0)
    assert_allclose(coarse.error, 1e4 * fine.error, rtol=1e-9)
    assert_allclose(coarse.bound(), 1e4 * fine.bound(), rtol=1e-9)
    assert (fine.error < fine.bound(as_printed=True))[2:].all()
    assert coarse.condition_19.all()
    assert (coarse.error > coarse.bound(as_printed=True))[-1]


def test_a14_is_a_rate_of_v_though_it_is_not_below_every_lambda_t():
    """Near the limit (23) lambda_t of (A.11) all but vanishes, and V contracts as (A.14) says."""
    tight = theory(*MILD, 1.01314)
    assert tight.condition_19.all()
    lam, _ = xiong2009.theorem_constants(tight.a)
    assert tight.lam.min() < 1e-3 * lam
    assert lam <= tight.rate.min() < 1


@pytest.mark.parametrize("n", [1, 2, 4])
def test_a14_is_a_rate_of_v_on_random_systems(n):
    """Any Sigma that satisfies (19), any regular H; the rate by eigenvalues of (A.5)."""
    rng = np.random.default_rng(n)
    P, R, noise, more = (covariances(rng, (300,), n) for _ in range(4))
    F, H = rng.normal(size=(2, 300, n, n))
    beta = np.exp(rng.normal(size=(300, n)))[..., None] * np.eye(n)
    Sigma = xiong2009.real_covariance(F, beta, P, noise) + more
    P_next = inv(inv(Sigma) + H.mT @ inv(R) @ H)
    M = P_next @ inv(Sigma) @ beta @ F
    rate = xiong2009.contraction(M, P, P_next)
    directly = [
        1 - scipy.linalg.eigh(M.T @ inv(B) @ M, inv(A))[0][-1]
        for M, A, B in zip(M, P, P_next, strict=True)
    ]
    assert_allclose(rate, directly, rtol=1e-6, atol=1e-9)
    for k in range(300):
        a = xiong2009.assumptions(F[k], beta[k], H[k], P[k], R[k], noise[k])
        assert xiong2009.theorem_constants(a)[0] <= rate[k]


def test_the_lemma_without_contraction_grows_for_ever():
    t = np.arange(5)
    assert_allclose(xiong2009.lemma_bound(1, 2, 3, 0.0, 1.0, t), 2 + 3 * t)
    assert_allclose(xiong2009.lemma_bound(1, 2, 3, 1e-9, 1.0, t), 2 + 3 * t, rtol=1e-6)
    assert_allclose(xiong2009.lemma_bound(1, 2, 3, 0.0, 1.0, t, as_printed=True)[1:], 3 * t[1:] - 1)
    assert_allclose(xiong2009.lemma_bound(1, 2, 3, 1.0, 1.0, t), [2, 3, 3, 3, 3])


def test_fewer_measurements_than_states_leave_theorem_1_empty():
    eye = np.eye(6)
    a = xiong2009.assumptions(eye, eye, eye[:2], eye, np.eye(2), eye)
    assert (a.n, a.m, a.h_min, a.h_max) == (6, 2, 0.0, 1.0)
    assert xiong2009.theorem_constants(a)[0] == 0.0
    bound = xiong2009.theorem_bound(a, 1.0, TIMES)
    assert_allclose(np.diff(bound), bound[1] - bound[0])


def worst_attenuation(gamma, steps=40):
    """Largest singular value, squared, from all disturbances of a run to its predicted errors.

    The members of a batch are the unit disturbances: an error map by running the filter on them.
    The first prediction is the initial error, (10) with whitened disturbances.
    """
    R, H = np.eye(1), np.array([[1.0, 0.2]])
    sensor, dynamics = Linear(H, R), Matched(TURN, np.eye(2), Q)
    count = 2 + 3 * steps
    unit = np.eye(count)
    x = np.linalg.cholesky(np.eye(2) + Q) @ unit[:2]  # P of the first prediction
    estimator = RobustEKF(gamma, on_violation="raise")
    state = estimator.init(Gaussian(np.zeros((count, 2)), np.eye(2)))
    rows = []
    for t in range(steps):
        w, v = unit[2 + 3 * t : 4 + 3 * t], unit[4 + 3 * t]
        predicted = dynamics.transition(state.estimate.mean)[0]
        rows.append((x.T - predicted).T)
        state = estimator.step(state, (H @ x + np.sqrt(R) * v).T, dynamics, sensor)
        x = TURN @ x + np.sqrt(Q) @ w
    return np.linalg.norm(np.concatenate(rows), 2) ** 2, np.array(rows)


def test_the_rekf_attenuates_every_disturbance_below_gamma_squared():
    """Eq. (10) in the form that the recursion guarantees; the EKF lets more through."""
    worst, errors = worst_attenuation(2.6)
    ekf, _ = worst_attenuation(np.inf)
    assert worst < 2.6**2 < ekf
    assert_allclose([worst, ekf], [5.9452, 8.0630], rtol=1e-4)
    units = np.eye(errors.shape[-1])[None]
    each = xiong2009.attenuation_ratio(errors.mT, units)
    assert each.shape == (122,)
    assert each.max() < worst
    some = np.random.default_rng(0).normal(size=(1, 50, 122))
    assert (xiong2009.attenuation_ratio((errors @ some[0].T).mT, some) < worst).all()


def test_the_printed_attenuation_ratio_depends_on_units():
    """sum |x|^2 / sum (|w|^2 + |v|^2) > gamma^2 in a run that satisfies (23) at every step."""
    rng = np.random.default_rng(1)
    unit = 1e-3
    sensor = Linear(np.eye(2), unit**2 * np.eye(2))
    dynamics = Matched(TURN, np.eye(2), unit**2 * Q)
    estimator = RobustEKF(2.0 * unit, on_violation="raise")
    state, x = estimator.init(Gaussian(np.zeros(2), unit**2 * np.eye(2))), np.zeros(2)
    w, v = unit * np.sqrt(0.2) * rng.normal(size=(50, 2)), unit * rng.normal(size=(50, 2))
    error = []
    for t in range(50):
        x = TURN @ x + w[t]
        state = estimator.step(state, x + v[t], dynamics, sensor)
        error.append(x - state.estimate.mean)
    assert state.violations == 0
    assert xiong2009.attenuation_ratio(np.array(error), w, v) > 1e3 * estimator.gamma**2


def test_the_attenuation_ratio_sums_over_time():
    error = np.arange(12.0).reshape(3, 2, 2)
    w, start = np.ones((3, 2, 1)), np.full((1, 2, 4), 2.0)
    got = xiong2009.attenuation_ratio(error, w, start)
    wanted = [sum(error[t, i] @ error[t, i] for t in range(3)) / (3 + 16) for i in range(2)]
    assert_allclose(got, wanted)
