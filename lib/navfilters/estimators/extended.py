"""The extended Kalman filter through motion: predict, then the common update."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from navfilters.estimators.moments import linearized
from navfilters.estimators.update import kalman_update
from navfilters.numerics import validation
from navfilters.types import Array, Gaussian, MeasurementModel


class Dynamics(Protocol):
    """x_t = f(x_{t-1}) + w with w ~ N(0, Q).

    Dynamics that adds Q at each of several sub-steps has one more method, ``accumulate(Q, x)``: the
    noise (..., n, n) of the whole transition from x, given that of one sub-step.
    """

    @property
    def Q(self) -> Array:
        """Process noise covariance, (..., n, n): of a transition, or of one of its sub-steps."""

    def transition(self, x: Array) -> tuple[Array, Array]:
        """f(x), (..., n), and its Jacobian F = df/dx, (..., n, n)."""


def predict(estimate: Gaussian, dynamics: Dynamics) -> Gaussian:
    """The state one transition later.

    x_{t|t-1} = f(x),   P_{t|t-1} = F P F^T + Q

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n).
    dynamics : Dynamics

    Returns
    -------
    Gaussian

    References
    ----------
    xiong2009, Eqs. (3) and (4).
    """
    x, F = _moved(estimate, dynamics)
    return Gaussian(x, _spread(estimate, F, dynamics, _noise(estimate, dynamics)))


def _moved(estimate: Gaussian, dynamics: Dynamics) -> tuple[Array, Array]:
    """The transition, of arrays with the axes that it must have."""
    x, F = dynamics.transition(estimate.mean)
    n = estimate.mean.shape[-1]
    validation.core("f(x) of dynamics.transition", x, (n,))
    return x, validation.core("F of dynamics.transition", F, (n, n))


def _noise(estimate: Gaussian, dynamics: Dynamics) -> Array:
    """Q, if it is a matrix: a vector or a number would be added to every row."""
    Q = validation.given("dynamics.Q", dynamics.Q)
    return validation.core("dynamics.Q", Q, estimate.mean.shape[-1:] * 2)


def _spread(estimate: Gaussian, F: Array, dynamics: Dynamics, Q: Array) -> Array:
    """Eq. (4), its rounding made symmetric."""
    accumulate = getattr(dynamics, "accumulate", None)
    if accumulate is not None:
        Q = accumulate(Q, estimate.mean)
        validation.core("dynamics.accumulate", Q, estimate.mean.shape[-1:] * 2)
    P = F @ estimate.cov @ F.mT + Q
    return (P + P.mT) / 2


def _update(prior: Gaussian, z: Array, sensor: MeasurementModel) -> Gaussian:
    """Eqs. (6)-(9). Eq. (9) is P - K P_xz^T by the inversion lemma, and needs no inverse."""
    return kalman_update(prior, z, linearized(prior, sensor))


class KalmanState(NamedTuple):
    """What the EKF remembers.

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n), after the last update.
    """

    estimate: Gaussian


@dataclass(frozen=True)
class ExtendedKalman:
    """The extended Kalman filter, Sigma = P.

    References
    ----------
    xiong2009, section 5: Eqs. (3), (4), (6)-(9) with Sigma_{t|t-1} = P_{t|t-1}.
    """

    def init(self, prior: Gaussian) -> KalmanState:
        """The state before any measurement.

        Parameters
        ----------
        prior : Gaussian
            mean (..., n), cov (..., n, n).

        Returns
        -------
        KalmanState
        """
        return KalmanState(_given(prior))

    def step(
        self, state: KalmanState, z: Array, dynamics: Dynamics, sensor: MeasurementModel
    ) -> KalmanState:
        """One prediction and one update.

        Parameters
        ----------
        state : KalmanState
        z : array (..., m)
            The measurement.
        dynamics : Dynamics
        sensor : MeasurementModel

        Returns
        -------
        KalmanState
        """
        return KalmanState(_update(predict(state.estimate, dynamics), z, sensor))


def _given(prior: Gaussian) -> Gaussian:
    """A prior whose arrays are of a kind that products keep, and fit together."""
    mean, cov = (validation.given(f"prior.{name}", a) for name, a in prior._asdict().items())
    if mean.ndim == 0:
        raise ValueError(f"prior.mean must have shape (..., n); found {mean.shape}")
    return Gaussian(mean, validation.core("prior.cov", cov, mean.shape[-1:] * 2))


def _zeros(prior: Gaussian) -> Array:
    """A counter for every member of the prior."""
    xp = prior.mean.__array_namespace__()
    batch = np.broadcast_shapes(prior.mean.shape[:-1], prior.cov.shape[:-2])
    return xp.zeros(batch, dtype=xp.int64)
