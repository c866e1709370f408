"""The update that every Kalman-type filter shares."""

from contextvars import ContextVar
from typing import Any, Literal

import numpy as np

from navfilters.estimators import model_parts
from navfilters.numerics import validation
from navfilters.numerics.matrix_roots import keep_exact
from navfilters.numerics.small_matrices import WRITTEN_OUT, matmul, right_divide
from navfilters.types import Array, Gaussian, Moments

Form = Literal["joseph", "short"]
FORMS = ("joseph", "short")

COMPLETE: ContextVar[bool] = ContextVar("COMPLETE", default=False)
"""Whether whoever traces an update knows that all components were measured: a sixth of its time."""


def kalman_update(
    prior: Gaussian, z: Array, moments: Moments, *, form: Form = "joseph", model: Any = None
) -> Gaussian:
    """One update.

    K = P_xz P_zz^-1,   x+ = x + K (z - z_hat),   P+ = P - K P_xz^T,
    or in Joseph's form, where the moments have an H, P+ = (I - K H) P (I - K H)^T + K R K^T

    Parameters
    ----------
    prior : Gaussian
        mean (..., n), cov (..., n, n).
    z : array (..., m)
        The measurement; NaN where it was not measured, which leaves the state as it is.
    moments : Moments
        What the filter expected of it.
    form : {"joseph", "short"}
        "short" is that of the equations, whatever the moments have.
    model : MeasurementModel, optional
        Where ``residual`` and ``retract`` come from; by default z - z_hat and x + dx.

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
    Both forms are one covariance; their rounding is not. The symmetric part is taken.

    References
    ----------
    perea2007, Eqs. (5)-(7); pogorelsky2020, Eqs. (38), (39) for Joseph's.
    """
    z = validation.given("z", z)
    fit(prior, z, moments)
    y = innovation(z, moments, model)
    return correct(prior, y, moments, form, model, absent(z))


def fit(prior: Gaussian, z: Array, moments: Moments) -> None:
    """ValueError, naming the one, where trailing axes do not fit together."""
    n, m = prior.cov.shape[-1], moments.P_zz.shape[-1]
    if not (
        prior.cov.shape[-2] == n
        and moments.z_hat.shape[-1:] == z.shape[-1:] == (m,)
        and moments.P_zz.shape[-2:] == (m, m)
        and moments.P_xz.shape[-2:] == (n, m)
    ):
        validation.core("prior.cov", prior.cov, (n, n))
        validation.core("the expected measurement, from model.h,", moments.z_hat, (m,))
        validation.core("z", z, (m,))
        validation.core("its covariance, from model.R,", moments.P_zz, (m, m))
        validation.core("P_xz, from model.jacobian or model.h,", moments.P_xz, (n, m))


def innovation(z: Array, moments: Moments, model: Any) -> Array:
    """z minus what was expected, (..., m)."""
    try:
        return model_parts.residual(model, z, moments.z_hat)
    except (TypeError, ValueError):  # of JAX, of NumPy: this names what does not fit
        validation.batch(z=z.shape[:-1], prior_and_model=moments.z_hat.shape[:-1])
        raise


def absent(z: Array) -> Array | None:
    """Which components were not measured, (..., m); None where it is known that all were."""
    if type(z) is np.ndarray:
        squares = np.vdot(z, z)  # NaN where one of them is, in a fifth of the time
        return np.isnan(z) if squares != squares else None
    if COMPLETE.get() and validation.traced(z):
        return None
    gone = z.__array_namespace__().isnan(z)
    return gone if validation.traced(z) or gone.any() else None


def measured(moments: Moments, gone: Array) -> Moments:
    """The moments of what was measured: the rest has unit variance and covaries with nothing."""
    xp = gone.__array_namespace__()
    either = gone[..., :, None] | gone[..., None, :]
    unit = xp.eye(gone.shape[-1])
    H, R = moments.H, moments.R
    return moments._replace(
        P_zz=xp.where(either, unit, moments.P_zz),
        P_xz=xp.where(gone[..., None, :], 0.0, moments.P_xz),
        H=None if H is None else xp.where(gone[..., :, None], 0.0, H),
        R=None if R is None else xp.where(either, unit, R),
    )


def correct(
    prior: Gaussian, y: Array, moments: Moments, form: Form, model: Any, gone: Array | None
) -> Gaussian:
    """The update of :func:`kalman_update` by an innovation y, of which so much was not measured."""
    xp = moments.P_zz.__array_namespace__()
    if gone is not None:
        y, moments = xp.where(gone, 0.0, y), measured(moments, gone)
    K = gain(moments)
    mean = model_parts.retract(model, prior.mean, matmul(K, y[..., None])[..., 0])
    if form == "joseph" and moments.H is not None:
        rest = xp.eye(K.shape[-2]) - matmul(K, moments.H)
        cov = matmul(matmul(rest, prior.cov), rest.mT) + matmul(matmul(K, moments.R), K.mT)
        return Gaussian(mean, (cov + cov.mT) / 2)
    reduction = matmul(K, moments.P_xz.mT)
    cov = prior.cov - (reduction + reduction.mT) / 2
    if moments.exact is not None:
        cov = keep_exact(cov, moments.exact)
    return Gaussian(mean, cov)


def gain(moments: Moments) -> Array:
    """K = P_xz P_zz^-1, (..., n, m); rows and columns of unit variance where BLAS has it."""
    S = moments.P_zz
    if S.shape[-1] <= WRITTEN_OUT:
        return right_divide(moments.P_xz, S)
    xp = S.__array_namespace__()
    variance = xp.abs(xp.linalg.diagonal(S))
    scale = (1 / xp.sqrt(xp.where(variance > 0, variance, 1.0)))[..., None, :]
    return right_divide(moments.P_xz * scale, scale.mT * S * scale) * scale
