"""The best of a scan, on draws that did not choose it."""

import pytest

from navfilters.problems import CURES, Cell, fresh, fresh_report, problems, treat

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
