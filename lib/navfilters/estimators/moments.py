"""How a filter predicts its measurement: approximations of the same three moments."""

from functools import partial

from navfilters.estimators.model_parts import hessian, jacobian, noise, residual, retract
from navfilters.estimators.sigma_points import (
    SigmaPoints,
    behind,
    is_singular,
    offsets,
    root_of,
    spreads,
)
from navfilters.numerics import validation
from navfilters.numerics.in_floats import in_floats
from navfilters.numerics.small_matrices import matmul
from navfilters.types import Array, Gaussian, MeasurementModel, Moments


def linearized(prior: Gaussian, model: MeasurementModel) -> Moments:
    """Moments of the measurement under a first-order expansion about the prior mean.

    z_hat = h(x),   P_zz = R + H P H^T,   P_xz = P H^T

    Parameters
    ----------
    prior : Gaussian
        mean (..., n), cov (..., n, n), in the state's units.
    model : MeasurementModel
        Gives h (..., m), jacobian (..., m, n) and R (..., m, m).

    Returns
    -------
    Moments
        z_hat (..., m), P_zz (..., m, m), P_xz (..., n, m).

    References
    ----------
    perea2007, Eqs. (10)-(12).
    """
    H = jacobian(model, prior.mean)
    R = noise(model, prior.mean)
    validation.core("model.jacobian", H, (R.shape[-1], prior.cov.shape[-1]))
    P_zz, P_xz = _linear(prior.cov, H, R)
    return Moments(model.h(prior.mean), P_zz, P_xz, H, R)


@in_floats
def _linear(P: Array, H: Array, R: Array) -> tuple[Array, Array]:
    """P_zz and P_xz."""
    P_xz = matmul(P, H.mT)
    return R + matmul(H, P_xz), P_xz


def second_order(prior: Gaussian, model: MeasurementModel) -> Moments:
    """Moments of the modified truncated second-order filter.

    z_hat = h(x) + b,   P_zz = R + H P H^T - b b^T,   P_xz = P H^T,   b_i = tr(h_i'' P) / 2

    Parameters
    ----------
    prior : Gaussian
        mean (..., n), cov (..., n, n).
    model : MeasurementModel
        Gives h, jacobian, hessian (..., m, n, n) and R.

    Returns
    -------
    Moments
        z_hat (..., m), P_zz (..., m, m), which may be indefinite, and P_xz (..., n, m).

    Notes
    -----
    The paper prints the bias with the *updated* covariance, which does not exist yet; the prior's
    is meant. For a Gaussian, second-order terms would *add* to P_zz; truncating the fourth moments
    leaves the subtraction that costs this filter its definiteness.

    References
    ----------
    perea2007, Eqs. (18)-(20).
    """
    first = linearized(prior, model)
    b = second_order_bias(prior, model)
    squares = b[..., :, None] * b[..., None, :]
    return first._replace(z_hat=first.z_hat + b, P_zz=first.P_zz - squares, R=first.R - squares)


def gaussian_second_order(prior: Gaussian, model: MeasurementModel) -> Moments:
    """Moments of the Gaussian second-order filter: those of a quadratic h of a Gaussian state.

    z_hat = h(x) + b,   P_zz = R + H P H^T + C,   P_xz = P H^T,   C_ij = tr(h_i'' P h_j'' P) / 2

    Parameters
    ----------
    prior : Gaussian
        mean (..., n), cov (..., n, n).
    model : MeasurementModel
        Gives h, jacobian, hessian (..., m, n, n) and R.

    Returns
    -------
    Moments
        z_hat (..., m), P_zz (..., m, m) and P_xz (..., n, m).

    Notes
    -----
    :func:`second_order` has -b b^T in the place of C: a Gaussian's fourth moments are not zero but
    b b^T + C.

    References
    ----------
    athans1968.
    """
    first = linearized(prior, model)
    b, C = of_curvature(hessian(model, prior.mean), prior.cov)
    return first._replace(z_hat=first.z_hat + b, P_zz=first.P_zz + C, R=first.R + C)


