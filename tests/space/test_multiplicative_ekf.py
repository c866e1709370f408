"""The EKF on position, velocity and attitude: a plain loop, fifty digits, and the Kalman filter."""

from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import matrix as mp_matrix
from mpmath import mp
from naive import covariances, kalman
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from navfilters import Filter, Gaussian, run
from navfilters.estimators.variants import bump_linear
from navfilters.space.frames import body_axes, ellipsoid_intersection, enu_covariance
from navfilters.space.image_measurement import Measurement, SarGeometry
from navfilters.space.navigation_state import NavigationState
from navfilters.space.pose import difference, retract
from navfilters.space.quaternions import from_rotation_vector, rotation_vector

R0 = np.array([-1108465.150, -6100044.949, 3397134.666])
V0 = np.array([-1003.9419331, 3801.3289491, 6498.2536689])
R = np.diag([0.0, 0.0, 1.0, 0.54**2])
GEOMETRY = SarGeometry(
    np.deg2rad(34.3), 0.0, R, enu_covariance((2.0, 8.0, 1.0), 29.76, -95.37), body_axes(R0, V0)
)
SIGMA = np.array([1e3] * 3 + [10.0] * 3 + [np.deg2rad(0.1)] * 3)
NOMINAL = np.array([0.0, 0.0, 0.0, 1.0])


def update(prior, z, model, bump=0.0):
    """One update by the EKF, underweighted so much."""
    ekf = Filter(variant=partial(bump_linear, bump=bump))
    return ekf.update(ekf.init(prior), z, model)


def scene(runs=5):
    """Estimates drawn around the truth, correlated, and an image of each."""
    rng = np.random.default_rng(0)
    P = covariances(rng, (runs,), 9)
    P = (SIGMA[:, None] * P * SIGMA + SIGMA[:, None] * P.mT * SIGMA) / 2
    error = np.stack([rng.multivariate_normal(np.zeros(9), p) for p in P])
    truth = np.concatenate([R0, V0, NOMINAL])
    pixel = ellipsoid_intersection(R0, GEOMETRY.boresight(NOMINAL))
    slant_range = np.linalg.norm(pixel - R0) + rng.normal(size=runs)
    speed = np.linalg.norm(V0) + 0.54 * rng.normal(size=runs)
    seen = Measurement(pixel + 5 * rng.normal(size=(runs, 3)), slant_range, speed)
    return Gaussian(retract(truth, -error), P), seen.z


@dataclass(frozen=True, eq=False)
class Affine:
    """y = H e + v of the error e from a reference state: what the filter is on a linear model."""

    H: np.ndarray
    R: np.ndarray
    reference: np.ndarray

    def h(self, x):
        return (self.H @ difference(x, self.reference)[..., None])[..., 0]

    def jacobian(self, x):
        return self.H

    retract = staticmethod(retract)
    difference = staticmethod(difference)


def linear_problem(seed=0, m=4):
    rng = np.random.default_rng(seed)
    x = np.concatenate([rng.normal(size=6), NOMINAL])
    prior = Gaussian(x, covariances(rng, (), 9))
    model = Affine(rng.normal(size=(m, 9)), covariances(rng, (), m), x)
    return prior, 0.1 * rng.normal(size=m), model


@pytest.mark.parametrize("beta", [0.0, 1e-6, 0.2, 1.0, 50.0])
def test_linear_limit(beta):
    """The Kalman filter for a measurement of covariance beta H P H^T + R, mean and covariance."""
    prior, y, model = linear_problem()
    got = update(prior, y, model, beta)
    enlarged = beta * model.H @ prior.cov @ model.H.T + model.R
    mean, P = kalman(np.zeros(9), prior.cov, y, model.H, enlarged)
    assert_allclose(difference(got.estimate.mean, prior.mean), mean, rtol=1e-12, atol=1e-15)
    assert_allclose(got.estimate.cov, P, rtol=1e-12, atol=1e-14)
    assert_allclose(got.innovation, y)
    assert_allclose(got.S, model.H @ prior.cov @ model.H.T + enlarged, rtol=1e-13)


