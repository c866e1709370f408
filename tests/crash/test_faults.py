"""Every planted fault is caught by the check that is meant for it; who is right passes."""

import pytest

from navfilters import FILTERS
from navfilters.crash import SUITES, crash_test, from_filterpy
from navfilters.crash.planted import FAULTS
from navfilters.crash.planted import textbook_ekf as ekf


@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_caught(fault):
    make, check = FAULTS[fault]
    report = crash_test(make(), [check], workers=1, progress=False)
    assert report.failed == (check,)
    assert not report.passed


@pytest.mark.parametrize("check", sorted({check for _, check in FAULTS.values()}))
def test_what_catches_a_fault_lets_a_correct_filter_of_another_author_pass(check):
    kalman = pytest.importorskip("filterpy.kalman")
    theirs = from_filterpy(kalman.ExtendedKalmanFilter)
    report = crash_test(theirs, [check], workers=1, progress=False)
    assert report.passed, str(report)


@pytest.mark.parametrize("check", SUITES["correct"])
def test_a_textbooks_filter_passes_what_is_asked_of_correct_ones(check):
    report = crash_test(ekf(), [check], progress=False)
    assert report.passed, str(report)


def test_the_librarys_own_ekf_is_correct_and_diverges():
    report = crash_test(FILTERS["EKF"], "quick", progress=False)
    assert report.failed == ("fix, perfect", "fix, noisy", "starts", "sweeps")


def test_filterpys_ekf_is_correct_and_diverges_in_the_same_way():
    kalman = pytest.importorskip("filterpy.kalman")
    theirs = from_filterpy(kalman.ExtendedKalmanFilter)
    assert crash_test(theirs, SUITES["correct"], progress=False).passed
    assert crash_test(theirs, ["starts"], progress=False).failed == ("starts",)


def test_filterpys_ukf_comes_out_as_the_book_says():
    """Correct where P is definite; the Cholesky factor needs that, and turns with the axes."""
    kalman = pytest.importorskip("filterpy.kalman")
    theirs = from_filterpy(kalman.UnscentedKalmanFilter)
    easy = ["linear", "motion", "missing", "members", "jump"]
    assert crash_test(theirs, easy, progress=False).passed
    hard = crash_test(theirs, ["exact", "decades", "axes", "starts"], progress=False)
    assert hard.failed == ("exact", "decades", "axes", "starts")


def test_filterpys_cubature_and_linear_filters():
    kalman = pytest.importorskip("filterpy.kalman")
    for kind in (kalman.KalmanFilter, kalman.CubatureKalmanFilter):
        report = crash_test(from_filterpy(kind), ["linear", "motion", "missing"], progress=False)
        assert report.passed, str(report)


@pytest.mark.slow
def test_the_whole_suite_of_the_ekf():
    report = crash_test(FILTERS["EKF"], progress=False)
    passed = [f.check.name for f in report.findings if f.passed]
    assert {"pendulum", "orbit, quiet"} <= set(passed)
    assert {"fix, perfect", "burns, A"} <= set(report.failed)
