"""How a filter predicts its state: the approximation of its moments, with f in the place of h."""

from collections.abc import Callable
from typing import Any

from navfilters.estimators.model_parts import by_error, difference, moved, retract, transition
from navfilters.estimators.moments import (
    gaussian_second_order,
    of_curvature,
    second_order,
    unscented,
)
from navfilters.estimators.sigma_points import SigmaPoints, behind, offsets, root_of, spread
from navfilters.numerics.small_matrices import matmul
from navfilters.numerics.state_derivatives import first_derivative, second_derivative
from navfilters.types import Array, Dynamics, Gaussian


def predict_linearized(estimate: Gaussian, dynamics: Dynamics, Q: Array) -> Gaussian:
    """The state one transition later.

    x' = f(x),   P' = F P F^T + Q

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n).
    dynamics : Dynamics
    Q : array (..., n, n)
        Covariance of the process noise: the dynamics', or a rule's in its place.

    Returns
    -------
    Gaussian

    References
    ----------
    xiong2009, Eqs. (3), (4); lecture16, Eqs. (81)-(84); pogorelsky2020, Eqs. (8)-(12).
    """
    x, F, W = transition(dynamics, estimate, Q)
    P = matmul(matmul(F, estimate.cov), F.mT) + W
    return Gaussian(x, (P + P.mT) / 2)


def predict_second_order(estimate: Gaussian, dynamics: Dynamics, Q: Array) -> Gaussian:
    """As :func:`predict_linearized`, with the bias of the modified truncated second-order filter.

    x' = f(x) + b,   P' = F P F^T + Q - b b^T,   b_i = tr(f_i'' P) / 2

    Parameters
    ----------
    estimate : Gaussian
    dynamics : Dynamics
        Its Hessian is ``hessian(x)``, (..., n, n, n), or made of F or f.
    Q : array (..., n, n)

    Returns
    -------
    Gaussian
    """
    first = predict_linearized(estimate, dynamics, Q)
    x = estimate.mean
    second = transition_hessian(dynamics, x)
    xp = second.__array_namespace__()
    b = xp.sum(second * estimate.cov[..., None, :, :], axis=(-2, -1)) / 2
    squares = b[..., :, None] * b[..., None, :]
    return Gaussian(retract(dynamics, first.mean, b), first.cov - squares)


def predict_gaussian_second_order(estimate: Gaussian, dynamics: Dynamics, Q: Array) -> Gaussian:
    """As :func:`predict_linearized`, with what the curvature of f adds for a Gaussian.

    x' = f(x) + b,   P' = F P F^T + Q + C,   b_i = tr(f_i'' P) / 2,   C_ij = tr(f_i'' P f_j'' P) / 2

    Parameters
    ----------
    estimate : Gaussian
    dynamics : Dynamics
        As of :func:`predict_second_order`.
    Q : array (..., n, n)

    Returns
    -------
    Gaussian

    References
    ----------
    athans1968.
    """
    first = predict_linearized(estimate, dynamics, Q)
    b, C = of_curvature(transition_hessian(dynamics, estimate.mean), estimate.cov)
    return Gaussian(retract(dynamics, first.mean, b), first.cov + C)


def transition_hessian(dynamics: Dynamics, x: Array) -> Array:
    """Second derivatives of f at x, (..., n, n, n): its own, or from F, or from f."""
    if hasattr(dynamics, "hessian"):
        return dynamics.hessian(x)
    if hasattr(dynamics, "transition"):
        F = by_error(dynamics, lambda y: dynamics.transition(y)[1], x)
        return first_derivative(*F, "F of dynamics")
    f = by_error(dynamics, lambda y: moved(dynamics, y), x)
    return second_derivative(*f, "dynamics.f")


def predict_unscented(
    estimate: Gaussian, dynamics: Dynamics, Q: Array, *, points: SigmaPoints = SigmaPoints()
) -> Gaussian:
    """The state one transition later, by sigma points.

    x' = sum W_m f(X),   P' = Q + sum W_c (f(X) - x')(f(X) - x')^T

    Parameters
    ----------
    estimate : Gaussian
    dynamics : Dynamics
    Q : array (..., n, n)
    points : SigmaPoints

    Returns
    -------
    Gaussian
        NaN where cov has no square root.
    """
    x, n = estimate.mean, estimate.cov.shape[-1]
    X = retract(dynamics, x, offsets(estimate, points, root_of(estimate.cov, points.root)[0]))
    Y = moved(dynamics, behind(X, Q.ndim - X.ndim))  # batch axes that only the dynamics have
    xp = Y.__array_namespace__()
    _, _, W0_c, W_i = points.weights(n, xp)
    shift = W_i[..., None] * xp.sum(difference(dynamics, Y[1:], Y[0]), axis=0)
    mean = retract(dynamics, Y[0], shift)
    dY = difference(dynamics, Y, mean)
    W = transition(dynamics, estimate, Q)[2] if hasattr(dynamics, "propagate") else Q
    W0_c, W_i = W0_c[..., None, None], W_i[..., None, None]
    P = spread(dY, W, W0_c, W_i)
    return Gaussian(mean, (P + P.mT) / 2)


def in_parts(
    predict: Callable[..., Gaussian],
    estimate: Gaussian,
    dynamics: Dynamics,
    Q: Array,
    **options: Any,
) -> tuple[Gaussian, Array]:
    """A prediction, and what the noise added to its covariance.

    Parameters
    ----------
    predict : callable
        One of those above.
    estimate : Gaussian
    dynamics : Dynamics
    Q : array (..., n, n)
    **options
        Of ``predict``.

    Returns
    -------
    tuple of Gaussian, array (..., n, n)
        The second is the covariance of the same prediction of a state without doubt, which is made
        along with it: f is not called again.
    """
    mean, cov = estimate
    axes = max(mean.ndim + 1, cov.ndim, Q.ndim)
    cov = cov[(None,) * (axes + 1 - cov.ndim)]
    both = cov.__array_namespace__().concat([cov, 0 * cov])
    mean, cov = predict(Gaussian(mean[(None,) * (axes - mean.ndim)], both), dynamics, Q, **options)
    return Gaussian(mean[0], cov[0]), cov[1]


PREDICTIONS = {
    second_order: predict_second_order,
    gaussian_second_order: predict_gaussian_second_order,
    unscented: predict_unscented,
}
"""How the moments functions predict a state; all others linearise."""