@pytest.mark.parametrize("m", [1, 2, 3, 4])
def test_without_underweighting_it_tends_to_the_kalman_filter_with_order_one(m):
    prior, y, model = linear_problem(1, m)
    mean, P = kalman(np.zeros(9), prior.cov, y, model.H, model.R)
    gaps = []
    for beta in (0.0, 1e-4, 1e-3):
        x, cov = update(prior, y, model, beta).estimate
        off = difference(x, prior.mean) - mean
        gaps.append(max(np.abs(off).max(), np.abs(cov - P).max()))
    assert gaps[0] < 1e-14
    assert_allclose(gaps[2] / gaps[1], 10, rtol=0.02)


def plain(state, P, measurement, beta):
    """One member by Eqs. (13)-(39), with rotations from SciPy and an inverse in fifty digits."""
    r, v = state.r, state.v
    attitude = Rotation.from_quat(state.q_mu)  # its transpose is T_mu
    T = attitude.as_matrix().T @ GEOMETRY.T_b_s @ GEOMETRY.T_e_b
    r_sf = measurement.r_f - r
    x, y, z = T @ r_sf
    distance, speed = np.linalg.norm(r_sf), np.linalg.norm(v)
    of_s = np.array([[1 / z, 0, -x / z**2], [0, 1 / z, -y / z**2]])
    H = np.zeros((4, 9))
    H[:2, :3], H[2, :3] = -of_s @ T, -r_sf / distance
    H[3, 3:6] = v / speed
    H[:2, 6:] = of_s @ np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    H_f = np.vstack([-H[:3, :3], np.zeros(3)])
    residual = [-x / z, -y / z, measurement.slant_range - distance, measurement.speed - speed]
    R_b = beta * H @ P @ H.T + R + H_f @ GEOMETRY.D @ H_f.T
    with mp.workdps(50):
        S = mp_matrix(H.tolist()) * mp_matrix(P.tolist()) * mp_matrix(H.T.tolist())
        S = S + mp_matrix(R_b.tolist())
        K = mp_matrix(P.tolist()) * mp_matrix(H.T.tolist()) * S**-1
        K = np.array(K.tolist(), dtype=float)
        S = np.array(S.tolist(), dtype=float)
    dx = K @ residual
    A = np.eye(9) - K @ H
    q = (attitude * Rotation.from_rotvec(dx[6:])).as_quat()  # Hamilton: the new one on the right
    return r + dx[:3], v + dx[3:6], q, A @ P @ A.T + K @ R_b @ K.T, np.array(residual), S


@pytest.mark.parametrize("beta", [0.0, 0.2, 3.0])
def test_update_of_images_in_a_plain_loop(beta):
    """S has variances of 1e-10 beside 1e6: its inverse keeps the digits of each."""
    prior, z = scene()
    got = update(prior, z, GEOMETRY, beta)
    for i in range(5):
        state, after = (NavigationState.of(x[i]) for x in (prior.mean, got.estimate.mean))
        r, v, q, P, residual, S = plain(state, prior.cov[i], Measurement.of(z[i]), beta)
        assert_allclose(after.r - state.r, r - state.r, rtol=1e-7, atol=1e-7)
        assert_allclose(after.v - state.v, v - state.v, rtol=1e-7, atol=1e-9)
        assert_allclose(after.q_mu, np.sign(q @ after.q_mu) * q, rtol=0, atol=1e-12)
        deviation = np.sqrt(np.diag(P))
        scaled = (got.estimate.cov[i] - P) / deviation / deviation[:, None]
        assert np.abs(scaled).max() < 1e-6
        scale = np.sqrt(np.diag(S))
        assert scale.max() > 1e5 * scale.min()
        assert_allclose(got.innovation[i] / scale, residual / scale, atol=1e-9)
        assert_allclose(got.S[i] / scale / scale[:, None], S / scale / scale[:, None], atol=1e-12)


