"""Moments of a measurement whose noise depends on a state that is only predicted."""

from typing import Any

from navfilters.estimators.model_parts import jacobian
from navfilters.numerics.small_matrices import matmul
from navfilters.types import Gaussian, Moments


def expecting_noise(prior: Gaussian, model: Any) -> Moments:
    """As :func:`~navfilters.estimators.moments.linearized`, with R its expectation over the prior.

    Parameters
    ----------
    prior : Gaussian
        mean (..., n), cov (..., n, n).
    model : MeasurementModel
        With ``expected_noise(prior)``, such as
        :class:`~navfilters.models.converted.ConvertedRangeBearing`.

    Returns
    -------
    Moments

    Raises
    ------
    TypeError
        A model without it.

    References
    ----------
    bordonaro2014, for the noise at the prediction; zhao2004, for the best linear update.
    """
    if not hasattr(model, "expected_noise"):
        raise TypeError(f"model must have expected_noise(prior); found {type(model).__name__}")
    H, R = jacobian(model, prior.mean), model.expected_noise(prior)
    P_xz = matmul(prior.cov, H.mT)
    return Moments(model.h(prior.mean), R + matmul(H, P_xz), P_xz, H, R)
