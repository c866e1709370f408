"""The multiplicative EKF against a plain loop, fifty digits, and the Kalman filter."""

from dataclasses import dataclass, replace

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

from navfilters.estimators.multiplicative import MekfState, mekf_update
from navfilters.space.frames import body_axes, ellipsoid_intersection, enu_covariance
from navfilters.space.image_measurement import Measurement, SarGeometry
from navfilters.space.quaternions import conjugate, from_rotation_vector, product, rotation_vector

R0 = np.array([-1108465.150, -6100044.949, 3397134.666])
V0 = np.array([-1003.9419331, 3801.3289491, 6498.2536689])
R = np.diag([0.0, 0.0, 1.0, 0.54**2])
GEOMETRY = SarGeometry(
    np.deg2rad(34.3), 0.0, R, enu_covariance((2.0, 8.0, 1.0), 29.76, -95.37), body_axes(R0, V0)
)
SIGMA = np.array([1e3] * 3 + [10.0] * 3 + [np.deg2rad(0.1)] * 3)
NOMINAL = np.array([0.0, 0.0, 0.0, 1.0])


def scene(runs=5):
    """Estimates drawn around the truth, correlated, and an image of each."""
    rng = np.random.default_rng(0)
    P = covariances(rng, (runs,), 9)
    P = (SIGMA[:, None] * P * SIGMA + SIGMA[:, None] * P.mT * SIGMA) / 2
    error = np.stack([rng.multivariate_normal(np.zeros(9), p) for p in P])
    q = product(from_rotation_vector(-error[:, 6:]), NOMINAL)
    pixel = ellipsoid_intersection(R0, GEOMETRY.boresight(NOMINAL))
    slant_range = np.linalg.norm(pixel - R0) + rng.normal(size=runs)
    speed = np.linalg.norm(V0) + 0.54 * rng.normal(size=runs)
    state = MekfState(R0 - error[:, :3], V0 - error[:, 3:6], q, P)
    return state, Measurement(pixel + 5 * rng.normal(size=(runs, 3)), slant_range, speed)


@dataclass(frozen=True, eq=False)
class Affine:
    """y = H e + v of the error e from a reference state: what the filter is on a linear model."""

    H: np.ndarray
    R: np.ndarray
    reference: MekfState

    def linearize(self, state, y):
        e = error(state, self.reference)
        return y - (self.H @ e[..., None])[..., 0], self.H, self.R


def error(state, reference):
    turned = rotation_vector(product(state.q_mu, conjugate(reference.q_mu)))
    return np.concatenate([state.r - reference.r, state.v - reference.v, turned], axis=-1)


def linear_problem(seed=0, m=4):
    rng = np.random.default_rng(seed)
    prior = MekfState(rng.normal(size=3), rng.normal(size=3), NOMINAL, covariances(rng, (), 9))
    model = Affine(rng.normal(size=(m, 9)), covariances(rng, (), m), prior)
    return prior, 0.1 * rng.normal(size=m), model


@pytest.mark.parametrize("gamma", [None, 0.0, 1e9])
@pytest.mark.parametrize("beta", [0.0, 1e-6, 0.2, 1.0, 50.0])
def test_linear_limit(beta, gamma):
    """The Kalman filter for a measurement of covariance beta H P H^T + R, mean and covariance."""
    prior, y, model = linear_problem()
    got = mekf_update(prior, y, model, underweighting=beta, gamma=gamma)
    used = 0.0 if gamma == 1e9 else beta
    enlarged = used * model.H @ prior.P @ model.H.T + model.R
    mean, P = kalman(np.zeros(9), prior.P, y, model.H, enlarged)
    assert_allclose(error(got.state, prior), mean, rtol=1e-12, atol=1e-15)
    assert_allclose(got.state.P, P, rtol=1e-12, atol=1e-14)
    assert_allclose(got.innovation, y)
    assert_allclose(got.S, model.H @ prior.P @ model.H.T + enlarged, rtol=1e-13)


