"""What checks ask: the problem of their name; the gain of a filter of the linearised problem."""

from functools import partial
from types import SimpleNamespace

import numpy as np
from numpy.testing import assert_allclose

from navfilters.crash import CHECKS
from navfilters.crash.problem_checks import _swept, patients
from navfilters.models import RangeBearing


def test_the_exact_share_is_that_of_a_linear_filter_step_by_step():
    """Forty updates of the error by (I - K H), where H is that of range and bearing by hand."""
    setup = SimpleNamespace(x_true=(30.0, 40.0), x0=(36.0, 32.0), steps=40)
    sensors = [RangeBearing(np.diag([4.0, 1e-2])), RangeBearing(np.diag([0.01, 1.0]))]
    sigma, end = np.array([5.0, 80.0]), np.array([[30.0, 45.0], [33.0, 36.0]])
    found = _swept(setup, np.array([1.0, 2.0]), sigma, sensors, end)
    H = np.array([[0.6, 0.8], [-40.0 / 2500, 30.0 / 2500]])  # of hypot(x, y) and atan2(y, x)
    for i, sensor in enumerate(sensors):
        error, P = np.array([6.0, -8.0]), sigma[i] ** 2 * np.eye(2)
        for _ in range(setup.steps):
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + sensor.R)
            error, P = error - K @ H @ error, P - K @ H @ P
        assert_allclose(found.exact[i], np.linalg.norm(error) / 10, rtol=1e-9)
    assert_allclose(found.gain, [5.0 / 10, 5.0 / 10])
    assert_allclose(found.parameter, [1.0, 2.0])


def test_a_check_on_a_problem_is_on_that_of_its_name():
    asked = {n: c.cases.args for n, c in CHECKS.items() if isinstance(c.cases, partial)}
    assert len(asked) == 8
    for name, (problem, runs) in asked.items():
        assert problem == name
        assert problem in patients()
        assert runs == (40 if name.startswith("images") else 20)
