"""The flight of Xiong et al. by other means: Eq. (36) written out, differences, plain inverses."""

from functools import lru_cache

import numpy as np

MU, RADIUS, J2 = 3.986004418e14, 6378137.0, 1.08262668e-3
PUSH = 0.4527952178
BURNS = ((7293, 8373), (11279, 12068))
OF_J2 = np.array([1.0, 1.0, 3.0])
STARS = np.array([[0.5**0.5, 0, 0.5**0.5], [0, 1, 0]])
SIZES = np.array([10.0] * 3 + [1e-2] * 3 + [1e-4])  # of the differences


def rate(x, push):
    """dx/dt of (..., 6) with an acceleration along the velocity."""
    r2 = squared(x[..., :3])
    bracket = 1 + 1.5 * J2 * RADIUS**2 / r2 * (OF_J2 - 5 * x[..., 2:3] ** 2 / r2)
    v, a = x[..., 3:6], -MU * x[..., :3] / r2**1.5 * bracket
    if np.any(push):
        a = a + push * (v / np.sqrt(squared(v)))
    return np.concatenate([v, a], axis=-1)


def squared(v):
    """Lengths (..., 1) of vectors (..., 3), squared."""
    v = v**2
    return v[..., :1] + v[..., 1:2] + v[..., 2:]


def advance(x, h, push):
    """A state (..., 6) so many seconds later, by Simpson's rule of Runge and Kutta."""
    k1 = rate(x, push)
    k2 = rate(x + h / 2 * k1, push)
    k3 = rate(x + h / 2 * k2, push)
    return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(x + h * k3, push))


def fires(t, arcs=BURNS):
    """Whether the engine runs at a time."""
    return any(start <= t < end for start, end in arcs)


def parts(k, arcs=BURNS):
    """Beginnings and lengths of the sub-steps of interval k: 25 seconds, or up to an arc's end."""
    inside = [t for arc in (*arcs, *BURNS) for t in arc if 100 * k < t < 100 * k + 100]
    times = np.unique([*range(100 * k, 100 * k + 101, 25), *inside])
    return list(zip(times[:-1], np.diff(times), strict=True))


def angles(x):
    """The two angles of (38)."""
    r = x[..., :3]
    cosine = -(r @ STARS.T) / np.sqrt(np.sum(r**2, axis=-1, keepdims=True))
    return np.arccos(cosine)


@lru_cache
def flight(burns=BURNS):
    """The true states at 0, 100, ..., 20 000 s, (201, 6), not to be written into."""
    speed, tilt = np.sqrt(MU / (RADIUS + 500e3)), np.deg2rad(27.0)
    x = np.array([RADIUS + 500e3, 0, 0, 0, speed * np.cos(tilt), speed * np.sin(tilt)])
    states = [x]
    for k in range(200):
        for t, h in parts(k):
            x = advance(x, h, PUSH * fires(t, burns))
        states.append(x)
    path = np.array(states)
    path.setflags(write=False)
    return path


def differences(function, x):
    """A function of states (..., n) and its central differences: (..., m) and (..., m, n)."""
    n = x.shape[-1]
    steps = np.diag(SIZES[:n])
    found = function(x[..., None, :] + np.concatenate([steps, -steps, np.zeros((1, n))]))
    up, down, here = found[..., :n, :], found[..., n:-1, :], found[..., -1, :]
    return here, np.swapaxes((up - down) / (2 * SIZES[:n, None]), -1, -2)


def predicted(x, k, arcs, q_v, quiet):
    """A state (..., 6 or 7) 100 s later, its derivative, and W.

    A seventh component is the strength of a thrust that acts in the arcs. q_v and quiet are the
    deviations (...) per second of the velocity's noise in the arcs and always; that of a sub-step
    enters in its middle.
    """
    n = x.shape[-1]
    q_v, quiet = (np.asarray(q, float)[..., None, None] ** 2 for q in (q_v, quiet))
    E = np.eye(n)
    F, W = E, 0.0
    for t, h in parts(k, arcs):
        on = fires(t, arcs)

        def move(y, t=t, h=h, on=on):
            push = y[..., 6:] if on and n == 7 else 0.0
            return np.concatenate([advance(y[..., :6], h, push), y[..., 6:]], axis=-1)

        x, step = differences(move, x)
        half = E + h / 2 * np.eye(n, k=3) * (np.arange(n) < 6) * (np.arange(n) > 2)
        Q = 4e-10 * np.diag(np.arange(n) < 3)
        Q = Q + (quiet + on * q_v) * np.diag((np.arange(n) > 2) * (np.arange(n) < 6))
        F = step @ F
        W = step @ W @ np.swapaxes(step, -1, -2) if np.ndim(W) else W
        W = W + h * (half @ Q @ half.T)
    return x, F, W


