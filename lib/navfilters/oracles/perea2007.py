"""Ten Kalman-type filters for range and bearing of a fixed point, in 60-digit arithmetic.

Written from the equations of L. Perea, J. How, L. Breger and P. Elosegui, "Nonlinearity in
Sensor Fusion: Divergence Issues in EKF, modified truncated SOF, and UKF" (AIAA, 2007), sections
II to VI, as a second computation to hold the package's own filters against. Equation numbers
below are that paper's.

The state is the position (x1, x2), the measurement (range, bearing) with bearing
atan2(x2, x1) and noise covariance diag(R1, R2). There are no dynamics, Eqs. (8) and (9), and the
same measurement is used at every update. Bearings are never wrapped.

Everything is scalar algebra on mpmath numbers. Vectors are pairs; a symmetric matrix is the
triple of its entries (11, 12, 22); a general 2x2 matrix is (11, 12, 21, 22).

Every filter is its own rule for (zhat, Pzz, Pxz), see `measurement_moments`, followed by the one
linear update of Eqs. (5) to (7), see `update`.

Readings where the text leaves a choice:

- The norm of Eqs. (15) to (17) is the spectral norm.
- The bias b_m of Eqs. (18) and (19) takes the covariance before the update.
- B-mtSOF adds the H P H^T of Eq. (13) to R, and the b_m b_m^T of Eq. (19) is subtracted once.
- UKFz replaces zhat in the residual of Eq. (6) only; Eqs. (24) and (25) stay centred on the
  weighted mean of Eq. (23).
- The scaled weights and the matrix square root of Eq. (21) are arguments: the paper gives neither.
"""

try:
    from mpmath import mp, mpf
except ImportError:
    raise ImportError("this oracle needs mpmath: pip install navfilters[book]") from None

from navfilters.oracles.two_by_two import (
    add,
    is_positive_definite,
    outer,
    spectral_norm,
    spread_through,
    square_root,
)

_EKF_FAMILY = ("EKF", "B-EKF 1", "B-EKF 2", "B-EKF 3", "B-EKF 4")

_SOF_FAMILY = ("mtSOF", "B-mtSOF")

_UKF_FAMILY = ("UKF", "B-UKF", "UKFz")

NAMES = _EKF_FAMILY + _SOF_FAMILY + _UKF_FAMILY


# --- the measurement and its derivatives -------------------------------------------------------


def _h(x):
    """Range and bearing of x (section III)."""
    x1, x2 = x
    return mp.sqrt(x1 * x1 + x2 * x2), mp.atan2(x2, x1)


def _jacobian(x):
    """H of Eqs. (11) and (12): rows (x1, x2)/r and (-x2, x1)/r^2."""
    x1, x2 = x
    r2 = x1 * x1 + x2 * x2
    r = mp.sqrt(r2)
    return x1 / r, x2 / r, -x2 / r2, x1 / r2


def _second_order_bias(x, p):
    """b_m of Eq. (18): half the trace of (Hessian of h_i) times P.

    The Hessian of the range is [x2^2, -x1 x2, x1^2] / r^3 and that of the bearing
    [2 x1 x2, x2^2 - x1^2, -2 x1 x2] / r^4, as entries (11, 12, 22).
    """
    x1, x2 = x
    p11, p12, p22 = p
    r2 = x1 * x1 + x2 * x2
    r = mp.sqrt(r2)
    b1 = (x2 * x2 * p11 - 2 * x1 * x2 * p12 + x1 * x1 * p22) / (2 * r2 * r)
    b2 = (x1 * x2 * (p11 - p22) + (x2 * x2 - x1 * x1) * p12) / (r2 * r2)
    return b1, b2


# --- zhat, Pzz and Pxz of each filter ----------------------------------------------------------