def test_the_error_is_corrected_in_the_direction_of_the_truth():
    """A small error and a sharp image: what is seen of it is gone."""
    small = 1e-3 * SIGMA * np.array([1, -1, 1, 1, 1, -1, 1, -1, 1])
    x = retract(np.concatenate([R0, V0, NOMINAL]), -small)
    pixel = ellipsoid_intersection(R0, GEOMETRY.boresight(NOMINAL))
    z = Measurement(pixel, np.linalg.norm(pixel - R0), np.linalg.norm(V0)).z
    sharp = replace(GEOMETRY, R=1e-12 * R, D=1e-12 * GEOMETRY.D)
    y, sensor = sharp.given(z)
    before = y - sensor.h(x)
    made = update(Gaussian(x, np.diag(SIGMA**2) * 1e-6), z, sharp)
    after = y - sensor.h(made.estimate.mean)
    assert (np.abs(after) < 1e-3 * np.abs(before)).all()
    assert_array_equal(made.innovation, before)


def additive(mu, P, z):
    """An EKF whose attitude state is the rotation vector itself; its new one, and ours."""
    y, sensor = GEOMETRY.given(z)

    def whole(x):
        return np.concatenate([x[:6], from_rotation_vector(x[6:])])

    x = np.concatenate([R0 + 300.0, V0, mu])
    steps = np.array([10.0] * 3 + [1e-2] * 3 + [1e-6] * 3)
    apart = [sensor.h(whole(x + d)) - sensor.h(whole(x - d)) for d in np.diag(steps)]
    H, at = np.stack(apart, axis=-1) / (2 * steps), whole(x)
    moved = kalman(x, P, y - sensor.h(at) + H @ x, H, sensor.noise(at))[0]
    return moved[6:], update(Gaussian(at, P), z, GEOMETRY).estimate.mean[6:]


def test_for_small_angles_it_is_the_additive_filter():
    """Of the way that both attitudes move, they differ by less than the angle."""
    pixel = ellipsoid_intersection(R0, GEOMETRY.boresight(NOMINAL)) + 20.0
    z = Measurement(pixel, np.linalg.norm(pixel - R0), np.linalg.norm(V0)).z
    for angle in (1e-2, 1e-3, 1e-4):
        P = np.diag(np.concatenate([SIGMA[:6], [angle] * 3]) ** 2)
        mu = angle * np.array([0.6, -0.5, 0.3])
        plain_mu, q = additive(mu, P, z)
        moved = np.linalg.norm(plain_mu - mu)
        apart = np.linalg.norm(rotation_vector(q) - plain_mu)
        assert apart < angle * moved, (angle, apart / moved)


@given(st.integers(0, 2**32 - 1), st.floats(0, 2), st.floats(-3, 3))
def test_covariance_stays_one_and_never_grows(seed, beta, exponent):
    """Symmetric to the bit, positive, P+ <= P, and a quaternion of length one."""
    rng = np.random.default_rng(seed)
    P = SIGMA[:, None] * covariances(rng, (), 9) * SIGMA * 10.0**exponent
    prior, z = scene(1)
    after = update(prior._replace(cov=((P + P.T) / 2)[None]), z, GEOMETRY, beta).estimate
    deviation = np.sqrt(np.diag(P))
    scaled = after.cov[0] / deviation / deviation[:, None]
    before = P / deviation / deviation[:, None]
    assert_array_equal(after.cov, after.cov.mT)
    assert np.linalg.eigvalsh(scaled).min() > -1e-13
    assert np.linalg.eigvalsh(before - scaled).min() > -1e-9
    assert_allclose(np.linalg.norm(after.mean[:, 6:], axis=-1), 1, rtol=1e-15)


def test_underweighting_leaves_a_larger_covariance():
    prior, z = scene()
    free, held = (update(prior, z, GEOMETRY, b).estimate.cov for b in (0.0, 0.2))
    more = np.linalg.eigvalsh((held - free) / SIGMA / SIGMA[:, None])
    assert more.min() > -1e-12
    assert (more.max(axis=-1) > 1e-3).all()