def of_curvature(second: Array, P: Array) -> tuple[Array, Array]:
    """b_i = tr(A_i P) / 2 and C_ij = tr(A_i P A_j P) / 2 of second derivatives A (..., m, n, n).

    On a manifold those that are made of Jacobians are not symmetric; what is asked for is.
    """
    curvature = matmul((second + second.mT) / 2, P[..., None, :, :])
    xp = curvature.__array_namespace__()
    b = xp.sum(xp.linalg.diagonal(curvature), axis=-1) / 2
    pairs = curvature[..., :, None, :, :] * curvature.mT[..., None, :, :, :]
    return b, xp.sum(pairs, axis=(-2, -1)) / 2


def second_order_bias(prior: Gaussian, model: MeasurementModel) -> Array:
    """The bias b_i = tr(h_i'' P) / 2 that curvature adds to the expected measurement.

    Parameters
    ----------
    prior : Gaussian
        mean (..., n), cov (..., n, n).
    model : MeasurementModel
        Gives hessian (..., m, n, n).

    Returns
    -------
    array (..., m)
        In the measurement's units.

    References
    ----------
    perea2007, the definition below Eq. (20).
    """
    n, m = prior.cov.shape[-1], noise(model, prior.mean).shape[-1]
    second = validation.core("model.hessian", hessian(model, prior.mean), (m, n, n))
    products = second * prior.cov[..., None, :, :]
    xp = products.__array_namespace__()
    return xp.sum(products, axis=(-2, -1)) / 2


def unscented(
    prior: Gaussian, model: MeasurementModel, *, points: SigmaPoints = SigmaPoints()
) -> Moments:
    """Moments of the measurement by weighted sigma points, redrawn from the prior.

    z_hat = sum W_m Z,   P_zz = R + sum W_c (Z - z_hat)(Z - z_hat)^T,
    P_xz = sum W_c (X - x)(Z - z_hat)^T,   Z = h(X)

    Parameters
    ----------
    prior : Gaussian
        mean (..., n), cov (..., n, n).
    model : MeasurementModel
        Gives h (..., m) and R (..., m, m).
    points : SigmaPoints
        Scaling, weights and square root.

    Returns
    -------
    Moments
        z_hat (..., m), P_zz (..., m, m), P_xz (..., n, m); NaN where cov has no square root.
        ``exact`` if some member's cov is singular.

    References
    ----------
    perea2007, Eqs. (21)-(25); its Eq. (26) is empty.
    """
    if not hasattr(model, "retract"):
        validation.core("prior.cov", prior.cov, prior.mean.shape[-1:] * 2)
    root, exact = root_of(prior.cov, points.root)
    dX = offsets(prior, points, root)
    X = retract(model, prior.mean, dX)
    if exact is None and not hasattr(model, "retract"):
        del dX, root  # a batch fills the cache
    xp = X.__array_namespace__()
    R = noise(model, prior.mean)
    missing = R.ndim - X.ndim  # batch axes that only the model has go behind the points' axis
    X = behind(X, missing)
    Z = validation.core("model.h", model.h(X), R.shape[-1:])
    _, _, W0_c, W_i = points.weights(prior.cov.shape[-1], xp)
    # The weights sum to one. Summing differences keeps the digits that a large negative W0 would
    # cancel, and finds the mean of angles that lie on both sides of their jump.
    z_hat = Z[0] + W_i[..., None] * xp.sum(residual(model, Z[1:], Z[0]), axis=0)
    dZ = residual(model, Z, z_hat)
    if hasattr(model, "retract"):
        dX = behind(dX, missing)
    elif exact is None:
        dX = X - prior.mean
    else:  # what is known as a combination must not see the rounding of the mean
        dX = xp.where(is_singular(exact)[..., None], behind(dX, missing), X - prior.mean)
    W0_c, W_i = W0_c[..., None, None], W_i[..., None, None]
    return Moments(z_hat, *spreads(dX, dZ, R, W0_c, W_i), exact=exact)


cubature = partial(unscented, points=SigmaPoints(alpha=1.0, beta=0.0, kappa=0.0))
"""Moments by the third-degree spherical-radial cubature rule (arasaratnam2009): the unscented
transform whose central point has no weight and whose 2 n others stand at sqrt(n) deviations."""
