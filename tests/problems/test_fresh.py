"""The best of a scan, on draws that did not choose it."""

import pytest

from navfilters.problems import (
    CURES,
    Cell,
    Fresh,
    best,
    fresh,
    fresh_report,
    own,
    problems,
    read,
    read_fresh,
    treat,
    write_fresh,
)

PATIENT = "three images"
BY_NAME = {cure.name: cure for cure in CURES}


def scanned(**ratios):
    """A table with an EKF of error 2 and values of B-EKF 1."""
    made = [Cell(PATIENT, "EKF", ratio=2.0)]
    return made + [Cell(PATIENT, "B-EKF 1", float(v[1:]), ratio=r) for v, r in ratios.items()]


def test_the_best_value_is_flown_again():
    patient = problems()[PATIENT]
    (row,) = fresh(scanned(b1=1.8, b5=1.5), {PATIENT: patient}, 12, [3, 4])
    assert (row.cure, row.value, row.then) == ("B-EKF 1", 5.0, 0.75)
    for seed, again in zip((3, 4), row.again, strict=True):
        both = []
        for name, value in (("B-EKF 1", 5.0), ("EKF", 1.0)):
            believed, estimator = BY_NAME[name].apply(patient, value)
            both.append(treat(patient, estimator, 12, seed, believed=believed).rms)
        assert again == pytest.approx(float(both[0] / both[1]), rel=1e-12)
    assert row.again[0] != row.again[1]
    assert "three images: B-EKF 1 5" in fresh_report([row])


def test_a_problem_without_a_scan_is_refused():
    with pytest.raises(ValueError, match="three images"):
        fresh(scanned(), {PATIENT: problems()[PATIENT]}, 4)


def test_what_is_written_is_read_to_three_digits(tmp_path):
    path = tmp_path / "fresh.json"
    write_fresh(path, [Fresh(PATIENT, "AREKF", 0.15, 0.123456, (1.23456, 5e-7))])
    assert read_fresh(path) == [Fresh(PATIENT, "AREKF", 0.15, 0.123, (1.23, 5e-7))]


def test_the_stored_rows_are_of_the_stored_table():
    """A table that was computed anew needs fresh draws for its new best values."""
    cells = read()
    first, chosen = own(cells), best(cells).values()
    assert [row.problem for row in read_fresh()] == list(problems(full=True))
    for row in read_fresh():
        at_best = min(
            (c for c in chosen if c.problem == row.problem and c.value is not None),
            key=lambda c: c.ratio,
        )
        assert (row.cure, row.value) == (at_best.cure, at_best.value)
        assert row.then == pytest.approx(at_best.ratio / first[row.problem, "EKF"].ratio, rel=6e-3)
        assert len(row.again) == 4


def test_a_stored_row_comes_again():
    """The other sets of draws are flown anew for the cheapest patient."""
    (row,) = fresh(read(), {PATIENT: problems()[PATIENT]})
    (kept,) = (r for r in read_fresh() if r.problem == PATIENT)
    assert row.again == pytest.approx(kept.again, rel=6e-3)
