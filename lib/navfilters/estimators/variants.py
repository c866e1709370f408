"""What a filter changes between its moments and the update."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from navfilters.estimators.model_parts import jacobian, noise
from navfilters.numerics import validation
from navfilters.numerics.small_matrices import matmul, right_divide, spectral_norm
from navfilters.types import Array, Gaussian, MeasurementModel, Moments

Variant = Callable[..., tuple[Gaussian, Moments]]


def unchanged(
    prior: Gaussian, model: MeasurementModel, moments: Moments
) -> tuple[Gaussian, Moments]:
    """The variant that changes nothing.

    Parameters
    ----------
    prior : Gaussian
    model : MeasurementModel
    moments : Moments

    Returns
    -------
    tuple of Gaussian, Moments
    """
    return prior, moments


def bump_linear(
    prior: Gaussian, model: MeasurementModel, moments: Moments, *, bump: Array = 1.0
) -> tuple[Gaussian, Moments]:
    """R_new = R + bump * H P H^T: the noise grows by the linearised spread of the measurement.

    Parameters
    ----------
    prior : Gaussian
    model : MeasurementModel
        Gives jacobian (..., m, n).
    moments : Moments
        With P_xz = P H^T, as :func:`~navfilters.estimators.moments.linearized` and
        :func:`~navfilters.estimators.moments.second_order` give it.
    bump : float or array (...)
        The paper's alpha in Eq. (14), at least 0; 1 gives Eq. (13).

    Returns
    -------
    tuple of Gaussian, Moments

    Raises
    ------
    ValueError
        A negative or NaN bump.

    References
    ----------
    perea2007, Eqs. (13), (14) and, for the second-order filter, section V.A.
    """
    H = jacobian(model, prior.mean) if moments.H is None else moments.H
    spread = matmul(H, moments.P_xz)
    return prior, _add_noise(moments, _per_member(spread, bump) * spread)


@dataclass(frozen=True, eq=False)
class Underweighting:
    """Lear's underweighting: :func:`bump_linear` in the first updates, nothing afterwards.

    Parameters
    ----------
    bump : float or array (...)
        The text's beta-bar, at least 0.
    updates : int
        How many.

    References
    ----------
    pogorelsky2020, Eqs. (31)-(39), by the index rule. Eq. (39) prints beta for beta-bar.
    """

    bump: Array = 0.2
    updates: int = 10

    def __post_init__(self) -> None:
        validation.whole_number("updates", self.updates, 0)
        if not (validation.real_array("bump", self.bump, "") >= 0).all():
            raise ValueError(f"bump must be at least 0; found {np.min(self.bump)}")

    def at(self, k: Array) -> Variant:
        """The variant of update k, from 0."""
        if validation.traced(k):
            xp = k.__array_namespace__()
            return partial(bump_linear, bump=xp.where(k < self.updates, self.bump, 0.0))
        return partial(bump_linear, bump=self.bump) if k < self.updates else unchanged

    def __call__(
        self, prior: Gaussian, model: MeasurementModel, moments: Moments
    ) -> tuple[Gaussian, Moments]:
        """The first update's, for a single one."""
        return self.at(0)(prior, model, moments)


def bump_predicted(
    prior: Gaussian, model: MeasurementModel, moments: Moments, *, bump: Array = 1.0
) -> tuple[Gaussian, Moments]:
    """R_new = R + bump * (P_zz - R): the noise grows by the spread of the filter's own prediction.

    Parameters
    ----------
    prior : Gaussian
    model : MeasurementModel
        Gives R (..., m, m).
    moments : Moments
    bump : float or array (...)
        At least 0; 1 is the paper's.

    Returns
    -------
    tuple of Gaussian, Moments

    Raises
    ------
    ValueError
        A negative or NaN bump.

    References
    ----------
    perea2007, section VI.A.1 (B-UKF).
    """
    spread = moments.P_zz - noise(model, prior.mean)
    return prior, _add_noise(moments, _per_member(spread, bump) * spread)


