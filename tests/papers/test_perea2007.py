"""The paper's set-up and the published table of position errors."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import Gaussian, run
from navfilters.models import RangeBearing
from navfilters.papers.perea2007 import (
    FILTERS,
    Setup,
    deviations,
    improvement,
    isotropic,
    position_error,
)

STEPS = [1, 2, 10, 100, 1000]

# Position errors after k updates, from 60-digit arithmetic (REPLICATION.md, part A).
TABLE = {
    "EKF": [34.8059705, 54.9210316, 54.6405820, 54.5657458, 54.3848227],
    "B-EKF 1": [51.3775111, 28.7432046, 0.518439238, 0.0165227628, 0.00175818626],
    "B-EKF 2": [51.3775111, 28.7431326, 0.522374858, 0.0156552823, 0.00141294873],
    "B-EKF 4": [34.8059705, 25.1657435, 8.19815186, 0.954496059, 0.0970424436],
}


@pytest.mark.parametrize("name", TABLE)
def test_position_errors_of_the_table(name):
    setup = Setup()
    history = run(FILTERS[name], setup.prior, setup.z, setup.model)
    error = position_error(history.mean, setup.x_true)
    assert_allclose(error[STEPS], TABLE[name], rtol=1e-6)


def test_the_mtsof_has_the_tables_digits_while_they_are_determined():
    setup = Setup()
    history = run(FILTERS["mtSOF"], setup.prior, setup.z, setup.model)
    error = position_error(history.mean, setup.x_true)
    assert_allclose(
        error[[1, 2, 10, 100]], [50.2366865, 32.6305656, 30.9477044, 32.8615336], rtol=1e-6
    )
    assert 39.17 < error[1000] < 39.19


def test_b_ekf_3_ends_at_a_tenth():
    """Eq. (16) literally: 0.100 at k = 1000."""
    setup = Setup()
    history = run(FILTERS["B-EKF 3"], setup.prior, setup.z, setup.model)
    assert round(float(position_error(history.mean[-1], setup.x_true)), 3) == 0.100


def test_the_baseline_is_section_iii():
    setup = Setup()
    assert setup.steps == 1000
    assert isinstance(setup.model, RangeBearing)
    assert_array_equal(setup.model.R, np.diag([2.5e-5, 6e-3]))
    assert_allclose(setup.z, [np.hypot(100, 100), np.pi / 4], rtol=1e-15)
    assert_array_equal(setup.prior.mean, [20.0, 80.0])
    assert_array_equal(setup.prior.cov, 1e4 * np.eye(2))


def test_one_field_changes_one_thing():
    setup = replace(Setup(), sigma=10.0, x_true=(-3.0, 4.0), range_variance=1.0)
    assert_array_equal(setup.prior.cov, 100 * np.eye(2))
    assert_allclose(setup.z, [5.0, np.arctan2(4, -3)], rtol=1e-15)
    assert_array_equal(setup.model.R, np.diag([1.0, 6e-3]))
    with pytest.raises(FrozenInstanceError):
        setup.sigma = 1.0


def test_isotropic_batches_of_means_and_deviations():
    means = np.arange(6.0).reshape(3, 2)
    one = isotropic(means[0], 2.0)
    assert isinstance(one, Gaussian)
    assert_array_equal(one.cov, [[4.0, 0.0], [0.0, 4.0]])
    many = isotropic(means, [1.0, 2.0, 3.0])
    assert_array_equal(many.mean, means)
    assert_array_equal(many.cov, np.eye(2) * np.array([1.0, 4.0, 9.0])[:, None, None])
    assert isotropic([1, 2, 3], 1).cov.shape == (3, 3)


def test_position_error_is_the_distance():
    assert position_error([3.0, 4.0], (0.0, 0.0)) == 5.0
    assert_array_equal(
        position_error(np.zeros((2, 3, 2)), [[3, 4], [6, 8], [0, 1]]), [[5, 10, 1]] * 2
    )


def test_deviations_are_counted_along_the_axes_and_of_any_symmetric_matrix():
    cov = np.array([np.diag([4.0, 1.0]), np.diag([4.0, 1.0]), np.diag([-4.0, 1.0])])
    mean = np.array([[2.0, 0.0], [0.0, 3.0], [2.0, 0.0]])
    assert_allclose(deviations(Gaussian(mean, cov), (0.0, 0.0)), [1.0, 3.0, 1.0])


def test_improvement_is_the_last_error_over_the_first():
    """Eq. (27), member by member; a member that failed is NaN, not an improvement."""
    mean = np.array(
        [
            [[0.0, 2.0], [4.0, 0.0], [1.0, 0.0]],
            [[9.0, 9.0], [9.0, 9.0], [9.0, 9.0]],
            [[0.0, 1.0], [0.0, 8.0], [np.nan, np.nan]],
        ]
    )
    got = improvement(Gaussian(mean, np.zeros((3, 3, 2, 2))), (0.0, 0.0))
    assert_array_equal(got, [0.5, 2.0, np.nan])


def test_improvement_of_the_baseline():
    setup = Setup()
    history = run(FILTERS["EKF"], setup.prior, setup.z, setup.model)
    assert_allclose(improvement(history, setup.x_true), 54.3848227 / np.hypot(80, 20), rtol=1e-6)
