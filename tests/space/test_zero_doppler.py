"""The plane of zero Doppler as a measurement: equations, differences, JAX, and what is missing."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Gaussian
from navfilters.space import (
    NavigationState,
    SarGeometry,
    SarPass,
    TimedMeasurement,
    ZeroDoppler,
    body_axes,
    ellipsoid_intersection,
    enu_covariance,
    from_rotation_vector,
    retract,
)

R0 = np.array([-1108465.150, -6100044.949, 3397134.666])
V0 = np.array([-1003.9419331, 3801.3289491, 6498.2536689])
ANTENNA = SarGeometry(
    np.deg2rad(34.3),
    0.0,
    np.diag([0.0, 0.0, 1.0, 0.54**2]),
    enu_covariance((2.0, 8.0, 1.0), 29.76, -95.37),
    body_axes(R0, V0),
)
SENSOR = ZeroDoppler(ANTENNA, 0.7)
SIZE = np.array([1e3] * 3 + [10.0] * 3 + [1e-3] * 3)
UNIT = np.array([1e-3, 1e-3, 1e3, 1e3, 10.0])


def states(count=5):
    rng = np.random.default_rng(0)
    q = from_rotation_vector(rng.normal(size=(count, 3)) * 2e-3)
    pixel = ellipsoid_intersection(R0, ANTENNA.boresight(q))
    truth = NavigationState(R0, V0, q)
    estimate = NavigationState.of(retract(truth.x, SIZE * rng.normal(size=(count, 9))))
    return truth, estimate, pixel


def timed(pixel, **changed):
    """What the true state measures, without noise."""
    d = pixel - R0
    seen = TimedMeasurement(
        pixel,
        np.linalg.norm(d, axis=-1),
        np.full(len(pixel), np.linalg.norm(V0)),
        d @ V0 / np.linalg.norm(V0),
        np.zeros((len(pixel), 2)),
    )
    return seen._replace(**changed)


def test_the_third_number_is_the_distance_ahead_of_the_plane():
    truth, estimate, pixel = states()
    got = SENSOR.h(estimate, pixel)
    for i in range(5):
        v = estimate.v[i]
        wanted = np.dot(pixel[i] - estimate.r[i], v) / np.sqrt(np.dot(v, v))
        assert_allclose(got[i, 2], wanted, rtol=1e-12)
    assert_allclose(got[:, [0, 1, 3, 4]], ANTENNA.h(estimate, pixel), rtol=1e-14)
    y, sensor = SENSOR.given(timed(pixel).z)
    assert_allclose(y, sensor.h(truth.x), atol=1e-8)


def test_derivatives_by_differences():
    _, estimate, pixel = states()
    h, H = 1e-4, SENSOR.jacobian(estimate, pixel)
    for i in range(9):
        step = h * SIZE[i] * np.eye(9)[i]
        up, down = (
            SENSOR.h(NavigationState.of(retract(estimate.x, s * step)), pixel) for s in (1, -1)
        )
        slope = (up - down) / (2 * h) / UNIT
        assert_allclose(H[..., i] * SIZE[i] / UNIT, slope, rtol=1e-6, atol=1e-8)
    H_f = SENSOR.pixel_jacobian(estimate, pixel)
    for i in range(3):
        step = 0.1 * np.eye(3)[i]
        slope = (SENSOR.h(estimate, pixel + step) - SENSOR.h(estimate, pixel - step)) / 0.2
        assert_allclose(H_f[..., i] * 1e3 / UNIT, slope * 1e3 / UNIT, rtol=1e-5, atol=1e-6)


def test_the_error_of_the_pixel_is_one_error_in_all_rows():
    _, estimate, pixel = states()
    rng = np.random.default_rng(1)
    shifts = rng.multivariate_normal(np.zeros(3), ANTENNA.D, 20000)
    one = NavigationState(*(part[0] for part in estimate))
    y = SENSOR.h(one, pixel[0] + shifts) / UNIT
    wanted = (SENSOR.noise(estimate, pixel)[0] - SENSOR.R) / np.outer(UNIT, UNIT)
    assert_allclose(np.cov(y.T), wanted, atol=0.05 * np.sqrt(np.max(np.diag(wanted))) ** 2)
    assert abs(wanted[0, 2]) > 0.9 * np.sqrt(wanted[0, 0] * wanted[2, 2])


def test_jax_computes_the_same():
    _, estimate, pixel = states()
    with jax.enable_x64(True):
        there = NavigationState(*map(jnp.asarray, estimate))
        for name in ("h", "jacobian", "noise"):
            got = getattr(SENSOR, name)(there, jnp.asarray(pixel))
            assert_allclose(got, getattr(SENSOR, name)(estimate, pixel), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kept", [[0, 1, 3, 4], [2, 3, 4]])
def test_what_is_not_measured_is_as_if_it_had_never_been_there(kept):
    """The update with NaN is that of a textbook with fewer rows."""
    _, estimate, pixel = states()
    missing = timed(
        pixel,
        azimuth=timed(pixel).azimuth if 2 in kept else np.full(5, np.nan),
        ratios=np.full((5, 2), 0.0 if 0 in kept else np.nan),
    )
    P = np.diag(SIZE**2)
    got = FILTERS["EKF"](Gaussian(estimate.x, np.broadcast_to(P, (5, 9, 9))), missing.z, SENSOR)
    y, sensor = SENSOR.given(timed(pixel).z)
    H, R = sensor.jacobian(estimate.x)[:, kept], sensor.noise(estimate.x)[:, kept][:, :, kept]
    y = (y - sensor.h(estimate.x))[:, kept]
    K = P @ H.mT @ np.linalg.inv(H @ P @ H.mT + R)
    assert_allclose(got.mean, retract(estimate.x, (K @ y[..., None])[..., 0]), rtol=1e-7)
    scale = np.outer(SIZE, SIZE)
    assert_allclose(got.cov / scale, (P - K @ H @ P) / scale, atol=1e-8)


def test_without_a_pixel_nothing_is_measured():
    pixel = states()[-1]
    y, _ = SENSOR.given(timed(pixel * np.nan).z)
    assert np.isnan(y).all()


def test_each_member_may_have_its_own_noise():
    sensor = ZeroDoppler(ANTENNA, np.array([0.0, 2.0]), np.array([0.0, 1e-4]))
    assert_allclose(sensor.R[:, 2, 2], [0, 4])
    assert_allclose(sensor.R[:, 0, 0], [0, 1e-8])
    assert_allclose(sensor.R[:, 1, 1], [0, 1e-8])
    assert_array_equal(sensor.R[0], np.diag([0, 0, 0, 1, 0.54**2]))


def test_a_pass_gives_the_attitude_of_each_image():
    turned = body_axes(R0, V0 + np.array([100.0, 0, 0]))
    sensor = ZeroDoppler(SarPass(ANTENNA, np.stack([ANTENNA.T_e_b, turned])), 0.7)
    _, estimate, pixel = states()
    wanted = ZeroDoppler(replace(ANTENNA, T_e_b=turned), 0.7).h(estimate, pixel)
    assert_array_equal(sensor.at(1).h(estimate, pixel), wanted)
    assert SENSOR.at(3) is SENSOR


@pytest.mark.parametrize("name", ["sigma_azimuth", "pointing"])
def test_a_deviation_is_not_negative(name):
    with pytest.raises(ValueError, match=rf"{name} must be at least 0; found -1"):
        replace(SENSOR, **{name: -1.0})
