"""Later Kalman-type filters for range and bearing of a fixed point, in other formulas.

Written from the works that each function names, as a second computation: every update is in
information form, the noise of a statistical linearisation is a sum over the residuals of its
points, and the recursive update carries its two covariances. The state is the position (x1, x2),
the measurement (range, bearing) with noise covariance diag(R1, R2). Residual bearings are wrapped.

Everything is scalar algebra, on mpmath numbers with sixty digits or, member by member, on arrays
of doubles. Vectors are pairs; a symmetric matrix is the triple of its entries (11, 12, 22); a
general 2x2 matrix is (11, 12, 21, 22).
"""

import numpy as np

try:
    from mpmath import mp, mpf
except ImportError:
    raise ImportError("this oracle needs mpmath: pip install navfilters[book]") from None

from navfilters.oracles.two_by_two import (
    add,
    applied,
    full,
    general_inverse,
    inverse,
    product,
    symmetric,
    transposed,
)

CUBATURE, UNSCENTED = (1, 0, 0), (1, 2, 1)
"""(alpha, beta, kappa) of the sigma points."""

NAMES = ("EKF", "GSOF", "CKF", "UKF", "IEKF", "IPLF", "RUF", "RC-EKF", "RC-UKF")


# --- the measurement ---------------------------------------------------------------------------


def _of(x):
    """The functions for these numbers: NumPy's for arrays, mpmath's otherwise."""
    return np if isinstance(x, np.ndarray) else mp


def _h(x):
    f = _of(x[0])
    angle = f.arctan2(x[1], x[0]) if f is np else f.atan2(x[1], x[0])
    return f.sqrt(x[0] * x[0] + x[1] * x[1]), angle


def _residual(z, other):
    """Difference of two measurements, the bearing's in (-pi, pi]."""
    angle = z[1] - other[1]
    f = _of(angle)
    return z[0] - other[0], angle - 2 * f.pi * f.ceil(angle / (2 * f.pi) - 0.5)


def _jacobian(x):
    r, _ = _h(x)
    return x[0] / r, x[1] / r, -x[1] / (r * r), x[0] / (r * r)


def _curvature(x, p):
    """b_i = tr(A_i P) / 2 and C_ij = tr(A_i P A_j P) / 2, A_i the Hessians of range and bearing."""
    r, _ = _h(x)
    x1, x2 = x
    r3, r4 = r**3, r**4
    A = (
        (x2 * x2 / r3, -x1 * x2 / r3, x1 * x1 / r3),
        (2 * x1 * x2 / r4, (x2 * x2 - x1 * x1) / r4, -2 * x1 * x2 / r4),
    )
    one, two = (product(full(a), full(p)) for a in A)
    b = tuple((m[0] + m[3]) / 2 for m in (one, two))
    C = tuple((m[0] + m[3]) / 2 for m in (product(one, one), product(one, two), product(two, two)))
    return b, C


# --- affine models: expected measurement, slope, covariance of the rest --------------------------


def _expanded(x, p, r):
    """First order."""
    return _h(x), _jacobian(x), (r[0], 0 * r[0], r[1])


def _quadratic(x, p, r):
    """Second order of a Gaussian: Athans, Wishner and Bertolini 1968."""
    b, C = _curvature(x, p)
    z, H, noise = _expanded(x, p, r)
    return (z[0] + b[0], z[1] + b[1]), H, add(noise, C)


