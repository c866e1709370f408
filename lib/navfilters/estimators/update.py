"""The update that every Kalman-type filter shares."""

from contextvars import ContextVar
from typing import Any, Literal

import numpy as np

from navfilters.estimators import model_parts
from navfilters.numerics import validation
from navfilters.numerics.in_floats import in_floats
from navfilters.numerics.matrix_roots import keep_exact, semidefinite_root
from navfilters.numerics.small_matrices import WRITTEN_OUT, identity, matmul, right_divide
from navfilters.types import Array, Gaussian, Moments

Form = Literal["joseph", "short", "sqrt"]
FORMS = ("joseph", "short", "sqrt")

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
    form : {"joseph", "short", "sqrt"}
        "short" is that of the equations, whatever the moments have. "sqrt" triangularises
        [[R^1/2, H P^1/2], [0, P^1/2]] and needs a semidefinite R: NaN elsewhere.
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
    All forms are one covariance; their rounding is not. The symmetric part is taken. "sqrt" returns
    a product of a factor and its transpose, but the next update takes the root again: it cannot
    lose its definiteness by a subtraction, and it has no more digits than P has.

    References
    ----------
    perea2007, Eqs. (5)-(7); pogorelsky2020, Eqs. (38), (39) for Joseph's; kaminski1971 for the
    array.
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
        # NaN where one of them is, in a fifth of the time.
        squares = z.dot(z) if z.ndim == 1 else np.vdot(z, z)
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
    if gone is not None:
        xp = y.__array_namespace__()
        y, moments = xp.where(gone, 0.0, y), measured(moments, gone)
    _, P_zz, P_xz, H, R, _ = moments
    if form == "sqrt":
        dx, cov = _by_array(prior.cov, y, moments)
    elif form == "joseph" and H is not None:
        dx, cov = _joseph(prior.cov, y, P_zz, P_xz, H, R)
    else:
        dx, cov = _short(prior.cov, y, P_zz, P_xz)
    mean = model_parts.retract(model, prior.mean, dx)
    return Gaussian(mean, cov if moments.exact is None else keep_exact(cov, moments.exact))


@in_floats
def _joseph(
    P: Array, y: Array, P_zz: Array, P_xz: Array, H: Array, R: Array
) -> tuple[Array, Array]:
    """How far the mean goes, (..., n), and the covariance after it, in Joseph's form."""
    K = gain(P_zz, P_xz)
    return _times(K, y), _joseph_covariance(P, K, H, R)


@in_floats
def _short(P: Array, y: Array, P_zz: Array, P_xz: Array) -> tuple[Array, Array]:
    """The same in the form of the equations."""
    K = gain(P_zz, P_xz)
    reduction = matmul(K, P_xz.mT)
    return _times(K, y), P - (reduction + reduction.mT) / 2


def _by_array(P: Array, y: Array, moments: Moments) -> tuple[Array, Array]:
    """The same by a triangular factor."""
    K, cov = by_array(P, moments)
    return _times(K, y), cov


def _times(K: Array, y: Array) -> Array:
    return matmul(K, y[..., None])[..., 0]


def _joseph_covariance(P: Array, K: Array, H: Array, R: Array) -> Array:
    rest = identity(K) - matmul(K, H)
    cov = matmul(matmul(rest, P), rest.mT) + matmul(matmul(K, R), K.mT)
    return (cov + cov.mT) / 2


def covariance_after(P: Array, K: Array, moments: Moments, form: Form) -> Array:
    """The covariance after an update by any gain K, also by one that is not these moments'."""
    if form == "sqrt":
        H, root, noise_root = _factors(P, moments)
        A = join([root - matmul(K, matmul(H, root)), matmul(K, noise_root)], -1)
        return matmul(A, A.mT)
    if form == "joseph" and moments.H is not None:
        return _joseph_covariance(P, K, moments.H, moments.R)
    reduction = matmul(K, moments.P_xz.mT)
    cov = P - reduction - reduction.mT + matmul(matmul(K, moments.P_zz), K.mT)
    return (cov + cov.mT) / 2


def by_array(P: Array, moments: Moments) -> tuple[Array, Array]:
    """Gain and covariance after the update, from one triangular factor."""
    H, root, noise_root = _factors(P, moments)
    xp, m = P.__array_namespace__(), H.shape[-2]
    zero = xp.zeros((root.shape[-1], m))
    before = join([join([noise_root, matmul(H, root)], -1), join([zero, root], -1)], -2)
    after = xp.linalg.qr(before.mT).R.mT
    K = right_divide(after[..., m:, :m], after[..., :m, :m])
    return K, matmul(after[..., m:, m:], after[..., m:, m:].mT)


def _factors(P: Array, moments: Moments) -> tuple[Array, Array, Array]:
    """H, P^1/2 and R^1/2."""
    H, R = affine(P, moments)
    return H, semidefinite_root(P)[0], semidefinite_root(R)[0]


def affine(P: Array, moments: Moments) -> tuple[Array, Array]:
    """H and R with P_xz = P H^T and P_zz = H P H^T + R: the moments' own, or by regression."""
    if moments.H is not None:
        return moments.H, moments.R
    root, exact = semidefinite_root(P)
    cross = moments.P_xz.mT
    if exact is not None:  # what follows from other states has no column of its own
        xp = P.__array_namespace__()
        follows = xp.linalg.diagonal(exact) == 0
        either = follows[..., :, None] | follows[..., None, :]
        root = xp.where(either, xp.eye(P.shape[-1]), root)
        cross = xp.where(follows[..., None, :], 0.0, cross)
    H = right_divide(right_divide(cross, root.mT), root)
    R = moments.P_zz - matmul(H, moments.P_xz)
    return H, (R + R.mT) / 2


def join(parts: list[Array], axis: int) -> Array:
    """Matrices side by side or one below the other, with all the batch axes of all."""
    xp = parts[0].__array_namespace__()
    batch = xp.broadcast_shapes(*(A.shape[:-2] for A in parts))
    return xp.concat([xp.broadcast_to(A, (*batch, *A.shape[-2:])) for A in parts], axis=axis)


def gain(S: Array, P_xz: Array) -> Array:
    """K = P_xz S^-1, (..., n, m); rows and columns of unit variance where BLAS has it."""
    if S.shape[-1] <= WRITTEN_OUT:
        return right_divide(P_xz, S)
    xp = S.__array_namespace__()
    variance = xp.abs(xp.linalg.diagonal(S))
    scale = (1 / xp.sqrt(xp.where(variance > 0, variance, 1.0)))[..., None, :]
    return right_divide(P_xz * scale, scale.mT * S * scale) * scale