def _ekf_noise(name, x, p, r, hph, bump):
    """The measurement noise each EKF variant puts in place of R, Eqs. (13) to (16).

    For range and bearing H H^T = diag(1, 1/rho^2), and J^T J = diag(1, rho^2) makes the
    eigenvalues of J R J^T equal to R1 and rho^2 R2, where rho is the estimated range.
    """
    noise = (r[0], mpf(0), r[1])
    rho2 = x[0] * x[0] + x[1] * x[1]
    hht = (mpf(1), mpf(0), 1 / rho2)
    if name == "B-EKF 1":
        return add(noise, hph, bump)
    if name == "B-EKF 2":
        return add(noise, hht, spectral_norm(p))
    if name == "B-EKF 3":
        largest = max(r[0], rho2 * r[1])
        return tuple(largest * entry for entry in hht)
    return noise


def _unscented(x, p, alpha, beta, kappa, root):
    """Sums of Eqs. (21) to (25): mean of Z, its covariance without R, and Pxz.

    The weights are the scaled ones: lambda = alpha^2 (n + kappa) - n with n = 2.
    """
    scale = alpha * alpha * (2 + kappa)  # n + lambda
    gamma = mp.sqrt(scale)
    w0_mean = (scale - 2) / scale
    w0_cov = w0_mean + 1 - alpha * alpha + beta
    w = 1 / (2 * scale)

    offsets = [(mpf(0), mpf(0))]
    for column in square_root(p, root):
        u, v = gamma * column[0], gamma * column[1]
        offsets += [(u, v), (-u, -v)]
    images = [_h((x[0] + u, x[1] + v)) for u, v in offsets]

    z1 = w0_mean * images[0][0] + w * sum(image[0] for image in images[1:])
    z2 = w0_mean * images[0][1] + w * sum(image[1] for image in images[1:])
    residuals = [(a - z1, b - z2) for a, b in images]

    spread = tuple(w0_cov * entry for entry in outer(residuals[0]))
    for residual in residuals[1:]:
        spread = add(spread, outer(residual), w)
    # The central point has no offset, so it drops out of Pxz.
    pairs = list(zip(offsets, residuals, strict=True))[1:]
    pxz = tuple(w * sum(o[i] * e[j] for o, e in pairs) for i in (0, 1) for j in (0, 1))
    return (z1, z2), spread, pxz


def measurement_moments(name, x, p, r, *, bump=1, alpha=1, beta=2, kappa=1, root="cholesky"):
    """Expected measurement and covariances of one filter, before an update.

    Eqs. (10) to (12) for the EKF, with the noise of (13) to (16) for its bumped-up forms; (18) to
    (20) for the mtSOF; (21) to (25) for the UKF; section VI.A for B-UKF and UKFz. Works in the
    current mpmath precision.

    Parameters
    ----------
    name : str
        One of `NAMES`.
    x, p : tuples of mpf
        Prior state (x1, x2) and covariance (P11, P12, P22). For B-EKF 4, the covariance
        after Eq. (17).
    r : tuple of mpf
        The two variances of the measurement noise.
    bump : number
        The alpha of Eq. (14), for B-EKF 1.
    alpha, beta, kappa : numbers
        Scaled unscented weights.
    root : str
        "cholesky" or "symmetric".

    Returns
    -------
    zhat : tuple
        The expected measurement (range, bearing).
    pzz : tuple
        Its covariance (11, 12, 22).
    pxz : tuple
        Cross covariance (11, 12, 21, 22); rows are states, columns measurements.
    """
    noise = (r[0], mpf(0), r[1])
    if name in _EKF_FAMILY:
        hph, pxz = spread_through(_jacobian(x), p)
        return _h(x), add(_ekf_noise(name, x, p, r, hph, bump), hph), pxz
    if name in _SOF_FAMILY:
        hph, pxz = spread_through(_jacobian(x), p)
        bias = _second_order_bias(x, p)
        copies = 2 if name == "B-mtSOF" else 1
        pzz = add(add(noise, hph, copies), outer(bias), -1)
        z1, z2 = _h(x)
        return (z1 + bias[0], z2 + bias[1]), pzz, pxz
    if name in _UKF_FAMILY:
        mean, spread, pxz = _unscented(x, p, alpha, beta, kappa, root)
        copies = 2 if name == "B-UKF" else 1
        return (_h(x) if name == "UKFz" else mean), add(noise, spread, copies), pxz
    raise ValueError(f"unknown filter {name!r}; the names are {', '.join(NAMES)}")


