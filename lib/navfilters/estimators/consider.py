"""States that a filter considers and does not estimate, after Schmidt."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from navfilters.estimators import model_parts
from navfilters.estimators.correction import recursive
from navfilters.estimators.filter import Filter
from navfilters.estimators.rule import sensed
from navfilters.estimators.variants import Variant
from navfilters.numerics import validation
from navfilters.types import Array, Gaussian, MeasurementModel, Moments


@dataclass(frozen=True)
class Consider:
    """A variant without gain in some of the states; see :func:`considering`."""

    states: frozenset[int]
    variant: Variant

    def at(self, k: Array) -> Any:
        """The variant of update k, from 0."""
        return replace(self, variant=model_parts.at(self.variant, k))

    def __call__(
        self, prior: Gaussian, model: MeasurementModel, moments: Moments
    ) -> tuple[Gaussian, Moments]:
        """The moments with rows of zeros in P_xz."""
        prior, moments = self.variant(prior, model, moments)
        xp, n = moments.P_xz.__array_namespace__(), moments.P_xz.shape[-2]
        if max(self.states) >= n:
            raise ValueError(f"states must be below {n}, their number; found {max(self.states)}")
        H, R = sensed(prior, moments)
        rows = np.isin(np.arange(n), list(self.states))[:, None]
        return prior, moments._replace(P_xz=xp.where(rows, 0.0, moments.P_xz), H=H, R=R)

    def limit(self, prior: Gaussian, updated: Gaussian) -> Gaussian:
        """A Kalman filter's update, in which the considered states are as they were."""
        own = np.isin(np.arange(prior.cov.shape[-1]), list(self.states))
        mean = np.where(own, prior.mean, updated.mean)
        return Gaussian(mean, np.where(own[:, None] & own, prior.cov, updated.cov))


def considering(estimator: Filter, states: Sequence[int]) -> Filter:
    """The same filter, which leaves some states as they are and weighs their uncertainty.

    K of those rows is 0, and P+ = (I - K H) P (I - K H)^T + K R K^T, which holds for any K.

    Parameters
    ----------
    estimator : Filter
        With Joseph's update.
    states : sequence of int
        Numbers of the considered states, from 0: their means and variances change with the dynamics
        alone.

    Returns
    -------
    Filter
        Of sigma points with H = P_xz^T P^-1, so that P must be definite.

    Raises
    ------
    TypeError
        An estimator that is no Filter.
    ValueError
        The short form, whose covariance holds for the optimal gain alone; recursive updates, which
        make gains of their own; no states, or what is no number of one; from an update, a number
        that the state does not have.

    References
    ----------
    schmidt1966.
    """
    if not isinstance(estimator, Filter):
        raise TypeError(f"estimator must be a Filter; found {type(estimator).__name__}")
    if estimator.form != "joseph":
        raise ValueError(f"estimator must have form 'joseph'; found {estimator.form!r}")
    if getattr(estimator.correction, "func", estimator.correction) is recursive:
        raise ValueError("estimator must take its gain from P_xz; recursive updates do not")
    numbers = frozenset(validation.whole_number("states", i, 0) for i in states)
    if not numbers:
        raise ValueError("states must be at least one number; found none")
    return replace(estimator, variant=Consider(numbers, estimator.variant))
