"""Whether functions without given derivatives have them by complex step: once, before a run."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from navfilters.estimators.model_parts import at
from navfilters.numerics.state_derivatives import EXAMINED
from navfilters.runs.model_checks import first_member, measured_size
from navfilters.types import Gaussian


def derivatives(estimator: Any, prior: Gaussian, model: Any, motion: Any) -> None:
    """Compare what one step of a filter derives by complex step with differences.

    Parameters
    ----------
    estimator : object
        With ``init`` and ``step``.
    prior : Gaussian
    model : MeasurementModel
    motion : Dynamics or None

    Raises
    ------
    TypeError
        A function that is not analytic, whose derivative the filter needs and the model lacks.
    """
    first = at(model, 0)
    given = all(hasattr(first, name) for name in ("jacobian", "hessian"))
    moved = motion is None or hasattr(at(motion, 0), "hessian")
    if (given and moved) or hasattr(first, "given") or not prior.mean.size:
        return
    cov = prior.cov[(0,) * (prior.cov.ndim - 2)]
    nothing = np.full(measured_size(first, prior), np.nan)
    with np.errstate(all="ignore"), examined():
        state = estimator.init(Gaussian(first_member(prior.mean), cov))
        estimator.step(state, nothing, model, motion, 0)


@contextmanager
def examined() -> Iterator[None]:
    """Where derivatives by complex step are compared with differences."""
    token = EXAMINED.set(True)
    try:
        yield
    finally:
        EXAMINED.reset(token)