def _regressed(x, p, r, points):
    """Statistical linear regression on sigma points from the Cholesky factor."""
    alpha, beta, kappa = points
    scale = alpha * alpha * (2 + kappa)
    f = _of(x[0])
    l11 = f.sqrt(p[0])
    l21 = p[1] / l11
    l22 = f.sqrt(p[2] - l21 * l21)
    gamma, w = f.sqrt(scale + 0 * x[0]), 1 / (2 * scale + 0 * r[0])
    central = 1 - 2 / (scale + 0 * r[0]) + 1 - alpha * alpha + beta
    offsets = []
    for u, v in ((gamma * l11, gamma * l21), (0 * l22, gamma * l22)):
        offsets += [(u, v), (-u, -v)]
    middle = _h(x)
    from_middle = [_residual(_h((x[0] + u, x[1] + v)), middle) for u, v in offsets]
    shift = tuple(w * sum(d[i] for d in from_middle) for i in (0, 1))
    spread = [(d[0] - shift[0], d[1] - shift[1]) for d in from_middle]
    cross = tuple(
        w * sum(d[i] * o[j] for d, o in zip(spread, offsets, strict=True))
        for i in (0, 1)
        for j in (0, 1)
    )
    H = product(cross, full(inverse(p)))
    rest = (r[0] + central * shift[0] ** 2, central * shift[0] * shift[1], r[1])
    rest = (rest[0], rest[1], rest[2] + central * shift[1] ** 2)
    for d, o in zip(spread, offsets, strict=True):
        on_line = applied(H, o)
        e = d[0] - on_line[0], d[1] - on_line[1]
        rest = add(rest, (e[0] * e[0], e[0] * e[1], e[1] * e[1]), w)
    return (middle[0] + shift[0], middle[1] + shift[1]), H, rest


def _affine(name, x, p, r, size):
    """Of one filter; with size times H H^T more noise, Eq. (15) of Perea and others 2007."""
    if name in ("CKF", "IPLF"):
        z, H, noise = _regressed(x, p, r, CUBATURE)
    elif name in ("UKF", "RC-UKF"):
        z, H, noise = _regressed(x, p, r, UNSCENTED)
    else:
        z, H, noise = (_quadratic if name == "GSOF" else _expanded)(x, p, r)
    distance = x[0] * x[0] + x[1] * x[1]
    return z, H, add(noise, (size, 0 * size, size / distance))


def _largest_eigenvalue(p):
    half = (p[0] - p[2]) / 2
    return (p[0] + p[2]) / 2 + _of(half).sqrt(half * half + p[1] * p[1])


# --- updates -----------------------------------------------------------------------------------


def _informed(x, p, y, H, noise):
    """(P^-1 + H^T N^-1 H)^-1, the gain that belongs to it, and the state."""
    weight = product(transposed(H), full(inverse(noise)))
    after = inverse(add(inverse(p), symmetric(product(weight, H))))
    K = product(full(after), weight)
    step = applied(K, y)
    return (x[0] + step[0], x[1] + step[1]), after, K


def _iterated(name, x, p, z, r, size, iterations):
    """Bell and Cathey 1993; Garcia-Fernandez and others 2015."""
    mean, cov = x, p
    for _ in range(iterations):
        z_hat, H, noise = _affine(name, mean, cov, r, size)
        y = _residual(z, z_hat)
        back = applied(H, (x[0] - mean[0], x[1] - mean[1]))
        mean, cov, _ = _informed(x, p, (y[0] - back[0], y[1] - back[1]), H, noise)
    return mean, cov


def _recursive(x, p, z, r, updates):
    """Zanetti 2012, with C the covariance of error and noise."""
    R, one = (r[0], 0 * r[0], 0 * r[0], r[1]), (1, 0, 0, 1)
    P, C = full(p), (0 * r[0],) * 4
    for i in range(1, updates + 1):
        H = _jacobian(x)
        PH = product(P, transposed(H))
        HC = product(H, C)
        S = add(add(product(H, PH), R), add(HC, transposed(HC)))
        K = product(add(PH, C), general_inverse(S))
        K = tuple(k / (updates + 1 - i) for k in K)
        step = applied(K, _residual(z, _h(x)))
        x = x[0] + step[0], x[1] + step[1]
        A = add(one, product(K, H), -1)
        KR = product(K, R)
        mixed = product(product(A, C), transposed(K))
        quiet = product(product(A, P), transposed(A))
        P = add(add(quiet, product(KR, transposed(K))), add(mixed, transposed(mixed)), -1)
        C = add(product(A, C), KR, -1)
    return x, symmetric(P)


