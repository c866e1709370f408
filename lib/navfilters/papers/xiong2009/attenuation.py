"""Limits of the tuning parameters of the robust filters, as numbers."""

import numpy as np

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

    References
    ----------
    xiong2009, Eq. (25).
    """
    root = np.linalg.inv(np.linalg.cholesky(P))
    return np.linalg.eigvalsh(root @ Sigma_bar @ root.mT)[..., -1]


def attenuation_ratio(error: Array, *disturbances: Array) -> Array:
    """Energy of the errors over that of the disturbances.

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

    References
    ----------
    xiong2009, Eq. (10), the first of two with this number.
    """
    return np.sum(error**2, axis=(0, -1)) / sum(np.sum(d**2, axis=(0, -1)) for d in disturbances)
