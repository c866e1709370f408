"""Many updates in a row: one history of every member, on the host."""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.allocator import keep_freed_memory
from navfilters.numerics.small_matrices import is_positive_definite
from navfilters.runs import model_checks
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
        A wrong shape, a value that is not finite, a covariance that is not one, masked entries, a
        model's function that mixes the members of a batch; before any update.
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
    steps = validation.whole_number("steps", steps, 0)
    z_varies = validation.flag("z_varies", z_varies)
    prior = validation.gaussian("prior", prior)
    z, batch = model_checks.measurements(z, prior, model, steps, z_varies)
    model_checks.sensor(model, prior.mean)
    keep_freed_memory()
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
    cov = np.asarray(validation.plain("cov", cov))
    if cov.ndim < 3 or cov.shape[-1] != cov.shape[-2]:
        raise ValueError(f"cov must have shape (steps + 1, ..., n, n); found {cov.shape}")
    with np.errstate(all="ignore"):
        lost = ~np.asarray(is_positive_definite(cov))
    return np.where(lost.any(axis=0), lost.argmax(axis=0), -1)
