"""The update that every Kalman-type filter shares."""

from navfilters.numerics import validation
from navfilters.numerics.matrix_roots import keep_exact
from navfilters.numerics.small_matrices import matmul, right_divide
from navfilters.types import Array, ExactMoments, Gaussian, Moments


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
