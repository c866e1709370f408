"""Consistency tests against SciPy, plain loops, and filters known to be right or wrong."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import matrix as mp_matrix
from mpmath import mp
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal
from scipy import stats

from navfilters.runs.chi_square import chi_square_band
from navfilters.runs.consistency import (
    coverage,
    mean_nees,
    nees,
    nis,
    sample_deviation,
)


def honest(runs=400, times=3, n=4, factor=1.0, seed=0):
    """Errors drawn from a covariance that differs from run to run, times a factor on the error."""
    rng = np.random.default_rng(seed)
    P = covariances(rng, (runs, times), n)
    L = np.linalg.cholesky(P)
    return factor * (L @ rng.normal(size=(runs, times, n, 1)))[..., 0], P


def test_nees_in_a_plain_loop():
    error, P = honest(20)
    wanted = [
        [e @ np.linalg.solve(p, e) for e, p in zip(*r, strict=True)]
        for r in zip(error, P, strict=True)
    ]
    assert_allclose(nees(error, P), wanted, rtol=1e-12)
    assert_array_equal(nis(error, P), nees(error, P))


def test_nees_of_metres_beside_microradians_in_fifty_digits():
    """Nearly singular too: a position that is known only together with the misalignment."""
    rng = np.random.default_rng(1)
    sigma = np.array([7e2, 1e1, 1e-3, 1e-6])
    L = np.tril(rng.normal(size=(4, 4)))
    L[3, 3] = 1e-4
    P = sigma[:, None] * (L @ L.T) * sigma
    P, e = (P + P.T) / 2, sigma * rng.normal(size=4)
    with mp.workdps(50):
        exact = mp_matrix(e.tolist()).T * mp_matrix(P.tolist()) ** -1 * mp_matrix(e.tolist())
    assert_allclose(nees(e, P), float(exact[0]), rtol=1e-6)


@given(st.floats(-6, 6), st.integers(0, 1000))
def test_nees_has_no_units(exponent, seed):
    rng = np.random.default_rng(seed)
    P, e, scale = covariances(rng, (), 3), rng.normal(size=3), np.array([10.0**exponent, 1, 2])
    assert_allclose(nees(scale * e, scale[:, None] * P * scale), nees(e, P), rtol=1e-10)


def test_members_without_a_number_stay_alone():
    error, P = honest(6, 1, 3)
    wanted = nees(error, P)
    error[1, 0, 2], P[2, 0, 1, 1], P[3, 0] = np.nan, np.nan, -P[3, 0]
    P[4, 0] = [[1, 2, 0], [2, 1, 0], [0, 0, 1]]  # indefinite, with a positive diagonal
    got = nees(error, P)
    assert np.isnan(got[1:5]).all()
    assert_array_equal(got[[0, 5]], wanted[[0, 5]])


def test_chi_square_band():
    assert_allclose(chi_square_band(9), stats.chi2.ppf([0.025, 0.975], 9))
    assert_allclose(chi_square_band(9, 100), [8.188, 9.850], atol=1e-3)
    low, high = chi_square_band(9, np.array([1, 100]), 0.5)
    assert_allclose(low, [stats.chi2.ppf(0.25, 9), stats.chi2.ppf(0.25, 900) / 100])
    assert (low < high).all()


def test_mean_nees_of_an_honest_and_of_a_confident_filter():
    result = mean_nees(*honest(), runs_axis=0, confidence=0.999)
    assert_allclose(result.mean, nees(*honest()).mean(axis=0))
    assert (result.low < result.mean).all()
    assert (result.mean < result.high).all()
    assert_array_equal(result.runs, 400)
    assert (mean_nees(*honest(factor=1.2), runs_axis=0).mean > result.high).all()
    assert (mean_nees(*honest(factor=0.8), runs_axis=0).mean < result.low).all()


def test_the_bands_hold_as_often_as_they_say():
    """Over 400 times at 90 percent, each test is passed about 360 times."""
    error, P = honest(50, 400, 2, seed=2)
    total = mean_nees(error, P, runs_axis=0, confidence=0.9)
    passed = (total.low <= total.mean) & (total.mean <= total.high)
    assert 340 <= passed.sum() <= 380
    error = np.random.default_rng(3).normal(size=(50, 400, 1)) * 7
    spread = sample_deviation(error, np.full((50, 400, 1, 1), 49.0), runs_axis=0, confidence=0.9)
    assert 340 <= ((spread.low <= 7) & (spread.high >= 7)).sum() <= 380
    within = coverage(error, np.full((50, 400, 1, 1), 49.0), 1.0, runs_axis=0, confidence=0.9)
    held = (within.low <= within.expected) & (within.expected <= within.high)
    assert held.sum() >= 355  # Clopper and Pearson promise at least


def test_a_wrong_combination_hides_from_the_axes_and_not_from_nees():
    """Two errors whose correlation has the wrong sign: each by itself looks right."""
    rng = np.random.default_rng(4)
    true, believed = np.array([[1, 0.9], [0.9, 1]]), np.array([[1, -0.9], [-0.9, 1]])
    error = rng.multivariate_normal(np.zeros(2), true, 200)
    P = np.broadcast_to(believed, (200, 2, 2))
    spread = sample_deviation(error, P, runs_axis=0)
    assert ((spread.low < spread.predicted) & (spread.predicted < spread.high)).all()
    assert mean_nees(error, P, runs_axis=0).mean > 5


def test_sample_deviation_in_a_plain_loop():
    error, P = honest(30)
    result = sample_deviation(error, P, runs_axis=0)
    assert_allclose(result.mean, error.mean(axis=0))
    assert_allclose(result.sample, error.std(axis=0, ddof=1))
    mean_variance = np.mean([[np.diag(p) for p in run] for run in P], axis=0)
    assert_allclose(result.predicted, np.sqrt(mean_variance))
    ends = 29 / stats.chi2.ppf([0.975, 0.025], 29)
    assert_allclose(result.low, result.sample * np.sqrt(ends[0]))
    assert_allclose(result.high, result.sample * np.sqrt(ends[1]))


def test_coverage_is_clopper_and_pearsons():
    error, P = honest(60)
    result = coverage(error, P, 2.0, runs_axis=0)
    deviation = np.sqrt(np.diagonal(P, axis1=-2, axis2=-1))
    hits = np.sum(np.abs(error) <= 2 * deviation, axis=0)
    assert_allclose(result.fraction, hits / 60)
    for i in np.ndindex(hits.shape):
        interval = stats.binomtest(int(hits[i]), 60).proportion_ci(0.95, "exact")
        assert_allclose([result.low[i], result.high[i]], interval, rtol=1e-12)
    assert_allclose(result.expected, 0.9545, atol=1e-4)


@pytest.mark.parametrize(("scale", "fraction"), [(0.0, 1.0), (1e9, 0.0)])
def test_coverage_of_all_and_of_none(scale, fraction):
    error, P = honest(10)
    result = coverage(scale * error, P, runs_axis=0)
    assert_array_equal(result.fraction, fraction)
    interval = stats.binomtest(round(10 * fraction), 10).proportion_ci(0.95, "exact")
    assert_allclose([result.low[0, 0], result.high[0, 0]], interval, rtol=1e-12)


@pytest.mark.parametrize("judge", [mean_nees, sample_deviation, coverage])
def test_runs_that_failed_are_left_out_and_counted(judge):
    error, P = honest(20)
    wanted = judge(np.delete(error, [3, 7], 0), np.delete(P, [3, 7], 0), runs_axis=0)
    error[3, 1], P[7, 1] = np.nan, np.nan
    got = judge(error, P, runs_axis=0)
    assert_array_equal(got.runs, [20, 18, 20])
    for a, b in zip(got, wanted, strict=True):
        if np.ndim(a):
            assert_allclose(a[1], b[1], rtol=1e-13)


@pytest.mark.parametrize("judge", [mean_nees, sample_deviation, coverage])
def test_one_covariance_may_serve_all_runs(judge):
    error, P = honest(20, 3, 2)
    got = judge(error, P[:1, :1], runs_axis=0)
    wanted = judge(error, np.broadcast_to(P[:1, :1], P.shape), runs_axis=0)
    for a, b in zip(got, wanted, strict=True):
        assert_array_equal(a, b)


@pytest.mark.parametrize("judge", [mean_nees, sample_deviation, coverage])
@pytest.mark.parametrize("axis", [1, -2])
def test_any_axis_may_be_that_of_the_runs(judge, axis):
    """A history, (times, runs, n), is averaged over its runs and never over time."""
    error, P = honest(20)
    got = judge(error.swapaxes(0, 1), P.swapaxes(0, 1), runs_axis=axis)
    for a, b in zip(got, judge(error, P, runs_axis=0), strict=True):
        assert_allclose(a, b, rtol=1e-13)


@pytest.mark.parametrize("judge", [mean_nees, sample_deviation, coverage])
def test_a_covariance_of_each_time_serves_all_runs(judge):
    """As of a filter whose P does not depend on what it measures: aligned from the end."""
    error, P = honest(20, 3, 2)
    error, P = error.swapaxes(0, 1), P[0][:, None]
    got = judge(error, P, runs_axis=1)
    wanted = judge(error, np.broadcast_to(P, (3, 20, 2, 2)), runs_axis=1)
    for a, b in zip(got, wanted, strict=True):
        assert_array_equal(a, b)


def test_mean_nis_of_a_filter_that_is_right():
    """Innovations and S in place of errors and covariances; NaN where nothing was measured."""
    innovation, S = honest(400, 5, 2)
    innovation[:100, 2] = np.nan
    result = mean_nees(innovation, S, runs_axis=0, confidence=0.999)
    assert_array_equal(result.runs, [400, 400, 300, 400, 400])
    assert ((result.low < result.mean) & (result.mean < result.high)).all()
    assert_allclose(result.mean, np.nanmean(nis(innovation, S), axis=0))


@pytest.mark.parametrize("judge", [mean_nees, sample_deviation, coverage])
def test_the_axis_of_the_runs_must_be_named(judge):
    with pytest.raises(TypeError, match="runs_axis"):
        judge(*honest(5))


E, P = honest(5)
REFUSED = {
    "confidence": (
        lambda: chi_square_band(9, 1, 95),
        "confidence must be between 0 and 1; found 95",
    ),
    "dof": (lambda: chi_square_band(0), "dof and runs must be at least 1; found 0 and 1"),
    "runs": (lambda: chi_square_band(9, 0), "dof and runs must be at least 1; found 9 and 0"),
    "shapes": (
        lambda: mean_nees(E, P[..., :2], runs_axis=0),
        r"error and cov must have shapes .*found \(5, 3, 4",
    ),
    "no runs axis": (
        lambda: coverage(E[0, 0], P[0, 0], runs_axis=0),
        r"\(..., n\).*an axis of runs; found \(4,\)",
    ),
    "core axis": (
        lambda: mean_nees(E, P, runs_axis=2),
        r"runs_axis must name an axis of error before its last, 0 to 1; found 2, and .*5, 3, 4",
    ),
    "core axis from the end": (
        lambda: coverage(E, P, runs_axis=-1),
        r"before its last, 0 to 1; found -1, and error of shape \(5, 3, 4\)",
    ),
    "no such axis": (
        lambda: sample_deviation(E, P, runs_axis=3),
        r"before its last, 0 to 1; found 3, and error of shape \(5, 3, 4\)",
    ),
    "far below": (
        lambda: mean_nees(E, P, runs_axis=-4),
        r"before its last, 0 to 1; found -4, and error of shape",
    ),
    "no integer": (
        lambda: mean_nees(E, P, runs_axis=0.0),
        r"before its last, 0 to 1; found 0.0, and error of shape",
    ),
    "batch": (lambda: mean_nees(E, P[:, :2], runs_axis=0), "batch.*error .5, 3., cov .5, 2."),
    "all failed": (
        lambda: mean_nees(E * np.nan, P, runs_axis=0),
        "at least 1 finite runs; found 0",
    ),
    "one run": (
        lambda: sample_deviation(E[:1], P[:1], runs_axis=0),
        "at least 2 finite runs; found 1",
    ),
    "none": (lambda: coverage(E[:0], P[:0], runs_axis=0), "at least 1 finite runs; found 0"),
    "k": (
        lambda: coverage(E, P, -1.0, runs_axis=0),
        "k must be a positive number of deviations; found -1",
    ),
}


@pytest.mark.parametrize(("call", "message"), REFUSED.values(), ids=REFUSED)
def test_bad_input_is_refused_by_name(call, message):
    with pytest.raises(ValueError, match=message):
        call()