def bump_circular(
    prior: Gaussian, model: MeasurementModel, moments: Moments
) -> tuple[Gaussian, Moments]:
    """R_new = R + norm(P) H H^T: as if the state were uncertain by its worst direction in all.

    Parameters
    ----------
    prior : Gaussian
    model : MeasurementModel
        Gives jacobian (..., m, n).
    moments : Moments

    Returns
    -------
    tuple of Gaussian, Moments

    References
    ----------
    perea2007, Eq. (15) (B-EKF 2); the norm is the spectral one.
    """
    H = jacobian(model, prior.mean)
    return prior, _add_noise(moments, spectral_norm(prior.cov)[..., None, None] * matmul(H, H.mT))


def bump_equivalent(
    prior: Gaussian, model: MeasurementModel, moments: Moments
) -> tuple[Gaussian, Moments]:
    """R_new = norm(J R J^T) H H^T, J = H^-1: every sensor as coarse, in state space, as the worst.

    Parameters
    ----------
    prior : Gaussian
    model : MeasurementModel
        Gives R and a square jacobian (..., n, n).
    moments : Moments

    Returns
    -------
    tuple of Gaussian, Moments

    Raises
    ------
    ValueError
        When there are not as many measurements as states, so that h has no inverse.

    References
    ----------
    perea2007, Eq. (16) (B-EKF 3), literally: R itself is not added.
    """
    H = jacobian(model, prior.mean)
    m, n = H.shape[-2:]
    if m != n:
        raise ValueError(
            "B-EKF 3 inverts the measurement function, so model must measure as many components as "
            f"the state has; found {m} measurements of {n} states"
        )
    R = noise(model, prior.mean)
    J_R = right_divide(R, H.mT).mT  # H^-1 R, R being symmetric
    in_state_space = right_divide(J_R, H.mT)
    R_new = spectral_norm(in_state_space)[..., None, None] * matmul(H, H.mT)
    return prior, _add_noise(moments, R_new - R)


def bump_state(
    prior: Gaussian, model: MeasurementModel, moments: Moments
) -> tuple[Gaussian, Moments]:
    """P_new = norm(P) I: forget every direction, keep the worst uncertainty.

    Parameters
    ----------
    prior : Gaussian
    model : MeasurementModel
        Gives jacobian (..., m, n) and R (..., m, m).
    moments : Moments
        Only z_hat is kept; the covariances are those of P_new.

    Returns
    -------
    tuple of Gaussian, Moments

    References
    ----------
    perea2007, Eq. (17) (B-EKF 4).
    """
    H = jacobian(model, prior.mean)
    xp = H.__array_namespace__()
    size = spectral_norm(prior.cov)[..., None, None]
    P_new = size * xp.eye(H.shape[-1])
    R = noise(model, prior.mean)
    moments = Moments(moments.z_hat, R + size * matmul(H, H.mT), size * H.mT, H, R)
    return Gaussian(prior.mean, P_new), moments


def expect_at_mean(
    prior: Gaussian, model: MeasurementModel, moments: Moments
) -> tuple[Gaussian, Moments]:
    """z_hat = h(x): the residual is taken from the mean, the covariances from the sigma points.

    Parameters
    ----------
    prior : Gaussian
    model : MeasurementModel
        Gives h (..., m).
    moments : Moments

    Returns
    -------
    tuple of Gaussian, Moments

    References
    ----------
    perea2007, section VI.A.2 (UKFz).
    """
    return prior, moments._replace(z_hat=model.h(prior.mean))


def _add_noise(moments: Moments, extra: Array) -> Moments:
    R = None if moments.R is None else moments.R + extra
    return moments._replace(P_zz=moments.P_zz + extra, R=R)


def _per_member(like: Array, value: Array) -> Array:
    if not (type(value) is float and value >= 0) and not validation.traced(value):
        value = validation.real_array("bump", value, "", finite=False)
        if not (value >= 0).all():
            raise ValueError(f"bump must be at least 0; found {np.min(value)}")
        if value.ndim:
            validation.batch(bump=value.shape, prior_and_model=like.shape[:-2])
    return like.__array_namespace__().asarray(value)[..., None, None]
