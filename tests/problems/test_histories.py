"""Courses of error and claim: stored as they are computed, and consistent with the table."""

import math

import numpy as np
import pytest

from navfilters.problems import CURES, own, problems, read, static_fix
from navfilters.problems.histories import (
    STEP,
    Course,
    History,
    course,
    histories,
    updates,
    write,
)
from navfilters.problems.histories import read as read_histories

PATIENTS = problems()
BY_NAME = {cure.name: cure for cure in CURES}
COURSES, STORED = read_histories()


def test_every_history_is_of_a_pair_of_the_table():
    table = {(c.problem, c.cure, c.value) for c in read() if not c.reason}
    kept = [h[:3] for h in STORED]
    assert len(set(kept)) == len(kept)
    assert set(kept) <= table
    missing = {key for key in table - set(kept) if key[0] != "satellite"}
    assert missing == set()


@pytest.mark.parametrize("cure", ["EKF", "B-EKF 1", "UKF"])
def test_the_stored_histories_are_what_the_library_computes(cure):
    fresh = histories(PATIENTS["three images"], BY_NAME[cure])
    kept = [h for h in STORED if h[:2] == ("three images", cure)]
    assert [h[:3] for h in fresh] == [h[:3] for h in kept]
    for new, old in zip(fresh, kept, strict=True):
        np.testing.assert_allclose(new[3:], old[3:], atol=STEP)


def test_a_course_ends_where_the_tables_error_is():
    """Twenty runs beside two hundred, where both are judged after the last update."""
    first = own(read())
    for name in ("fix, noisy", "images, TC-2"):
        for cure in ("EKF", "B-EKF 2", "UKF"):
            h = next(h for h in STORED if h[:2] == (name, cure))
            ratio = 10 ** h.error[-1] / COURSES[name].reference
            assert ratio == pytest.approx(first[name, cure].ratio, rel=0.5)


def test_polar_coordinates_claim_in_the_plane():
    """As much as converted measurements, which stay in it, once the first estimate is forgotten."""
    fix = static_fix(True, 50)
    polar, converted = (histories(fix, BY_NAME[name], 10)[0] for name in ("polar", "converted"))
    assert polar.claim[-1] == pytest.approx(converted.claim[-1], abs=0.02)


def test_updates_go_from_the_first_to_the_last():
    for patient in PATIENTS.values():
        at = updates(patient)
        assert (at[0], at[-1]) == (1, patient.steps)
        assert (np.diff(at) > 0).all()
    assert course(PATIENTS["three images"], 4).updates == (1, 2, 3, 4, 5)


def test_a_cure_that_cannot_act_has_no_course():
    assert histories(PATIENTS["three images"], BY_NAME["AEKF"], 2) == []


def test_they_are_read_as_they_were_written(tmp_path):
    head = Course("p", (1, 4), 4, 2.5, "m")
    lines = [History("p", "EKF", None, (1.0, math.nan), (0.5, 0.24))]
    write(tmp_path / "h.json", [head], lines)
    courses, found = read_histories(tmp_path / "h.json")
    assert courses == {"p": head}
    assert found[0].claim == (0.5, 0.24)
    assert found[0].error[0] == 1.0
    assert math.isnan(found[0].error[1])


def test_another_file_is_refused(tmp_path):
    (tmp_path / "other.json").write_text("[1]")
    with pytest.raises(ValueError, match="path must be a file of courses and histories"):
        read_histories(tmp_path / "other.json")
