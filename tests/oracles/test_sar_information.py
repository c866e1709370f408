"""All images in one matrix: against the recursion, against the library, and in its limits."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from navfilters.oracles import sar_information as oracle
from navfilters.oracles import sar_second_order as theory
from navfilters.oracles import uneven_gravity
from navfilters.papers.pogorelsky2020 import CASES, Trial, fly

pytestmark = pytest.mark.slow

SETUP = replace(CASES["TC-2"], steps=2)
ROWS = {"antenna": (0, 1, 3, 4), "plane": (2, 3, 4), "both": (0, 1, 2, 3, 4)}


@pytest.fixture(scope="module")
def flown():
    return theory.intervals(8)


@pytest.fixture(scope="module")
def images(flown):
    return oracle.all_images(flown)


def test_it_is_the_recursion(flown, images):
    wanted = theory.linear_filter(SETUP, flown)[1]
    unit = np.sqrt(np.diag(wanted))
    got = oracle.covariance(SETUP, images)
    assert_allclose(got / np.outer(unit, unit), wanted / np.outer(unit, unit), atol=1e-6)


@pytest.mark.parametrize("measured", ROWS)
def test_it_is_the_librarys_filter(images, measured):
    found = fly(SETUP, [Trial(measured, clock=1e-3)], 8, runs=20).covariances[8, 0]
    deviation = np.sqrt(np.diagonal(found, axis1=1, axis2=2)).mean(axis=0)
    wanted = oracle.covariance(SETUP, images, ROWS[measured], clock=1e-3)
    assert_allclose(deviation, np.sqrt(np.diag(wanted)), rtol=0.05)


def test_errors_that_are_told_cost_deviation_and_those_that_are_not_cost_honesty(images):
    P, nine = oracle.all_at_once(SETUP, images)
    assert_allclose(nine, 9, rtol=1e-12)
    told, honest = oracle.all_at_once(SETUP, images, pointing=1e-4)
    assert_allclose(honest, 9, rtol=1e-12)
    assert (np.diag(told)[:8] > np.diag(P)[:8]).all()  # the ninth no image sees
    same, more = oracle.all_at_once(SETUP, images, untold=[1e-4, 1e-4, 0, 0, 0])
    assert_allclose(same, P)
    assert more > 20


def test_a_clock_without_error_at_all_is_a_useless_one_in_the_limit(images):
    without = oracle.covariance(SETUP, images, (3, 4))
    useless = oracle.covariance(SETUP, images, ROWS["plane"], clock=1e6)
    assert_allclose(np.diag(useless), np.diag(without), rtol=1e-6)


def test_what_is_not_told_does_what_the_gains_of_the_recursion_make_of_it(flown, images):
    """A constant error of the range, and a force that the filter does not have."""
    steps, P = theory.linear_filter(SETUP, flown)
    rng = np.random.default_rng(0)
    drift = np.cumsum(rng.normal(size=(8, 6)) * ([5.0] * 3 + [1e-2] * 3), axis=0)
    bias = np.array([0.0, 0.0, 2.0, 0.0])
    m, before = np.zeros(9), np.zeros(9)
    for step, at in zip(steps, drift, strict=True):
        now = np.append(at, np.zeros(3))
        m = step.F @ (m - before) + now
        before = now
        m = m - step.K @ (step.H @ m + bias)
    unit = np.sqrt(np.diag(P))
    wanted = 9 + m / unit @ np.linalg.solve(P / np.outer(unit, unit), m / unit)
    got = oracle.all_at_once(SETUP, images, bias=[0, 0, 0, 2.0, 0], drift=drift)[1]
    assert_allclose(got, wanted, rtol=1e-5)


def test_uneven_gravity_solves_laplaces_equation():
    p, h = np.array([-1.1e6, -6.1e6, 3.4e6]), 2e4
    steps = h * np.eye(3)
    middle = uneven_gravity.potential(p)
    bends = [
        uneven_gravity.potential(p + s) + uneven_gravity.potential(p - s) - 2 * middle
        for s in steps
    ]
    assert abs(sum(bends)) < 1e-3 * max(map(abs, bends))
    assert abs(middle) > 100
