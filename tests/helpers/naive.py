"""The same mathematics one member at a time, written plainly in NumPy: what the tests compare with.

Nothing here is batched and nothing calls the library; a model only answers h, jacobian and hessian
at one state.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg


def covariances(rng, shape, n):
    """Random symmetric positive definite matrices (*shape, n, n) of condition below 100 or so."""
    V, _ = np.linalg.qr(rng.normal(size=(*shape, n, n)))
    A = (V * rng.uniform(0.2, 4.0, (*shape, 1, n))) @ V.mT
    return (A + A.mT) / 2


@dataclass(frozen=True, eq=False)
class Quadratic:
    """h_i(x) = H_i x + x^T A_i x / 2 with symmetric A_i (m, n, n): any size, moments known."""

    H: np.ndarray
    A: np.ndarray
    R: np.ndarray

    def h(self, x):
        return (self.jacobian(x / 2) @ x[..., None])[..., 0]

    def jacobian(self, x):
        return self.H + (self.A @ x[..., None, :, None])[..., 0]

    def hessian(self, x):
        return self.A + 0 * x[..., None, None, :1]


def quadratic(rng, m, n):
    """A random quadratic model."""
    A = rng.normal(size=(m, n, n))
    return Quadratic(rng.normal(size=(m, n)), A + A.mT, covariances(rng, (), m))


def kalman(x, P, z, H, R):
    """The Kalman filter's update, covariance form, from a textbook."""
    S = H @ P @ H.T + R
    K = np.linalg.solve(S, H @ P).T
    A = np.eye(len(x)) - K @ H
    return x + K @ (z - H @ x), A @ P @ A.T + K @ R @ K.T


def linearized(x, P, model):
    """Eqs. (10)-(12)."""
    H = model.jacobian(x)
    return model.h(x), H @ P @ H.T + model.R, P @ H.T


def bias(x, P, model):
    """b_i = tr(h_i'' P) / 2, below Eq. (20)."""
    return np.array([np.trace(hessian @ P) / 2 for hessian in model.hessian(x)])


def second_order(x, P, model):
    """Eqs. (18)-(20)."""
    z_hat, P_zz, P_xz = linearized(x, P, model)
    b = bias(x, P, model)
    return z_hat + b, P_zz - np.outer(b, b), P_xz


def unscented(x, P, model, alpha=1.0, beta=2.0, kappa=None, root="cholesky"):
    """Eqs. (21)-(25), with the scaled weights as in the textbooks, in terms of lambda."""
    n = len(x)
    lam = alpha**2 * (n + (3 - n if kappa is None else kappa)) - n
    S = np.linalg.cholesky(P) if root == "cholesky" else np.real(scipy.linalg.sqrtm(P))
    W_m = np.full(2 * n + 1, 1 / (2 * (n + lam)))
    W_c = W_m.copy()
    W_m[0] = lam / (n + lam)
    W_c[0] = lam / (n + lam) + 1 - alpha**2 + beta
    X = [x]
    for sign in (1, -1):
        for j in range(n):
            X.append(x + sign * np.sqrt(n + lam) * S[:, j])
    Z = [model.h(point) for point in X]
    z_hat = sum(w * z for w, z in zip(W_m, Z, strict=True))
    P_zz = model.R + sum(w * np.outer(z - z_hat, z - z_hat) for w, z in zip(W_c, Z, strict=True))
    pairs = zip(W_c, X, Z, strict=True)
    return z_hat, P_zz, sum(w * np.outer(p - x, z - z_hat) for w, p, z in pairs)


def update(x, P, z, z_hat, P_zz, P_xz):
    """Eqs. (5)-(7)."""
    K = P_xz @ np.linalg.inv(P_zz)
    return x + K @ (z - z_hat), P - K @ P_xz.T


def each(function, x, P, *others):
    """function(x, P, *others) for every member of x (..., n) and P (..., n, n), stacked."""
    batch = x.shape[:-1]
    results = [function(x[i], P[i], *others) for i in np.ndindex(batch)]
    return tuple(
        np.stack(part).reshape(*batch, *np.shape(part[0])) for part in zip(*results, strict=True)
    )
