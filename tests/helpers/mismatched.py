"""Robust filters on a plane that turns and grows, with a Jacobian that is off by a known beta."""

from dataclasses import dataclass

import numpy as np
from ruled import Matched, inv

from navfilters import Filter, Gaussian
from navfilters.estimators.robust import AdaptiveRobust, Robust
from navfilters.models import Linear
from navfilters.papers import xiong2009

TURN = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
Q = 0.2 * np.eye(2)
TIMES = np.arange(61)


@dataclass(frozen=True, eq=False)
class Run:
    """A run of the REKF on a system that meets Eq. (15) with a known beta; rank H = n = 2."""

    a: xiong2009.Assumptions
    rate: np.ndarray  # by which V contracts, at every step
    error: np.ndarray  # mean square, at every time
    P: np.ndarray  # predicted
    Sigma: np.ndarray
    Sigma_bar: np.ndarray
    lam: np.ndarray  # the smallest that (A.11) takes, whatever the error's direction

    @property
    def condition_19(self):
        return np.linalg.eigvalsh(self.Sigma - self.Sigma_bar)[:, 0] > 0

    def bound(self, **options):
        return xiong2009.theorem_bound(self.a, self.error[0], TIMES, **options)


def theory(growth, beta, gamma=np.inf, lam=None, unit=1.0, members=2000):
    """unit is the size of the state's unit: the same run, in metres or in centimetres.

    With lam, the AREKF whose P_y_bar never lets it be an EKF.
    """
    rng = np.random.default_rng(7)
    G, beta, P0 = growth * TURN, np.diag(beta), unit**2 * np.eye(2)
    R, H, w = np.diag([1.0, 0.5]), np.array([[1.0, 0.2], [0, 0.8]]) / unit, unit**2 * Q
    dynamics, sensor = Matched(G, beta, w), Linear(H, R)
    estimator = Filter(rule=Robust(gamma * unit, on_violation="raise"))
    if lam is not None:
        estimator = Filter(rule=AdaptiveRobust(alpha=1e9, lam=lam))
    x = np.zeros((members, 2))
    state = estimator.init(Gaussian(unit * rng.normal(size=(members, 2)), P0))
    error, cov = [x - state.estimate.mean], [P0]
    for _ in TIMES[1:]:
        x = x @ G.T + rng.normal(size=x.shape) @ np.sqrt(w)
        z = sensor.h(x) + rng.normal(size=x.shape) @ np.sqrt(R)
        state = estimator.step(state, z, sensor, dynamics)
        error.append(x - state.estimate.mean)
        cov.append(state.estimate.cov if state.estimate.cov.ndim == 2 else state.estimate.cov[0])
    F, cov = inv(beta) @ G, np.array(cov)
    P = F @ cov[:-1] @ F.T + w
    Sigma = inv(inv(P) - np.eye(2) / (gamma * unit) ** 2) if lam is None else lam * P
    a = xiong2009.assumptions(F, beta, H, cov, R, w)
    K = Sigma @ H.T @ inv(H @ Sigma @ H.T + R)
    rate = xiong2009.contraction((np.eye(2) - K @ H) @ G, cov[:-1], cov[1:])
    seen = np.linalg.cholesky(cov[:-1]).mT @ G.T @ H.T
    least = np.linalg.eigvalsh(seen @ inv(H @ Sigma @ H.T + R) @ seen.mT)[:, 0]
    mean_square = np.mean(np.sum(np.square(error), axis=-1), axis=-1)
    return Run(
        a, rate, mean_square, P, Sigma, xiong2009.real_covariance(F, beta, cov[:-1], w), least
    )


MILD = (1.0, (1.2, 1.1))  # the Jacobian is 10 to 20 % too small, the system marginally stable
WILD = (1.3, (4.0, 4.0))  # it is a quarter of the truth, and the system unstable
