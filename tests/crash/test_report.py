"""What a report says, in lines, as data, as a page, as a command and as a fixture."""

import json

import numpy as np
import pytest
from bs4 import BeautifulSoup

from navfilters import FILTERS
from navfilters.__main__ import main as navfilters
from navfilters.crash import CHECKS, Case, crash_test, from_filterpy, from_functions
from navfilters.crash import suite as suites
from navfilters.crash.planted import textbook_ekf as ekf

pytest_plugins = ["navfilters.crash.pytest_plugin"]


@pytest.fixture(scope="module")
def report():
    return crash_test(ekf("no wrap"), ["linear", "jump"], name="mine", progress=False)


def test_lines(report):
    text = str(report)
    assert text.startswith("mine: 1 of 2 checks passed\npass  linear")
    assert "FAIL  jump" in text
    assert "range-bearing/sensitivity" in text


def test_three_lines_reproduce_a_failure(report):
    *imports, call = report.reproduce(report.findings[1])
    assert imports[0] == "from navfilters.crash import CHECKS"
    found = {}
    exec(
        f"{imports[0]}\nfound['cases'] = CHECKS['jump'](mine)",
        {"mine": ekf("no wrap"), "found": found},
    )
    assert not found["cases"][0].passed
    assert "CHECKS['jump'](mine)" in call


def test_data(report):
    data = json.loads(report.json())
    assert [row["passed"] for row in data["checks"]] == [True, False]
    case = data["checks"][1]["cases"][0]
    assert case["value"] > case["limit"]


def test_page(report):
    soup = BeautifulSoup(report.html(), "html.parser")
    assert [s["class"] for s in soup.find_all("section")] == [["pass"], ["fail"]]
    assert not soup.find_all(["script", "link", "img"])
    assert "CHECKS" in soup.pre.text


def test_a_filter_that_raises_fails_and_says_why():
    def broken(x, P, z, model):
        raise ZeroDivisionError("no luck")

    report = crash_test(from_functions(lambda x, P, d: (x, P), broken), ["linear"], progress=False)
    assert report.failed == ("linear",)
    assert "it raised ZeroDivisionError: no luck" in str(report)


def test_a_filter_without_numbers_fails():
    def lost(x, P, z, model):
        return x * np.nan, P

    report = crash_test(from_functions(lambda x, P, d: (x, P), lost), "correct", progress=False)
    assert set(report.failed) >= {"linear", "motion", "missing", "exact", "jump", "units"}


def test_a_filter_that_returns_something_else_is_told_so():
    """Of two states the mean alone was taken apart as if it were mean and covariance."""
    alone = from_functions(lambda x, P, d: (x, P), lambda x, P, z, model: x)
    report = crash_test(alone, ["decades"], progress=False)
    assert "must return mean and cov of shapes (2,) and (2, 2); found (1,) and ()" in str(report)
    certain = from_functions(lambda x, P, d: (x, P), lambda x, P, z, model: (x, 0 * P))
    assert crash_test(certain, ["decades"], progress=False).failed == ("decades",)


def test_what_is_not_asked_does_not_fail():
    report = crash_test(ekf(), ["images, TC-1"], progress=False)
    assert report.passed
    assert report.findings[0].passed is None
    assert "attitude" in report.findings[0].line


def test_an_interruption_keeps_what_was_done(monkeypatch):
    real = suites._examined

    def stop(subject, check):
        if check.name == "motion":
            raise KeyboardInterrupt
        return real(subject, check)

    monkeypatch.setattr(suites, "_examined", stop)
    report = crash_test(ekf(), ["linear", "motion", "missing"], progress=False)
    assert [f.check.name for f in report.findings] == ["linear"]
    assert report.missing == ("motion", "missing")
    assert not report.passed
    assert "interrupted; not made: motion, missing" in str(report)


def test_no_number_is_beyond_every_limit():
    case = Case("somewhere", "what", np.nan, 1.0)
    assert not case.passed
    assert case.excess == np.inf


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: crash_test(ekf(), "fast"), "suite must be one of .*found 'fast'"),
        (lambda: crash_test(ekf(), ["linear", "x"]), "found 'x'"),
        (lambda: crash_test(7), "estimator must be a filter"),
        (lambda: from_functions(7, ekf), "predict must be a function; found 7"),
        (lambda: from_filterpy(dict), "one of filterpy's four; found dict"),
        (lambda: from_filterpy(dict, alpha=1), r"unknown options \['alpha'\]"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises((ValueError, TypeError), match=message):
        call()


MINE = """
from navfilters.crash.planted import textbook_ekf as ekf
right, wrong = ekf(), ekf("no wrap")
"""


def test_the_help_says_what_passes_in_paragraphs_of_one_indent(capsys):
    with pytest.raises(SystemExit):
        navfilters(["crash-test", "--help"])
    said = capsys.readouterr().out.partition("what passes:\n")[2]
    indents = {len(line) - len(line.lstrip()) for line in said.splitlines() if line}
    assert indents == {2, 6}


def test_the_command(tmp_path, monkeypatch, capsys):
    (tmp_path / "mine.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    assert navfilters(["crash-test", "mine:right", "--check", "jump"]) == 0
    page, data = tmp_path / "r.html", tmp_path / "r.json"
    given = [
        "crash-test",
        "mine:wrong",
        "--check",
        "jump",
        "--html",
        str(page),
        "--json",
        str(data),
    ]
    assert navfilters(given) == 1
    assert "from mine import wrong as mine" in capsys.readouterr().out
    assert page.read_text().startswith("<!doctype html>")
    assert json.loads(data.read_text())["filter"] == "mine:wrong"


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("mine", "MODULE:NAME is needed"),
        ("no_such_module_here:x", "no module no_such_module_here"),
        ("mine:nothing", "mine has no nothing"),
    ],
)
def test_the_command_says_what_is_wrong(tmp_path, monkeypatch, capsys, where, message):
    (tmp_path / "mine.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        navfilters(["crash-test", where])
    assert end.value.code == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--html", "--json"])
def test_a_report_that_cannot_be_written_is_told(tmp_path, monkeypatch, capsys, option):
    """If there is no such folder, before anything is computed."""
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "r.part").mkdir()
    monkeypatch.chdir(tmp_path)
    given = ["crash-test", "mine:right", "--check", "jump", option]
    needed = f"{option}: a file in a folder that exists is needed; found "
    for path, message in ((".", needed + "."), ("none/r", needed + "none/r"), ("r", "directory")):
        with pytest.raises(SystemExit) as end:
            navfilters([*given, path])
        assert end.value.code == 2
        told = capsys.readouterr()
        assert message in told.err
        assert bool(told.out) == (path == "r")


def test_the_fixture(crash_test):
    crash_test(FILTERS["EKF"], ["linear"])
    with pytest.raises(pytest.fail.Exception, match="jump"):
        crash_test(ekf("no wrap"), ["jump"])


def test_checks_name_chapters_that_exist():
    from browser import toc

    assert {f"book/{c.chapter}" for c in CHECKS.values()} <= set(toc())