def start(n=6):
    """P0, with a deviation of 0.4528 m/s^2 for the strength."""
    return np.diag(([5e3] * 3 + [10.0] * 3 + [PUSH])[:n]) ** 2


def expected(sigma, burns=BURNS, arcs=(), q_v=0.0, quiet=2e-4, strength=False):
    """What a filter without a rule does, to first order in its errors and without a random number.

    Parameters
    ----------
    sigma : float
        Deviation of an angle, rad.
    burns : tuple
        When the engine runs.
    arcs : tuple
        When the filter thinks so.
    q_v, quiet : float or array (k,)
        The deviation of its velocity's noise per second then, and always.
    strength : bool
        Whether it estimates the strength of the thrust.

    Returns
    -------
    tuple of array (201, k), array (201, k)
        RMS position error, m, and the mean NEES of six components.
    """
    n = 7 if strength else 6
    truth = flight(burns)
    if strength:
        truth = np.column_stack([truth, np.full(201, PUSH if burns else 0.0)])
    P, R = start(n), sigma**2 * np.eye(2)
    mean, C = np.array([5e3] * 3 + [10.0] * 3 + [truth[0, -1]])[:n, None], np.zeros((n, n))
    rms, nees = [], []
    for k in range(201):
        if k:
            modelled, F, W = predicted(truth[k - 1], k - 1, arcs, q_v, quiet)
            P = F @ P @ F.T + W
            mean = F @ mean + (truth[k] - modelled)[:, None]
            _, H = differences(angles, truth[k])
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
            left = np.eye(n) - K @ H
            turned = np.swapaxes(left, -1, -2)
            C = left @ F @ C @ F.T @ turned + K @ R @ np.swapaxes(K, -1, -2)
            P, mean = left @ P, left @ mean
        spread = (C + mean @ np.swapaxes(mean, -1, -2))[..., :6, :6]
        rms.append(np.sqrt(np.trace(spread[..., :3, :3], axis1=-2, axis2=-1)))
        weighted = np.linalg.solve(P[..., :6, :6], spread)
        nees.append(np.trace(weighted, axis1=-2, axis2=-1))
    return tuple(np.array(np.broadcast_arrays(*series)) for series in (rms, nees))


def fly(z, sigma, rule=None, arcs=(), q_v=0.0, quiet=2e-4, strength=False):
    """A filter through measured angles (200, seeds, 2): estimates (201, seeds, n) and P.

    ``rule(memory, y, H, P, R, W)`` gives the enlarged P and the next memory of every seed.
    """
    n = 7 if strength else 6
    x = flight(())[0] - np.array([5e3] * 3 + [10.0] * 3)
    x = np.tile(np.append(x, 0.0)[:n], (z.shape[1], 1))
    P, R = np.tile(start(n), (z.shape[1], 1, 1)), sigma**2 * np.eye(2)
    memory, path = None, [(x, P)]
    for k in range(200):
        x, F, W = predicted(x, k, arcs, q_v, quiet)
        P = F @ P @ np.swapaxes(F, -1, -2) + W
        expected_z, H = differences(angles, x)
        y = z[k] - expected_z
        if rule is not None:
            P, memory = rule(memory, y, H, P, R, W)
        T = np.swapaxes(H, -1, -2)
        K = P @ T @ np.linalg.inv(H @ P @ T + R)
        x, P = x + (K @ y[..., None])[..., 0], P - K @ H @ P
        path.append((x, P))
    return tuple(np.array(series) for series in zip(*path, strict=True))


