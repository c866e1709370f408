"""The robust and the adaptive robust EKF of Xiong et al. as rules on the predicted covariance."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from navfilters.estimators.rule import Rule, finite, innovation_spread, zeros
from navfilters.numerics import validation
from navfilters.numerics.small_matrices import is_positive_definite, right_divide
from navfilters.types import Array, Gaussian, Moments


class RobustMemory(NamedTuple):
    """What the robust rule remembers.

    Parameters
    ----------
    violations : int array (...)
        Steps so far at which gamma violated Eq. (23).
    """

    violations: Array


@dataclass(frozen=True, eq=False)
class Robust(Rule):
    """The H-infinity rule with L = I: every step's covariance is enlarged.

    Sigma = (P^-1 - gamma^-2 I)^-1,   if gamma > sqrt(max eig P)

    Parameters
    ----------
    gamma : float or array (...)
        Attenuation level, positive, in the state's units; as it grows the filter becomes the EKF,
        and at infinity it is the EKF.
    on_violation : {"skip", "nan", "raise"}
        What happens to a member whose gamma violates Eq. (23) at a step: Eq. (5) is not applied
        there (Sigma = P), the member ends, or the whole step is refused (on the host only).
        Violations are counted in the memory.

    Raises
    ------
    ValueError
        A gamma that is not positive or an unknown on_violation; from a step, with "raise", when
        gamma violates Eq. (23), naming the smallest admissible gamma at that step.

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

    def init(self, prior: Gaussian) -> RobustMemory:
        """No violations."""
        return RobustMemory(zeros(prior))

    def enlarge(
        self, memory: RobustMemory, prior: Gaussian, y: Array | None, moments: Moments | None
    ) -> tuple[Gaussian, RobustMemory]:
        """Eq. (5) where Eq. (23) allows it."""
        Sigma, violated = self._enlarge(prior.cov)
        return Gaussian(prior.mean, Sigma), RobustMemory(memory.violations + violated)

    def limit(self, P: Array) -> Array:
        """(P^-1 - gamma^-2 I)^-1 where gamma allows it, by an inverse."""
        weight = np.asarray(self.gamma, float)[..., None, None] ** -2
        allowed = np.linalg.eigvalsh(np.eye(P.shape[-1]) - weight * P)[..., :1, None] > 0
        Sigma = np.linalg.inv(np.linalg.inv(P) - weight * np.eye(P.shape[-1]))
        return np.where(allowed, Sigma, P if self.on_violation == "skip" else np.nan)

    def _enlarge(self, P: Array) -> tuple[Array, Array]:
        """Eq. (5), and where Eq. (23) forbids it."""
        xp = P.__array_namespace__()
        weight = xp.asarray(self.gamma, dtype=P.dtype)[..., None, None] ** -2
        rest = xp.eye(P.shape[-1]) - weight * P
        violated = finite(rest) & ~is_positive_definite(rest)
        if self.on_violation == "raise" and xp.any(violated):
            largest = np.linalg.eigvalsh(np.asarray(P)[np.asarray(violated)])[..., -1]
            needed = np.sqrt(np.max(largest))
            raise ValueError(
                "gamma must exceed sqrt(max eig P_{t|t-1}), Eq. (23): the smallest admissible "
                f"gamma at this step is {needed:.6g}; found {np.min(self.gamma):.6g}"
            )
        forbidden = violated[..., None, None]
        # The same matrix, and it keeps P's digits when gamma is large
        added = right_divide(weight * P, xp.where(forbidden, xp.eye(P.shape[-1]), rest)) @ P
        otherwise = P if self.on_violation == "skip" else xp.nan
        return xp.where(forbidden, otherwise, P + (added + added.mT) / 2), violated


class AdaptiveRobustMemory(NamedTuple):
    """What the adaptive robust rule remembers.

    Parameters
    ----------
    P_y_bar : array (..., m, m), optional
        Estimated covariance of the innovations, Eq. (27); None, or NaN, before the first.
    robust : int array (...)
        Steps so far in the robust branch of Eq. (26).
    clipped : int array (...)
        How many of those had a lambda below 1, which was taken as 1.
    """

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
class AdaptiveRobust(Rule):
    """The rule that enlarges P only where the innovations are too large.

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
        (P_y_bar, P_y) -> lambda (...), or a fixed lambda; below 1 it is taken as 1, and counted.

    Raises
    ------
    ValueError
        A negative or non-finite parameter.

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

    looks = True

    def init(self, prior: Gaussian) -> AdaptiveRobustMemory:
        """No innovation yet."""
        return AdaptiveRobustMemory(None, zeros(prior), zeros(prior))

    def enlarge(
        self,
        memory: AdaptiveRobustMemory,
        prior: Gaussian,
        y: Array | None,
        moments: Moments | None,
    ) -> tuple[Gaussian, AdaptiveRobustMemory]:
        """Eq. (26)."""
        assert y is not None
        assert moments is not None
        P_y = moments.P_zz
        xp = P_y.__array_namespace__()
        P_y_bar = innovation_spread(memory.P_y_bar, y, self.rho)
        excess = P_y - xp.asarray(self.alpha)[..., None, None] * P_y_bar
        robust = finite(excess) & ~is_positive_definite(excess)
        lam = self.lam(P_y_bar, P_y) if callable(self.lam) else xp.asarray(self.lam)
        clipped = robust & (lam < 1)
        scale = xp.where(robust & (lam > 1), lam, 1.0)[..., None, None]
        counted = (memory.robust + robust, memory.clipped + clipped)
        return Gaussian(prior.mean, scale * prior.cov), AdaptiveRobustMemory(P_y_bar, *counted)
