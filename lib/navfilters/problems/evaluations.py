"""What a filter costs: at how many states it evaluates its models in one step."""

from typing import Any

import numpy as np

from navfilters.estimators import model_parts
from navfilters.estimators.any_filter import as_filter
from navfilters.problems.problem import Problem
from navfilters.types import Gaussian

FUNCTIONS = ("h", "jacobian", "hessian", "f", "transition", "propagate")


def evaluations(problem: Problem, estimator: Any, step: int = 2) -> int:
    """States at which one member's models are evaluated in one step.

    Parameters
    ----------
    problem : Problem
    estimator : Filter
    step : int
        Which, from 0.

    Returns
    -------
    int
        Of h, f and their derivatives, each counted once; a matrix made by complex step counts the
        states that it takes.
    """
    draw, estimator, count = problem.drawn(1), as_filter(estimator), Count()
    state = estimator.init(Gaussian(draw.prior.mean[0], draw.prior.cov))
    model, dynamics = Counted(problem.model, count), None
    if problem.dynamics is not None:
        dynamics = Counted(problem.dynamics, count)
    for k in range(step + 1):
        count.states = 0
        state = estimator.step(state, draw.z[k, 0], model, dynamics, k)
    return count.states


class Count:
    """How many states so far."""

    states = 0


class Counted:
    """A model that counts the states it is evaluated at."""

    def __init__(self, model: Any, count: Count) -> None:
        self._model, self._count = model, count

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._model, name)
        if name == "at":
            return lambda k: Counted(model_parts.at(self._model, k), self._count)
        if name == "given":
            return self._given
        if name in FUNCTIONS:
            return lambda x, *rest: self._counting(value, x, *rest)
        return value

    def _given(self, z: Any) -> Any:
        z, model = self._model.given(z)
        return z, Counted(model, self._count)

    def _counting(self, function: Any, x: Any, *rest: Any) -> Any:
        self._count.states += int(np.prod(np.shape(x)[:-1]))
        return function(x, *rest)
