"""The table: complete, stored as it is computed, and read as it is written."""

import math
from dataclasses import replace

import numpy as np
import pytest

from navfilters import Gaussian
from navfilters.models import Linear
from navfilters.problems import (
    CURES,
    Cell,
    Draw,
    Problem,
    best,
    cells,
    elsewhere,
    listing,
    own,
    problems,
    read,
    reasons,
    rows,
    stored,
    table,
)
from navfilters.problems.table import settled

BY_NAME = {cure.name: cure for cure in CURES}
STORED = read()


@pytest.fixture(scope="module")
def full():
    """The patients of the stored table; the satellite's takes seconds to solve."""
    return problems(full=True)


def test_every_pair_is_stored_in_order(full):
    pairs = list(own(STORED))
    assert pairs == [(patient, cure.name) for patient in full for cure in CURES]


def test_a_pair_has_either_numbers_or_a_reason():
    for cell in STORED:
        assert bool(cell.reason) == math.isnan(cell.ratio)
        assert bool(cell.reason) == (cell.evaluations == 0)


@pytest.mark.parametrize(
    ("patient", "cure"),
    [
        ("three images", "EKF"),
        ("three images", "B-UKF"),
        ("pendulum", "UKF"),
        ("fix, noisy", "polar"),
    ],
)
def test_the_stored_table_is_what_the_library_computes(patient, cure, full):
    fresh = cells(full[patient], BY_NAME[cure], stored.RUNS, scan=False)[0]
    kept = own(STORED)[patient, cure]
    for name in ("ratio", "median", "lost", "honesty", "nis", "covered"):
        assert getattr(fresh, name) == pytest.approx(getattr(kept, name), rel=1e-3)
    assert (fresh.honest, fresh.evaluations) == (kept.honest, kept.evaluations)


def test_a_table_is_read_as_it_was_written(tmp_path, full):
    three = {"three images": full["three images"]}
    found = table(3, patients=three, cures=[BY_NAME["AREKF"], BY_NAME["B-EKF 3"]])
    stored.write(tmp_path / "table.csv", found)
    again = read(tmp_path / "table.csv")
    assert [c.cure for c in again] == [c.cure for c in found]
    assert again[0].ratio == pytest.approx(found[0].ratio, rel=1e-3)
    assert again[-1].reason.startswith("needs a square H")


def test_only_what_is_lost_is_decided_by_rounding(full):
    """Where a filter works, the last bits of its first estimate do not matter."""
    assert min(cell.lost for cell in STORED if not cell.settled) > 0.1
    shown = [cell for row in rows(STORED) for cell in row.cells if not cell.settled]
    assert min(cell.lost for cell in shown) > 0.5
    first = own(STORED)
    assert all(first[patient, "EKF"].settled for patient in full)


class Chaotic:
    """A logistic map for dynamics: a last bit is everything after some fifty steps."""

    Q = np.array([[1e-30]])

    def f(self, x):
        return 4 * x * (1 - x)

    def transition(self, x):
        return self.f(x), (4 - 8 * x)[..., None] * 0.0


def test_a_last_bit_that_decides_is_found():
    def draw(runs, seed):
        start = np.full((runs, 1), 0.3)
        z = np.zeros((120, runs, 1))
        truth = np.full((121, 1, 1), 0.5)
        return Draw(Gaussian(start, np.eye(1)), truth, z)

    model = Linear(np.eye(1), 1e30 * np.eye(1))  # sees nothing
    still = Problem("still", draw, model, 120, (0,), "m", 120, dynamics=None)
    moving = replace(still, name="chaos", dynamics=Chaotic())
    for problem, wanted in ((still, True), (moving, False)):
        (cell,) = settled(problem, BY_NAME["EKF"], 2)
        assert cell.settled == wanted


def test_another_file_is_refused(tmp_path):
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match="path must be a table with the columns"):
        read(tmp_path / "other.csv")


def made(problem, cure, value, ratio, reason=""):
    return Cell(problem, cure, value, ratio=ratio, reason=reason)


def test_a_value_that_rounding_decides_is_not_the_best():
    few = replace(made("p", "AREKF", 0.1, 2.0), settled=False)
    assert best([few, made("p", "AREKF", 0.2, 3.0)])["p", "AREKF"].value == 0.2
    shown = listing(rows([few]))
    assert "<td>lost</td>" in shown


def test_rows_have_the_texts_value_and_the_best_in_hindsight():
    found = [
        made("p", "AREKF", 0.2, 3.0),
        made("p", "AREKF", 0.1, 2.0),
        made("p", "more Q", 10.0, 5.0),
        made("p", "more Q", 99.0, 4.0),
    ]
    shown = [(row.label, row.cells[0].ratio) for row in rows(found)]
    assert shown == [("AREKF", 3.0), ("AREKF *", 2.0), ("more Q *", 4.0)]
    assert best(found)["p", "AREKF"].value == 0.1


def test_elsewhere_is_the_same_value_or_the_reason_why_not():
    found = [
        made("p", "Q", 1.0, 3.0),
        made("q", "Q", 2.0, 9.0),
        made("q", "Q", 1.0, 4.0),
        made("r", "Q", None, math.nan, "no dynamics"),
    ]
    assert elsewhere(found, found[0], "q").ratio == 4.0
    assert elsewhere(found, found[0], "r").reason == "no dynamics"
    with pytest.raises(ValueError, match="must be in the table"):
        elsewhere(found, found[0], "s")
    assert reasons(found) == {"Q": {"no dynamics": ["r"]}}


@pytest.mark.slow
def test_processes_compute_what_one_does(full):
    one = {"three images": full["three images"]}
    few = [BY_NAME[name] for name in ("EKF", "B-EKF 1", "UKF", "AREKF", "gate")]
    alone = table(3, patients=one, cures=few)
    assert table(3, patients=one, cures=few, workers=2) == alone
