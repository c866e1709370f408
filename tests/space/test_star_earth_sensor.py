"""Star angles: values and derivatives against JAX and thirty digits, also near 0 and pi."""

import jax
import numpy as np
import pytest
from mpmath import acos, diff, mp, mpf
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import Gaussian, linearized, unscented
from navfilters.space.star_earth_sensor import StarEarthSensor

STARS = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
R = np.diag([1e-8, 2e-8])
SENSOR = StarEarthSensor(STARS, R)
NEAR = [1e-3, 1e-6, 1e-9]


def states(count=8):
    rng = np.random.default_rng(0)
    return rng.normal(size=(count, 6)) * np.array([7e6] * 3 + [7e3] * 3)


def grazing(angle, sign):
    """Over the star (0, 1, 0), or under it, off the line by an angle."""
    return 7e6 * np.array([0.6 * np.sin(angle), sign * np.cos(angle), 0.8 * np.sin(angle), 0, 0, 0])


def exact(x, order=(0, 0, 0)):
    """A derivative of arccos(-y/|r|), in thirty digits more than cancel."""

    def angle(*r):
        return acos(-r[1] / mp.sqrt(sum(c * c for c in r)))

    with mp.workdps(80):
        r = tuple(map(mpf, map(float, x[:3])))
        return float(diff(angle, r, order, h=mpf(10) ** -20) if any(order) else angle(*r))


def test_h_is_equation_38():
    x = states()
    u = STARS / np.linalg.norm(STARS, axis=1, keepdims=True)
    wanted = np.arccos(-(x[:, :3] @ u.T) / np.linalg.norm(x[:, :3], axis=1, keepdims=True))
    assert_allclose(SENSOR.h(x), wanted, rtol=1e-14)


@pytest.mark.parametrize("angle", NEAR)
def test_h_near_zero_and_pi(angle):
    """Above the star the Earth is opposite to it, pi; below, in line with it, 0."""
    above, below = grazing(angle, 1), grazing(angle, -1)
    assert_allclose(SENSOR.h(below)[1], exact(below), rtol=1e-15)
    assert_allclose(SENSOR.h(below)[1], angle, rtol=1e-15)
    assert_allclose(np.pi - SENSOR.h(above)[1], angle, rtol=0, atol=1e-15)


def test_derivatives_by_jax():
    x = states()
    H = jax.jit(jax.vmap(jax.jacfwd(SENSOR.h)))(x)
    second = jax.jit(jax.vmap(jax.jacfwd(SENSOR.jacobian)))(x)
    assert_allclose(SENSOR.jacobian(x), H, rtol=0, atol=1e-13 * np.abs(H).max())
    assert_allclose(SENSOR.hessian(x), second, rtol=0, atol=1e-12 * np.abs(second).max())
    assert_array_equal(SENSOR.hessian(x), SENSOR.hessian(x).mT)


def test_jacobian_by_differences():
    x, step = states(), 10 * np.eye(6)[:, None]
    difference = np.moveaxis(SENSOR.h(x + step) - SENSOR.h(x - step), 0, -1) / 20
    H = SENSOR.jacobian(x)
    assert_allclose(H, difference, rtol=0, atol=1e-9 * np.abs(H).max())
    assert_array_equal(H[..., 3:], 0)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("angle", NEAR)
def test_derivatives_near_zero_and_pi(angle, sign):
    """H keeps its length 1/|r|; the curvature grows as 1/angle and stays right."""
    x = grazing(angle, sign)
    orders = np.eye(3, dtype=int)
    H = [exact(x, tuple(o)) for o in orders]
    assert_allclose(SENSOR.jacobian(x)[1, :3], H, rtol=0, atol=1e-14 * np.abs(H).max())
    second = np.array([[exact(x, tuple(a + b)) for a in orders] for b in orders])
    got = SENSOR.hessian(x)[1, :3, :3]
    assert_allclose(got, second, rtol=0, atol=1e-13 * np.abs(second).max())


