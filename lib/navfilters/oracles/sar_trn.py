"""SAR navigation a second time, one run at a time, in other techniques; imports nothing of ours.

Motion is integrated in an inertial frame and turned; the covariance follows the exponential (Van
Loan) of a numerically differenced dynamics; measurement Jacobians are fourth-order central
differences with the misalignment perturbed multiplicatively; attitude is direction cosine matrices;
the gain is a 50-digit inverse of the badly scaled innovation covariance; the ellipsoid is hit by
root finding.

SI units, radians. Errors are truth minus estimate: r = r_hat + dr, v = v_hat + dv,
T_mu = T(dmu) T_mu_hat with the passive T(dmu) = I - [dmu x] + ... . T_ab maps components in frame a
to frame b; e is Earth-fixed, b the body, s the nominal antenna. T_mu maps the nominal antenna frame
to the actual one, whose third axis is the boresight. About 0.15 s for a run of 72 updates.
"""

import functools
from decimal import Decimal, localcontext

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from scipy.spatial.transform import Rotation

GM, J2 = 3.986004418e14, 1.08262668e-3
RE, FLAT, OMEGA = 6378137.0, 1 / 298.257223563, 7.292115e-5
RP = RE * (1 - FLAT)
ALTITUDE, INCLINATION, LOOK = 691.5e3, np.radians(98.16), np.radians(34.3)
HOUSTON = np.radians([29.76, -95.37])  # latitude, longitude
N_UPDATES, SPAN = 72, 600.0
INTERVAL = SPAN / N_UPDATES
Q_VELOCITY, Q_MISALIGNMENT = 3.5e-11, 3.4e-13  # PSD: m^2/s^3, rad^2/s
SIGMA_RANGE, SIGMA_SPEED = 1.0, 0.54
SIGMA_ENU = np.array([2.0, 8.0, 1.0])  # geolocation error, m
BETA, N_UNDERWEIGHTED = 0.2, 10
CASES = {
    "TC-1": {"sigma": [1000.0] * 3 + [10.0] * 3 + [np.radians(0.1)] * 3, "underweight": True},
    "TC-2": {"sigma": [1000.0] * 3 + [10.0] * 3 + [np.radians(0.01)] * 3, "underweight": False},
}


ALONG = np.array([1.0, 1.0, 3.0])
W = OMEGA * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


# --- motion
def gravity(r):
    """Two-body + J2 acceleration at one point or many, in rows; the same in ECEF and inertial axes
    (it is symmetric about z)."""
    d2 = np.vecdot(r, r)[..., None]
    oblate = 1.5 * J2 * RE**2 / d2 * (ALONG - 5 * r[..., 2:] ** 2 / d2)
    return -GM / (d2 * np.sqrt(d2)) * r * (1 + oblate)


def spin(angle):
    """DCM from inertial axes to ECEF axes that have turned by `angle` about z."""
    return Rotation.from_euler("z", -angle).as_matrix()


def flow(r, v, times):
    """ECEF r, v, one row per time, at `times` (s, nondecreasing) after the state r, v at time 0.

    The inertial frame is the ECEF frame frozen at time 0."""
    times = np.atleast_1d(np.asarray(times, float))
    w = np.array([0.0, 0.0, OMEGA])
    start = np.concatenate([r, v + np.cross(w, r)])
    if times[-1] == 0.0:
        return np.tile(r, (times.size, 1)), np.tile(v, (times.size, 1))
    answer = solve_ivp(
        lambda t, x: np.concatenate([x[3:], gravity(x[:3])]),
        (0.0, times[-1]),
        start,
        method="DOP853",
        t_eval=times,
        rtol=3e-14,
        atol=1e-9,
    )
    T = [spin(OMEGA * t) for t in times]
    rs = np.array([A @ x for A, x in zip(T, answer.y[:3].T, strict=True)])
    vs = np.array([A @ x for A, x in zip(T, answer.y[3:].T, strict=True)]) - np.cross(w, rs)
    return rs, vs


# --- geometry
def geodetic(p):
    """Latitude, longitude, height, by iterating z + e^2 N sin(lat) = rho tan(lat)."""
    e2 = FLAT * (2 - FLAT)
    rho = np.hypot(p[0], p[1])
    lat = np.arctan2(p[2], rho * (1 - e2))
    for _ in range(50):
        N = RE / np.sqrt(1 - e2 * np.sin(lat) ** 2)
        new = np.arctan2(p[2] + e2 * N * np.sin(lat), rho)
        done, lat = abs(new - lat) < 1e-15, new
        if done:
            break
    N = RE / np.sqrt(1 - e2 * np.sin(lat) ** 2)
    height = rho * np.cos(lat) + p[2] * np.sin(lat) - RE * RE / N
    return lat, np.arctan2(p[1], p[0]), height


def enu(lat, lon):
    """Columns: east, north and up in ECEF."""
    sa, ca, so, co = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    return np.array([[-so, -sa * co, ca * co], [co, -sa * so, ca * so], [0.0, ca, sa]])


