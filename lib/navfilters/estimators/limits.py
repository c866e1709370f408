"""What each variant is on a linear model, in the textbook's terms: its P and R given (P, H, R)."""

from typing import Any

import numpy as np

from navfilters.estimators import variants
from navfilters.types import Array, Gaussian

Limit = tuple[Array, Array]


def _kalman(P: Array, H: Array, R: Array) -> Limit:
    return P, R


def _bumped(P: Array, H: Array, R: Array, bump: Array = 1.0) -> Limit:
    return P, R + np.asarray(bump)[..., None, None] * (H @ P @ H.mT)


def _circular(P: Array, H: Array, R: Array) -> Limit:
    return P, R + np.linalg.norm(P, 2, axis=(-2, -1), keepdims=True) * (H @ H.mT)


def _equivalent(P: Array, H: Array, R: Array) -> Limit:
    J = np.linalg.inv(H)
    return P, np.linalg.norm(J @ R @ J.mT, 2, axis=(-2, -1), keepdims=True) * (H @ H.mT)


def _forgetful(P: Array, H: Array, R: Array) -> Limit:
    return np.linalg.norm(P, 2, axis=(-2, -1), keepdims=True) * np.eye(P.shape[-1]), R


LIMITS = {
    variants.unchanged: _kalman,
    variants.bump_linear: _bumped,
    variants.bump_predicted: _bumped,
    variants.bump_circular: _circular,
    variants.bump_equivalent: _equivalent,
    variants.bump_state: _forgetful,
    variants.expect_at_mean: _kalman,
}
"""Every variant of the library, with its limit: the Kalman filter of this P and R."""


def textbook(
    variant: Any, options: dict[str, Any], prior: Gaussian, z: Array, H: Array, R: Array
) -> Gaussian:
    """The Kalman filter that a variant is, by LAPACK: no line of the filters takes part.

    Parameters
    ----------
    variant : callable
        Of the first step. One that is made around another has this as ``variant``, and ``limit``.
    options : dict
    prior : Gaussian
        As the rule left it.
    z, H, R : array (..., m), (..., m, n), (..., m, m)

    Returns
    -------
    Gaussian
    """
    inner = getattr(variant, "variant", variant)
    given = getattr(inner, "keywords", {}) | options
    P, R = LIMITS[getattr(inner, "func", inner)](prior.cov, H, R, **given)
    weight = H.mT @ np.linalg.inv(R)
    cov = np.linalg.inv(np.linalg.inv(P) + weight @ H)
    residual = z - (H @ prior.mean[..., None])[..., 0]
    updated = Gaussian(prior.mean + (cov @ weight @ residual[..., None])[..., 0], cov)
    return updated if inner is variant else variant.limit(Gaussian(prior.mean, P), updated)
