"""Patients: their draws, their references, and what they refuse."""

import numpy as np
import pytest

from navfilters.papers.xiong2009 import VARIANTS, cramer_rao_bound
from navfilters.problems import Problem, problems, static_fix
from navfilters.problems.orbit_manoeuvre import orbit
from navfilters.runs import mean_nees, nees

PATIENTS = problems()
every_patient = pytest.mark.parametrize("patient", PATIENTS.values(), ids=PATIENTS)


@every_patient
def test_a_run_is_the_same_whatever_the_others_are(patient):
    few, many = patient.drawn(2), patient.drawn(3)
    np.testing.assert_array_equal(few.prior.mean, many.prior.mean[:2])
    np.testing.assert_array_equal(few.z, many.z[:, :2])


@every_patient
def test_first_estimates_are_as_wrong_as_they_say(patient):
    draw = patient.drawn(200)
    error = patient.error(draw.prior.mean, np.broadcast_to(draw.truth[0], draw.prior.mean.shape))
    found = mean_nees(error, draw.prior.cov, runs_axis=0, confidence=0.999)
    assert found.low < found.mean < found.high


@pytest.mark.parametrize("name", ["fix, noisy", "orbit, quiet", "burns, B"])
def test_measurements_are_as_noisy_as_they_say(name):
    patient = PATIENTS[name]
    draw = patient.drawn(5)
    rest = draw.z - patient.model.h(draw.truth[1:])
    found = np.mean(nees(rest, patient.model.R)) / rest.shape[-1]
    assert abs(found - 1) < 5 * np.sqrt(2 / rest.size)


def test_the_perfect_fix_has_no_noise():
    patient = PATIENTS["fix, perfect"]
    draw = patient.drawn(2)
    np.testing.assert_allclose(draw.z, patient.model.h(draw.truth[1:]) + 0 * draw.z, rtol=1e-15)


def test_the_reference_of_the_fix_is_the_bound_by_information():
    c, r = np.sqrt(0.5), np.hypot(100, 100)
    H = np.array([[c, c], [-c / r, c / r]])
    information = np.eye(2) / 100**2 + 50 * H.T @ np.diag([1 / 2.5e-5, 1 / 6e-3]) @ H
    bound = np.sqrt(np.trace(np.linalg.inv(information)))
    assert static_fix(True, 50).reference(3) == pytest.approx(bound, rel=1e-9)


def test_the_reference_in_the_burns_is_the_bound_of_a_known_thrust():
    bound = cramer_rao_bound("A", thrust="known")[18000::100]
    expected = np.sqrt(np.mean(np.sum(bound**2, axis=-1)))
    assert PATIENTS["burns, A"].reference(2) == pytest.approx(expected, rel=0.03)


def test_long_sub_steps_lead_to_the_same_place():
    x = VARIANTS["A"].x0
    by_second, by_twenty = (
        orbit("quiet", burns=False, step=step).dynamics.f(x) for step in (1.0, 20.0)
    )
    np.testing.assert_allclose(by_twenty[:3], by_second[:3], rtol=0, atol=0.01)
    np.testing.assert_allclose(by_twenty[3:], by_second[3:], rtol=0, atol=1e-4)


def test_burning_names_the_steps_with_fire():
    burning = PATIENTS["burns, A"].burning
    assert burning.sum() == 12 + 9
    assert (burning[72], burning[71], burning[83], burning[84]) == (True, False, True, False)
    assert PATIENTS["orbit, quiet"].burning is None


def test_a_step_that_does_not_divide_the_interval_is_refused():
    with pytest.raises(ValueError, match=r"step must be a whole part of 100 s; found 30"):
        orbit("quiet", step=30.0)


def test_a_window_beyond_the_end_is_refused():
    with pytest.raises(ValueError, match="since must be 1 to 5; found 6"):
        Problem("short", lambda runs, seed: None, None, 5, (0,), "m", 6)


@pytest.mark.slow
def test_the_satellite_is_told_no_leak_and_judged_by_the_batch_solution():
    pytest.importorskip("astropy")
    from navfilters.problems.real_satellite import satellite

    patient = satellite()
    assert patient.tested == tuple(range(6))  # position and velocity, of which the truth is told
    draw = patient.drawn(2)
    assert (draw.prior.cov[6:9] == 0).all()
    assert np.linalg.norm(draw.truth[-1, 0, 6:9]) > 1e-6  # and there is one
    sensors = [patient.model.at(k) for k in range(patient.steps)]
    seen = zip(sensors, draw.z[:, 0], draw.truth[1:, 0], strict=True)
    rest = np.array([sensor.residual(z, sensor.h(x)) for sensor, z, x in seen])
    assert np.sqrt(np.mean(rest**2)) < 3  # of the numbers' deviations, by the batch solution
