"""Systems are no models of a filter; the models that they offer check themselves."""

from typing import Any

from navfilters.estimators.continuous import ContinuousSystem
from navfilters.estimators.discrete import DiscreteSystem
from navfilters.estimators.model_parts import at
from navfilters.types import Gaussian


def refuse_systems(model: Any, dynamics: Any) -> None:
    """TypeError, saying what to give, for a system where a run takes a model."""
    for name, found in (("model", model), ("dynamics", dynamics)):
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