def ellipsoid_hit(r, direction):
    """Near intersection of the ray from r with the WGS-84 ellipsoid."""
    scale = np.array([RE, RE, RP])
    a, u = r / scale, direction / scale
    nearest = -(a @ u) / (u @ u)
    return r + direction * brentq(
        lambda s: np.sum((a + s * u) ** 2) - 1, 0.0, nearest, xtol=1e-9, rtol=1e-15
    )


def attitude(r, v):
    """T_es: body axes z down, y along v x r, x = y x z; antenna turned LOOK to the right."""
    z = -r / np.linalg.norm(r)
    y = np.cross(v, r)
    y /= np.linalg.norm(y)
    T_eb = np.array([np.cross(y, z), y, z])
    c, s = np.cos(LOOK), np.sin(LOOK)
    T_bs = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])  # last row: boresight, z towards +y
    return T_bs @ T_eb


def misalignment(mu):
    """Passive DCM T(mu) of a rotation vector: I - [mu x] + ... ."""
    return Rotation.from_rotvec(-np.asarray(mu, float)).as_matrix()


def rotation_vector(T):
    """The inverse of `misalignment`."""
    return -Rotation.from_matrix(T).as_rotvec()


# --- truth
def circular_state(u, node):
    """ECEF state on the circular orbit, inertial and ECEF axes coinciding."""
    a = RE + ALTITUDE
    R = Rotation.from_euler("ZXZ", [node, INCLINATION, u]).as_matrix()
    r = a * R[:, 0]
    return r, np.sqrt(GM / a) * R[:, 1] - np.cross([0.0, 0.0, OMEGA], r)


@functools.lru_cache
def initial_state():
    """Ascending state whose boresight meets the ellipsoid at HOUSTON."""

    def miss(x):
        r, v = circular_state(*x)
        lat, lon, _ = geodetic(ellipsoid_hit(r, attitude(r, v)[2]))
        return [lat - HOUSTON[0], np.sin(lon - HOUSTON[1])]

    return circular_state(*fsolve(miss, np.radians([29.0, -97.0]), xtol=1e-12))


def truth(times):
    """True ECEF position and velocity, one row per time (nondecreasing, from 0)."""
    r, v = initial_state()
    return flow(r, v, times)


# --- filter
def difference(f, steps):
    """Jacobian of f at 0 by fourth-order central differences with the given step per component."""
    return difference_at_once(lambda points: np.array([f(d) for d in points]), steps)


def difference_at_once(f, steps):
    """The same of an f that takes many points, one a row, and gives a row for each."""
    d = np.diag(steps)
    f1, f2, f3, f4 = f(np.concatenate([d, -d, 2 * d, -2 * d])).reshape(4, len(d), -1)
    return ((8 * (f1 - f2) - (f3 - f4)) / (12 * np.array(steps)[:, None])).T


def ecef_rate(x):
    """d(r, v)/dt in ECEF from the inertial motion, without writing the fictitious forces out:
    the velocity relative to turning axes is v_i - w x r, and its components turn with the axes.
    Of one state or many, in rows."""
    r, v = x[..., :3], x[..., 3:]
    vi = v + r @ W.T
    return np.concatenate([vi - r @ W.T, gravity(r) - vi @ W.T - v @ W.T], axis=-1)


def exponential(A):
    """By its series, of matrices whose squares are small; SciPy's starts threads, which wait."""
    total = term = np.eye(A.shape[-1])
    for k in range(1, 9):
        term = term @ A / k
        total = total + term
    return total


def predict(r, v, T_mu, P, dt, substeps=4):
    """Filter prediction over dt: estimate by `flow`, covariance by the exponential of differenced
    dynamics."""
    h = dt / substeps
    rs, vs = flow(r, v, np.append((np.arange(substeps) + 0.5) * h, dt))
    Q = np.diag([0.0] * 3 + [Q_VELOCITY] * 3 + [Q_MISALIGNMENT] * 3)
    middles = np.hstack([rs, vs])[:-1]  # A held at the middle of each substep
    changes = difference_at_once(
        lambda points: ecef_rate(middles + points[:, None]), [2e3] * 3 + [1.0] * 3
    )
    van_loan = np.zeros((substeps, 18, 18))
    van_loan[:, 9:15, 9:15] = changes.reshape(substeps, 6, 6).swapaxes(1, 2)
    van_loan[:, :6, :6] = -changes.reshape(substeps, 6, 6)
    van_loan[:, :9, 9:] = Q
    for block in exponential(h * van_loan):
        F = block[9:, 9:].T
        P = F @ P @ F.T + F @ block[:9, 9:]
        P = (P + P.T) / 2
    return rs[-1], vs[-1], T_mu, P


def measure(r, v, T_mu, r_f, T_es):
    """h(x): the two antenna-frame ratios, the slant range and the ECEF speed; many in rows."""
    d = r_f - r
    s = (T_mu @ T_es @ d[..., None])[..., 0]
    speed = np.broadcast_to(np.sqrt(np.vecdot(v, v)), d.shape[:-1])
    rows = s[..., 0] / s[..., 2], s[..., 1] / s[..., 2], np.sqrt(np.sum(d**2, axis=-1)), speed
    return np.stack(rows, axis=-1)


