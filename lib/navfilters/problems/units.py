"""The same problem with its state in other units."""

from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from navfilters.estimators import model_parts
from navfilters.numerics import validation
from navfilters.problems.problem import Draw, Problem
from navfilters.types import Array, Gaussian


def in_units(problem: Problem, unit: Array) -> Problem:
    """The same problem, its state counted in other units.

    Parameters
    ----------
    problem : Problem
        Whose state is a vector, and whose Q is of the state.
    unit : array-like (n,)
        The new unit of each component, in the old one: 1000 where metres become kilometres.

    Returns
    -------
    Problem
        Of which the error is in the new units too.

    Raises
    ------
    ValueError
        A state on a manifold; units that are not positive.
    """
    unit = validation.real_array("unit", unit, "n")
    if not (unit > 0).all():
        raise ValueError(f"unit must be positive; found {unit.min()}")
    if hasattr(problem.model, "retract"):
        raise ValueError("problem must have a vector for its state; found one on a manifold")
    return replace(
        problem,
        draw=partial(_draw, problem, unit),
        model=RescaledModel(problem.model, unit),
        dynamics=None if problem.dynamics is None else RescaledDynamics(problem.dynamics, unit),
    )


def _draw(problem: Problem, unit: Array, runs: int, seed: int) -> Draw:
    (mean, cov), truth, z = problem.drawn(runs, seed)
    return Draw(Gaussian(mean / unit, cov / np.outer(unit, unit)), truth / unit, z)


@dataclass(frozen=True, eq=False)
class RescaledModel:
    """A measurement model of a state in other units.

    Parameters
    ----------
    model : MeasurementModel
    unit : array (n,)
    """

    model: Any
    unit: Array = field(metadata={"axes": 1})

    @property
    def R(self) -> Array:
        """The model's own."""
        return self.model.R

    def at(self, k: Array) -> "RescaledModel":
        """The model of step k."""
        return RescaledModel(model_parts.at(self.model, k), self.unit)

    def noise(self, x: Array) -> Array:
        """R at the state x, (..., m, m)."""
        return model_parts.noise(self.model, x * self.unit)

    def h(self, x: Array) -> Array:
        """The expected measurement, (..., m)."""
        return self.model.h(x * self.unit)

    def residual(self, z: Array, z_hat: Array) -> Array:
        """The model's own, (..., m)."""
        return model_parts.residual(self.model, z, z_hat)

    def jacobian(self, x: Array) -> Array:
        """By the new units, (..., m, n)."""
        return model_parts.jacobian(self.model, x * self.unit) * self.unit

    def hessian(self, x: Array) -> Array:
        """By the new units, (..., m, n, n)."""
        second = model_parts.hessian(self.model, x * self.unit)
        return second * self.unit[:, None] * self.unit


@dataclass(frozen=True, eq=False)
class RescaledDynamics:
    """Dynamics of a state in other units.

    Parameters
    ----------
    dynamics : Dynamics
    unit : array (n,)
    """

    dynamics: Any
    unit: Array = field(metadata={"axes": 1})

    @property
    def Q(self) -> Array:
        """In the new units, (..., n, n)."""
        return self.dynamics.Q / (self.unit[:, None] * self.unit)

    def at(self, k: Array) -> "RescaledDynamics":
        """The motion of step k."""
        return RescaledDynamics(model_parts.at(self.dynamics, k), self.unit)

    def f(self, x: Array) -> Array:
        """The next state, (..., n)."""
        return model_parts.moved(self.dynamics, x * self.unit) / self.unit

    def propagate(self, x: Array, Q: Array) -> tuple[Array, Array, Array]:
        """f(x), F and what Q amounts to, in the new units."""
        squares = self.unit[:, None] * self.unit
        here = Gaussian(
            x * self.unit, np.broadcast_to(np.eye(x.shape[-1]), (*x.shape, x.shape[-1]))
        )
        f, F, W = model_parts.transition(self.dynamics, here, Q * squares)
        return f / self.unit, F * self.unit / self.unit[:, None], W / squares
