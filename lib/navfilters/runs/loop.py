"""Many steps in a row: one history of every member, on the host."""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters._moved import refuse_old_keywords
from navfilters.estimators.any_filter import as_filter
from navfilters.estimators.filter import Filter
from navfilters.numerics import validation
from navfilters.numerics.allocator import keep_freed_memory
from navfilters.numerics.small_matrices import is_positive_definite
from navfilters.runs import model_checks, records
from navfilters.runs.system_checks import compare_derivatives, derivatives
from navfilters.types import Array, Gaussian


def run(
    estimator: Any,
    prior: Gaussian,
    z: Any,
    model: Any,
    steps: int | None = None,
    *,
    dynamics: Any = None,
    z_per_step: bool = False,
    record: Callable[[Any], Any] = records.estimate,
    **old: Any,
) -> Any:
    """Repeat a step and keep what it leads to.

    Parameters
    ----------
    estimator : Filter, or whatever :func:`~navfilters.estimators.any_filter.as_filter` takes
        A member of ``FILTERS``, a ``functools.partial`` of one with its options, a function
        (prior, z, model) -> Gaussian, or an object with ``init`` and ``step``.
    prior : Gaussian
        mean (..., n), cov (..., n, n). Leading axes are batch axes and broadcast with those of z,
        of the models and of the options.
    z : array (..., m), (steps, ..., m) with z_per_step, or callable
        The measurement: the same at every step, or one for each; NaN where it was not measured. A
        function (k, predicted state) -> (..., m) measures when it is asked.
    model : MeasurementModel
        Gives h and R, and its derivatives where it has them.
    steps : int, optional
        By default as many as z has with z_per_step, otherwise 1000.
    dynamics : Dynamics, optional
        Each step begins with a prediction. By default there is none.
    z_per_step : bool
        Whether the first axis of z is the step.
    record : callable
        What to keep of a state: an array, or a tuple of arrays; by default its ``estimate``.

    Returns
    -------
    Gaussian
        mean (steps + 1, ..., n) and cov (steps + 1, ..., n, n), the prior first; or as ``record``
        returns it, with the steps in front. A member that cannot go on is NaN from there; the
        others do not notice.

    Raises
    ------
    ValueError
        A wrong shape, a value that is infinite, a covariance that is not one, masked entries, a
        model's function that mixes the members of a batch; before any update.
    TypeError
        An estimator that is none.

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
    refuse_old_keywords("run", old)
    estimator = as_filter(estimator)
    z_per_step = validation.flag("z_per_step", z_per_step)
    steps = model_checks.number_of_steps(steps, z, z_per_step)
    prior = model_checks.start("prior", prior, model, dynamics)
    batch: tuple[int, ...] = prior.mean.shape[:-1]
    if not callable(z):
        z, batch = model_checks.measurements(z, prior, model, steps, z_per_step)
    elif not hasattr(estimator, "predict"):
        raise TypeError(
            "estimator must have predict and update where z is a function of the predicted state; "
            f"found {type(estimator).__name__}"
        )
    model_checks.models(model, dynamics, prior, steps)
    if steps and isinstance(estimator, Filter):
        model_checks.measures(model)
        compare_derivatives(estimator, model, dynamics, prior)
    if record is not records.estimate and not callable(record):
        raise TypeError(f"record must be callable as record(state); found {record!r}")
    keep_freed_memory()
    with np.errstate(all="ignore"):  # a member that fails is NaN in the result: that is its report
        state = estimator.init(prior)
        kept = records.put(None, record(state), 0, steps + 1)
        for k in range(steps):
            if callable(z):
                if dynamics is not None:
                    state = estimator.predict(state, dynamics, k)
                state = estimator.update(state, z(k, state), model, k)
            else:
                state = estimator.step(state, z[k] if z_per_step else z, model, dynamics, k)
            kept = records.put(kept, record(state), k + 1, steps + 1)
        derivatives(model, dynamics, state.estimate, steps)
    if record is records.estimate:
        batch = np.broadcast_shapes(batch, kept.mean.shape[1:-1], kept.cov.shape[1:-2])
        return Gaussian(*map(_whole, kept, (batch, batch), (1, 2)))
    return kept


def _whole(series: np.ndarray, batch: tuple[int, ...], core: int) -> np.ndarray:
    """A series with all the batch axes."""
    missing = len(batch) + core + 1 - series.ndim
    series = series.reshape(len(series), *(1,) * missing, *series.shape[1:])
    whole = (len(series), *batch, *series.shape[series.ndim - core :])
    return series if series.shape == whole else np.broadcast_to(series, whole).copy()


def first_indefinite(cov: Array) -> np.ndarray:
    """For each member, the first step whose covariance is not positive definite.

    Parameters
    ----------
    cov : array (steps + 1, ..., n, n), or bool array (steps + 1, ...)
        A history of covariances, such as ``run(...).cov``; or of ``records.definite``.

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
    if cov.dtype.kind == "b" and cov.ndim:
        lost = ~cov
    else:
        if cov.ndim < 3 or cov.shape[-1] != cov.shape[-2]:
            raise ValueError(f"cov must have shape (steps + 1, ..., n, n); found {cov.shape}")
        with np.errstate(all="ignore"):
            lost = ~np.asarray(is_positive_definite(cov))
    return np.where(lost.any(axis=0), lost.argmax(axis=0), -1)
