"""Logs of Kalman filters of a target on a line, right ones and ones with a fault."""

import numpy as np

from navfilters.diagnosis import Log

F = np.array([[1.0, 1.0], [0.0, 1.0]])
Q = np.diag([0.01, 0.02])
R = np.diag([0.5, 0.2])


def kalman_logs(seeds, steps=400, *, told_r=1.0, told_q=1.0, late=None, gaps=0.0):
    """Position and velocity, both measured; what it is told may be wrong, from ``late`` on."""
    draws = [_drawn(np.random.default_rng(seed), steps) for seed in seeds]
    x, w, v, chance = (np.stack(part, axis=-2) for part in zip(*draws, strict=True))
    w, v, seen = w * np.sqrt(np.diag(Q)), v * np.sqrt(np.diag(R)), chance >= gaps
    mean, P, rows = np.zeros_like(x), np.eye(2), []
    for k in range(steps):
        wrong = late is None or k >= late
        r, q = (told_r, told_q) if wrong else (1.0, 1.0)
        x = x @ F.T + w[k]
        mean, P = mean @ F.T, F @ P @ F.T + q * Q
        S, y = P + r * R, x + v[k] - mean
        both = seen[k, :, :, None] & seen[k, :, None, :]
        K = P @ np.where(both, np.linalg.inv(np.where(both, S, np.eye(2))), 0.0)
        mean, P = mean + (K @ y[..., None])[..., 0], P - K @ P
        rows.append((np.where(seen[k], y, np.nan), np.broadcast_to(S, P.shape), mean - x, P))
    of_seeds = (np.stack(column, axis=1) for column in zip(*rows, strict=True))
    return [Log(np.arange(1.0, steps + 1), *parts) for parts in zip(*of_seeds, strict=True)]


def _drawn(rng, steps):
    """Standard normal numbers of the start, of motion and measurement, and chances of a gap."""
    first = rng.normal(size=2)
    rest = [(rng.normal(size=2), rng.normal(size=2), rng.random(2)) for _ in range(steps)]
    w, v, chance = map(np.array, zip(*rest, strict=True))
    return first, w[:, ::-1], v, chance


def kalman_log(seed=0, steps=400, **wrong):
    """One of them."""
    return kalman_logs([seed], steps, **wrong)[0]