@pytest.mark.parametrize("m", [1, 2, 3, 4])
def test_without_underweighting_it_tends_to_the_kalman_filter_with_order_one(m):
    prior, y, model = linear_problem(1, m)
    mean, P = kalman(np.zeros(9), prior.P, y, model.H, model.R)
    gaps = []
    for beta in (0.0, 1e-4, 1e-3):
        state = mekf_update(prior, y, model, underweighting=beta).state
        gaps.append(max(np.abs(error(state, prior) - mean).max(), np.abs(state.P - P).max()))
    assert gaps[0] < 1e-14
    assert_allclose(gaps[2] / gaps[1], 10, rtol=0.02)


def plain(state, measurement, i, beta):
    """One member by Eqs. (13)-(39), with rotations from SciPy and an inverse in fifty digits."""
    r, v, P = state.r[i], state.v[i], state.P[i]
    attitude = Rotation.from_quat(state.q_mu[i])  # its transpose is T_mu
    T = attitude.as_matrix().T @ GEOMETRY.T_b_s @ GEOMETRY.T_e_b
    r_sf = measurement.r_f[i] - r
    x, y, z = T @ r_sf
    distance, speed = np.linalg.norm(r_sf), np.linalg.norm(v)
    of_s = np.array([[1 / z, 0, -x / z**2], [0, 1 / z, -y / z**2]])
    H = np.zeros((4, 9))
    H[:2, :3], H[2, :3] = -of_s @ T, -r_sf / distance
    H[3, 3:6] = v / speed
    H[:2, 6:] = of_s @ np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    H_f = np.vstack([-H[:3, :3], np.zeros(3)])
    residual = [-x / z, -y / z, measurement.slant_range[i] - distance, measurement.speed[i] - speed]
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
    state, measurement = scene()
    got = mekf_update(state, measurement, GEOMETRY, underweighting=beta)
    for i in range(5):
        r, v, q, P, residual, S = plain(state, measurement, i, beta)
        assert_allclose(got.state.r[i] - state.r[i], r - state.r[i], rtol=1e-7, atol=1e-7)
        assert_allclose(got.state.v[i] - state.v[i], v - state.v[i], rtol=1e-7, atol=1e-9)
        sign = np.sign(q @ got.state.q_mu[i])
        assert_allclose(got.state.q_mu[i], sign * q, rtol=0, atol=1e-12)
        deviation = np.sqrt(np.diag(P))
        scaled = (got.state.P[i] - P) / deviation / deviation[:, None]
        assert np.abs(scaled).max() < 1e-6
        scale = np.sqrt(np.diag(S))
        assert_allclose(got.innovation[i] / scale, residual / scale, atol=1e-9)
        assert_allclose(got.S[i] / scale / scale[:, None], S / scale / scale[:, None], atol=1e-12)


def test_the_error_is_corrected_in_the_direction_of_the_truth():
    """A small error and a sharp image: what is seen of it is gone."""
    small = 1e-3 * SIGMA * np.array([1, -1, 1, 1, 1, -1, 1, -1, 1])
    q = product(from_rotation_vector(-small[6:]), NOMINAL)
    state = MekfState(R0 - small[:3], V0 - small[3:6], q, np.diag(SIGMA**2) * 1e-6)
    pixel = ellipsoid_intersection(R0, GEOMETRY.boresight(NOMINAL))
    seen = Measurement(pixel, np.linalg.norm(pixel - R0), np.linalg.norm(V0))
    sharp = SarGeometry(GEOMETRY.look, 0.0, 1e-12 * R, 1e-12 * GEOMETRY.D, GEOMETRY.T_e_b)
    before = sharp.linearize(state, seen)[0]
    made = mekf_update(state, seen, sharp)
    after = sharp.linearize(made.state, seen)[0]
    assert (np.abs(after) < 1e-3 * np.abs(before)).all()
    assert_array_equal(made.innovation, before)


