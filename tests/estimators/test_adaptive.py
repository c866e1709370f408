"""The adaptive rule against the printed formulas as the library reads them, and its window."""

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose, assert_array_equal
from ruled import (
    SIZES,
    assert_printed,
    go,
    inv,
    printed_prediction,
    printed_update,
    problem,
    ruled,
)

from navfilters import Filter, run, sweep
from navfilters.estimators.adaptive import AdaptiveNoise
from navfilters.numerics.matrix_exponential import expm
from navfilters.papers.xiong2009 import CurrentNoise


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


def printed_aekf_current(estimates, z, p):
    return printed_aekf(estimates, z, p, current=True)


@pytest.mark.parametrize("form", ["joseph", "short"])
@pytest.mark.parametrize(("n", "m"), SIZES)
def test_every_step_is_the_printed_one(n, m, form):
    """Each from the library's last estimate, with the reference's own memory."""
    p = problem(n, m)
    rule = AdaptiveNoise(a=0.5, N=8, directions=p.directions)
    assert_printed(printed_aekf, go(Filter(rule=rule, form=form), p), p)
    assert_printed(printed_aekf_current, go(CurrentNoise(rule), p), p)


def test_the_aekf_with_no_feedback_is_the_ekf():
    p = problem()
    ekf = ruled(None, p)[-1].estimate
    got = ruled(AdaptiveNoise(a=0.0, N=4, directions=p.directions), p)[-1].estimate
    assert_array_equal(got.mean, ekf.mean)


def test_the_aekf_waits_for_seventeen_innovations():
    """N + k = 17 by default; the reading *current* has the seventeenth in its own step."""
    p = problem(6, 2)
    ekf = ruled(None, p)
    cases = (
        (Filter(rule=AdaptiveNoise()), 17),
        (Filter(rule=AdaptiveNoise(k=3, N=7)), 10),
        (CurrentNoise(), 16),
    )
    for estimator, steps in cases:
        aekf = go(estimator, p)
        pairs = zip(ekf, aekf, strict=True)
        same = [np.allclose(a.estimate.cov, b.estimate.cov, rtol=1e-12) for a, b in pairs]
        assert same == [True] * (steps + 1) + [False] * (30 - steps)
        assert (aekf[-1].memory.count == 30).all()


def test_the_aekf_with_memory_multiplies_its_factors_up_to_the_cap():
    """The same window as without memory gives the same factor, times that of the step before."""
    p = problem(6, 2)
    options = {"a": 0.5, "N": 4, "directions": np.eye(6)[:, :2]}
    first = ruled(AdaptiveNoise(**options), p)
    states = ruled(AdaptiveNoise(**options, memory=True), p)
    eye = np.eye(6) + np.zeros_like(states[0].memory.factor)
    assert_array_equal(states[6].memory.factor, eye)
    assert_array_equal(first[-1].memory.factor, eye)
    assert_array_equal(states[7].estimate.cov, first[7].estimate.cov)  # one factor as yet
    assert not np.allclose(states[-1].memory.factor, eye)
    Q = p.dynamics.Q
    growth = np.trace(
        states[-1].memory.factor @ Q @ states[-1].memory.factor.mT, axis1=-2, axis2=-1
    )
    capped = ruled(AdaptiveNoise(**options, memory=True, cap=1.01), p)
    for state in capped[1:]:
        spread = np.trace(state.memory.factor @ Q @ state.memory.factor.mT, axis1=-2, axis2=-1)
        assert (spread <= 1.01 * np.trace(Q) * (1 + 1e-12)).all()
    assert growth.max() > 1.01 * np.trace(Q)


def test_caps_side_by_side_are_caps_one_by_one():
    p = problem(6, 2, steps=12)
    options = {"a": 0.5, "N": 4, "directions": np.eye(6)[:, :2], "memory": True}
    caps = np.array([1.01, 1.5, np.inf])
    axes = np.expand_dims(caps, tuple(range(1, p.prior.mean.ndim)))
    together = ruled(AdaptiveNoise(**options, cap=axes), p)[-1].estimate
    for k, cap in enumerate(caps):
        alone = ruled(AdaptiveNoise(**options, cap=cap), p)[-1].estimate
        assert_array_equal(together.cov[k], alone.cov)


@pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])
def test_the_current_reading_goes_through_run_and_sweep(engine):
    p = problem(steps=12)
    estimator = CurrentNoise(AdaptiveNoise(a=0.5, N=5, directions=p.directions))
    options = {"dynamics": p.dynamics, "z_per_step": True}
    wanted = run(estimator, p.prior, p.z, p.sensor, **options)
    got = sweep(estimator, p.prior, p.z, p.sensor, engine=engine, progress=False, **options).final
    assert_allclose(got.mean, wanted.mean[-1], rtol=1e-9)
    assert_allclose(got.cov, wanted.cov[-1], rtol=1e-9, atol=1e-12)


def test_the_current_reading_multiplies_each_factor_once():
    """With memory: after the step in which the window is full, E is that of the window alone."""
    p = problem(6, 2)
    options = {"a": 0.5, "N": 4, "directions": np.eye(6)[:, :2]}
    states = go(CurrentNoise(AdaptiveNoise(**options, memory=True)), p)
    late = ruled(AdaptiveNoise(**options, memory=True), p, z=p.z)
    assert_array_equal(states[5].memory.factor, np.eye(6) + 0 * states[5].memory.factor)
    assert_allclose(states[6].memory.factor, late[7].memory.factor, rtol=1e-10)


def test_the_aekf_keeps_the_papers_pattern():
    """Eq. (44): star directions (1, 0, 1) / sqrt 2 and (0, 1, 0) in the velocity components."""
    pattern = AdaptiveNoise().directions
    assert_allclose(pattern.T @ pattern, np.eye(2), atol=1e-15)
    assert not pattern[:3].any()


def test_the_paper_s_values_are_the_defaults():
    assert (AdaptiveNoise().a, AdaptiveNoise().k, AdaptiveNoise().N) == (1.5, 2, 15)


@pytest.mark.parametrize("size", [1e-9, 0.3, 0.5, 3.0, 40.0])
def test_matrix_exponential(size):
    A = size * np.random.default_rng(1).normal(size=(20, 5, 5)) / 5
    A = A * 10.0 ** np.linspace(-2, 0, 20)[:, None, None]
    wanted = scipy.linalg.expm(A)
    scale = np.abs(wanted).max(axis=(1, 2), keepdims=True)
    assert_allclose(expm(A) / scale, wanted / scale, atol=2e-13)


def test_matrix_exponential_that_overflows_or_is_nan():
    A = np.stack([np.eye(2), 2e3 * np.eye(2), np.full((2, 2), np.nan), np.zeros((2, 2))])
    got = expm(A)
    assert_allclose(got[[0, 3]], [np.e * np.eye(2), np.eye(2)])
    assert np.isnan(got[[1, 2]]).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: AdaptiveNoise(k=0), "k must be an integer of at least 1; found 0"),
        (lambda: AdaptiveNoise(N=1), "N must be an integer of at least 2; found 1"),
        (lambda: AdaptiveNoise(N=15.0), "N must be an integer of at least 2; found 15.0"),
        (lambda: AdaptiveNoise(a=np.inf), "a must be an array"),
        (lambda: AdaptiveNoise(cap=0.0), "cap must be positive; found 0.0"),
        (lambda: AdaptiveNoise(directions=[1.0, 2.0]), "directions must be an array"),
    ],
)
def test_parameters_are_checked_when_a_rule_is_made(make, message):
    with pytest.raises(ValueError, match=message):
        make()