def test_underweighting_may_differ_from_member_to_member():
    prior, z = scene()
    betas = np.array([0.2, 0.0, 0.2, 0.0, 0.0])
    got = update(prior, z, GEOMETRY, betas)
    for i, beta in enumerate(betas):
        wanted = update(prior, z, GEOMETRY, float(beta))
        assert_array_equal(got.S[i], wanted.S[i])
        assert_array_equal(got.estimate.cov[i], wanted.estimate.cov[i])


LACKING = {"r_f": slice(3), "one of r_f": 1, "slant_range": 3, "speed": 4}


@pytest.mark.parametrize("lacking", LACKING.values(), ids=LACKING)
def test_an_image_that_was_not_matched_changes_nothing_and_nobody_else(lacking):
    prior, z = scene()
    wanted = update(prior, z, GEOMETRY, 0.2)
    z[1, lacking] = np.nan
    got = update(prior, z, GEOMETRY, 0.2)
    for before, after, reference in zip(prior, got.estimate, wanted.estimate, strict=True):
        assert_array_equal(after[1], before[1])
        assert_array_equal(np.delete(after, 1, 0), np.delete(reference, 1, 0))
    assert np.isnan(got.innovation[1]).all()
    assert_array_equal(got.missed, [0, 1, 0, 0, 0])
    assert_array_equal(np.delete(got.S, 1, 0), np.delete(wanted.S, 1, 0))


def test_a_member_that_failed_stays_alone():
    prior, z = scene()
    wanted = update(prior, z, GEOMETRY).estimate
    mean = np.array(prior.mean)
    mean[3, :3] = np.nan
    got = update(prior._replace(mean=mean), z, GEOMETRY).estimate
    assert np.isnan(got.mean[3, :3]).all()
    for a, b in zip(got, wanted, strict=True):
        assert_array_equal(np.delete(a, 3, 0), np.delete(b, 3, 0))


def test_a_member_without_any_uncertainty_fails_alone():
    """No noise in the ratios, a perfect pixel, and one prior that is certain: S has no inverse."""
    prior, z = scene()
    perfect, P = replace(GEOMETRY, D=np.zeros((3, 3))), np.array(prior.cov)
    P[2] = 0
    wanted, got = (run(Filter(), Gaussian(prior.mean, c), z, perfect, 1) for c in (prior.cov, P))
    assert np.isnan(got.mean[1, 2, :3]).all()
    for a, b in zip(got, wanted, strict=True):
        assert np.isfinite(b).all()
        assert_array_equal(np.delete(a, 2, 1), np.delete(b, 2, 1))


@pytest.mark.parametrize("batch", [(), (1,), (2, 2), (0,)])
def test_batch_axes_come_first_and_members_do_not_meet(batch):
    prior, z = scene()

    def shaped(a):
        return np.resize(a, (*batch, *a.shape[1:])) if np.prod(batch) else a[:0]

    mean, cov, z = map(shaped, (*prior, z))
    got = update(Gaussian(mean, cov), z, GEOMETRY, 0.2)
    for i in np.ndindex(batch):
        alone = update(Gaussian(mean[i], cov[i]), z[i], GEOMETRY, 0.2)
        for a, b in zip((*got.estimate, *got[3:]), (*alone.estimate, *alone[3:]), strict=True):
            assert_array_equal(a[i], b)


def test_the_same_source_compiles_under_jax():
    prior, z = scene()
    compiled = jax.jit(
        lambda prior, z: update(prior, z, GEOMETRY, 0.2).estimate,
        compiler_options={"xla_backend_optimization_level": 0},  # compiles twice as fast
    )
    got = compiled(Gaussian(*map(jnp.asarray, prior)), jnp.asarray(z))
    wanted = update(prior, z, GEOMETRY, 0.2).estimate
    assert_allclose(got.mean[:, :6], wanted.mean[:, :6], rtol=1e-10)
    assert_allclose(got.mean[:, 6:], wanted.mean[:, 6:], atol=1e-12)
    scaled = (np.asarray(got.cov) - wanted.cov) / SIGMA / SIGMA[:, None]
    assert np.abs(scaled).max() < 1e-8