def additive(mu, P, seen):
    """An EKF whose attitude state is the rotation vector itself; returns the new one."""

    def h(x):
        state = MekfState(x[:3], x[3:6], from_rotation_vector(x[6:]), P)
        return GEOMETRY.h(state, seen.r_f)

    x = np.concatenate([R0 + 300.0, V0, mu])
    steps = np.array([10.0] * 3 + [1e-2] * 3 + [1e-6] * 3)
    H = np.stack([(h(x + d) - h(x - d)) / (2 * d.max()) for d in np.diag(steps)], axis=-1)
    state = MekfState(x[:3], x[3:6], from_rotation_vector(mu), P)
    y, _, noise = GEOMETRY.linearize(state, seen)
    moved = kalman(x, P, y + H @ x, H, noise)[0]
    return moved[6:], mekf_update(state, seen, GEOMETRY).state


def test_for_small_angles_it_is_the_additive_filter():
    """Of the way that both attitudes move, they differ by less than the angle."""
    pixel = ellipsoid_intersection(R0, GEOMETRY.boresight(NOMINAL)) + 20.0
    seen = Measurement(pixel, np.linalg.norm(pixel - R0), np.linalg.norm(V0))
    for angle in (1e-2, 1e-3, 1e-4):
        P = np.diag(np.concatenate([SIGMA[:6], [angle] * 3]) ** 2)
        mu = angle * np.array([0.6, -0.5, 0.3])
        plain_mu, state = additive(mu, P, seen)
        moved = np.linalg.norm(plain_mu - mu)
        apart = np.linalg.norm(rotation_vector(state.q_mu) - plain_mu)
        assert apart < angle * moved, (angle, apart / moved)


@given(st.integers(0, 2**32 - 1), st.floats(0, 2), st.floats(-3, 3))
def test_covariance_stays_one_and_never_grows(seed, beta, exponent):
    """Symmetric to the bit, positive, P+ <= P, and a quaternion of length one."""
    rng = np.random.default_rng(seed)
    P = SIGMA[:, None] * covariances(rng, (), 9) * SIGMA * 10.0**exponent
    state, measurement = scene(1)
    state = state._replace(P=((P + P.T) / 2)[None])
    after = mekf_update(state, measurement, GEOMETRY, underweighting=beta).state
    deviation = np.sqrt(np.diag(P))
    scaled = after.P[0] / deviation / deviation[:, None]
    before = P / deviation / deviation[:, None]
    assert_array_equal(after.P, after.P.mT)
    assert np.linalg.eigvalsh(scaled).min() > -1e-13
    assert np.linalg.eigvalsh(before - scaled).min() > -1e-9
    assert_allclose(np.linalg.norm(after.q_mu), 1, rtol=1e-15)


def test_underweighting_leaves_a_larger_covariance():
    state, measurement = scene()
    free, held = (
        mekf_update(state, measurement, GEOMETRY, underweighting=b).state.P for b in (0.0, 0.2)
    )
    scaled = (held - free) / SIGMA / SIGMA[:, None]
    assert np.linalg.eigvalsh(scaled).min() > -1e-12
    assert (np.linalg.eigvalsh(scaled).max(axis=-1) > 1e-3).all()


def test_trace_rule_takes_the_members_whose_position_is_uncertain():
    """Eq. (31): exactly those above gamma are underweighted, the others exactly not."""
    state, measurement = scene()
    spread = np.sqrt(np.trace(state.P[:, :3, :3], axis1=-2, axis2=-1))
    gamma = np.sort(spread)[2]  # itself not above
    got = mekf_update(state, measurement, GEOMETRY, underweighting=0.2, gamma=gamma)
    all_, none = (mekf_update(state, measurement, GEOMETRY, underweighting=b) for b in (0.2, 0.0))
    above = spread > gamma
    assert above.sum() == 2
    for member, wanted in zip(range(5), above, strict=True):
        reference = (all_ if wanted else none).state
        for a, b in zip(got.state, reference, strict=True):
            assert_array_equal(a[member], b[member])


def test_index_rule_may_differ_from_member_to_member():
    state, measurement = scene()
    mask = np.array([0.2, 0.0, 0.2, 0.0, 0.0])
    got = mekf_update(state, measurement, GEOMETRY, underweighting=mask)
    for i, beta in enumerate(mask):
        wanted = mekf_update(state, measurement, GEOMETRY, underweighting=beta)
        assert_array_equal(got.S[i], wanted.S[i])
        assert_array_equal(got.state.P[i], wanted.state.P[i])


