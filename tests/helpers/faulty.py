"""A textbook's EKF and UKF of one state, right, and with one fault each."""

import numpy as np

from navfilters.crash import from_functions
from navfilters.estimators import model_parts


def seen(z, model):
    kept = ~np.isnan(z)
    return kept, z[kept], model.R[np.ix_(kept, kept)]


def ekf(fault=""):
    """An extended Kalman filter in Joseph's form."""

    def predict(x, P, dynamics):
        f, F = dynamics.transition(x)
        Q = dynamics.Q
        if fault == "Q discretised wrongly":
            Q = Q / 2
        return f, F @ P @ F.T + Q

    def update(x, P, z, model):
        if fault == "what is missing is read as zero":
            z = np.nan_to_num(z)
        kept, z, R = seen(z, model)
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
        if fault == "the short form, all digits lost":
            new = P - K @ S @ K.T
        return x + K @ y, new

    return from_functions(predict, update)


def stale_ukf():
    """Sigma points are those of before the prediction's noise, as in a well-known shortcut."""
    kept_points = {}

    def points(x, P):
        L = np.linalg.cholesky(3.0 * P)
        return np.vstack([x, x + L.T, x - L.T])

    def weights(n):
        return np.r_[1 - n / 3.0, np.full(2 * n, 1 / 6.0)]

    def predict(x, P, dynamics):
        X = np.array([dynamics.f(p) for p in points(x, P)])
        w = weights(len(x))
        mean = w @ X
        kept_points["X"] = X
        return mean, (X - mean).T @ (w[:, None] * (X - mean)) + dynamics.Q

    def update(x, P, z, model):
        kept, z, R = seen(z, model)
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


class Remembering:
    """A filter with state that leaks from one member to the next."""

    def __init__(self):
        self.last = 0.0

    def filter(self):
        right = ekf()

        def update(x, P, z, model):
            x, P = right.update(x, P, z, model)
            x = x + 1e-3 * self.last
            self.last = float(x[0])
            return x, P

        return from_functions(right.predict, update)


FAULTS = {
    "sign of a Jacobian": (lambda: ekf("sign of a Jacobian"), "linear"),
    "R squared": (lambda: ekf("R squared"), "linear"),
    "gain transposed": (lambda: ekf("gain transposed"), "linear"),
    "over-confident": (lambda: ekf("over-confident"), "linear"),
    "Q discretised wrongly": (lambda: ekf("Q discretised wrongly"), "motion"),
    "stale sigma points": (stale_ukf, "motion"),
    "what is missing is read as zero": (
        lambda: ekf("what is missing is read as zero"),
        "missing",
    ),
    "no wrap": (lambda: ekf("no wrap"), "jump"),
    "P not symmetrised": (lambda: ekf("P not symmetrised"), "covariance"),
    "the short form, all digits lost": (
        lambda: ekf("the short form, all digits lost"),
        "decades",
    ),
    "state leaks between members": (lambda: Remembering().filter(), "members"),
}
"""A planted fault, and the check that must catch it."""
