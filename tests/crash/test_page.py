"""The pictures of a report: in the page itself, or a line that says why there are none."""

import base64
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from bs4 import BeautifulSoup
from numpy.testing import assert_allclose

from navfilters import FILTERS
from navfilters.crash import CHECKS, crash_test, figures, from_filterpy, from_functions
from navfilters.crash.comparison import champion, course, nis_of
from navfilters.crash.planted import textbook_ekf as ekf
from navfilters.problems import problems
from navfilters.problems.outcome import follow, treat
from navfilters.runs import nees


@pytest.fixture(scope="module")
def report():
    checks = ["jump", "fix, noisy", "starts", "sweeps"]
    return crash_test(FILTERS["B-EKF 1"], checks, name="mine", progress=False)


@pytest.fixture(scope="module")
def page(report):
    return report.html()


def test_every_picture_is_in_the_page(page):
    soup = BeautifulSoup(page, "html.parser")
    pictures = {s.h2.contents[0].strip(): s.find_all("img") for s in soup.find_all("section")}
    assert {name: len(found) for name, found in pictures.items()} == {
        "jump": 0,
        "fix, noisy": 1,
        "starts": 1,
        "sweeps": 1,
    }
    for image in soup.find_all("img"):
        kind, data = image["src"].split(",")
        assert kind == "data:image/svg+xml;base64"
        root = ET.fromstring(base64.b64decode(data))
        assert root.tag.endswith("svg")
        assert len(image["alt"]) > 60
    assert not soup.find_all(["script", "link", "a"])


def test_the_page_is_the_same_twice(report, page):
    assert report.html() == page


def test_without_matplotlib_one_line_says_so(report, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.delitem(sys.modules, "matplotlib.figure", raising=False)
    soup = BeautifulSoup(report.html(), "html.parser")
    assert not soup.find_all("img")
    assert soup.text.count("pictures of a report needs matplotlib: pip install") == 1


def test_the_colours_of_a_map_end_where_its_numbers_do(monkeypatch):
    monkeypatch.setattr(figures, "_svg", lambda figure: figure)
    figure, _ = figures._map(figures._ekf(figures.starts)["map"])
    bar = figure.axes[-1]
    assert bar.get_ylim() == (bar.get_yticks()[0], bar.get_yticks()[-1])


def test_an_interrupted_report_says_so_on_its_page():
    def stop(x, P, z, model):
        raise KeyboardInterrupt

    report = crash_test(from_functions(ekf().predict, stop), ["linear"], progress=False)
    assert "Interrupted; not made: linear" in report.html()


def test_a_course_ends_where_the_outcome_does():
    """Two ways to the same NEES and error: over all steps, and of the last alone."""
    problem = problems()["fix, noisy"]
    found = follow(problem, FILTERS["UKF"], 20)
    drawn = course(problem, found, 20)
    outcome = treat(problem, FILTERS["UKF"], 20)
    assert_allclose(drawn.nees[-1], outcome.honesty, rtol=1e-12)
    assert_allclose(drawn.error[-1], outcome.median, rtol=1e-12)
    assert_allclose(np.mean(drawn.nis[1:]), outcome.nis, rtol=1e-9)
    judged = [found.estimate.cov[..., i, i] for i in problem.judged]
    assert_allclose(drawn.claimed, np.median(np.sqrt(np.sum(judged, axis=0)), axis=1), rtol=1e-12)


def test_nis_leaves_out_what_was_not_measured():
    y, S = np.array([1.0, np.nan]), np.array([[4.0, 1.0], [1.0, 2.0]])
    assert nis_of(y, S) == pytest.approx(0.25)
    assert np.isnan(nis_of(np.array([np.nan, np.nan]), S))
    assert nis_of(np.array([1.0, 1.0]), S) == pytest.approx(nees(np.ones(2), S))


def test_the_champion_is_one_of_the_book():
    assert champion("burns, A")
    assert champion("jump") == ""


@pytest.mark.parametrize("problem", ["pendulum", "orbit, quiet", "burns, B", "fix, noisy"])
def test_filterpys_ekf_is_told_the_same_as_the_books(problem):
    """Noise that is not additive, or that enters on the way, is told as what it amounts to."""
    kalman = pytest.importorskip("filterpy.kalman")
    given = problems()[problem]
    theirs = follow(given, from_filterpy(kalman.ExtendedKalmanFilter), 1)
    ours = follow(given, FILTERS["EKF"], 1)
    deviation = np.sqrt(np.diagonal(ours.estimate.cov, axis1=-2, axis2=-1))
    assert_allclose((theirs.estimate.mean - ours.estimate.mean) / deviation, 0.0, atol=1e-4)
    spread = np.sqrt(np.diagonal(ours.S[1:], axis1=-2, axis2=-1))
    assert_allclose((theirs.innovation - ours.innovation)[1:] / spread, 0.0, atol=1e-4)
    apart = (theirs.S - ours.S)[1:] / spread[..., :, None] / spread[..., None, :]
    assert_allclose(apart, 0.0, atol=1e-6)


def test_checks_with_pictures_keep_what_they_show(report):
    kept = {f.check.name: list(f.kept) for f in report.findings}
    assert kept == {"jump": [], "fix, noisy": ["runs"], "starts": ["map"], "sweeps": ["sweeps"]}
    assert set(kept) <= set(CHECKS)