@pytest.mark.parametrize("lacking", ["r_f", "slant_range", "speed"])
def test_an_image_that_was_not_matched_changes_nothing_and_nobody_else(lacking):
    state, measurement = scene()
    wanted = mekf_update(state, measurement, GEOMETRY, underweighting=0.2)
    values = np.array(getattr(measurement, lacking))
    values[1] = np.nan
    got = mekf_update(
        state, measurement._replace(**{lacking: values}), GEOMETRY, underweighting=0.2
    )
    for before, after, reference in zip(state, got.state, wanted.state, strict=True):
        assert_array_equal(after[1], before[1])
        assert_array_equal(np.delete(after, 1, 0), np.delete(reference, 1, 0))
    assert np.isnan(got.innovation[1]).any()
    assert_array_equal(np.delete(got.S, 1, 0), np.delete(wanted.S, 1, 0))


def test_a_member_that_failed_stays_alone():
    state, measurement = scene()
    wanted = mekf_update(state, measurement, GEOMETRY)
    r = np.array(state.r)
    r[3] = np.nan
    got = mekf_update(state._replace(r=r), measurement, GEOMETRY)
    assert np.isnan(got.state.r[3]).all()
    for a, b in zip(got.state, wanted.state, strict=True):
        assert_array_equal(np.delete(a, 3, 0), np.delete(b, 3, 0))


def test_a_member_without_any_uncertainty_fails_alone():
    """No noise in the ratios, a perfect pixel, and one prior that is certain: S has no inverse."""
    state, measurement = scene()
    perfect = replace(GEOMETRY, D=np.zeros((3, 3)))
    wanted = mekf_update(state, measurement, perfect)
    P = np.array(state.P)
    P[2] = 0
    got = mekf_update(state._replace(P=P), measurement, perfect)
    assert np.isnan(got.state.r[2]).all()
    for a, b in zip(got.state, wanted.state, strict=True):
        assert np.isfinite(b).all()
        assert_array_equal(np.delete(a, 2, 0), np.delete(b, 2, 0))


@pytest.mark.parametrize("batch", [(), (1,), (2, 2), (0,)])
def test_batch_axes_come_first_and_members_do_not_meet(batch):
    state, measurement = scene(5)

    def shaped(a):
        return np.resize(a, (*batch, *a.shape[1:])) if np.prod(batch) else a[:0]

    whole = MekfState(*map(shaped, state))
    seen = Measurement(*map(shaped, measurement))
    got = mekf_update(whole, seen, GEOMETRY, underweighting=0.2, gamma=500.0)
    for i in np.ndindex(batch):
        one = MekfState(*(a[i] for a in whole))
        alone = mekf_update(
            one, Measurement(*(a[i] for a in seen)), GEOMETRY, underweighting=0.2, gamma=500.0
        )
        for a, b in zip((*got.state, *got[1:]), (*alone.state, *alone[1:]), strict=True):
            assert_array_equal(a[i], b)


def test_the_same_source_compiles_under_jax():
    state, measurement = scene()
    update = jax.jit(
        lambda s, z: mekf_update(s, z, GEOMETRY, underweighting=0.2, gamma=500.0),
        compiler_options={"xla_backend_optimization_level": 0},  # compiles twice as fast
    )
    got = update(MekfState(*map(jnp.asarray, state)), Measurement(*map(jnp.asarray, measurement)))
    wanted = mekf_update(state, measurement, GEOMETRY, underweighting=0.2, gamma=500.0)
    assert_allclose(got.state.r, wanted.state.r, rtol=1e-10)
    assert_allclose(got.state.q_mu, wanted.state.q_mu, atol=1e-12)
    scaled = (np.asarray(got.state.P) - wanted.state.P) / SIGMA / SIGMA[:, None]
    assert np.abs(scaled).max() < 1e-8
