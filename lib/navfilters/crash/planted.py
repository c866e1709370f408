"""A textbook's EKF and UKF of one state, right, and with one fault each: the test of the test."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from navfilters.crash.adapters import Adapted, from_functions
from navfilters.estimators import model_parts
from navfilters.models import Linear
from navfilters.types import Array


def _seen(z: Array, model: Any) -> tuple[Array, Array, Array]:
    kept = ~np.isnan(z)
    return kept, z[kept], model.R[np.ix_(kept, kept)]


def textbook_ekf(fault: str = "") -> Adapted:
    """An extended Kalman filter in Joseph's form.

    Parameters
    ----------
    fault : str
        A key of ``FAULTS`` that is one of its lines; none by default.

    Returns
    -------
    Adapted
    """

    def predict(x: Array, P: Array, dynamics: Any) -> tuple[Array, Array]:
        f, F = dynamics.transition(x)
        Q = dynamics.Q
        if fault == "Q discretised wrongly":
            Q = Q / 2
        return f, F @ P @ F.T + Q

    def update(x: Array, P: Array, z: Array, model: Any) -> tuple[Array, Array]:
        if fault == "what is missing is read as zero":
            z = np.nan_to_num(z)
        kept, z, R = _seen(z, model)
        H = model.jacobian(x)[kept]
        if fault == "sign of a Jacobian":
            H = H * np.where(np.arange(H.shape[1]) == 0, -1, 1)
        if fault == "R squared":
            R = R @ R
        both = np.zeros((2, len(kept)))
        both[:, kept] = z, model.h(x)[kept]
        if fault == "no wrap":
            y = (both[0] - both[1])[kept]
        else:
            y = model_parts.residual(model, *both)[kept]
        S = H @ P @ H.T + R
        K = P @ H.T @ np.linalg.inv(S)
        if fault == "gain transposed":
            K = (np.linalg.inv(S) @ H @ P).reshape(K.shape)
        rest = np.eye(len(x)) - K @ H
        new = rest @ P @ rest.T + K @ R @ K.T
        if fault == "P not symmetrised":
            new = (np.eye(len(x)) - K @ H) @ P
            new[0, -1] *= 1 + 1e-6
        if fault == "over-confident":
            new = 0.8 * new
        if fault == "over-confident where it is curved" and not isinstance(model, Linear):
            new = 0.8 * new
        if fault == "the short form, all digits lost":
            new = P - K @ S @ K.T
        return x + K @ y, new

    return from_functions(predict, update)


def stale_ukf() -> Adapted:
    """An unscented filter whose update takes the points from before the noise of the prediction.

    Returns
    -------
    Adapted
    """
    kept_points: dict[str, Array] = {}

    def points(x: Array, P: Array) -> Array:
        L = np.linalg.cholesky(3.0 * P)
        return np.vstack([x, x + L.T, x - L.T])

    def weights(n: int) -> Array:
        return np.r_[1 - n / 3.0, np.full(2 * n, 1 / 6.0)]

    def predict(x: Array, P: Array, dynamics: Any) -> tuple[Array, Array]:
        X = np.array([dynamics.f(p) for p in points(x, P)])
        w = weights(len(x))
        mean = w @ X
        kept_points["X"] = X
        return mean, (X - mean).T @ (w[:, None] * (X - mean)) + dynamics.Q

    def update(x: Array, P: Array, z: Array, model: Any) -> tuple[Array, Array]:
        kept, z, R = _seen(z, model)
        X = kept_points.pop("X", None)
        X = points(x, P) if X is None else X
        w = weights(len(x))
        Z = np.array([model.h(p)[kept] for p in X])
        z_hat = w @ Z
        S = (Z - z_hat).T @ (w[:, None] * (Z - z_hat)) + R
        P_xz = (X - x).T @ (w[:, None] * (Z - z_hat))
        K = P_xz @ np.linalg.inv(S)
        return x + K @ (z - z_hat), P - K @ S @ K.T

    return from_functions(predict, update)


def remembering() -> Adapted:
    """A filter in which a member leaves something behind for the next.

    Returns
    -------
    Adapted
    """
    right, last = textbook_ekf(), [0.0]

    def update(x: Array, P: Array, z: Array, model: Any) -> tuple[Array, ...]:
        x, P = right.update(x, P, z, model)
        x = x + 1e-3 * last[0]
        last[0] = float(x[0])
        return x, P

    return from_functions(right.predict, update)


FAULTS: dict[str, tuple[Callable[[], Adapted], str]] = {
    "stale sigma points": (stale_ukf, "motion"),
    "state leaks between members": (remembering, "members"),
} | {
    fault: (partial(textbook_ekf, fault), check)
    for fault, check in (
        ("sign of a Jacobian", "linear"),
        ("R squared", "linear"),
        ("gain transposed", "linear"),
        ("over-confident", "linear"),
        ("over-confident where it is curved", "pendulum"),
        ("Q discretised wrongly", "motion"),
        ("what is missing is read as zero", "missing"),
        ("no wrap", "jump"),
        ("P not symmetrised", "covariance"),
        ("the short form, all digits lost", "decades"),
    )
}
"""A planted fault: what makes the filter, and the check that is meant for it."""
