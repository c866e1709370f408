"""How a filter predicts its measurement: three approximations of the same three moments.

Each function takes (prior, model) and returns :class:`~navfilters.types.Moments`; a filter is
one of them, perhaps a variant of it, and the common update of :mod:`navfilters.filters`.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from navfilters import linalg, validation
from navfilters.linalg import matmul, outer_sum
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


@dataclass(frozen=True)
class SigmaPoints:
    """Where an unscented filter samples its prior, and how it weighs the samples.

    Parameters
    ----------
    alpha : float or array (...)
        Spread, larger than 0. An array is one setting per member of the batch.
    beta : float or array (...)
        Added to the central covariance weight; 2 is right for a Gaussian.
    kappa : float or array (...), optional
        Second spread parameter, larger than -n. By default 3 - n, n being the state's size.
    root : {"cholesky", "symmetric"}
        The matrix square root whose columns become the sigma points.

    Raises
    ------
    ValueError
        An unknown root; alpha, beta or kappa not finite numbers; alpha not positive.

    References
    ----------
    perea2007, Eq. (21), which leaves all four open; the names are those of its reference 12.
    """

    alpha: Array = 1.0
    beta: Array = 2.0
    kappa: Array | None = None
    root: Literal["cholesky", "symmetric"] = "cholesky"

    def __post_init__(self) -> None:
        if self.root not in ROOTS:
            raise ValueError(f"root must be one of {list(ROOTS)}; found {self.root!r}")
        for name in ("alpha", "beta") if self.kappa is None else ("alpha", "beta", "kappa"):
            value = validation.real_array(name, getattr(self, name), "")
            if name == "alpha" and (value <= 0).any():
                raise ValueError(f"alpha must be positive; found {value.min()}")

    def weights(self, n: int, xp: Any = None) -> tuple[Array, Array, Array, Array]:
        """Scaling and weights for a state of size n.

        Parameters
        ----------
        n : int
            Size of the state.
        xp : array namespace, optional
            Of the results; NumPy by default.

        Returns
        -------
        tuple of array (...)
            (gamma, W0_m, W0_c, W_i): the scale of the offsets, the central point's weight in means
            and in covariances, and the weight of each of the 2 n other points.
        """
        xp = np if xp is None else xp
        given = 3.0 - n if self.kappa is None else self.kappa
        if not validation.traced(given) and np.any(n + np.asarray(given) <= 0):
            raise ValueError(
                f"kappa must be larger than {-n} for a state of size {n}; found {given}"
            )
        alpha, beta, kappa = (xp.asarray(v, dtype=float) for v in (self.alpha, self.beta, given))
        scale = alpha**2 * (n + kappa)  # n + lambda
        W0_m = 1 - n / scale
        return xp.sqrt(scale), W0_m, W0_m + 1 - alpha**2 + beta, 0.5 / scale


ROOTS = ("cholesky", "symmetric")


def _root(cov: Array, kind: str) -> tuple[Array, Array | None]:
    """The root of a covariance whose columns become the points, and what it knows exactly.

    A state or a combination without variance has no points of its own. A covariance that is
    positive definite has the root that it always had, to the last bit.
    """
    S, exact = linalg.semidefinite_root(cov)
    if kind == "symmetric":
        S = linalg.symmetric_root(cov, None if exact is None else _is_singular(exact))
    return S, exact


def _is_singular(exact: Array) -> Array:
    xp = exact.__array_namespace__()
    return xp.any(xp.linalg.diagonal(exact) == 0, axis=-1)


def sigma_points(prior: Gaussian, points: SigmaPoints) -> Array:
    """The 2 n + 1 sigma points of a prior: its mean, then mean + and mean - each scaled column.

    Parameters
    ----------
    prior : Gaussian
        mean (..., n), cov (..., n, n).
    points : SigmaPoints
        Scaling and square root.

    Returns
    -------
    array (2 n + 1, ..., n)
        The points in *front* of the batch axes, so that a model's own batch axes still line up.
        NaN, except the mean, where cov has no square root: where it is not positive semidefinite.

    References
    ----------
    perea2007, Eq. (21).
    """
    return prior.mean + _offsets(prior, points, _root(prior.cov, points.root)[0])


def _offsets(prior: Gaussian, points: SigmaPoints, root: Array) -> Array:
    """What the points have that the mean has not, with all the batch axes of both."""
    xp = prior.cov.__array_namespace__()
    n = prior.mean.shape[-1]
    gamma, *_ = points.weights(n, xp)
    if gamma.ndim:
        validation.batch(points=gamma.shape, prior=root.shape[:-2])
    S = gamma[..., None, None] * root
    batch = xp.broadcast_shapes(S.shape[:-2], prior.mean.shape[:-1])
    columns = xp.moveaxis(xp.broadcast_to(S, (*batch, n, n)), -1, 0)
    return xp.concat([xp.zeros_like(columns[:1]), columns, -columns], axis=0)


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
