"""The promises about covariances, for any range-bearing problem."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from ten_filters import every_filter, norm

from navfilters import (
    FILTERS,
    Gaussian,
)
from navfilters.models import RangeBearing

EKF_FAMILY = ["EKF", "B-EKF 1", "B-EKF 2", "B-EKF 3", "B-EKF 4"]
ekf_family = pytest.mark.parametrize("name", EKF_FAMILY)


@st.composite
def range_bearing_problems(draw):
    """Any place, prior deviations of 0.1 to 100 % of the range, noise from 1 % of those, any z."""
    angle = st.floats(-np.pi, np.pi)
    r, a = draw(st.floats(1.0, 1e3)), draw(angle)
    x = r * np.array([np.cos(a), np.sin(a)])
    deviations = r * np.array([draw(st.floats(1e-3, 1.0)) for _ in range(2)])
    turn = draw(angle)
    V = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    P = (V * deviations**2) @ V.T
    least = deviations.min()
    range_deviation = least * draw(st.floats(1e-2, 10.0))
    bearing_deviation = least / r * draw(st.floats(1e-2, 10.0))
    off = draw(st.floats(-0.9, 0.9)) * range_deviation * bearing_deviation
    R = np.array([[range_deviation**2, off], [off, bearing_deviation**2]])
    z = np.array([r * draw(st.floats(0.1, 3.0)), draw(angle)])
    return Gaussian(x, (P + P.T) / 2), z, RangeBearing(R)


@every_filter
@given(range_bearing_problems())
def test_the_covariance_stays_symmetric_exactly(name, problem):
    _, P = FILTERS[name](*problem)
    assert_array_equal(P, P.T)


@ekf_family
@given(range_bearing_problems())
def test_an_update_never_adds_uncertainty(name, problem):
    """P+ <= P in the Loewner order; for B-EKF 4, which forgets P first, P+ <= |P| I."""
    prior = problem[0]
    before = norm(prior.cov) * np.eye(2) if name == "B-EKF 4" else prior.cov
    after = FILTERS[name](*problem).cov
    assert np.linalg.eigvalsh(before - after).min() >= -1e-13 * norm(before)


@ekf_family
@given(range_bearing_problems())
def test_the_ekf_family_keeps_its_covariance_positive_definite(name, problem):
    after = FILTERS[name](*problem).cov
    assert np.linalg.eigvalsh(after).min() > 0


@pytest.mark.parametrize("name", ["B-EKF 1", "B-EKF 2", "B-mtSOF", "B-UKF"])
@given(range_bearing_problems())
def test_a_bump_leaves_more_uncertainty(name, problem):
    """R_new >= R, so that P+ of the bumped filter is not below that of the bare one."""
    bare = {"B-EKF 1": "EKF", "B-EKF 2": "EKF", "B-mtSOF": "mtSOF", "B-UKF": "UKF"}[name]
    prior, _, model = problem
    P_zz = FILTERS[bare].moments(prior, model).P_zz
    if np.linalg.eigvalsh(P_zz).min() > 1e-6 * norm(P_zz):
        more = FILTERS[name](*problem).cov - FILTERS[bare](*problem).cov
        assert np.linalg.eigvalsh(more).min() >= -1e-9 * norm(prior.cov)


@pytest.mark.parametrize("name", ["B-EKF 1", "B-mtSOF", "B-UKF"])
@pytest.mark.parametrize("bump", [-0.5, np.nan, np.array([1.0, -1.0])])
def test_a_negative_bump_is_refused(name, bump):
    prior = Gaussian(np.array([20.0, 80.0]), 100.0 * np.eye(2))
    model = RangeBearing(np.diag([1.0, 0.01]))
    with pytest.raises(ValueError, match=r"bump must be at least 0; found (-|nan)"):
        FILTERS[name](prior, np.array([80.0, 1.0]), model, bump=bump)
