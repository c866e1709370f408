"""How a filter predicts its measurement: three approximations of the same three moments."""

import numpy as np

from navfilters.estimators.sigma_points import SigmaPoints, _is_singular, _offsets, _root
from navfilters.numerics import validation
from navfilters.numerics.small_matrices import matmul, outer_sum
from navfilters.types import Array, ExactMoments, Gaussian, MeasurementModel, Moments


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
    H = model.jacobian(prior.mean)
    R = noise(model)
    validation.core("model.jacobian", H, (R.shape[-1], prior.mean.shape[-1]))
    P_xz = matmul(prior.cov, H.mT)
    return Moments(model.h(prior.mean), R + matmul(H, P_xz), P_xz)


def noise(model: MeasurementModel) -> Array:
    """A model's R, if it is one: a vector or a number would be added to every row.

    Parameters
    ----------
    model : MeasurementModel

    Returns
    -------
    array (..., m, m)

    Raises
    ------
    ValueError
        Another shape, no real numbers, masked entries or a unit.
    """
    R = validation.given("model.R", model.R)
    if R.ndim > 1 and R.shape[-1] == R.shape[-2]:
        return R
    return validation.core("model.R", R, R.shape[-1:] * 2 or (1, 1))


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
    return Moments(first.z_hat + b, first.P_zz - b[..., :, None] * b[..., None, :], first.P_xz)


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
    n = prior.mean.shape[-1]
    m = np.shape(model.R)[-1]
    hessian = validation.core("model.hessian", model.hessian(prior.mean), (m, n, n))
    products = hessian * prior.cov[..., None, :, :]
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
        ``ExactMoments`` if some member's cov is singular.

    References
    ----------
    perea2007, Eqs. (21)-(25); its Eq. (26) is empty.
    """
    root, exact = _root(prior.cov, points.root)
    X = prior.mean + _offsets(prior, points, root)
    if exact is None:
        del root  # a batch fills the cache
    xp = X.__array_namespace__()
    R = noise(model)
    missing = R.ndim - X.ndim  # batch axes that only the model has go behind the points' axis
    X = xp.reshape(X, (X.shape[0], *(1,) * missing, *X.shape[1:]))
    Z = validation.core("model.h", model.h(X), R.shape[-1:])
    _, _, W0_c, W_i = points.weights(prior.mean.shape[-1], xp)
    # The weights sum to one. Summing differences keeps the digits that a large negative W0 would
    # cancel.
    z_hat = Z[0] + W_i[..., None] * xp.sum(Z[1:] - Z[0], axis=0)
    dX, dZ = X - prior.mean, Z - z_hat
    if exact is not None:  # what is known as a combination must not see the rounding of the mean
        offsets = xp.reshape(_offsets(prior, points, root), X.shape)
        dX = xp.where(_is_singular(exact)[..., None], offsets, dX)
    W0_c, W_i = W0_c[..., None, None], W_i[..., None, None]
    P_zz = R + W0_c * outer_sum(dZ[:1], dZ[:1]) + W_i * outer_sum(dZ[1:], dZ[1:])
    moments = Moments(z_hat, P_zz, W_i * outer_sum(dX[1:], dZ[1:]))
    return moments if exact is None else ExactMoments.of(moments, exact)
