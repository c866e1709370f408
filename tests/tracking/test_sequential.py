"""The flight for filters: derivatives against differences, numbers against the batch's."""

import numpy as np
import pytest

from navfilters import FILTERS, Gaussian, run
from navfilters.tracking import STARTS, flight, trial


@pytest.fixture(scope="module")
def real():
    return trial(flight())


def steps(x):
    return [1e3] * 3 + [0.5] * 3 + [1e-6] * 3 + [1e-3] * (len(x) - 9)


def test_the_reference_flies_along_its_own_truth(real):
    x = real.first
    for k in range(330):
        x = real.sequence.dynamics.at(k).f(x)
        assert np.abs(x[:3] - real.truth[k, :3]).max() < 0.5


@pytest.mark.parametrize("k", [0, 1, 2, pytest.param(327, marks=pytest.mark.slow)])
def test_a_transition_is_the_derivative_of_the_motion(real, k):
    before = real.truth[k - 1] if k else real.first[:9]
    x = np.concatenate([before, real.first[9:]])
    leg = real.sequence.dynamics.at(k)
    end, F, W = leg.propagate(x, 1e-10 * np.eye(3))
    assert np.array_equal(end, leg.f(x))
    h = np.diag(steps(x))
    slopes = np.linalg.solve(2 * h, leg.f(x + h) - leg.f(x - h)).T
    for part in (slice(0, 3), slice(3, 6), slice(6, 24)):
        size = np.maximum(np.abs(slopes[part]).max(axis=0), 1e-9)
        assert np.all(np.abs(F[part] - slopes[part]).max(axis=0) < 5e-3 * size)
    assert np.linalg.eigvalsh(W).min() > -1e-12 * max(np.trace(W), 1.0)
    assert W[9:].any() == W[:, 9:].any() == False  # noqa: E712


def test_white_acceleration_grows_as_in_the_textbook(real):
    """Far from the Earth, over one leg: q t^3/3, q t^2/2 and q t."""
    leg = real.sequence.dynamics.at(0)
    t = leg.step * leg.count
    W = leg.propagate(real.first, 1e-8 * np.eye(3))[2]
    assert W[0, 0] == pytest.approx(1e-8 * t**3 / 3, rel=1e-2)
    assert W[0, 3] == pytest.approx(1e-8 * t**2 / 2, rel=1e-2)
    assert W[3, 3] == pytest.approx(1e-8 * t, rel=1e-2)


@pytest.mark.parametrize("k", [0, 1, 2, 500])
def test_a_sensor_s_derivatives_are_its_own(real, k):
    x = np.concatenate([real.truth[k], real.first[9:]])
    sensor = real.sequence.model.at(k)
    H, second = sensor.jacobian(x)[0], sensor.hessian(x)[0]
    for j, h in enumerate(steps(x)):
        step = h * np.eye(len(x))[j]
        assert H[j] == pytest.approx(
            (sensor.h(x + step) - sensor.h(x - step))[0] / (2 * h), rel=1e-4, abs=1e-12
        )
    for j in range(3):
        step = 1e4 * np.eye(len(x))[j]
        slope = (sensor.jacobian(x + step) - sensor.jacobian(x - step))[0, :3] / 2e4
        assert np.abs(second[:3, j] - slope).max() < 1e-3 * np.abs(second).max() + 1e-18
    assert np.array_equal(second, second.T)


def test_a_motion_s_hessian_is_symmetric_and_the_change_of_its_jacobian(real):
    k = 327
    x = np.concatenate([real.truth[k - 1], real.first[9:]])
    leg = real.sequence.dynamics.at(k)
    second = leg.hessian(x)
    step = 5e3 * np.eye(len(x))[1]
    slope = (leg.propagate(x + step, np.eye(3))[1] - leg.propagate(x - step, np.eye(3))[1]) / 1e4
    assert np.abs(second[:3, :3, 1] - slope[:3, :3]).max() < 0.05 * np.abs(slope[:3, :3]).max()
    assert not real.sequence.dynamics.at(1).hessian(x).any() or leg.count


def test_a_vague_start_is_drawn_as_its_covariance_says(real):
    """A tenth of a millimetre a second for each metre of position."""
    starts = real.starts(STARTS, 400)
    deviations = np.sqrt(np.diagonal(starts.cov, axis1=-2, axis2=-1))
    assert deviations[:, 0, :6] == pytest.approx(STARTS[:, None] * [1, 1, 1, 1e-4, 1e-4, 1e-4])
    drawn = (starts.mean[..., :6] - real.first[:6]) / deviations[..., :6]
    assert drawn.std(axis=1) == pytest.approx(1.0, rel=0.1)


def test_numbers_are_the_residuals_of_the_batch(real):
    """At the reference every innovation is the batch's residual."""
    found = real.reference.residuals / real.flight.problem.deviation
    expected = found[~np.isnan(found)]
    for k in (0, 1, 2, 100, 400, 859):
        x = np.concatenate([real.truth[k], real.first[9:]])
        sensor = real.sequence.model.at(k)
        y = sensor.residual(real.sequence.z[k], sensor.h(x))[0]
        assert y == pytest.approx(expected[k], abs=2e-3)


def test_a_hidden_station_is_seen_by_nobody(real):
    z = real.sequence.without(np.array([-1, 3]))[..., 0]
    assert not np.isnan(z[:, 0]).any()
    assert np.array_equal(np.isnan(z[:, 1]), real.sequence.station == 3)


def test_starts_are_the_same_draws_at_every_size(real):
    starts = real.starts(STARTS, 3, leak=np.array([True, False, True]))
    assert starts.mean.shape == (3, 3, 24)
    apart = starts.mean[..., :6] - real.first[:6]
    assert np.allclose(apart[2], 100 * apart[0])
    assert not starts.cov[1, :, 6:9, 6:9].any()
    assert starts.cov[0, 0, 6, 6] == pytest.approx(1e-10)


def test_a_run_without_batch_is_a_member_of_a_sweep(real):
    starts = real.starts(STARTS[:2], 2)
    flown = real.fly(FILTERS["EKF"], starts, steps=12, workers=1, progress=False)
    one = Gaussian(starts.mean[1, 0], starts.cov[1, 0])
    s = real.sequence
    alone = run(FILTERS["EKF"], one, s.z[:12], s.model, dynamics=s.dynamics, z_per_step=True)
    assert np.abs(flown.mean[:, 1, 0, :3] - alone.mean[1:, :3]).max() < 1e-3
    assert real.errors(flown).shape == (12, 2, 2)


def test_surprises_of_a_hidden_station_are_those_of_its_prediction(real):
    starts = real.starts(STARTS[0], 1)
    flown = real.fly(
        FILTERS["EKF"],
        starts,
        hidden=np.array([2, -1])[:, None],
        steps=9,
        workers=1,
        progress=False,
    )
    rows = np.flatnonzero(real.sequence.station[:9] == 2)
    assert np.isnan(flown.innovation[rows, 0]).all()
    assert np.array_equal(flown.mean[rows[0], 0], flown.mean[rows[0], 0])
    first = rows[0]
    sensor = real.sequence.model.at(first)
    y = sensor.residual(real.sequence.z[first], sensor.h(flown.mean[first, 0]))
    assert y[0, 0] == pytest.approx(flown.innovation[first, 1, 0], rel=1e-6)
