"""Other answers to an unknown thrust, flown as the paper's filters are."""

from typing import Any, NamedTuple

import numpy as np

from navfilters.estimators.filter import Filter
from navfilters.papers.xiong2009.experiment import ESTIMATORS, Setup
from navfilters.papers.xiong2009.monte_carlo import measurements
from navfilters.papers.xiong2009.true_flight import truth
from navfilters.runs.consistency import nees, nis
from navfilters.runs.sweeping import sweep
from navfilters.space.manoeuvring_orbit import SIZES, ManoeuvringOrbit, manoeuvring
from navfilters.types import Array, Gaussian

EKF = Filter(form="short")


class Flight(NamedTuple):
    """What is asked of flights: at the first estimate and after each update.

    Parameters
    ----------
    error : array (updates + 1, ..., 6)
        Truth minus estimate, m and m/s.
    nees : array (updates + 1, ...)
        Of these six components.
    nis : array (updates, ...)
    """

    error: Array
    nees: Array
    nis: Array

    @property
    def distance(self) -> Array:
        """Position error, m, (updates + 1, ...)."""
        return np.linalg.norm(self.error[..., :3], axis=-1)


def prior(setup: Setup, thrust: str = "none", p_a: float = 0.4528) -> Gaussian:
    """The paper's first estimate, and of the thrust only how large it may be.

    Parameters
    ----------
    setup : Setup
    thrust : {"none", "strength", "vector"}
    p_a : float
        Deviation of the thrust's components about zero, m/s^2; by default the true strength.

    Returns
    -------
    Gaussian
    """
    first, more = setup.prior, SIZES[thrust] - 6
    cov = np.pad(first.cov, (0, more))
    cov[6:, 6:] = p_a**2 * np.eye(more)
    return Gaussian(np.pad(first.mean, (0, more)), cov)


def fly_rival(
    setup: Setup,
    z: Array,
    estimator: Any = EKF,
    dynamics: ManoeuvringOrbit | None = None,
    *,
    p_a: float = 0.4528,
    workers: int | None = None,
) -> Flight:
    """A filter through the flight, with any dynamics.

    Parameters
    ----------
    setup : Setup
    z : array (updates, ..., 2)
        The angles, such as ``measurements`` of the set-up.
    estimator : Filter
    dynamics : ManoeuvringOrbit, optional
        By default the paper's, which coasts.
    p_a : float
        As of :func:`prior`.
    workers : int, optional
        As of ``sweep``.

    Returns
    -------
    Flight
    """
    dynamics = manoeuvring(setup.orbit()) if dynamics is None else dynamics
    start = prior(setup, dynamics.thrust, p_a)
    kept = sweep(
        estimator, start, z, setup.sensor, dynamics=dynamics, z_per_step=True,
        record=_kept, workers=workers, progress=False,
    ).record
    mean, cov, y, S = kept
    true = truth(setup).states[:: setup.interval]
    error = true.reshape(len(true), *(1,) * (mean.ndim - 2), 6) - mean
    with np.errstate(all="ignore"):
        return Flight(error, nees(error, cov), nis(y[1:], S[1:]))


def _kept(state: Any) -> tuple:
    mean, cov = state.estimate
    return mean[..., :6], cov[..., :6, :6], state.innovation, state.S