def jacobians(r, v, T_mu, r_f, T_es):
    """H (4 x 9, with respect to dr, dv, dmu) and H_f (4 x 3, with respect to the feature)."""
    H = difference_at_once(
        lambda d: measure(r + d[:, :3], v + d[:, 3:6], misalignment(d[:, 6:]) @ T_mu, r_f, T_es),
        [100.0] * 3 + [1.0] * 3 + [1e-4] * 3,
    )
    H_f = difference_at_once(lambda d: measure(r, v, T_mu, r_f + d, T_es), [100.0] * 3)
    return H, H_f


def solve_in_50_digits(A, B):
    """A^-1 B of a positive definite A, by elimination of decimal numbers."""
    n = len(A)
    with localcontext(prec=50):
        rows = np.vectorize(Decimal, otypes=[object])(np.hstack([A, B]))
        for i in range(n):
            rows[i] /= rows[i, i]
            for j in {*range(n)} - {i}:
                rows[j] -= rows[j, i] * rows[i]
    return rows[:, n:].astype(float)


def gain_and_covariance(P, H, H_f, D, beta):
    """K (32) with the innovation covariance (31), and the Joseph form (38) with R' (39)."""
    HPH = H @ P @ H.T
    R = np.diag([0.0, 0.0, SIGMA_RANGE**2, SIGMA_SPEED**2])
    B = H_f @ D @ H_f.T
    S = (1 + beta) * HPH + R + B
    K = solve_in_50_digits((S + S.T) / 2, (P @ H.T).T).T
    J = np.eye(9) - K @ H
    P = J @ P @ J.T + K @ (beta * HPH + R + B) @ K.T
    return K, (P + P.T) / 2


def correct(r, v, T_mu, dx):
    """Additive position and velocity, multiplicative misalignment correction."""
    return r + dx[:3], v + dx[3:6], misalignment(dx[6:]) @ T_mu


def update(r, v, T_mu, P, y, r_f, T_es, D, beta=0.0):
    """MEKF update with measurement y and geolocated feature r_f."""
    H, H_f = jacobians(r, v, T_mu, r_f, T_es)
    K, P = gain_and_covariance(P, H, H_f, D, beta)
    return *correct(r, v, T_mu, K @ (y - measure(r, v, T_mu, r_f, T_es))), P


# --- experiment
def geolocation_covariance():
    """D: constant in ECEF, the ENU error at Houston."""
    E = enu(*HOUSTON)
    return E @ np.diag(SIGMA_ENU**2) @ E.T


def draw(case, updates, rng):
    """All random inputs of one run: the initial error (truth minus estimate), the ECEF errors of
    geolocation, the noise of range and speed, and the steps of the true misalignment's walk."""
    walk = np.sqrt(Q_MISALIGNMENT * INTERVAL)
    return {
        "initial": np.array(CASES[case]["sigma"]) * rng.standard_normal(9),
        "feature": rng.standard_normal((updates, 3)) * SIGMA_ENU @ enu(*HOUSTON).T,
        "range": SIGMA_RANGE * rng.standard_normal(updates),
        "speed": SIGMA_SPEED * rng.standard_normal(updates),
        "walk": walk * rng.standard_normal((updates, 3)),
    }


def error(r, v, T_mu, r_hat, v_hat, T_hat):
    """Truth minus estimate, the misalignment part as a rotation vector."""
    return np.concatenate([r - r_hat, v - v_hat, rotation_vector(T_mu @ T_hat.T)])


def run(case, updates, drawn):
    """One run, from what `draw` gives. Returns errors (updates + 1, 9) and covariances
    (updates + 1, 9, 9): row 0 is the start and row k follows update k, at k * INTERVAL."""
    T_mu = np.eye(3)
    rs, vs = truth(np.arange(updates + 1) * INTERVAL)
    D = geolocation_covariance()
    P = np.diag(np.array(CASES[case]["sigma"]) ** 2)
    e0 = drawn["initial"]
    r, v, T_hat = rs[0] - e0[:3], vs[0] - e0[3:6], misalignment(e0[6:]).T @ T_mu
    errors, covariances = [error(rs[0], vs[0], T_mu, r, v, T_hat)], [P]
    for k in range(updates):
        T_mu = misalignment(drawn["walk"][k]) @ T_mu
        rt, vt = rs[k + 1], vs[k + 1]
        T_es = attitude(rt, vt)  # known exactly to the filter
        hit = ellipsoid_hit(rt, (T_mu @ T_es)[2])
        y = np.array(
            [
                0.0,
                0.0,
                np.linalg.norm(hit - rt) + drawn["range"][k],
                np.linalg.norm(vt) + drawn["speed"][k],
            ]
        )
        r, v, T_hat, P = predict(r, v, T_hat, P, INTERVAL)
        beta = BETA if CASES[case]["underweight"] and k < N_UNDERWEIGHTED else 0.0
        r, v, T_hat, P = update(r, v, T_hat, P, y, hit + drawn["feature"][k], T_es, D, beta)
        errors.append(error(rt, vt, T_mu, r, v, T_hat))
        covariances.append(P)
    return np.array(errors), np.array(covariances)
