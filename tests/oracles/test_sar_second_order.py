"""Second-order theory of the SAR filter: against the library's matrices and against draws."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.oracles import sar_second_order as theory
from navfilters.papers.pogorelsky2020 import CASES, linearised_flight, truth
from navfilters.runs import nees

pytestmark = pytest.mark.slow

SETUP = replace(CASES["TC-1"], steps=2)


@pytest.fixture(scope="module")
def flown():
    return theory.intervals(12)


def scaled(A, rows, columns):
    return A / np.outer(rows, columns)


def test_transitions_and_derivatives_are_the_librarys(flown):
    legs, P = linearised_flight(SETUP, truth(SETUP, 12), 12)
    first = np.sqrt(np.diag(SETUP.P0))
    for ours, leg in zip(flown, legs, strict=True):
        assert_allclose(
            scaled(ours.F, first, 1 / first), scaled(leg.F, first, 1 / first), atol=1e-5
        )
        size = np.sqrt(np.diag(leg.R))
        assert_allclose(
            scaled(ours.H, size, 1 / first), scaled(leg.H, size, 1 / first), rtol=1e-3, atol=1e-2
        )
    last = theory.linear_filter(SETUP, flown)[1]
    deviation = np.sqrt(np.diag(P))
    assert_allclose(np.sqrt(np.diag(last)), deviation, rtol=1e-3)


def test_without_curvature_a_filter_that_is_right_has_nine(flown):
    plain = replace(SETUP, underweighting=0.0)
    linear, shift, scatter = theory.second_order(plain, flown, rows=())
    assert_allclose(linear, 9, rtol=1e-5)  # the velocity's noise is left out
    assert_array_equal([shift, scatter], 0)
    held = theory.second_order(SETUP, flown, rows=())[0]
    assert held < 9  # underweighted, it errs less than it says


def test_the_bend_is_that_of_the_range_along_the_weak_direction(flown):
    """3 kappa^2 is most of what the range adds; the gap is s^2 / 2 rho of the weak deviation."""
    plain = replace(SETUP, underweighting=0.0)
    steps, P = theory.linear_filter(plain, flown)
    c, gaps = theory.bend(steps, P)
    _, shift, scatter = theory.second_order(plain, flown, rows=(2,))
    assert 0.5 < 3 * nees(c, P) / (shift + scatter) < 1.2
    sigma = theory.principal(P[:3, :3])[0][-1]
    assert_allclose(gaps[-1], sigma**2 / (2 * np.linalg.norm(steps[-1].d)), rtol=0.05)


def test_principal_axes_give_the_covariance_back():
    P, unit = np.array([[4.0, 1], [1, 2]]), np.array([2.0, 0.5])
    sigma, V = theory.principal(P, unit)
    assert sigma[0] < sigma[1]
    assert_allclose((V * sigma**2) @ V.T * np.outer(unit, unit), P)
