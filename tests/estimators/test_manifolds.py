"""Angles and unit quaternions: residuals on the circle, states that are no vectors."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from navfilters import FILTERS, Gaussian, linearized, run, second_order, sweep, unscented
from navfilters.estimators import LATER_FILTERS
from navfilters.models import RangeBearing
from navfilters.runs import records
from navfilters.space.quaternions import (
    from_rotation_vector,
    normalized,
    product,
    rotation_vector,
)

engines = pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])
POLAR = RangeBearing(np.diag([0.01, 1e-4]))


def at_angle(degrees, r=80.0):
    return r * np.array([np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))])


@engines
@pytest.mark.parametrize("name", FILTERS)
def test_a_target_behind_the_sensor_is_found(name, engine):
    """Truth one degree below, estimate one degree above the negative axis, 2.79 away."""
    truth, prior = at_angle(-179), Gaussian(at_angle(179), 9 * np.eye(2))
    got = sweep(FILTERS[name], prior, POLAR.h(truth), POLAR, 1, engine=engine, progress=False).final
    assert np.linalg.norm(got.mean - truth) < 2.8
    plain = RangeBearing(POLAR.R, wrap=False)
    far = run(FILTERS[name], prior, POLAR.h(truth), plain, 1).mean[-1]
    if "UKF" not in name:  # whose points on both sides spread by a turn, and are not believed
        assert np.linalg.norm(far - truth) > 50


@pytest.mark.parametrize("moments", [linearized, second_order, unscented])
@pytest.mark.parametrize("turn", [90.0, 180.0, 179.3])
def test_moments_do_not_know_where_the_jump_is(moments, turn):
    """A problem and the same one turned across the jump: the same bearings, but for the turn."""
    angle = np.deg2rad(turn)
    T = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    P = np.array([[200.0, 30.0], [30.0, 90.0]])
    here = moments(Gaussian(at_angle(1.0), P), POLAR)
    there = moments(Gaussian(T @ at_angle(1.0), T @ P @ T.T), POLAR)
    turned = POLAR.residual(there.z_hat - [0.0, angle], here.z_hat)
    if moments is unscented:  # its Cholesky points turn otherwise
        assert_allclose(turned, 0.0, atol=2e-2)
        assert_allclose(there.P_zz, here.P_zz, atol=0.05 * here.P_zz.max())
        return
    assert_allclose(turned, 0.0, atol=1e-12)
    assert_allclose(there.P_zz, here.P_zz, rtol=1e-9, atol=1e-9)


def test_sigma_points_across_the_jump_are_those_of_a_turned_problem():
    """Half a turn keeps the Cholesky factor up to its sign, and so the points."""
    P = np.array([[200.0, 30.0], [30.0, 90.0]])
    here = unscented(Gaussian(at_angle(1.0), P), POLAR)
    there = unscented(Gaussian(at_angle(181.0), P), POLAR)
    assert_allclose(POLAR.residual(there.z_hat - [0, np.pi], here.z_hat), 0.0, atol=1e-13)
    assert_allclose(there.P_zz, here.P_zz, rtol=1e-12)
    assert_allclose(there.P_xz, -here.P_xz, rtol=1e-10, atol=1e-10)


# --- a unit quaternion --------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Directions:
    """Two known directions, seen from a body whose attitude is the state (..., 4)."""

    R: np.ndarray
    known: np.ndarray  # (2, 3)

    def h(self, q):
        xp = q.__array_namespace__()
        return xp.concat([self._seen(q, v) for v in self.known], axis=-1)

    def _seen(self, q, v):
        """v in the body's axes, for a passive quaternion with the scalar last."""
        xp = q.__array_namespace__()
        e, s = q[..., :3], q[..., 3:]
        v = xp.broadcast_to(xp.asarray(v), e.shape)
        return v - 2 * s * xp.linalg.cross(e, v) + 2 * xp.linalg.cross(e, xp.linalg.cross(e, v))

    def jacobian(self, q):
        """d h / d dx, where q becomes (dx as a rotation) q: the cross product of what is seen."""
        xp = q.__array_namespace__()
        rows = []
        for v in self.known:
            a, b, c = (self._seen(q, v)[..., i] for i in range(3))
            o = xp.zeros_like(a)
            rows += [xp.stack(r, -1) for r in ([o, -c, b], [c, o, -a], [-b, a, o])]
        return xp.stack(rows, -2)

    def retract(self, q, dx):
        return normalized(product(from_rotation_vector(dx), q))

    def difference(self, p, q):
        xp = q.__array_namespace__()
        inverse = xp.concat([-q[..., :3], q[..., 3:]], axis=-1)
        return rotation_vector(product(p, inverse))