# --- the update and the run --------------------------------------------------------------------


def update(x, p, z, zhat, pzz, pxz):
    """One linear update, Eqs. (5) to (7): the new state and covariance.

    The covariance is Eq. (7) itself, each of its three entries computed once.
    """
    s11, s12, s22 = pzz
    a, b, c, d = pxz
    det = s11 * s22 - s12 * s12
    # Gain K = Pxz Pzz^-1, Eq. (5).
    k11, k12 = (a * s22 - b * s12) / det, (b * s11 - a * s12) / det
    k21, k22 = (c * s22 - d * s12) / det, (d * s11 - c * s12) / det
    e1, e2 = z[0] - zhat[0], z[1] - zhat[1]
    x_new = (x[0] + k11 * e1 + k12 * e2, x[1] + k21 * e1 + k22 * e2)
    p_new = (
        p[0] - (k11 * a + k12 * b),
        p[1] - (k11 * c + k12 * d),
        p[2] - (k21 * c + k22 * d),
    )
    return x_new, p_new


def history(
    name: str,
    *,
    x_true=(100, 100),
    x0=(20, 80),
    sigma=100,
    R=("2.5e-5", "6e-3"),
    steps: int = 1000,
    digits: int = 60,
    bump=1,
    alpha=1,
    beta=2,
    kappa=1,
    root: str = "cholesky",
    keep=None,
    z=None,
) -> list:
    """Run one filter from x0 and P0 = sigma^2 I over `steps` equal measurements.

    The defaults are the baseline of section III. Numbers given as text are read as the decimal
    they spell; floats are taken as the binary value they hold.

    Parameters
    ----------
    name : str
        One of `NAMES`.
    x_true, x0 : pairs of numbers
        True position and first estimate.
    sigma : number
        Standard deviation of the first estimate, the same in both directions.
    R : pair of numbers
        Variances of range and bearing noise.
    steps : int
        Number of updates.
    digits : int
        Decimal digits carried.
    bump, alpha, beta, kappa, root
        See `measurement_moments`.
    keep : iterable of int, optional
        The ks to return; all of them if left out.
    z : pair of numbers, optional
        The measurement; h(x_true) if left out.

    Returns
    -------
    list
        Entries (k, (x1, x2), (P11, P12, P22)) for k = 0 (the start) to `steps`.

    Raises
    ------
    ValueError
        If the name is unknown, or if P of an unscented filter stops being positive definite;
        the message names the update.
    """
    if name not in NAMES:
        raise ValueError(f"unknown filter {name!r}; the names are {', '.join(NAMES)}")
    wanted = None if keep is None else set(keep)
    with mp.workdps(digits):
        x = (mpf(x0[0]), mpf(x0[1]))
        p = (mpf(sigma) ** 2, mpf(0), mpf(sigma) ** 2)
        r = (mpf(R[0]), mpf(R[1]))
        z = _h((mpf(x_true[0]), mpf(x_true[1]))) if z is None else (mpf(z[0]), mpf(z[1]))
        options = {
            "bump": mpf(bump),
            "alpha": mpf(alpha),
            "beta": mpf(beta),
            "kappa": mpf(kappa),
            "root": root,
        }
        entries = []
        for k in range(steps + 1):
            if k > 0:
                if name == "B-EKF 4":  # Eq. (17), before the update
                    p = (spectral_norm(p), mpf(0), spectral_norm(p))
                x, p = update(x, p, z, *measurement_moments(name, x, p, r, **options))
            if name in _UKF_FAMILY and not is_positive_definite(p):
                raise ValueError(f"{name}: P is not positive definite after update {k}")
            if wanted is None or k in wanted:
                entries.append((k, x, p))
        return entries


def position_error(state_tuple, x_true=(100, 100), digits: int = 60):
    """Distance from a state (x1, x2), or an entry of `history`, to the true position.

    It is the norm plotted in Figs. 3 to 6 and 9, and the numerator of Eq. (27).
    """
    x = state_tuple[1] if len(state_tuple) == 3 else state_tuple
    with mp.workdps(digits):
        return mp.hypot(x[0] - mpf(x_true[0]), x[1] - mpf(x_true[1]))
