"""Whatever a run is given as a filter, with init, predict, update and step."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from navfilters.estimators import model_parts
from navfilters.estimators.filter import Filter
from navfilters.estimators.prediction import predict_linearized
from navfilters.estimators.state import FilterState, first_state, keep_estimate, missed
from navfilters.estimators.update import absent
from navfilters.numerics import validation
from navfilters.types import Array, Gaussian


@dataclass(frozen=True)
class Memoryless:
    """A filter that is one function, with a linearised prediction.

    Parameters
    ----------
    function : callable
        (prior, z, model) -> Gaussian.
    """

    function: Callable[..., Gaussian]

    def init(self, prior: Gaussian) -> FilterState:
        """The state before any step."""
        return first_state(prior)

    def predict(self, state: FilterState, dynamics: Any, k: Array = 0) -> FilterState:
        """The state one transition later, linearised."""
        dynamics = model_parts.at(dynamics, k)
        Q = validation.given("dynamics.Q", dynamics.Q)
        return state._replace(estimate=predict_linearized(state.estimate, dynamics, Q))

    def update(self, state: FilterState, z: Array, sensor: Any, k: Array = 0) -> FilterState:
        """The state after a measurement; as it was where anything of z is NaN."""
        z, sensor = model_parts.seen(validation.given("z", z), sensor, k)
        gone, estimate = absent(z), self.function(state.estimate, z, sensor)
        if gone is not None:
            some = gone.__array_namespace__().any(gone, axis=-1)
            estimate = keep_estimate(some, state.estimate, estimate)
        return FilterState(estimate, missed(state, gone))

    step = Filter.step


def as_filter(estimator: Any) -> Any:
    """A filter's protocol for whatever a run is given.

    Parameters
    ----------
    estimator : Filter, partial of one, object with ``init`` and ``step``, or callable
        A callable is (prior, z, model) -> Gaussian.

    Returns
    -------
    object
        With ``init(prior) -> state`` and ``step(state, z, sensor, dynamics, k) -> state``, where
        ``state.estimate`` is a Gaussian.

    Raises
    ------
    TypeError
        Anything else.
    """
    if not isinstance(estimator, type):
        if hasattr(estimator, "init") and hasattr(estimator, "step"):
            return estimator
        if isinstance(estimator, partial) and isinstance(estimator.func, Filter):
            if estimator.args:
                raise TypeError(
                    "estimator must be a partial of a filter with options by name, as "
                    f"points=SigmaPoints(); found {estimator.args[0]!r} without one"
                )
            return estimator.func.having(**estimator.keywords)
        if callable(estimator):
            _takes_three(estimator)
            return Memoryless(estimator)
    raise TypeError(
        "estimator must be a filter such as FILTERS['EKF'], an object with init and step, or "
        f"callable as estimator(prior, z, model); found {estimator!r}"
    )


def _takes_three(function: Callable[..., Any]) -> None:
    """TypeError for a function that cannot be called as (prior, z, model)."""
    try:
        inspect.signature(function).bind(None, None, None)
    except TypeError as error:
        name = getattr(function, "__name__", repr(function))
        raise TypeError(
            f"estimator must be callable as estimator(prior, z, model); found {name}: {error}"
        ) from None
    except ValueError:  # a builtin, whose signature cannot be had
        return
