"""A SAR image as a measurement: each equation literally, each Jacobian by differences and JAX."""

from dataclasses import replace
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from navfilters.space.frames import antenna_axes, body_axes, ellipsoid_intersection, enu_covariance
from navfilters.space.image_measurement import Measurement, SarGeometry
from navfilters.space.image_sensor import SarPass
from navfilters.space.navigation_state import NavigationState
from navfilters.space.pose import retract
from navfilters.space.quaternions import cross_matrix, from_rotation_vector, matrix

R0 = np.array([-1108465.150, -6100044.949, 3397134.666])
V0 = np.array([-1003.9419331, 3801.3289491, 6498.2536689])
R = np.diag([0.0, 0.0, 1.0, 0.54**2])
D = enu_covariance((2.0, 8.0, 1.0), 29.76, -95.37)
LOOK = np.deg2rad(34.3)
GEOMETRY = SarGeometry(LOOK, 0.0, R, D, body_axes(R0, V0))
SIZE = np.array([1e3] * 3 + [10.0] * 3 + [1e-3] * 3)  # of errors, m, m/s, rad
UNIT = np.array([1e-3, 1e-3, 1e3, 10.0])  # of what they do to y


def states(count=6, size=1.0):
    """Estimates around the pass over Houston, and the pixels that the true antenna sees."""
    rng = np.random.default_rng(0)
    error = size * SIZE * rng.normal(size=(count, 9))
    q = from_rotation_vector(rng.normal(size=(count, 3)) * 2e-3)
    pixel = ellipsoid_intersection(R0, GEOMETRY.boresight(q))
    truth = NavigationState(R0, V0, q)
    return NavigationState.of(retract(truth.x, error)), pixel


def moved(state, error):
    """The state whose error with respect to the given one is this."""
    return NavigationState.of(retract(state.x, error))


def told(geometry, state, measurement):
    """Residual, H and noise, as a filter asks for them."""
    y, sensor = geometry.given(measurement.z)
    x = state.x
    return y - sensor.h(x), sensor.jacobian(x), sensor.noise(x)


def differences(f, n, step):
    """Fourth-order central differences of f(error), f(0) being where; columns last."""
    steps = (step * np.eye(n))[:, None]
    at = {k: f(k * steps) for k in (-2, -1, 1, 2)}
    return np.moveaxis((8 * (at[1] - at[-1]) - (at[2] - at[-2])) / 12, 0, -1) / step


