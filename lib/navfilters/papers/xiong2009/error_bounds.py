"""Bounds of the error of the robust filters, as numbers."""

from typing import NamedTuple

import numpy as np

from navfilters.numerics import validation
from navfilters.types import Array


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
        Start the sum at i = 1 as the text does, which is no bound.

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

    References
    ----------
    xiong2009, Eqs. (17), (18).
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
        With the slips of (20): mu_max / p_min for mu_max p_max, and a sum from i = 1.

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
