"""The bounds of Theorems 1 and 2 beside errors, the lemma, and the slips of the printed ones."""

import numpy as np
import pytest
import scipy.linalg
from mismatched import MILD, TIMES, WILD, theory
from naive import covariances
from numpy.testing import assert_allclose
from ruled import inv

from navfilters import Filter
from navfilters.estimators import Robust, trace_ratio
from navfilters.papers import xiong2009


def test_a_simulation_is_a_plain_loop_over_the_steps():
    """The chapters' simulation against the one of these tests, which steps the filter."""
    rekf = Filter(rule=Robust(120.0, on_violation="raise"))
    got = xiong2009.simulate(xiong2009.MILD, rekf, unit=100.0, members=300)
    wanted = theory(*MILD, 1.2, unit=100.0, members=300)
    assert_allclose(got.error, wanted.error, rtol=1e-9)
    assert_allclose(got.P, wanted.P, rtol=1e-12)
    assert_allclose(got.Sigma_bar, wanted.Sigma_bar, rtol=1e-12)
    assert_allclose(got.bound(), wanted.bound(), rtol=1e-9)
    assert_allclose(got.bound(as_printed=True), wanted.bound(as_printed=True), rtol=1e-9)


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