def test_h_is_equations_13_to_18_one_by_one():
    estimate, pixel = states()
    got = GEOMETRY.h(estimate, pixel)
    for i in range(6):
        T_mu = Rotation.from_quat(estimate.q_mu[i]).as_matrix().T
        r_sf = pixel[i] - estimate.r[i]
        x, y, z = T_mu @ antenna_axes(LOOK) @ body_axes(R0, V0) @ r_sf
        wanted = [x / z, y / z, np.linalg.norm(r_sf), np.linalg.norm(estimate.v[i])]
        assert_allclose(got[i], wanted, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("look", [34.3, -34.3, 10.0])
@pytest.mark.parametrize("squint", [0.0, 5.0])
def test_the_true_state_sees_what_is_measured(look, squint):
    """(0, 0, range, speed), whatever the misalignment: the boresight defines the pixel."""
    geometry = replace(GEOMETRY, look=np.deg2rad(look), squint=np.deg2rad(squint))
    q = from_rotation_vector(np.array([[0.0, 0, 0], [1e-3, -2e-3, 3e-3]]))
    pixel = ellipsoid_intersection(R0, geometry.boresight(q))
    slant_range = np.linalg.norm(pixel - R0, axis=-1)
    truth = NavigationState(R0, V0, q)
    measured = Measurement(pixel, slant_range, np.full(2, np.linalg.norm(V0)))
    residual, _, _ = told(geometry, truth, measured)
    assert_allclose(residual / UNIT, 0, atol=1e-11)
    east = np.array([-R0[1], R0[0], 0.0]) @ (pixel[0] - R0)
    assert (east < 0) == (look < 0)  # northwards, the right side is east


def test_jacobian_by_differences():
    """All nine errors, the misalignment's multiplied from the left, to 1e-7 of each block."""
    estimate, pixel = states()
    got = GEOMETRY.jacobian(estimate, pixel) * SIZE / UNIT[:, None]
    wanted = differences(lambda e: GEOMETRY.h(moved(estimate, e * SIZE), pixel), 9, 1.0)
    wanted = wanted / UNIT[:, None]
    for columns in (slice(3), slice(3, 6), slice(6, 9)):
        for row in range(4):
            block = wanted[:, row, columns]
            assert_allclose(
                got[:, row, columns], block, rtol=0, atol=1e-7 * max(np.abs(block).max(), 1e-4)
            )


def test_jacobians_by_jax():
    estimate, pixel = states()

    def of_all(small, r, v, q, r_f):
        state = moved(NavigationState(r, v, q), small[:9])
        return GEOMETRY.h(state, r_f + small[9:])

    small = jnp.full(12, 1e-30)  # at zero itself the length of the rotation has no derivative
    each = jax.vmap(jax.jacfwd(of_all), (None, 0, 0, 0, 0))
    fast = {"xla_backend_optimization_level": 0}  # to compile
    both = jax.jit(each, compiler_options=fast)(small, *estimate[:3], pixel)
    H, H_f = GEOMETRY.jacobian(estimate, pixel), GEOMETRY.pixel_jacobian(estimate, pixel)
    got = np.concatenate([H, H_f], axis=-1)
    scale = np.concatenate([SIZE, [1e3] * 3]) / UNIT[:, None]
    assert_allclose(got * scale, np.asarray(both) * scale, rtol=0, atol=1e-12)
    assert_array_equal(H_f[:, 3], 0)
    assert_array_equal(H_f[:, :3], -H[:, :3, :3])


def test_jacobians_are_equations_20_to_30_and_their_slips():
    """(27) as printed, with the antenna's axes applied twice, is wrong by its own size."""
    estimate, pixel = states(1)
    H = GEOMETRY.jacobian(estimate, pixel)[0]
    T = matrix(estimate.q_mu[0]) @ GEOMETRY.T_b_s @ GEOMETRY.T_e_b
    r_sf = pixel[0] - estimate.r[0]
    x, y, z = s = T @ r_sf
    of_s = np.array([[1 / z, 0, -x / z**2], [0, 1 / z, -y / z**2]])
    assert_allclose(H[:2, :3], -of_s @ T, rtol=1e-12)
    assert_allclose(H[2, :3], -r_sf / np.linalg.norm(r_sf), rtol=1e-12)
    assert_allclose(H[3, 3:6], estimate.v[0] / np.linalg.norm(estimate.v[0]), rtol=1e-12)
    assert_allclose(H[:2, 6:], of_s @ cross_matrix(s), rtol=1e-12)
    assert_allclose(H[:2, 6:], [[0, -1, 0], [1, 0, 0]], atol=5e-3)  # per radian
    assert np.abs(H[:2, 6:] - of_s @ cross_matrix(T @ s)).max() > 0.5
    for rows, columns in ((slice(2), slice(3, 6)), (2, slice(3, 9)), (3, [0, 1, 2, 6, 7, 8])):
        assert_array_equal(H[rows, columns], 0)


def test_pixel_covariance_is_equation_29():
    estimate, pixel = states()
    zero = np.zeros(6)
    _, H, total = told(GEOMETRY, estimate, Measurement(pixel, zero, zero))
    H_f = GEOMETRY.pixel_jacobian(estimate, pixel)
    for i in range(6):
        assert_allclose(total[i], R + H_f[i] @ D @ H_f[i].T, rtol=1e-9, atol=1e-24)
    assert_array_equal(H, GEOMETRY.jacobian(estimate, pixel))


def test_pixel_covariance_is_that_of_the_residuals():
    """20 000 pixels in error, seen by the true state."""
    rng = np.random.default_rng(1)
    truth = NavigationState(R0, V0, np.array([0.0, 0, 0, 1]))
    hit = ellipsoid_intersection(R0, GEOMETRY.boresight(truth.q_mu))
    n = 20000
    pixel = hit + rng.multivariate_normal(np.zeros(3), D, n)
    ranges = np.linalg.norm(hit - R0) + rng.normal(size=n)
    speeds = np.linalg.norm(V0) + 0.54 * rng.normal(size=n)
    residual, _, _ = told(GEOMETRY, truth, Measurement(pixel, ranges, speeds))
    _, _, total = told(GEOMETRY, truth, Measurement(hit, np.array(0.0), np.array(0.0)))
    deviation = np.sqrt(np.diag(total))
    assert_allclose(
        np.cov(residual.T) / deviation / deviation[:, None],
        total / deviation / deviation[:, None],
        atol=0.03,
    )


@given(st.floats(-1.2, 1.2), st.floats(-1.0, 1.0))
def test_the_boresight_is_the_third_axis(look, squint):
    geometry = replace(GEOMETRY, look=look, squint=squint)
    beam = geometry.boresight(np.array([0.0, 0, 0, 1]))
    in_body = GEOMETRY.T_e_b @ beam
    wanted = [np.sin(squint), np.cos(squint) * np.sin(look), np.cos(squint) * np.cos(look)]
    assert_allclose(in_body, wanted, rtol=0, atol=1e-15)


@pytest.mark.parametrize("batch", [(), (1,), (4,), (2, 3), (0,)])
def test_batch_axes_come_first_and_members_do_not_meet(batch):
    estimate, pixel = states(6)
    count = int(np.prod(batch))
    r, v, q, pixel = (
        np.resize(a, (*batch, a.shape[-1])) if count else np.zeros((0, a.shape[-1]))
        for a in (*estimate[:3], pixel)
    )
    state, seen = NavigationState(r, v, q), np.ones(batch)
    whole = told(GEOMETRY, state, Measurement(pixel, seen, seen))
    assert whole[1].shape == (*batch, 4, 9)
    for i in np.ndindex(batch):
        one = NavigationState(r[i], v[i], q[i])
        alone = told(GEOMETRY, one, Measurement(pixel[i], seen[i], seen[i]))
        for got, wanted in zip(whole, alone, strict=True):
            assert_array_equal(got[i], wanted)


def test_attitude_and_state_may_have_other_batch_axes_than_the_pixel():
    estimate, pixel = states(3)
    many = replace(GEOMETRY, T_e_b=np.stack([GEOMETRY.T_e_b] * 2)[:, None])
    state = NavigationState(estimate.r[0], estimate.v[0], estimate.q_mu[0])
    got = many.jacobian(state, pixel)
    assert got.shape == (2, 3, 4, 9)
    assert_array_equal(got[1, 2], GEOMETRY.jacobian(state, pixel[2]))
    assert many.h(state, pixel).shape == (2, 3, 4)


def test_a_pixel_that_was_not_found_is_nan_alone():
    estimate, pixel = states(3)
    wanted = told(GEOMETRY, estimate, Measurement(pixel, np.ones(3), np.ones(3)))
    pixel = np.where(np.array([False, True, False])[:, None], np.nan, pixel)
    got = told(GEOMETRY, estimate, Measurement(pixel, np.ones(3), np.ones(3)))
    for a, b in zip(got, wanted, strict=True):
        assert np.isnan(a[1]).any()
        assert_array_equal(a[[0, 2]], b[[0, 2]])


@pytest.mark.parametrize("batch", [(), (2, 3)])
def test_parts_and_whole_of_a_measurement_and_of_a_state(batch):
    rng = np.random.default_rng(0)
    z, x = rng.normal(size=(*batch, 5)), rng.normal(size=(*batch, 10))
    seen, state = Measurement.of(z), NavigationState.of(x)
    assert (seen.slant_range.shape, state.q_mu.shape) == (batch, (*batch, 4))
    assert_array_equal(seen.z, z)
    assert_array_equal(state.x, x)
    assert_array_equal(Measurement(R0, 8e5, 7500.0).z, [*R0, 8e5, 7500])
    one = NavigationState(R0, V0, state.q_mu)  # of which all members share a part
    assert_array_equal(one.x[..., :3], np.broadcast_to(R0, (*batch, 3)))


def test_what_is_compared_with_the_expected_measurement():
    """Ratios of zero, range and speed; nothing of an image of which anything is missing."""
    z = np.arange(1.0, 31.0).reshape(6, 5)
    z[np.arange(5), np.arange(5)] = np.nan
    y, sensor = GEOMETRY.given(z)
    assert np.isnan(y[:5]).all()
    assert_array_equal(y[5], [0, 0, 29, 30])
    assert_array_equal(sensor.r_f, z[:, :3])
    assert_array_equal(sensor.R, R)


def test_a_pass_has_the_attitude_of_each_image():
    turned = body_axes(np.array([R0, R0]), np.array([V0, V0 + 100.0]))
    images, (estimate, pixel) = SarPass(GEOMETRY, turned), states(2)
    for k in range(2):
        assert_array_equal(images.at(k).T_e_b, turned[k])
        one = replace(GEOMETRY, T_e_b=turned[k])
        assert_array_equal(images.at(k).h(estimate, pixel), one.h(estimate, pixel))
    assert_array_equal(images.R, R)


def test_any_state_with_three_fields_will_do():
    estimate, pixel = states(2)
    plain = SimpleNamespace(r=estimate.r, v=estimate.v, q_mu=estimate.q_mu)
    assert_array_equal(GEOMETRY.h(plain, pixel), GEOMETRY.h(estimate, pixel))


REFUSED = {
    "look": ({"look": 34.3}, "look must be an angle of less than pi/2 rad; found 34.3"),
    "squint": ({"squint": np.nan}, "squint must be .*found nan"),
    "R: size": ({"R": np.eye(3)}, r"R must have shape .*4, 4.*found \(3, 3\)"),
    "D: size": ({"D": np.eye(4)}, r"D must have shape .*3, 3.*found \(4, 4\)"),
    "D: sign": ({"D": -np.eye(3)}, "D must be symmetric positive semidefinite; found"),
    "T_e_b: size": ({"T_e_b": np.eye(4)}, r"T_e_b must have shape .*found \(4, 4\)"),
    "T_e_b: scale": ({"T_e_b": 2 * np.eye(3)}, "T_e_b must be a rotation; found .* 3 away from I"),
    "T_e_b: mirror": ({"T_e_b": -np.eye(3)}, "T_e_b must be a rotation; found a reflection"),
}


@pytest.mark.parametrize(("options", "message"), REFUSED.values(), ids=REFUSED)
def test_bad_input_is_refused_by_name(options, message):
    with pytest.raises(ValueError, match=message):
        replace(GEOMETRY, **options)
