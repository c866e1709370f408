"""What stands between prediction and moments: a rule on the covariances, with a memory."""

from typing import Any

import numpy as np

from navfilters.numerics.small_matrices import right_divide
from navfilters.types import Array, Gaussian, Moments


class Rule:
    """The rule that changes nothing; a base for others.

    A rule is a frozen dataclass of its tuning parameters. Its memory is a named tuple of arrays
    with the batch axes in front, or None. ``enlarge`` acts where the whole measurement was taken.
    """

    looks = False
    """Whether ``enlarge`` is given the innovation and the moments; they cost a call."""

    parts = False
    """Whether ``noise_added`` is told the noise's part of P."""

    def init(self, prior: Gaussian) -> Any:
        """The memory before any step."""
        return None

    def process_noise(self, memory: Any, Q: Array) -> tuple[Array, Any]:
        """The Q that the prediction takes, and the memory after it."""
        return Q, memory

    def noise_added(self, memory: Any, W: Array) -> Any:
        """The memory after a prediction P' = F P F^T + W, with ``parts``."""
        return memory

    def enlarge(
        self, memory: Any, prior: Gaussian, y: Array | None, moments: Moments | None
    ) -> tuple[Gaussian, Any]:
        """The prior that the moments are made of, and the memory after it.

        Parameters
        ----------
        memory
        prior : Gaussian
            Predicted: mean (..., n), cov (..., n, n).
        y : array (..., m), optional
            The innovation, with ``looks``.
        moments : Moments, optional
            Those of the predicted prior, with ``looks``.

        Returns
        -------
        tuple of Gaussian, memory
        """
        return prior, memory

    def limit(self, P: Array) -> Array:
        """What ``enlarge`` makes of a first P, in the textbook's terms: see ``Filter``."""
        return P


def zeros(prior: Gaussian) -> Array:
    """A counter for every member of a prior."""
    xp = prior.mean.__array_namespace__()
    batch = np.broadcast_shapes(prior.mean.shape[:-1], prior.cov.shape[:-2])
    return xp.zeros(batch, dtype=xp.int64)


def innovation_spread(before: Array | None, y: Array, rho: Array) -> Array:
    """Estimated covariance of the innovations, with forgetting.

    S <- (rho S + y y^T) / (rho + 1),   S = y y^T at first

    Parameters
    ----------
    before : array (..., m, m), optional
        None, or NaN, where there is none yet.
    y : array (..., m)
    rho : float or array (...)

    Returns
    -------
    array (..., m, m)

    References
    ----------
    zhou1996; xiong2009, Eq. (27), is the same.
    """
    square = y[..., :, None] * y[..., None, :]
    if before is None:
        return square
    xp = y.__array_namespace__()
    rho = xp.asarray(rho)[..., None, None]
    return xp.where(xp.isnan(before), square, (rho * before + square) / (rho + 1))


def sensed(prior: Gaussian, moments: Moments) -> tuple[Array, Array]:
    """H and R with P_xz = P H^T and P_zz = H P H^T + R: the moments' own, or by regression.

    Parameters
    ----------
    prior : Gaussian
    moments : Moments

    Returns
    -------
    tuple of array (..., m, n), array (..., m, m)
        Of moments without an H, such as those of sigma points, H = P_xz^T P^-1, and R has what
        that line leaves over.
    """
    if moments.H is not None and moments.R is not None:
        return moments.H, moments.R
    H = right_divide(moments.P_xz.mT, prior.cov)
    return H, moments.P_zz - H @ moments.P_xz


def finite(A: Array) -> Array:
    """Members without a NaN or an infinity, of a stack of matrices."""
    xp = A.__array_namespace__()
    return xp.all(xp.isfinite(A), axis=(-2, -1))
