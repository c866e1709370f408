"""The robust and the adaptive robust EKF: covariance rules in front of the same update."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from navfilters.estimators.extended import Dynamics, _given, _update, _zeros, predict
from navfilters.estimators.moments import linearized
from navfilters.numerics import validation
from navfilters.numerics.small_matrices import is_positive_definite, right_divide
from navfilters.types import Array, Gaussian, MeasurementModel


class RobustState(NamedTuple):
    """What the REKF remembers.

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n), after the last update.
    violations : int array (...)
        Steps so far at which gamma violated Eq. (23).
    """

    estimate: Gaussian
    violations: Array


@dataclass(frozen=True, eq=False)
class RobustEKF:
    """The robust (H-infinity) extended Kalman filter with L = I.

    Sigma = (P^-1 - gamma^-2 I)^-1,   if gamma > sqrt(max eig P)

    Parameters
    ----------
    gamma : float or array (...)
        Attenuation level, positive, in the state's units; as it grows the filter becomes the EKF,
        and at infinity it is the EKF.
    on_violation : {"skip", "nan", "raise"}
        What happens to a member whose gamma violates Eq. (23) at a step: Eq. (5) is not applied
        there (Sigma = P), the member ends, or the whole step is refused (on the host only).
        Violations are counted in the state.

    Raises
    ------
    ValueError
        A gamma that is not positive or an unknown on_violation; from ``step``, with "raise", when
        gamma violates Eq. (23), naming the smallest admissible gamma at that step.

    Notes
    -----
    Computed as P + P (gamma^2 I - P)^-1 P, which is the same matrix and keeps P's digits when gamma
    is large; Eq. (23) is tested by a Cholesky factor of gamma^2 I - P. The text finds gamma = 8000
    large enough for the whole of its run; that depends on the run. L = I adds a variance in square
    metres to one in square metres per square second: gamma is one number for both.

    References
    ----------
    xiong2009, Eqs. (3)-(9), (23).
    """

    gamma: Array = 8000.0
    on_violation: Literal["skip", "nan", "raise"] = "skip"

    def __post_init__(self) -> None:
        if not (validation.real_array("gamma", self.gamma, "", finite=False) > 0).all():
            raise ValueError(f"gamma must be positive; found {self.gamma}")
        if self.on_violation not in ("skip", "nan", "raise"):
            raise ValueError(
                f"on_violation must be 'skip', 'nan' or 'raise'; found {self.on_violation!r}"
            )

    def init(self, prior: Gaussian) -> RobustState:
        """The state before any measurement; as :meth:`ExtendedKalman.init`."""
        prior = _given(prior)
        return RobustState(prior, _zeros(prior))

    def step(
        self, state: RobustState, z: Array, dynamics: Dynamics, sensor: MeasurementModel
    ) -> RobustState:
        """One prediction, Eq. (5) where Eq. (23) allows it, and one update.

        As :meth:`ExtendedKalman.step`.
        """
        prior = predict(state.estimate, dynamics)
        Sigma, violated = self._enlarge(prior.cov)
        estimate = _update(Gaussian(prior.mean, Sigma), z, sensor)
        return RobustState(estimate, _count(state.violations, violated, estimate))

    def _enlarge(self, P: Array) -> tuple[Array, Array]:
        """Eq. (5), and where Eq. (23) forbids it."""
        xp = P.__array_namespace__()
        weight = xp.asarray(self.gamma, dtype=P.dtype)[..., None, None] ** -2
        rest = xp.eye(P.shape[-1]) - weight * P
        violated = _finite(rest) & ~is_positive_definite(rest)
        if self.on_violation == "raise" and xp.any(violated):
            largest = np.linalg.eigvalsh(np.asarray(P)[np.asarray(violated)])[..., -1]
            needed = np.sqrt(np.max(largest))
            raise ValueError(
                "gamma must exceed sqrt(max eig P_{t|t-1}), Eq. (23): the smallest admissible "
                f"gamma at this step is {needed:.6g}; found {np.min(self.gamma):.6g}"
            )
        forbidden = violated[..., None, None]
        added = right_divide(weight * P, xp.where(forbidden, xp.eye(P.shape[-1]), rest)) @ P
        otherwise = P if self.on_violation == "skip" else xp.nan
        return xp.where(forbidden, otherwise, P + (added + added.mT) / 2), violated


class AdaptiveRobustState(NamedTuple):
    """What the AREKF remembers.

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n), after the last update.
    P_y_bar : array (..., m, m) or None
        Estimated covariance of the innovations, Eq. (27); None before the first.
    robust : int array (...)
        Steps so far in the robust branch of Eq. (26).
    clipped : int array (...)
        How many of those had a lambda below 1, which was taken as 1.
    """

    estimate: Gaussian
    P_y_bar: Array | None
    robust: Array
    clipped: Array


def trace_ratio(P_y_bar: Array, P_y: Array) -> Array:
    """lambda = tr P_y_bar / tr P_y, the estimated spread of the innovations over the predicted one.

    Parameters
    ----------
    P_y_bar, P_y : array (..., m, m)

    Returns
    -------
    array (...)

    References
    ----------
    xiong2009, Eq. (47).
    """
    xp = P_y.__array_namespace__()
    return xp.linalg.trace(P_y_bar) / xp.linalg.trace(P_y)


@dataclass(frozen=True, eq=False)
class AdaptiveRobustEKF:
    """The extended Kalman filter that enlarges P only where its innovations are too large.

    Sigma = P   if P_y - alpha P_y_bar is positive definite, else lambda P,
    P_y = H P H^T + R,   P_y_bar <- (rho P_y_bar + y y^T) / (rho + 1)

    Parameters
    ----------
    alpha : float or array (...)
        Threshold, at least 0: the innovations may spread 1 / alpha times as far, in variance, as
        predicted. At 0 the filter is the EKF.
    rho : float or array (...)
        Forgetting factor of P_y_bar, at least 0.
    lam : callable or float or array (...)
        (P_y_bar, P_y) -> lambda (...), or a fixed lambda.

    Raises
    ------
    ValueError
        A negative or non-finite parameter.

    Notes
    -----
    With the L of Eq. (24), Eq. (5) is (P^-1 - P^-1 + P^-1 / lambda)^-1 = lambda P: gamma cancels.
    Below 1 the root in (24) is imaginary, so lambda is max(1, lam), counted. Eq. (8) defines P_y
    from the Sigma that (26) has yet to choose; P_{t|t-1} is meant. The text after (38) compares
    P_y_bar with P_y_bar / alpha, and remark 3 with alpha P_y; (26) itself says P_y / alpha. As (27)
    is printed the weights of the past and of the newest are nearly equal: "rho = 0.98" remembers
    about two innovations.

    References
    ----------
    xiong2009, Eqs. (24)-(27), (47).
    """

    alpha: Array = 0.2
    rho: Array = 0.98
    lam: Callable[[Array, Array], Array] | Array = trace_ratio

    def __post_init__(self) -> None:
        for name in ("alpha", "rho") if callable(self.lam) else ("alpha", "rho", "lam"):
            value = validation.real_array(name, getattr(self, name), "")
            if (value < 0).any():
                raise ValueError(f"{name} must be at least 0; found {value.min()}")

    def init(self, prior: Gaussian) -> AdaptiveRobustState:
        """The state before any measurement; as :meth:`ExtendedKalman.init`."""
        prior = _given(prior)
        return AdaptiveRobustState(prior, None, _zeros(prior), _zeros(prior))

    def step(
        self, state: AdaptiveRobustState, z: Array, dynamics: Dynamics, sensor: MeasurementModel
    ) -> AdaptiveRobustState:
        """One prediction, Eq. (26), and one update; as :meth:`ExtendedKalman.step`."""
        prior = predict(state.estimate, dynamics)
        z_hat, P_y, _ = linearized(prior, sensor)
        xp = P_y.__array_namespace__()
        z = validation.given("z", z)
        y = z - validation.core("sensor.h", z_hat, z.shape[-1:])
        P_y_bar = y[..., :, None] * y[..., None, :]
        if state.P_y_bar is not None:
            rho = xp.asarray(self.rho)[..., None, None]
            P_y_bar = (rho * state.P_y_bar + P_y_bar) / (rho + 1)
        excess = P_y - xp.asarray(self.alpha)[..., None, None] * P_y_bar
        robust = _finite(excess) & ~is_positive_definite(excess)
        lam = self.lam(P_y_bar, P_y) if callable(self.lam) else xp.asarray(self.lam)
        clipped = robust & (lam < 1)
        scale = xp.where(robust & (lam > 1), lam, 1.0)[..., None, None]
        estimate = _update(Gaussian(prior.mean, scale * prior.cov), z, sensor)
        robust = _count(state.robust, robust, estimate)
        clipped = _count(state.clipped, clipped, estimate)
        return AdaptiveRobustState(estimate, P_y_bar, robust, clipped)


def _count(counter: Array, event: Array, estimate: Gaussian) -> Array:
    """One more where the event happened, for every member of the estimate."""
    xp = estimate.mean.__array_namespace__()
    return xp.broadcast_to(counter + event, estimate.mean.shape[:-1])


def _finite(A: Array) -> Array:
    """Members without a NaN or an infinity."""
    xp = A.__array_namespace__()
    return xp.all(xp.isfinite(A), axis=(-2, -1))
