"""The theory of the robust filters as numbers: limits of the tuning parameters, error bounds.

Nothing here filters. Each function takes the matrices of a run, computes one inequality of
xiong2009, and names the slips of the printed one; ``as_printed=True`` evaluates it with them.
"""

from typing import NamedTuple

import numpy as np

from navfilters import validation
from navfilters.types import Array


def real_covariance(F: Array, beta: Array, P: Array, Q: Array) -> Array:
    """Covariance of the prediction error when the Jacobian is off by a factor beta.

    Sigma_bar = beta F P F^T beta + Q

    Parameters
    ----------
    F, beta, P, Q : array (..., n, n)
        Jacobian, the diagonal matrix of Eq. (15), covariance of the last estimate, process noise.

    Returns
    -------
    array (..., n, n)

    Notes
    -----
    P stands for the covariance of the last error, which the filter computes and does not know.

    References
    ----------
    xiong2009, Eqs. (15), (16).
    """
    return beta @ F @ P @ F.mT @ beta.mT + Q


def gamma_limits(P: Array, Sigma_bar: Array) -> tuple[Array, Array]:
    """The gammas that Theorem 1 allows at a step: above the first limit, below the second.

    sqrt(max eig P) < gamma < max eig(P^-1 - Sigma_bar^-1)^(-1/2)

    Parameters
    ----------
    P, Sigma_bar : array (..., n, n)
        Predicted and real covariance of the prediction error, symmetric positive definite.

    Returns
    -------
    tuple of array (...)
        The limit (23), for Sigma to exist, and the limit (22), for Sigma > Sigma_bar: infinite
        where P exceeds Sigma_bar by itself. No gamma will do where the first is not below the
        second.

    Notes
    -----
    The text after (21) calls max[eig(A)] the minimum eigenvalue; the maximum is meant.

    References
    ----------
    xiong2009, Eqs. (21)-(23).
    """
    lack = np.linalg.eigvalsh(np.linalg.inv(P) - np.linalg.inv(Sigma_bar))[..., -1]
    upper = np.where(lack > 0, lack, 1.0) ** -0.5
    return np.linalg.eigvalsh(P)[..., -1] ** 0.5, np.where(lack > 0, upper, np.inf)


def smallest_lambda(P: Array, Sigma_bar: Array) -> Array:
    """The lambda that Theorem 2 must exceed at a step: the least with Sigma_bar <= lambda P.

    Parameters
    ----------
    P, Sigma_bar : array (..., n, n)
        Predicted and real covariance of the prediction error, symmetric positive definite.

    Returns
    -------
    array (...)
        max eig(P^-1 Sigma_bar).

    Notes
    -----
    Where this, lambda*, exceeds 1, Eq. (47) with the true covariance of the innovations falls short
    of it: tr P_y_bar = tr(H Sigma_bar H^T + R) <= lambda* tr(H P H^T) + tr R < lambda* tr P_y. With
    the estimate (27) it may exceed lambda* or not.

    References
    ----------
    xiong2009, Eq. (25).
    """
    root = np.linalg.inv(np.linalg.cholesky(P))
    return np.linalg.eigvalsh(root @ Sigma_bar @ root.mT)[..., -1]


def attenuation_ratio(error: Array, *disturbances: Array) -> Array:
    """Energy of the errors over that of the disturbances, which the REKF keeps below gamma^2.

    sum norm(x_t - x_hat_t)^2 / (sum norm(w_t)^2 + sum norm(Delta_t)^2 + sum norm(v_t)^2)

    Parameters
    ----------
    error : array (steps, ..., n)
        Errors of the estimates.
    *disturbances : array (steps, ..., p)
        Whatever drove them. A disturbance at one time only, such as the initial error, has one
        step.

    Returns
    -------
    array (...)

    Notes
    -----
    For the printed ratio give w, Delta and v as they are: no two of the energies of x, w and v need
    have the same units, the initial error is missing, and nothing bounds it by gamma^2. What the
    recursion (3)-(9) guarantees on a linear system, for *any* disturbance, is the ratio with the
    *predicted* errors x_t - x_{t|t-1} above, and Q^(-1/2) w_t, R^(-1/2) v_t and
    P^(-1/2) (x - x_hat) of the first prediction below, as long as (23) holds at every step.

    References
    ----------
    xiong2009, Eq. (10), the first of two with this number.
    """
    return np.sum(error**2, axis=(0, -1)) / sum(np.sum(d**2, axis=(0, -1)) for d in disturbances)


