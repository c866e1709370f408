"""Ten filters that are one update: moments, perhaps a variant, and Eqs. (5)-(7)."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from navfilters.estimators.moments import linearized, noise, second_order, unscented
from navfilters.estimators.update import kalman_update
from navfilters.estimators.variants import (
    Variant,
    bump_circular,
    bump_equivalent,
    bump_linear,
    bump_predicted,
    bump_state,
    expect_at_mean,
    unchanged,
)
from navfilters.numerics import validation
from navfilters.types import Array, Gaussian, MeasurementModel, Moments


def _given(prior: Gaussian) -> Gaussian:
    mean, cov = prior.mean, prior.cov
    return Gaussian(validation.given("prior.mean", mean), validation.given("prior.cov", cov))


# What each filter is on a linear model, in the textbook's terms: its P and R given (P, H, R).


def _kalman(P, H, R):
    return P, R


def _kalman_bumped(P, H, R, bump=1.0):
    return P, R + np.asarray(bump)[..., None, None] * (H @ P @ H.mT)


def _kalman_circular(P, H, R):
    return P, R + np.linalg.norm(P, 2, axis=(-2, -1), keepdims=True) * (H @ H.mT)


def _kalman_equivalent(P, H, R):
    J = np.linalg.inv(H)
    return P, np.linalg.norm(J @ R @ J.mT, 2, axis=(-2, -1), keepdims=True) * (H @ H.mT)


def _kalman_forgetful(P, H, R):
    return np.linalg.norm(P, 2, axis=(-2, -1), keepdims=True) * np.eye(P.shape[-1]), R


@dataclass(frozen=True)
class Filter:
    """One memoryless filter: how it predicts, what it changes, and what it is on a linear model.

    Parameters
    ----------
    moments : callable
        (prior, model, \\*, options) -> Moments.
    variant : callable
        (prior, model, moments, \\*, options) -> (prior, Moments).
    limit : callable
        (P, H, R, options) -> (P, R) of the Kalman filter that this filter equals when h(x) = H x.
    """

    moments: Callable[..., Moments]
    variant: Variant = unchanged
    limit: Callable[..., tuple[Array, Array]] = _kalman

    def __call__(self, prior: Gaussian, z: Array, model: MeasurementModel, **options) -> Gaussian:
        """One update of every member.

        Parameters
        ----------
        prior : Gaussian
            mean (..., n), cov (..., n, n).
        z : array (..., m)
            The measurement.
        model : MeasurementModel
            Where it comes from.
        **options
            Those of the moments function and of the variant; see ``options``.

        Returns
        -------
        Gaussian
            The updated state. Of arrays only their kind and their trailing axes are checked here;
            ``run`` checks their values and the model.

        Raises
        ------
        ValueError
            Masked entries, units, no numbers, trailing axes that do not fit together.
        TypeError
            An option that this filter does not have.
        """
        unknown = set(options) - set(self.options)
        if unknown:
            has = ", ".join(self.options) or "none"
            raise TypeError(f"unknown options {sorted(unknown)}; this filter has {has}")
        mean, cov = prior.mean, prior.cov
        plain = type(mean) is type(cov) is np.ndarray and mean.dtype.char == cov.dtype.char == "d"
        if not plain:
            prior = _given(prior)
        moments = self.moments(prior, model, **_accepted(self.moments, options))
        changed, moments = self.variant(prior, model, moments, **_accepted(self.variant, options))
        return kalman_update(changed, z, moments)

    @property
    def options(self) -> tuple[str, ...]:
        """Names of the keywords that this filter takes."""
        return (*_keywords(self.moments), *_keywords(self.variant))

    def linear_limit(
        self, prior: Gaussian, z: Array, model: MeasurementModel, **options
    ) -> Gaussian:
        """What this filter must return on a linear model, by the textbook's Kalman filter.

        Parameters
        ----------
        prior, z, model
            As in a call, with h(x) = H x.
        **options
            As in a call; those of the sigma points change nothing here.

        Returns
        -------
        Gaussian
            Computed in the information form, (P^-1 + H^T R^-1 H)^-1, by LAPACK: no line of the
            filters takes part.
        """
        z, R = validation.given("z", z), noise(model)
        prior = _given(prior)
        H = model.jacobian(prior.mean)
        P, R = self.limit(prior.cov, H, R, **_accepted(self.limit, options))
        weight = H.mT @ np.linalg.inv(R)
        cov = np.linalg.inv(np.linalg.inv(P) + weight @ H)
        residual = z - (H @ prior.mean[..., None])[..., 0]
        return Gaussian(prior.mean + (cov @ weight @ residual[..., None])[..., 0], cov)


@lru_cache  # a signature costs as much as half an update of one member
def _keywords(function: Callable) -> tuple[str, ...]:
    parameters = inspect.signature(function).parameters.values()
    return tuple(p.name for p in parameters if p.default is not p.empty)


def _accepted(function: Callable, options: dict) -> dict:
    return {name: value for name, value in options.items() if name in _keywords(function)}


FILTERS: dict[str, Filter] = {
    "EKF": Filter(linearized),
    "B-EKF 1": Filter(linearized, bump_linear, limit=_kalman_bumped),
    "B-EKF 2": Filter(linearized, bump_circular, limit=_kalman_circular),
    "B-EKF 3": Filter(linearized, bump_equivalent, limit=_kalman_equivalent),
    "B-EKF 4": Filter(linearized, bump_state, limit=_kalman_forgetful),
    "mtSOF": Filter(second_order),
    "B-mtSOF": Filter(second_order, bump_linear, limit=_kalman_bumped),
    "UKF": Filter(unscented),
    "B-UKF": Filter(unscented, bump_predicted, limit=_kalman_bumped),
    "UKFz": Filter(unscented, expect_at_mean),
}
"""The ten filters of perea2007, in the paper's order, by the paper's names."""
