"""Ten filters that are one update: moments, perhaps a variant, and Eqs. (5)-(7).

::

    model --moments--> Moments --variant--> (prior, Moments) --kalman_update--> Gaussian

A *variant* maps (prior, model, moments) to (prior, moments). ``FILTERS[name](prior, z, model)``
makes one update for every member of a batch.
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from navfilters import validation
from navfilters.linalg import keep_exact, matmul, right_divide, spectral_norm
from navfilters.moments import linearized, noise, second_order, unscented
from navfilters.types import Array, ExactMoments, Gaussian, MeasurementModel, Moments

Variant = Callable[..., tuple[Gaussian, Moments]]


def kalman_update(prior: Gaussian, z: Array, moments: Moments) -> Gaussian:
    """The update that every Kalman-type filter shares.

    K = P_xz P_zz^-1,   x+ = x + K (z - z_hat),   P+ = P - K P_xz^T

    Parameters
    ----------
    prior : Gaussian
        mean (..., n), cov (..., n, n).
    z : array (..., m)
        The measurement.
    moments : Moments
        What the filter expected of it.

    Returns
    -------
    Gaussian
        The updated mean and covariance. Not finite where P_zz is singular.

    Raises
    ------
    ValueError
        Trailing axes that do not fit together, or a z whose meaning is more than its numbers.

    Notes
    -----
    K P_xz^T is symmetric, but its rounding is not. Early rounding stays in P while P shrinks by ten
    decades, so the symmetric part is taken: B-EKF 1 gains two digits by it over 1000 updates.

    References
    ----------
    perea2007, Eqs. (5)-(7).
    """
    z = validation.given("z", z)
    n, m = prior.mean.shape[-1], moments.P_zz.shape[-1]
    if not (
        prior.cov.shape[-2:] == (n, n)
        and moments.z_hat.shape[-1:] == z.shape[-1:] == (m,)
        and moments.P_zz.shape[-2:] == (m, m)
        and moments.P_xz.shape[-2:] == (n, m)
    ):  # this names what does not fit
        validation.core("prior.cov", prior.cov, (n, n))
        validation.core("the expected measurement, from model.h,", moments.z_hat, (m,))
        validation.core("z", z, (m,))
        validation.core("its covariance, from model.R,", moments.P_zz, (m, m))
        validation.core("P_xz, from model.jacobian or model.h,", moments.P_xz, (n, m))
    K = right_divide(moments.P_xz, moments.P_zz)
    try:
        residual = z - moments.z_hat
    except (TypeError, ValueError):  # of JAX, of NumPy: this names what does not fit
        validation.batch(z=z.shape[:-1], prior_and_model=moments.z_hat.shape[:-1])
        raise
    mean = prior.mean + matmul(K, residual[..., None])[..., 0]
    reduction = matmul(K, moments.P_xz.mT)
    cov = prior.cov - (reduction + reduction.mT) / 2
    if isinstance(moments, ExactMoments):
        cov = keep_exact(cov, moments.exact)
    return Gaussian(mean, cov)


def unchanged(prior: Gaussian, model: MeasurementModel, moments: Moments):
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


def bump_linear(prior: Gaussian, model: MeasurementModel, moments: Moments, *, bump: Array = 1.0):
    """R_new = R + bump * H P H^T: the noise grows by the linearised spread of the measurement.

    Parameters
    ----------
    prior : Gaussian
    model : MeasurementModel
        Gives jacobian (..., m, n).
    moments : Moments
        With P_xz = P H^T, as :func:`~navfilters.moments.linearized` and
        :func:`~navfilters.moments.second_order` give it.
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
    spread = matmul(model.jacobian(prior.mean), moments.P_xz)
    return prior, _add_noise(moments, _per_member(spread, bump) * spread)


def bump_predicted(
    prior: Gaussian, model: MeasurementModel, moments: Moments, *, bump: Array = 1.0
):
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
    spread = moments.P_zz - noise(model)
    return prior, _add_noise(moments, _per_member(spread, bump) * spread)


def bump_circular(prior: Gaussian, model: MeasurementModel, moments: Moments):
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
    H = model.jacobian(prior.mean)
    return prior, _add_noise(moments, spectral_norm(prior.cov)[..., None, None] * matmul(H, H.mT))


def bump_equivalent(prior: Gaussian, model: MeasurementModel, moments: Moments):
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
    H = model.jacobian(prior.mean)
    m, n = H.shape[-2:]
    if m != n:
        raise ValueError(
            "B-EKF 3 inverts the measurement function, so model must measure as many components as "
            f"the state has; found {m} measurements of {n} states"
        )
    R = noise(model)
    J_R = right_divide(R, H.mT).mT  # H^-1 R, R being symmetric
    in_state_space = right_divide(J_R, H.mT)
    R_new = spectral_norm(in_state_space)[..., None, None] * matmul(H, H.mT)
    return prior, _add_noise(moments, R_new - R)


def bump_state(prior: Gaussian, model: MeasurementModel, moments: Moments):
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
    H = model.jacobian(prior.mean)
    xp = H.__array_namespace__()
    size = spectral_norm(prior.cov)[..., None, None]
    P_new = size * xp.eye(H.shape[-1])
    moments = Moments(moments.z_hat, noise(model) + size * matmul(H, H.mT), size * H.mT)
    return Gaussian(prior.mean, P_new), moments


def expect_at_mean(prior: Gaussian, model: MeasurementModel, moments: Moments):
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


def _given(prior: Gaussian) -> Gaussian:
    mean, cov = prior.mean, prior.cov
    return Gaussian(validation.given("prior.mean", mean), validation.given("prior.cov", cov))


def _add_noise(moments: Moments, extra: Array) -> Moments:
    return moments._replace(P_zz=moments.P_zz + extra)


def _per_member(like: Array, value: Array) -> Array:
    if not (type(value) is float and value >= 0) and not validation.traced(value):
        value = validation.real_array("bump", value, "", finite=False)
        if not (value >= 0).all():
            raise ValueError(f"bump must be at least 0; found {np.min(value)}")
        if value.ndim:
            validation.batch(bump=value.shape, prior_and_model=like.shape[:-2])
    return like.__array_namespace__().asarray(value)[..., None, None]


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
