"""Many updates in a row: one history of every member, on the host."""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters import linalg, validation
from navfilters.types import Array, Gaussian, MeasurementModel


def run(
    estimator: Callable[..., Gaussian],
    prior: Gaussian,
    z: Any,
    model: MeasurementModel,
    steps: int = 1000,
    *,
    z_varies: bool = False,
) -> Gaussian:
    """Repeat an update and keep every state.

    Parameters
    ----------
    estimator : callable
        (prior, z, model) -> Gaussian: a member of ``FILTERS``, or a
        ``functools.partial`` of one with its options.
    prior : Gaussian
        mean (..., n), cov (..., n, n). Leading axes are batch axes and broadcast with those of z,
        of the model and of the options.
    z : array (..., m), or (steps, ..., m) with z_varies
        The measurement: the same at every step, or one for each.
    model : MeasurementModel
        Gives h, its derivatives and R.
    steps : int
        How many updates.
    z_varies : bool
        Whether the first axis of z is the step.

    Returns
    -------
    Gaussian
        mean (steps + 1, ..., n) and cov (steps + 1, ..., n, n), the prior first. A member that
        cannot go on is NaN from there; the others do not notice.

    Raises
    ------
    ValueError
        A wrong shape, a value that is not finite, a covariance that is not one; before any update.
    TypeError
        An estimator that cannot be called.

    Examples
    --------
    >>> import numpy as np
    >>> from navfilters import FILTERS, Gaussian, run
    >>> from navfilters.models import RangeBearing
    >>> model = RangeBearing(np.diag([2.5e-5, 6e-3]))
    >>> prior = Gaussian(np.array([20.0, 80.0]), 1e4 * np.eye(2))
    >>> history = run(FILTERS["EKF"], prior, model.h(np.array([100.0, 100.0])), model, steps=2)
    >>> history.mean.round(2).tolist()
    [[20.0, 80.0], [77.36, 126.43], [55.32, 131.94]]
    """
    if not callable(estimator):
        raise TypeError(
            "estimator must be callable as estimator(prior, z, model), such as FILTERS['EKF']; "
            f"found {estimator!r}"
        )
    if isinstance(steps, bool) or not isinstance(steps, int | np.integer) or steps < 0:
        raise ValueError(f"steps must be an integer of at least 0; found {steps!r}")
    prior = validation.gaussian("prior", prior)
    z, batch = _measurements(z, prior, model, int(steps), z_varies)
    state, states = prior, [prior]
    with np.errstate(all="ignore"):  # a member that fails is NaN in the result: that is its report
        for k in range(steps):
            state = estimator(state, z[k] if z_varies else z, model)
            states.append(state)
    n = prior.mean.shape[-1]
    batch = np.broadcast_shapes(batch, state.mean.shape[:-1], state.cov.shape[:-2])
    return Gaussian(
        np.stack([np.broadcast_to(s.mean, (*batch, n)) for s in states]),
        np.stack([np.broadcast_to(s.cov, (*batch, n, n)) for s in states]),
    )


def _measurements(z, prior, model, steps, z_varies) -> tuple[np.ndarray, tuple[int, ...]]:
    """z as an array that fits the prior, the model and the number of steps; and the batch axes."""
    axes = "steps, ..., m" if z_varies else "..., m"
    z = validation.real_array("z", z, "m")
    if z_varies and (z.ndim < 2 or z.shape[0] != steps):
        raise ValueError(f"z must have shape ({axes}) with {steps} steps; found {z.shape}")
    m = np.shape(model.R)[-1]
    if z.shape[-1] != m:
        raise ValueError(f"z must have shape ({axes}) with m = {m} as in model.R; found {z.shape}")
    n = prior.mean.shape[-1]
    with np.errstate(all="ignore"):
        try:
            H = model.jacobian(prior.mean)
        except (ValueError, IndexError) as error:
            raise ValueError(
                f"prior.mean must be a state of the model; found shape {prior.mean.shape} ({error})"
            ) from None
    if H.shape[-1] != n:
        raise ValueError(
            f"prior.mean must have shape (..., {H.shape[-1]}) for this model; found "
            f"{prior.mean.shape}"
        )
    batch = validation.batch(
        **{
            "prior.mean": prior.mean.shape[:-1],
            "prior.cov": prior.cov.shape[:-2],
            "z": z.shape[1:-1] if z_varies else z.shape[:-1],
            "model.R": np.shape(model.R)[:-2],
            "model.jacobian": H.shape[:-2],
        }
    )
    return z, batch


def first_indefinite(cov: Array) -> np.ndarray:
    """For each member, the first step whose covariance is not positive definite.

    Parameters
    ----------
    cov : array (steps + 1, ..., n, n)
        A history of covariances, such as ``run(...).cov``.

    Returns
    -------
    int array (...)
        The step, counted from 0 for the prior; -1 where every covariance has a Cholesky factor. A
        covariance that is NaN has none.

    Raises
    ------
    ValueError
        Fewer than three axes, or matrices that are not square.
    """
    cov = np.asarray(cov)
    if cov.ndim < 3 or cov.shape[-1] != cov.shape[-2]:
        raise ValueError(f"cov must have shape (steps + 1, ..., n, n); found {cov.shape}")
    with np.errstate(all="ignore"):
        lost = ~np.asarray(linalg.is_positive_definite(cov))
    return np.where(lost.any(axis=0), lost.argmax(axis=0), -1)