def _recalibrated(name, x, p, z, r, size):
    """Jiang, Shi and Moura 2024: the covariance of this gain about the new state, or nothing."""
    z_hat, H, noise = _affine(name, x, p, r, size)
    mean, _, K = _informed(x, p, _residual(z, z_hat), H, noise)
    _, H, noise = _affine(name, mean, p, r, size)
    A = add((1, 0, 0, 1), product(K, H), -1)
    quiet = product(product(A, full(p)), transposed(A))
    cov = symmetric(add(quiet, product(product(K, full(noise)), transposed(K))))
    worse = cov[0] + cov[2] >= p[0] + p[2]
    if isinstance(worse, np.ndarray):
        return tuple(
            tuple(np.where(worse, old, new) for old, new in zip(before, after, strict=True))
            for before, after in ((x, mean), (p, cov))
        )
    return (x, p) if worse else (mean, cov)


def update(name, x, p, z, r, *, iterations=10, circular=False):
    """One update.

    Parameters
    ----------
    name : str
        One of `NAMES`.
    x, z, r : pairs
        State, measurement, variances of the noise.
    p : triple
        Covariance.
    iterations : int
        Of IEKF and IPLF; updates of the RUF.
    circular : bool
        Whether the noise is enlarged as in B-EKF 2; not for the RUF.

    Returns
    -------
    x, p
        The new state and covariance.
    """
    if name not in NAMES:
        raise ValueError(f"unknown filter {name!r}; the names are {', '.join(NAMES)}")
    if name == "RUF":
        return _recursive(x, p, z, r, iterations)
    size = _largest_eigenvalue(p) if circular else 0 * r[0]
    if name.startswith("RC-"):
        return _recalibrated(name, x, p, z, r, size)
    return _iterated(name, x, p, z, r, size, iterations if name in ("IEKF", "IPLF") else 1)


def history(name, x0, sigma, R, z, *, steps=1000, digits=60, keep=None, **options):
    """One filter over equal measurements, in so many digits.

    Parameters
    ----------
    name : str
        One of `NAMES`.
    x0, R, z : pairs of numbers
        First estimate; variances of range and bearing; the measurement.
    sigma : number
        Deviation of the first estimate, the same in both directions.
    steps, digits : int
    keep : iterable of int, optional
        The steps to return, 0 being the start; all by default.
    **options
        Of `update`.

    Returns
    -------
    list
        (x, p) of each.
    """
    wanted = range(steps + 1) if keep is None else set(keep)
    with mp.workdps(digits):
        x, r, z = (tuple(map(mpf, pair)) for pair in (x0, R, z))
        p = mpf(sigma) ** 2, mpf(0), mpf(sigma) ** 2
        kept = []
        for k in range(steps + 1):
            if k:
                x, p = update(name, x, p, z, r, **options)
            if k in wanted:
                kept.append((x, p))
    return kept


def runs(name, x0, sigma, R, z, **options):
    """As `history`, of many runs in doubles: z (steps, runs, 2); x0 of numbers or arrays (runs,).

    Returns
    -------
    mean : array (steps, runs, 2)
    cov : array (steps, runs, 2, 2)
        After each measurement.
    """
    count = np.shape(z)[1]
    x, r = (tuple(np.zeros(count) + v for v in pair) for pair in (x0, R))
    p = tuple(np.full(count, float(v)) for v in (sigma**2, 0.0, sigma**2))
    means, covs = [], []
    with np.errstate(all="ignore"):
        for now in np.asarray(z):
            x, p = update(name, x, p, (now[:, 0], now[:, 1]), r, **options)
            means.append(np.stack(x, -1))
            covs.append(np.stack(full(p), -1).reshape(count, 2, 2))
    return np.array(means), np.array(covs)
