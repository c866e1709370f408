"""The batch solution on a flight that is made up, where the truth is known."""

import re
from dataclasses import replace

import numpy as np
import pytest

from navfilters.tracking import DRAG, LEAK_RATE, MOTION, flight, solve
from navfilters.tracking.w3b import FOLDER

TIMES = 40  # measurements of the made-up flight


@pytest.fixture(scope="module")
def problem():
    """The first measurements of the real flight, of perfect values."""
    real = flight(degree=2)
    data = real.problem.observations
    short = replace(
        data, time=data.time[:TIMES], station=data.station[:TIMES], z=0 * data.z[:TIMES]
    )
    rows = np.arange(TIMES)
    made = replace(real.problem, observations=short, sites=real.problem.sites[rows])
    truth = np.array(real.start)
    truth[DRAG] = 0.0
    missing = np.isnan(data.z[:TIMES])
    z = np.where(missing, np.nan, -made.residuals(truth))
    return replace(made, observations=replace(short, z=z)), truth


def free_of(problem):
    free = np.zeros(problem.size, bool)
    free[:6] = True
    free[MOTION:] = True
    return free


def test_a_start_far_away_comes_back(problem):
    made, truth = problem
    start = truth + np.array([5e3, -8e3, 3e3, 0.5, -0.2, 0.1, *np.zeros(made.size - 6)])
    free = free_of(made)
    free[MOTION:] = False
    found = solve(made, start, free=free)
    deviation = np.sqrt(np.diag(found.cov))[:6]
    assert (np.abs(found.parameters - truth)[:6] < 0.02 * deviation).all()
    assert np.nanmax(np.abs(found.residuals[:, 0])) < 2.0


def test_what_is_not_free_or_not_seen_does_not_move(problem):
    made, truth = problem
    start = truth + 1.0
    start[LEAK_RATE], start[DRAG] = 0.0, 0.0
    start[7:10] = 0.0
    start[MOTION:] = truth[MOTION:] + 1e-3
    found = solve(made, start, free=free_of(made))
    held = ~free_of(made)
    unseen = [i for i in range(5) if i not in made.observations.station]
    for i in unseen:
        held[MOTION + 3 * i : MOTION + 3 * i + 3] = True
    assert unseen
    assert np.array_equal(found.parameters[held], start[held])
    assert not found.cov[held].any()


def test_members_are_solved_as_if_alone(problem):
    made, truth = problem
    alone = solve(made, truth, free=free_of(made))
    used = np.ones((2, TIMES), bool)
    used[1, ::7] = False
    J = alone.jacobian
    both = solve(made, np.stack([truth, truth]), free=free_of(made), used=used, jacobian=J)
    assert np.abs(both.parameters[0] - alone.parameters).max() < 1e-6 * np.abs(truth).max()
    grown = np.diagonal(both.cov[1] - both.cov[0])
    assert (grown >= -1e-9 * np.diag(both.cov[0])).all()
    assert grown[:3].min() > 0


def test_the_jacobian_is_that_of_the_residuals(problem):
    made, truth = problem
    J = made.jacobian(truth)
    for j, h in ((0, 10.0), (4, 1e-2), (8, 1e-8), (MOTION + 3, 1.0)):
        step = h * np.eye(made.size)[j]
        slope = (made.residuals(truth - step) - made.residuals(truth + step)) / (2 * h)
        apart = np.nanmax(np.abs(slope - J[..., j]), axis=0)
        assert (apart <= 1e-4 * np.abs(J[..., j]).max(axis=0) + 1e-12).all()


def test_azimuths_differ_by_less_than_half_a_turn(problem):
    made, truth = problem
    turned = replace(made.observations, z=made.observations.z + 2 * np.pi * np.eye(3)[1])
    residuals = replace(made, observations=turned).residuals(truth)
    assert np.nanmax(np.abs(residuals[:, 1])) < 1e-9


def test_too_few_iterations_are_an_error(problem):
    made, truth = problem
    with pytest.raises(ArithmeticError, match="not converged in 1 iterations"):
        solve(made, truth + 1e5 * np.eye(made.size)[0], free=free_of(made), iterations=1)


def test_the_start_is_what_the_settings_say():
    """Read anew: drag of 2.0 on 13.12 m^2 and 5370 kg; the sites' biases in metres and radians."""
    real = flight(degree=2)
    text = (FOLDER / "od_test_W3.in").read_text(encoding="utf-8")
    said = dict(re.findall(r"^([\w.\[\]]+) *= *(\S+)", text, re.M))
    assert real.start[DRAG] == pytest.approx(2.0 * 13.12 / 5370.0, rel=1e-12)
    assert (said["drag.cd"], said["drag.area"]) == ("2.0", "13.12")
    assert "mass = 5370.0" in text
    radius = np.hypot.reduce([float(said[f"orbit.cartesian.{c}"]) for c in ("px", "py", "pz")])
    assert np.linalg.norm(real.start[:3]) == pytest.approx(radius, rel=1e-12)
    speed = np.hypot.reduce([float(said[f"orbit.cartesian.{c}"]) for c in ("vx", "vy", "vz")])
    assert np.linalg.norm(real.start[3:6]) == pytest.approx(speed, rel=1e-12)
