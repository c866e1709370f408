"""Logs of Kalman filters of a target on a line, right ones and ones with a fault."""

import numpy as np

from navfilters.diagnosis import Log

F = np.array([[1.0, 1.0], [0.0, 1.0]])
Q = np.diag([0.01, 0.02])
R = np.diag([0.5, 0.2])


def kalman_log(seed=0, steps=400, *, told_r=1.0, told_q=1.0, late=None, gaps=0.0):
    """Position and velocity, both measured; what it is told may be wrong, from ``late`` on."""
    rng = np.random.default_rng(seed)
    x, mean, P = np.zeros(2), np.zeros(2), np.eye(2)
    x = rng.multivariate_normal(mean, P)
    rows = []
    for k in range(steps):
        wrong = late is None or k >= late
        r, q = (told_r, told_q) if wrong else (1.0, 1.0)
        x = F @ x + rng.multivariate_normal(np.zeros(2), Q)
        z = x + rng.multivariate_normal(np.zeros(2), R)
        mean, P = F @ mean, F @ P @ F.T + q * Q
        S, y = P + r * R, z - mean
        seen = rng.random(2) >= gaps
        rows.append((k + 1.0, np.where(seen, y, np.nan), S))
        H = np.eye(2)[seen]
        K = P @ H.T @ np.linalg.inv(H @ S @ H.T)
        mean, P = mean + K @ (H @ y), P - K @ H @ P
        rows[-1] += (mean - x, P)
    return Log(*(np.array(column) for column in zip(*rows, strict=True)))