def gate(probability):
    """Chi-square of two components: P times what brings the square to 2, by bisection."""
    limit = -2 * np.log(1 - probability)

    def rule(memory, y, H, P, R, W):
        out = P.copy()
        for i in range(len(P)):
            C = H[i] @ P[i] @ H[i].T
            if y[i] @ np.linalg.solve(C + R, y[i]) > limit:
                low, high = 1.0, 1e6
                for _ in range(100):
                    factor = np.sqrt(low * high)
                    above = y[i] @ np.linalg.solve(factor * C + R, y[i]) > 2
                    low, high = (factor, high) if above else (low, factor)
                out[i] = factor * P[i]
        return out, None

    return rule


def fading(rho, beta):
    """The strong tracking filter of Zhou and Frank."""

    def rule(memory, y, H, P, R, W):
        V = y[:, :, None] * y[:, None, :]
        V = V if memory is None else (rho * memory + V) / (1 + rho)
        out = P.copy()
        for i in range(len(P)):
            wanted = np.trace(V[i] - beta * R - H[i] @ W[i] @ H[i].T)
            factor = wanted / np.trace(H[i] @ (P[i] - W[i]) @ H[i].T)
            out[i] = max(1.0, factor) * (P[i] - W[i]) + W[i]
        return out, V

    return rule


def adaptive(alpha, rho):
    """The AREKF's (26), (27) and (47)."""

    def rule(memory, y, H, P, R, W):
        V = y[:, :, None] * y[:, None, :]
        V = V if memory is None else (rho * memory + V) / (1 + rho)
        S = H @ P @ np.swapaxes(H, -1, -2) + R
        least = np.linalg.eigvalsh(S - alpha * V)[:, 0]
        factor = np.trace(V, axis1=1, axis2=2) / np.trace(S, axis1=1, axis2=2)
        factor = np.where((least <= 0) & (factor > 1), factor, 1.0)
        return factor[:, None, None] * P, V

    return rule


def robust(weights):
    """The REKF's (5) with a weight gamma^-2 for each component, where P allows it."""

    def rule(memory, y, H, P, R, W):
        out = P.copy()
        for i in range(len(P)):
            root = np.sqrt(weights)
            if np.linalg.eigvalsh(root[:, None] * P[i] * root)[-1] < 1:
                out[i] = np.linalg.inv(np.linalg.inv(P[i]) - np.diag(weights))
        return out, None

    return rule


def two_models(z, sigma, stay, back, q_v):
    """An IMM of two such filters, without and with a noise q_v: its estimates (201, seeds, 6).

    ``stay`` and ``back`` are the probabilities that each model stays the true one.
    """
    always = ((0, 20000),)
    x = np.tile(flight(())[0] - np.array([5e3] * 3 + [10.0] * 3), (2, z.shape[1], 1))
    P = np.tile(start(), (2, z.shape[1], 1, 1))
    mu = np.tile([0.99, 0.01], (z.shape[1], 1))
    table, R = np.array([[stay, 1 - stay], [1 - back, back]]), sigma**2 * np.eye(2)

    def merged(weights):
        mean = np.einsum("si,isn->sn", weights, x)
        off = x - mean
        spread = P + off[..., :, None] * off[..., None, :]
        return mean, np.einsum("si,isnm->snm", weights, spread)

    path = [x[0].copy()]
    for k in range(200):
        joint = mu[:, :, None] * table  # from i to j
        mu = joint.sum(axis=1)
        starts = [merged(joint[:, :, j] / mu[:, j : j + 1]) for j in (0, 1)]
        moved = [predicted(starts[j][0], k, always, (0.0, q_v)[j], 2e-4) for j in (0, 1)]
        fit = []
        for j, (y, F, W) in enumerate(moved):
            C = F @ starts[j][1] @ np.swapaxes(F, -1, -2) + W
            expected_z, H = differences(angles, y)
            e = z[k] - expected_z
            S = H @ C @ np.swapaxes(H, -1, -2) + R
            K = C @ np.swapaxes(H, -1, -2) @ np.linalg.inv(S)
            x[j], P[j] = y + (K @ e[..., None])[..., 0], C - K @ H @ C
            square = np.einsum("si,sij,sj->s", e, np.linalg.inv(S), e)
            fit.append(-0.5 * square - 0.5 * np.linalg.slogdet(S)[1])
        likely = np.stack(fit, axis=1)
        mu = mu * np.exp(likely - likely.max(axis=1, keepdims=True))
        mu /= mu.sum(axis=1, keepdims=True)
        path.append(merged(mu)[0])
    return np.array(path)
