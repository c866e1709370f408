"""What each variant is on a linear model, in the textbook's terms: its P and R given (P, H, R)."""

import numpy as np

from navfilters.estimators import variants
from navfilters.types import Array

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