def test_on_the_line_there_are_no_derivatives_for_that_star_alone():
    x = states(3)
    x[1] = [0, 7e6, 0, 1, 2, 3]
    with np.errstate(all="ignore"):
        H, second = SENSOR.jacobian(x), SENSOR.hessian(x)
    assert not np.isfinite(H[1, 1, :3]).any()
    assert not np.isfinite(second[1, 1, :3, :3]).any()
    assert np.isfinite(H[[0, 2]]).all()
    assert np.isfinite(H[1, 0]).all()
    assert_array_equal(
        SENSOR.h(np.array([[0, 7e6, 0, 0, 0, 0], [0, -1.0, 0, 0, 0, 0]]))[:, 1], [np.pi, 0]
    )


@pytest.mark.parametrize("batch", [(), (5,), (2, 3), (0,)])
@pytest.mark.parametrize("m", [1, 2, 3])
def test_batch_axes_come_first(batch, m):
    sensor = StarEarthSensor(np.eye(3)[:m], np.eye(m))
    x = np.random.default_rng(1).normal(size=(*batch, 6))
    assert sensor.h(x).shape == (*batch, m)
    assert sensor.jacobian(x).shape == (*batch, m, 6)
    assert sensor.hessian(x).shape == (*batch, m, 6, 6)
    for i in np.ndindex(batch):
        assert_allclose(sensor.h(x)[i], sensor.h(x[i]), rtol=1e-15)
        assert_allclose(sensor.jacobian(x)[i], sensor.jacobian(x[i]), rtol=1e-14, atol=1e-16)


def test_a_longer_state_adds_columns_of_zeros():
    x = np.concatenate([states(), np.ones((8, 3))], axis=-1)
    short = x[..., :6]
    assert_array_equal(SENSOR.h(x), SENSOR.h(short))
    for of_x, axes in ((SENSOR.jacobian, 1), (SENSOR.hessian, 2)):
        wanted = np.pad(of_x(short), [(0, 0)] * 2 + [(0, 3)] * axes)
        assert_array_equal(of_x(x), wanted)


def test_it_is_a_measurement_model_of_the_filters():
    x = np.array([6.9e6, 1e5, 2e5, 0, 7e3, 3e3])
    prior = Gaussian(x, np.diag([1e4] * 3 + [1.0] * 3))
    first, other = linearized(prior, SENSOR), unscented(prior, SENSOR)
    assert_allclose(first.P_zz, other.P_zz, rtol=1e-4)
    assert_allclose(first.P_xz, other.P_xz, rtol=0, atol=1e-4 * np.abs(first.P_xz).max())


def test_stars_are_directions_and_noise_may_be_a_batch():
    far = StarEarthSensor(1e9 * STARS, np.stack([R, 2 * R, 3 * R]))
    assert far.R.shape == (3, 2, 2)
    assert_allclose(far.stars, SENSOR.stars, rtol=1e-15)
    assert_allclose(np.linalg.norm(SENSOR.stars, axis=1), 1, rtol=1e-15)
    with pytest.raises(AttributeError, match="cannot assign"):
        far.R = R


REFUSED = {
    "a vector": ([1.0, 0.0, 0.0], np.eye(1), "stars must be", r"\(3,\)"),
    "two components": (np.eye(2), np.eye(2), "stars must have shape", r"\(2, 2\)"),
    "a stack": (np.ones((2, 2, 3)), R, "stars must have shape", r"\(2, 2, 3\)"),
    "NaN": ([[np.nan, 0, 1]], np.eye(1), "stars must be", "nan"),
    "zero": ([[0, 0, 1], [0, 0, 0]], R, "stars must be directions", "zero at index 1"),
    "R: size": (STARS, np.eye(3), r"R must have shape .*2, 2", r"\(3, 3\)"),
    "R: singular": (STARS, np.diag([1.0, 0.0]), "R must be symmetric positive definite", "0"),
}


@pytest.mark.parametrize(("stars", "noise", "needed", "found"), REFUSED.values(), ids=REFUSED)
def test_the_constructor_refuses_by_name(stars, noise, needed, found):
    with pytest.raises(ValueError, match=f"{needed}.*found.*{found}"):
        StarEarthSensor(stars, noise)
