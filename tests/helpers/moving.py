"""A moving state for the filters with a memory, six configurations of it."""

from dataclasses import dataclass

import numpy as np
from naive import covariances, quadratic

from navfilters import Filter, Gaussian
from navfilters.estimators.adaptive import AdaptiveNoise
from navfilters.estimators.robust import AdaptiveRobust, Robust


@dataclass(frozen=True, eq=False)
class Swing:
    """f(x) = G x + sin(x) / 5."""

    G: np.ndarray
    Q: np.ndarray

    def transition(self, x):
        xp = x.__array_namespace__()
        F = self.G + xp.cos(x)[..., None] * xp.eye(x.shape[-1]) / 5
        return (self.G @ x[..., None])[..., 0] + xp.sin(x) / 5, F


WITH_MEMORY = {
    "EKF": Filter(),
    "REKF": Filter(rule=Robust(np.linspace(2.0, 9.0, 6))),
    "AEKF": Filter(rule=AdaptiveNoise(np.linspace(0.1, 0.5, 6), N=4, directions=np.eye(3)[:, :2])),
    "AREKF": Filter(rule=AdaptiveRobust(np.linspace(0.1, 0.9, 6))),
}


def moving(steps=9, count=6):
    rng = np.random.default_rng(5)
    sensor = quadratic(rng, 2, 3)
    sensor = type(sensor)(sensor.H, 0.02 * sensor.A, sensor.R)
    dynamics = Swing(0.9 * np.linalg.qr(rng.normal(size=(3, 3)))[0], 0.2 * covariances(rng, (), 3))
    z = np.cumsum(rng.normal(size=(steps, count, 2)), axis=0)
    prior = Gaussian(rng.normal(size=(count, 3)), covariances(rng, (count,), 3))
    return prior, z, sensor, dynamics, steps