def lemma_bound(
    v_min: float,
    v_max: float,
    mu: float,
    lam: float,
    start: float,
    t: Array,
    *,
    as_printed: bool = False,
) -> np.ndarray:
    """Bound on E norm(xi_t)^2 when E[V_t | xi_{t-1}] <= (1 - lambda) V_{t-1} + mu.

    (v_max / v_min) E norm(xi_0)^2 (1 - lambda)^t + (mu / v_min) sum of (1 - lambda)^i, i < t

    Parameters
    ----------
    v_min, v_max : float
        v_min norm(xi)^2 <= V(xi) <= v_max norm(xi)^2.
    mu, lam : float
        The constants of Eq. (11), 0 <= lam <= 1. At lam = 0 the bound grows with t for ever.
    start : float
        E norm(xi_0)^2.
    t : int array (...)
        Times, at least 0.
    as_printed : bool
        Start the sum at i = 1 as the text does: too small by mu / v_min. Equality in (11) with
        v_min = v_max exceeds it at every t >= 1.

    Returns
    -------
    array (...)

    References
    ----------
    xiong2009, Lemma 1, Eqs. (10)-(12).
    """
    t = validation.real_array("t", t, "")
    q = 1.0 - lam
    terms = np.where(t > 0, t, 0.0) if lam == 0 else (1 - q**t) / lam
    if as_printed:
        terms = terms - (t > 0)
    return v_max / v_min * start * q**t + mu / v_min * terms


class Assumptions(NamedTuple):
    """The constants of assumptions 1 and 2 of Theorem 1.

    Parameters
    ----------
    n, m : int
        Sizes of state and measurement.
    f_min, f_max, beta_min, beta_max, h_min, h_max : float
        Bounds of the singular values of F, beta and H. h_min is that of H^T H: zero unless
        rank H = n.
    p_min, p_max, r_min, r_max, q_max : float
        Bounds of the eigenvalues of P, R and Q.

    References
    ----------
    xiong2009, Eqs. (17), (18).
    """

    n: int
    m: int
    f_min: float
    f_max: float
    beta_min: float
    beta_max: float
    h_min: float
    h_max: float
    p_min: float
    p_max: float
    r_min: float
    r_max: float
    q_max: float


def assumptions(F: Array, beta: Array, H: Array, P: Array, R: Array, Q: Array) -> Assumptions:
    """The tightest constants of Theorem 1 for a run.

    Parameters
    ----------
    F, beta, P, Q : array (..., n, n)
        Of every step; P from t = 0 on.
    H : array (..., m, n)
    R : array (..., m, m)

    Returns
    -------
    Assumptions

    Notes
    -----
    (17) prints h_min^2 I <= H H^T; (A.14) uses it as h_min^2 I <= H^T H. The two agree when H is
    square. With fewer measurements than states the second has h_min = 0, and (A.14) says nothing;
    V then contracts by what Q adds: see ``contraction``.
    """
    m, n = H.shape[-2:]
    f, b, h = (np.linalg.svd(A, compute_uv=False) for A in (F, beta, H))
    p, r, q = (np.linalg.eigvalsh(A) for A in (P, R, Q))
    return Assumptions(
        n=n,
        m=m,
        f_min=float(f.min()),
        f_max=float(f.max()),
        beta_min=float(b.min()),
        beta_max=float(b.max()),
        h_min=float(h.min()) if m >= n else 0.0,
        h_max=float(h.max()),
        p_min=float(p.min()),
        p_max=float(p.max()),
        r_min=float(r.min()),
        r_max=float(r.max()),
        q_max=float(q.max()),
    )


