"""Robust filters on a plane that turns and grows, with a Jacobian that is off by a known factor."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from navfilters.models.linear import Linear
from navfilters.papers.xiong2009.attenuation import real_covariance
from navfilters.papers.xiong2009.error_bounds import Assumptions, assumptions, theorem_bound
from navfilters.runs.loop import run
from navfilters.types import Array, Gaussian

STEPS = 60

TURN = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
"""A plane that turns by 0.3 radians."""

WILD = 1.3 * TURN, np.diag([4.0, 4.0])
"""G and beta: unstable, with a Jacobian a quarter of the true one."""

MILD = TURN, np.diag([1.2, 1.1])
"""G and beta: marginally stable, with a Jacobian 9 and 17 percent too small."""


@dataclass(frozen=True, eq=False)
class Mismatched:
    """f(x) = G x, with a Jacobian that is off by beta: Eq. (15) holds exactly.

    Parameters
    ----------
    G, beta, Q : array (n, n)

    References
    ----------
    xiong2009, Eq. (15).
    """

    G: Array
    beta: Array
    Q: Array

    @property
    def F(self) -> Array:
        """The Jacobian that a filter is told, (n, n)."""
        return np.linalg.inv(self.beta) @ self.G

    def transition(self, x: Array) -> tuple[Array, Array]:
        """G x and F, of a state (..., n)."""
        return x @ self.G.T, self.F + 0 * x[..., None]


@dataclass(frozen=True, eq=False)
class Simulation:
    """What a filter did on such a system.

    Parameters
    ----------
    dynamics : Mismatched
    sensor : Linear
    error : array (steps + 1,)
        Mean-square error over the members.
    covs : array (steps + 1, members, n, n)
        What the filter computed.
    """

    dynamics: Mismatched
    sensor: Linear
    error: Array
    covs: Array

    @property
    def cov(self) -> Array:
        """That of the first member, (steps + 1, n, n): of all, where no filter switches."""
        return self.covs[:, 0]

    @property
    def P(self) -> Array:
        """The first member's predicted covariance at each step, (steps, n, n)."""
        F = self.dynamics.F
        return F @ self.cov[:-1] @ F.T + self.dynamics.Q

    @property
    def Sigma_bar(self) -> Array:
        """The real one of Eq. (16), (steps, n, n)."""
        motion = self.dynamics
        return real_covariance(motion.F, motion.beta, self.cov[:-1], motion.Q)

    @property
    def assumptions(self) -> Assumptions:
        """The constants of Theorem 1 for the run."""
        motion, sensor = self.dynamics, self.sensor
        return assumptions(motion.F, motion.beta, sensor.H, self.cov, sensor.R, motion.Q)

    def bound(self, *, as_printed: bool = False) -> Array:
        """Theorem 1's bound of the mean-square error, (steps + 1,)."""
        times = np.arange(len(self.error))
        return theorem_bound(self.assumptions, self.error[0], times, as_printed=as_printed)


def simulate(
    system: tuple[Array, Array], estimator: Any, *, unit: float = 1.0, members: int = 2000
) -> Simulation:
    """A filter on 60 steps of a system, the same noise for every filter.

    Parameters
    ----------
    system : tuple of array (2, 2), array (2, 2)
        G and beta.
    estimator : Filter
    unit : float
        The size of the state's unit of length: the same run in another one.
    members : int

    Returns
    -------
    Simulation
        With Q = 0.2 I in squares of the unit, R = diag(1, 0.5) and an H of rank 2.
    """
    rng = np.random.default_rng(7)
    G, beta = system
    Q, R = 0.2 * unit**2 * np.eye(2), np.diag([1.0, 0.5])
    sensor = Linear(np.array([[1.0, 0.2], [0.0, 0.8]]) / unit, R)
    prior = Gaussian(unit * rng.normal(size=(members, 2)), unit**2 * np.eye(2))
    x, z = [np.zeros((members, 2))], []
    for _ in range(STEPS):
        x.append(x[-1] @ G.T + rng.normal(size=(members, 2)) @ np.sqrt(Q))
        z.append(sensor.h(x[-1]) + rng.normal(size=(members, 2)) @ np.sqrt(R))
    dynamics = Mismatched(G, beta, Q)
    history = run(estimator, prior, np.array(z), sensor, dynamics=dynamics, z_per_step=True)
    error = np.mean(np.sum((np.array(x) - history.mean) ** 2, axis=-1), axis=-1)
    return Simulation(dynamics, sensor, error, history.cov)
