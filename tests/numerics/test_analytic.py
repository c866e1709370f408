"""Complex step through every function of the library that a state goes through."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.models import Linear, RangeBearing
from navfilters.numerics import analytic
from navfilters.numerics.complex_step import complex_step
from navfilters.space import frames, quaternions
from navfilters.space.earth_fixed_orbit import EarthFixedOrbit
from navfilters.space.gravity import Gravity
from navfilters.space.image_measurement import Measurement, SarGeometry
from navfilters.space.inertial_orbit import Orbit
from navfilters.space.navigation_state import NavigationState
from navfilters.space.osculating_ellipse import perigee_apogee
from navfilters.space.star_earth_sensor import StarEarthSensor
from navfilters.space.thrust import Thrust

MEMBERS = 5


def direction(rng, n=3):
    x = rng.normal(size=(MEMBERS, n))
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def plane(rng):
    return 100 * rng.normal(size=(MEMBERS, 2))


def position(rng):
    return rng.uniform(6.6e6, 8e6, (MEMBERS, 1)) * direction(rng)


def orbit_state(rng):
    return np.concatenate([position(rng), rng.uniform(6e3, 8e3, (MEMBERS, 1)) * direction(rng)], -1)


def vector(rng):
    return rng.normal(size=(MEMBERS, 3))


def quaternion(rng):
    return direction(rng, 4)


def angles(rng):
    return rng.uniform(-1.4, 1.4, (MEMBERS, 2))


def seen(rng):
    """Position, velocity and misalignment of a spacecraft, and a pixel below it."""
    x = orbit_state(rng)
    pixel = 6.378e6 * direction(rng) * 0.05 + x[:, :3] * 0.9
    return np.concatenate([x, 1e-2 * rng.normal(size=(MEMBERS, 3)), pixel], -1)


GRAVITY = Gravity()
STARS = StarEarthSensor(np.array([[1.0, 0.2, -0.3], [-0.4, 1.0, 0.5]]), np.eye(2))
BEARING = RangeBearing(np.eye(2))
LINEAR = Linear(np.array([[1.0, 2.0], [0.5, -1.0], [3.0, 0.0]]), np.eye(3))
ORBIT = Orbit(substeps=3, step=10.0)
PUSHED = Orbit(substeps=3, step=10.0, thrust=Thrust(0.01, ((0.0, 30.0),)))
EULER = Orbit(substeps=3, step=10.0, integrator="euler")
FIXED = EarthFixedOrbit(step=10.0)
PRINTED = EarthFixedOrbit(step=10.0, integrator="printed")
RADAR = SarGeometry(0.6, 0.05, np.eye(4), np.eye(3))
PIXEL = np.array([6.0e6, 1.5e6, 1.2e6])


def radar(method):
    def of(x):
        q = quaternions.from_rotation_vector(x[..., 6:9])
        return method(NavigationState(x[..., :3], x[..., 3:6], q), x[..., 9:])

    return of


def residual(state, r_f):
    """Of a measurement that is what it is, whatever the state: no derivative in r_f."""
    pixel, distance = np.broadcast_to(PIXEL, r_f.shape), np.linalg.norm(PIXEL)
    size = np.broadcast_to(distance, r_f.shape[:-1])
    y, sensor = RADAR.given(Measurement(pixel, size, size).z)
    return y - sensor.h(state.x)


def intersection(x):
    """From a place above the ellipsoid, about downwards."""
    return frames.ellipsoid_intersection(x[..., :3], -x[..., :3] + 100 * x[..., 3:])


FUNCTIONS = {
    "cross_matrix": (quaternions.cross_matrix, vector),
    "product": (lambda x: quaternions.product(x, x[..., ::-1] * x), quaternion),
    "conjugate": (quaternions.conjugate, quaternion),
    "normalized": (quaternions.normalized, lambda rng: 3 * quaternion(rng)),
    "matrix": (quaternions.matrix, quaternion),
    "from_rotation_vector": (quaternions.from_rotation_vector, vector),
    "from a long rotation vector": (quaternions.from_rotation_vector, lambda rng: 5 * vector(rng)),
    "from no rotation": (quaternions.from_rotation_vector, lambda rng: np.zeros((MEMBERS, 3))),
    "from a tiny rotation": (quaternions.from_rotation_vector, lambda rng: 1e-9 * vector(rng)),
    "rotation_vector": (quaternions.rotation_vector, quaternion),
    "rotation_vector of the negative": (
        lambda q: quaternions.rotation_vector(-q),
        lambda rng: np.abs(quaternion(rng)),
    ),
    "rotation_vector of nearly none": (
        quaternions.rotation_vector,
        lambda rng: quaternions.from_rotation_vector(1e-4 * vector(rng)),
    ),
    "body_axes": (lambda x: frames.body_axes(x[..., :3], x[..., 3:]), orbit_state),
    "ellipsoid_intersection": (intersection, orbit_state),
    "acceleration": (GRAVITY.acceleration, position),
    "gradient": (GRAVITY.gradient, position),
    "Linear.h": (LINEAR.h, plane),
    "RangeBearing.h": (BEARING.h, plane),
    "RangeBearing.jacobian": (BEARING.jacobian, plane),
    "RangeBearing.hessian": (BEARING.hessian, plane),
    "StarEarthSensor.h": (STARS.h, orbit_state),
    "StarEarthSensor.jacobian": (STARS.jacobian, orbit_state),
    "Orbit.derivative": (lambda x: PUSHED.derivative(x, 0.01), orbit_state),
    "Orbit.jacobian": (lambda x: PUSHED.jacobian(x, 0.01), orbit_state),
    "Orbit, a transition": (lambda x: ORBIT.transition(x)[0], orbit_state),
    "Orbit, a transition under thrust": (lambda x: PUSHED.path(x)[-1], orbit_state),
    "Orbit, a transition as printed": (lambda x: EULER.path(x)[-1], orbit_state),
    "perigee_apogee": (lambda x: np.stack(perigee_apogee(x), -1), orbit_state),
    "EarthFixedOrbit.derivative": (FIXED.derivative, orbit_state),
    "EarthFixedOrbit.jacobian": (FIXED.jacobian, orbit_state),
    "EarthFixedOrbit.path": (lambda x: FIXED.path(x, 3)[-1], orbit_state),
    "EarthFixedOrbit.path as printed": (lambda x: PRINTED.path(x, 3)[-1], orbit_state),
    "SarGeometry.h": (radar(RADAR.h), seen),
    "SarGeometry.jacobian": (radar(RADAR.jacobian), seen),
    "SarGeometry.pixel_jacobian": (radar(RADAR.pixel_jacobian), seen),
    "SarGeometry.noise": (radar(RADAR.noise), seen),
    "Pixel.h": (radar(residual), seen),
    "SarGeometry.boresight": (
        lambda x: RADAR.boresight(quaternions.from_rotation_vector(x)),
        vector,
    ),
}


def flattened(function, x):
    return np.reshape(function(x), (*x.shape[:-1], -1))


def lengths(x):
    """A thousandth of each vector of three, or of x if it has none."""
    blocks = x.reshape(MEMBERS, -1, 3 if x.shape[-1] % 3 == 0 else x.shape[-1])
    size = np.linalg.norm(blocks, axis=-1, keepdims=True)
    return 1e-3 * np.broadcast_to(np.where(size > 0, size, 1.0), blocks.shape).reshape(x.shape)


def differences(f, x):
    """Central, of fourth order: df by each of the lengths."""
    columns = []
    for d in np.eye(x.shape[-1])[:, None] * lengths(x):
        near, far = f(x + d) - f(x - d), f(x + 2 * d) - f(x - 2 * d)
        columns.append((8 * near - far) / 12)
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_complex_step_agrees_with_differences(name, seed):
    """To 1e-5 of what the whole component changes by the lengths; wrong ones are off by 1e-3."""
    function, draw = FUNCTIONS[name]
    x = draw(np.random.default_rng(seed))
    got = complex_step(lambda x: flattened(function, x), x) * lengths(x)[:, None, :]
    wanted = differences(lambda x: flattened(function, x), x)
    size = np.abs(wanted).max(axis=-1, keepdims=True)
    value = np.abs(flattened(function, x))[..., None]
    assert (np.abs(got - wanted) <= 1e-5 * size + 1e-12 * value.max(axis=1, keepdims=True)).all()


@pytest.mark.parametrize(
    ("f", "J", "draw"),
    [
        (GRAVITY.acceleration, GRAVITY.gradient, position),
        (BEARING.h, BEARING.jacobian, plane),
        (LINEAR.h, LINEAR.jacobian, plane),
        (STARS.h, STARS.jacobian, orbit_state),
        (PUSHED.derivative, PUSHED.jacobian, orbit_state),
    ],
)
def test_complex_step_is_the_jacobian_by_hand(f, J, draw):
    x = draw(np.random.default_rng(3))
    got, wanted = complex_step(f, x), np.broadcast_to(J(x), (MEMBERS, *np.shape(J(x))[-2:]))
    assert_allclose(got, wanted, atol=1e-13 * np.abs(wanted).max())


def test_the_quadrants_of_the_bearing():
    """Steep and flat, in all four quadrants and on the axes."""
    x = np.array([[1, 0], [3, 1], [1, 3], [0, 1], [-1, 3], [-3, 1], [-1, 0], [-3, -1], [-1, -3]])
    x = np.concatenate([x, [[0, -1], [1, -3], [3, -1]]]).astype(float)
    assert_allclose(complex_step(BEARING.h, x), BEARING.jacobian(x), atol=1e-15)
    z = x + 1e-30j * np.array([1.0, -2.0])
    assert_allclose(BEARING.h(z).real, BEARING.h(x), atol=4e-16)


def test_real_numbers_take_the_old_way_to_the_last_bit():
    a, b = np.random.default_rng(4).normal(size=(2, 40, 3))
    assert_array_equal(analytic.dot(a, b), np.linalg.vecdot(a, b))
    assert_array_equal(analytic.hypot(a, b), np.hypot(a, b))
    assert_array_equal(analytic.atan2(a, b), np.atan2(a, b))
    assert_array_equal(analytic.absolute(a), np.abs(a))


@pytest.mark.parametrize("size", [1e-3, 0.1, 1.0])
def test_the_functions_are_analytic_away_from_the_real_axis(size):
    """Cauchy and Riemann: the derivative is the same along both axes."""
    rng = np.random.default_rng(5)
    x, y = (rng.normal(size=60) + 1j * size * rng.normal(size=60) for _ in range(2))
    x, y = (np.where(np.abs(v.real) < 0.2, v + 0.5, v) for v in (x, y))
    for f in (analytic.hypot, lambda x, y: analytic.atan2(y, x)):
        along, up = ((f(x + d, y) - f(x - d, y)) / (2 * d) for d in (1e-6, 1e-6j))
        near = np.abs(along) < 1e3  # the branch cut of the root is elsewhere
        assert_allclose(along[near], up[near], rtol=0, atol=1e-6)