def contraction(M: Array, P: Array, P_next: Array) -> Array:
    """The share of V = e^T P^-1 e that a step takes from every error: the least over directions.

    1 - max over e of (M e)^T P_next^-1 (M e) / e^T P^-1 e

    Parameters
    ----------
    M : array (..., n, n)
        What a step makes of an error: (I - K H) beta F.
    P, P_next : array (..., n, n)
        Covariance of the estimate before and after the step, symmetric positive definite.

    Returns
    -------
    array (...)
        The best lambda of Eq. (A.15) at this step.

    References
    ----------
    xiong2009, Eqs. (A.1)-(A.5).
    """
    root = np.linalg.solve(np.linalg.cholesky(P_next), M @ np.linalg.cholesky(P))
    return 1 - np.linalg.svd(root, compute_uv=False)[..., 0] ** 2


def theorem_constants(a: Assumptions) -> tuple[float, float]:
    """lambda_min and mu_max of Theorem 1, in E[V_t] <= (1 - lambda_min) V_{t-1} + mu_max.

    lambda_min = p_min s^2 / (p_max (h_max beta_max f_max)^2 + q_max h_max^2 + r_max)
    with s = h_min beta_min f_min,
    mu_max = (1 / p_min + h_max^4 p_max / r_min^2) q_max n + h_max^2 p_max m / r_min

    Parameters
    ----------
    a : Assumptions

    Returns
    -------
    tuple of float
        (lambda_min, mu_max).

    Notes
    -----
    The proof reaches lambda_min through the lambda_t of (A.11), which may be smaller. The rate
    holds all the same. With the Sigma of the step, (I - K H)^T P^-1 (I - K H) =
    (Sigma + Sigma H^T R^-1 H Sigma)^-1 <= Sigma^-1 / (1 + s), where
    s = h_min^2 p_min (beta_min f_min)^2 / r_max because Sigma > beta F P F^T beta, Eq. (19). So V
    contracts by s / (1 + s), which is never below lambda_min.

    References
    ----------
    xiong2009, Eqs. (A.12), (A.14), (A.15).
    """
    least = a.p_min * (a.h_min * a.beta_min * a.f_min) ** 2
    most = a.p_max * (a.h_max * a.beta_max * a.f_max) ** 2 + a.q_max * a.h_max**2
    mu = (1 / a.p_min + a.h_max**4 * a.p_max / a.r_min**2) * a.q_max * a.n
    return least / (most + a.r_max), mu + a.h_max**2 * a.p_max / a.r_min * a.m


def theorem_bound(
    a: Assumptions, start: float, t: Array, *, as_printed: bool = False
) -> np.ndarray:
    """Bound of Theorem 1 on the mean-square error E norm(x_t - x_hat_t)^2.

    (p_max / p_min) e_0^2 (1 - lambda_min)^t + mu_max p_max sum of (1 - lambda_min)^i,
    e_0^2 = E norm(x_0 - x_hat_0)^2

    Parameters
    ----------
    a : Assumptions
    start : float
        E norm(x_0 - x_hat_0)^2.
    t : int array (...)
        Times, at least 0.
    as_printed : bool
        With the slips: (20) has mu_max / p_min where (A.2) and Lemma 1 give mu_max p_max (the
        printed one is not even a square of the state's units), and starts its sum at i = 1.

    Returns
    -------
    array (...)
        Holds if Sigma > Sigma_bar at every step, Eq. (19), and rank H = n.

    References
    ----------
    xiong2009, Theorem 1, Eq. (20); Theorem 2, Eq. (30).
    """
    lam, mu = theorem_constants(a)
    if as_printed:
        mu /= a.p_min * a.p_max
    return lemma_bound(1 / a.p_max, 1 / a.p_min, mu, lam, start, t, as_printed=as_printed)
