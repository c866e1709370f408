"""Systems are no models of a filter; and derivatives that are made, compared with differences."""

from typing import Any

import numpy as np

from navfilters.estimators.continuous import ContinuousSystem
from navfilters.estimators.discrete import DiscreteSystem
from navfilters.estimators.model_parts import at, by_error
from navfilters.estimators.moments import unscented
from navfilters.estimators.variants import bump_predicted, expect_at_mean, unchanged
from navfilters.numerics.jacobians import ByComplexStep, around, examine
from navfilters.types import Gaussian


def refuse_systems(model: Any, dynamics: Any) -> None:
    """TypeError, saying what to give, for a system, or a class, where a run takes a model."""
    for name, found in (("model", model), ("dynamics", dynamics)):
        if isinstance(found, type):
            raise TypeError(
                f"{name} must be an object, made by calling its class, as {found.__name__}(); "
                f"found the class {found.__name__} itself"
            )
        if isinstance(found, DiscreteSystem):
            raise TypeError(
                f"{name} must be one of the system's two models: model=system.sensor and "
                "dynamics=system.dynamics(u); found the DiscreteSystem itself"
            )
        if isinstance(found, ContinuousSystem):
            raise TypeError(
                f"{name} must be a model in discrete time; found a ContinuousSystem: "
                "extended_kalman_bucy and linearized_kalman_bucy filter it"
            )


def derivatives(model: Any, motion: Any, estimate: Gaussian, steps: int) -> None:
    """Look once more, where a run ends, at derivatives that a model makes itself.

    Parameters
    ----------
    model : MeasurementModel
    motion : Dynamics or None
    estimate : Gaussian
        After the last step.
    steps : int

    Raises
    ------
    TypeError
        As of :func:`~navfilters.numerics.complex_step.complex_step`.
    """
    for part in (model, motion):
        if steps and hasattr(part, "examine"):
            at(part, steps - 1).examine([estimate.mean])


def compare_derivatives(estimator: Any, model: Any, motion: Any, prior: Gaussian) -> None:
    """Compare with differences, once, the Jacobians that a filter takes by complex step.

    Parameters
    ----------
    estimator : object
        Nothing is compared unless it has moments that need a Jacobian.
    model : MeasurementModel
    motion : Dynamics or None
    prior : Gaussian
        Where, and a deviation more and less.

    Raises
    ------
    TypeError
        As of :func:`~navfilters.numerics.complex_step.complex_step`; names model.h or dynamics.f.
    """
    if not _differentiates(estimator):
        return
    parts = [(at(model, 0), "h", "model.h", ("jacobian", "given"))]
    if motion is not None:
        parts.append((at(motion, 0), "f", "dynamics.f", ("transition", "propagate")))
    for part, name, called, known in parts:
        if any(hasattr(part, other) for other in known):
            continue
        function, x = by_error(part, getattr(part, name), prior.mean)
        with np.errstate(all="ignore"):
            for state in around(Gaussian(x, prior.cov)):
                examine(ByComplexStep(function, 0, called), [(state,)])


def _differentiates(estimator: Any) -> bool:
    """Whether a filter's moments, or its variant, need a Jacobian."""
    stages = [getattr(estimator, name, None) for name in ("moments", "variant")]
    moments, variant = (getattr(stage, "func", stage) for stage in stages)
    without = moments in (None, unscented)
    return not (without and variant in (None, unchanged, bump_predicted, expect_at_mean))
