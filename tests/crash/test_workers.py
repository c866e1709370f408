"""Members in other processes: the same numbers, a bar of updates, and Ctrl-C."""

import os
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from navfilters import FILTERS, Gaussian, run
from navfilters.crash import CHECKS, SUITES, crash_test, from_functions
from navfilters.crash.planted import textbook_ekf as ekf
from navfilters.crash.subject import Subject
from navfilters.crash.suite import updates
from navfilters.models import RangeBearing
from navfilters.problems import static_fix


def numbers(report):
    return [(c.configuration, c.value) for f in report.findings for c in f.cases]


def test_processes_change_no_number():
    one, two = (
        crash_test(ekf(), ["fix, noisy", "linear"], workers=w, progress=False) for w in (1, 2)
    )
    assert numbers(one) == numbers(two)


def test_members_are_divided():
    """A filter whose estimate is the number of the process that made it."""
    here = from_functions(lambda x, P, d: (x, P), lambda x, P, z, model: (0 * x + os.getpid(), P))
    problem = static_fix(True, 100)
    one = Subject(here).followed(problem, 20).estimate.mean[-1]
    two = Subject(here, workers=2).followed(problem, 20).estimate.mean[-1]
    assert set(one.flat) == {os.getpid()}
    assert os.getpid() not in set(two.flat)


@pytest.mark.parametrize("check", SUITES["correct"])
def test_the_bar_ends_at_its_total(check):
    """Updates are counted beforehand, with a filter that does nothing."""
    told = []
    CHECKS[check](Subject(FILTERS["EKF"], told=told.append))
    assert sum(told) == updates(check) > 0


def test_the_quick_suite_is_small_enough():
    """At 250 us an update, within five minutes on two cores: eight times over, even on one."""
    assert sum(updates(check) for check in SUITES["quick"]) * 250e-6 < 300 / 8


def test_the_bar_is_shown(capsys, monkeypatch):
    pytest.importorskip("tqdm")
    monkeypatch.setenv("TQDM_MININTERVAL", "0")
    crash_test(ekf(), ["linear", "missing"], workers=1)
    assert "/96 [" in capsys.readouterr().err


def test_without_joblib_it_is_one_process(monkeypatch):
    monkeypatch.setitem(sys.modules, "joblib", None)
    assert crash_test(ekf(), ["covariance"], progress=False).passed


def test_an_interruption_in_the_middle_of_a_check_keeps_those_before():
    right, count = ekf(), []

    def stopping(x, P, z, model):
        count.append(1)
        if len(count) > 700:
            raise KeyboardInterrupt
        return right.update(x, P, z, model)

    filter = from_functions(right.predict, stopping)
    report = crash_test(filter, ["linear", "covariance", "jump"], workers=1, progress=False)
    assert [f.check.name for f in report.findings] == ["linear"]
    assert report.missing == ("covariance", "jump")
    assert "interrupted; not made: covariance, jump" in str(report)


def test_what_is_raised_names_its_member():
    right = ekf()

    def sometimes(x, P, z, model):
        if z[0] > 5:
            raise ZeroDivisionError("far away")
        return right.update(x, P, z, model)

    filter = from_functions(right.predict, sometimes)
    report = crash_test(filter, ["covariance"], workers=1, progress=False)
    assert "it raised ZeroDivisionError: far away (configuration 0)" in str(report)


def test_bad_workers_are_refused():
    with pytest.raises(ValueError, match="workers must be an integer of at least 1; found 0"):
        crash_test(ekf(), ["linear"], workers=0)


def test_models_with_batch_axes_are_refused_by_name():
    """The shape of their product with one state was refused, whatever it was."""
    many = RangeBearing(np.eye(2) * np.ones((3, 1, 1)))
    still = SimpleNamespace(Q=many.R, f=lambda x: x, transition=lambda x: (x, np.eye(2)))
    prior = Gaussian(np.array([3.0, 4.0]), np.eye(2))
    for name, model, dynamics in (
        ("model.R", many, None),
        ("dynamics.Q", RangeBearing(many.R[0]), still),
    ):
        with pytest.raises(ValueError, match=rf"no batch axes.*found {name} of shape \(3, 2, 2\)"):
            run(ekf(), prior, np.ones(2), model, 1, dynamics=dynamics)