@dataclass(frozen=True, eq=False)
class Turning(Directions):
    """The body turns by the same rotation at each step; R is not used."""

    Q: np.ndarray = None
    rate: tuple = ()

    def f(self, q):
        xp = q.__array_namespace__()
        return product(from_rotation_vector(xp.asarray(self.rate)), q)

    def transition(self, q):
        return self.f(q), q.__array_namespace__().asarray(rotation(np.array(self.rate)))


def rotation(v):
    """The matrix of a passive rotation, by Rodrigues' formula."""
    angle = np.linalg.norm(v)
    e = v / angle
    cross = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return np.eye(3) - np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def flight(sigma, steps=6, count=4):
    rng = np.random.default_rng(1)
    known = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]])
    sensor = Directions(1e-6 * np.eye(6), known)
    motion = Turning(sensor.R, known, 1e-8 * np.eye(3), (0.3, -0.1, 0.2))
    truth = [normalized(rng.normal(size=4))]
    for _ in range(steps):
        truth.append(motion.f(truth[-1]))
    truth = np.stack(truth)
    start = sensor.retract(truth[0], sigma * rng.normal(size=(count, 3)))
    z = sensor.h(truth[1:, None]) + 1e-3 * rng.normal(size=(steps, count, 6))
    return Gaussian(start, sigma**2 * np.eye(3)), z, sensor, motion, truth


def test_the_jacobian_is_that_of_the_retraction():
    _, _, sensor, motion, truth = flight(0.1)
    q, small = truth[0], 1e-6 * np.eye(3)
    moved = [
        (sensor.h(sensor.retract(q, d)) - sensor.h(sensor.retract(q, -d))) / 2e-6 for d in small
    ]
    assert_allclose(np.stack(moved, -1), sensor.jacobian(q), atol=1e-9)
    turned = [sensor.difference(motion.f(sensor.retract(q, d)), motion.f(q)) for d in small]
    assert_allclose(np.stack(turned, -1) * 1e6, motion.transition(q)[1], atol=1e-6)


@engines
@pytest.mark.parametrize("name", ["EKF", "B-EKF 1", "UKF", "B-UKF", "UKFz", *LATER_FILTERS])
def test_any_moments_fly_on_quaternions(name, engine):
    prior, z, sensor, motion, truth = flight(0.1)
    filter_ = (FILTERS | LATER_FILTERS)[name]
    got = sweep(
        filter_, prior, z, sensor, dynamics=motion, z_per_step=True, engine=engine,
        record=records.estimate, progress=False, chunk=2,
    ).record  # fmt: skip
    assert got.mean.shape == (7, 4, 4)
    assert got.cov.shape == (7, 4, 3, 3)
    assert_allclose(np.linalg.norm(got.mean, axis=-1), 1.0, rtol=1e-12)
    error = sensor.difference(truth[:, None], got.mean)
    deviation = np.sqrt(np.diagonal(got.cov, axis1=-2, axis2=-1))
    if name != "CKF":  # its points see too little of the variance of a quadratic
        assert (np.abs(error) < 5 * deviation).all()
    assert (deviation[-1] < (2e-2 if name.startswith("B-") else 2e-3)).all()
    wanted = run(filter_, prior, z, sensor, dynamics=motion, z_per_step=True)
    assert_allclose(got.mean, wanted.mean, rtol=0, atol=1e-10)


def test_in_small_errors_ekf_and_ukf_agree():
    """Ten times smaller errors, a hundred times closer: to second order."""
    apart = []
    for sigma in (1e-2, 1e-3):
        prior, z, sensor, _, _ = flight(sigma)
        z = sensor.h(prior.mean)[None] + sigma * 0.1 * np.random.default_rng(2).normal(
            size=(1, 4, 6)
        )
        a, b = (run(FILTERS[n], prior, z, sensor, z_per_step=True).mean[-1] for n in ("EKF", "UKF"))
        apart.append(np.abs(sensor.difference(a, b)).max() / sigma)
    assert apart[0] < 1e-2
    assert apart[1] < 0.2 * apart[0]


def test_a_prior_that_does_not_fit_the_manifold_is_refused():
    prior, z, sensor, _, _ = flight(0.1)
    for cov in (np.eye(4), np.eye(2), np.ones(3)):
        for go in (run, sweep):
            with pytest.raises(ValueError, match=r"priors?(\.cov)? must"):
                go(FILTERS["EKF"], Gaussian(prior.mean, cov), z[0], sensor, 2)


def test_on_a_manifold_the_derivative_is_by_the_error():
    """With respect to dx, of three components, though the state has four."""
    prior, z, sensor, _, _ = flight(0.1)
    bare = SimpleNamespace(
        R=sensor.R, h=sensor.h, retract=sensor.retract, difference=sensor.difference
    )
    for name in ("EKF", "UKF"):
        got, wanted = (run(FILTERS[name], prior, z[0], model, 1) for model in (bare, sensor))
        assert_allclose(got.mean, wanted.mean, rtol=0, atol=1e-12)
        assert_allclose(got.cov, wanted.cov, rtol=0, atol=1e-12)
