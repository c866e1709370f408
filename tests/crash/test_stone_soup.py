"""Stone Soup's own filters come out as the book says; skipped where it is not installed."""

import sys
from functools import partial

import pytest

from navfilters.crash import crash_test, from_stonesoup

EASY = ["linear", "motion", "missing", "exact", "members", "jump"]


def test_without_it_one_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "stonesoup", None)
    monkeypatch.delitem(sys.modules, "stonesoup.types", raising=False)
    with pytest.raises(ImportError, match=r"from_stonesoup needs .*pip install stonesoup"):
        from_stonesoup(dict, dict)


@pytest.fixture
def soup():
    """Predictors and updaters by name."""
    predictor = pytest.importorskip("stonesoup.predictor.kalman")
    updater = pytest.importorskip("stonesoup.updater.kalman")

    def made(kind, **options):
        pair = (
            getattr(predictor, f"{kind}KalmanPredictor"),
            getattr(updater, f"{kind}KalmanUpdater"),
        )
        return from_stonesoup(pair[0], partial(pair[1], **options))

    return made


@pytest.mark.parametrize("kind", ["", "Extended", "Unscented", "Cubature"])
def test_they_are_kalman_filters_where_they_must_be(soup, kind):
    report = crash_test(soup(kind), EASY, progress=False)
    assert report.passed, str(report)


def test_the_ekf_is_correct_in_josephs_form_and_diverges(soup):
    joseph = soup("Extended", use_joseph_cov=True)
    assert crash_test(joseph, ["decades", "covariance", "axes"], progress=False).passed
    assert crash_test(joseph, ["starts"], progress=False).failed == ("starts",)


def test_its_short_form_loses_the_digits_that_joseph_keeps(soup):
    assert crash_test(soup("Extended"), ["decades"], progress=False).failed == ("decades",)


def test_the_ukf_turns_with_the_axes_and_is_lost_from_some_starts(soup):
    hard = ["decades", "axes", "starts"]
    assert crash_test(soup("Unscented"), hard, progress=False).failed == tuple(hard)


def test_what_is_no_class_is_refused(soup):
    with pytest.raises(TypeError, match="updater must be a class of Stone Soup or a partial"):
        from_stonesoup(dict, 7)


@pytest.mark.slow
def test_the_ekf_is_honest_on_the_pendulum(soup):
    report = crash_test(soup("Extended"), ["pendulum"], progress=False)
    assert report.passed, str(report)
