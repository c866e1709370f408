"""What a filter asks of a model, and what it takes where the model does not say."""

from collections.abc import Callable
from typing import Any

from navfilters.numerics import validation
from navfilters.numerics.state_derivatives import first_derivative, second_derivative
from navfilters.types import Array, Dynamics, Gaussian, MeasurementModel


def at(model: Any, k: int) -> Any:
    """The model of step k: itself, unless it has ``at``."""
    return model.at(k) if hasattr(model, "at") else model


def seen(z: Array, sensor: MeasurementModel, k: Array) -> tuple[Array, MeasurementModel]:
    """What is compared with the sensor of step k, and that sensor."""
    sensor = at(sensor, k)
    return sensor.given(z) if hasattr(sensor, "given") else (z, sensor)


def noise(model: MeasurementModel, x: Array | None = None) -> Array:
    """A model's R, if it is one: a vector or a number would be added to every row.

    Parameters
    ----------
    model : MeasurementModel
    x : array (..., n), optional
        Where, for a model with ``noise``.

    Returns
    -------
    array (..., m, m)

    Raises
    ------
    ValueError
        Another shape, no real numbers, masked entries or a unit.
    """
    if x is not None and hasattr(model, "noise"):
        R = validation.given("model.noise", model.noise(x))
    else:
        R = validation.given("model.R", model.R)
    if R.ndim > 1 and R.shape[-1] == R.shape[-2]:
        return R
    return validation.core("model.R", R, R.shape[-1:] * 2 or (1, 1))


def jacobian(model: MeasurementModel, x: Array) -> Array:
    """H = dh/dx, (..., m, n): the model's own, or by complex step."""
    if hasattr(model, "jacobian"):
        return model.jacobian(x)
    return first_derivative(*by_error(model, model.h, x), "model.h")


def hessian(model: MeasurementModel, x: Array) -> Array:
    """Second derivatives of h, (..., m, n, n): the model's own, or by complex step."""
    if hasattr(model, "hessian"):
        return model.hessian(x)
    if hasattr(model, "jacobian"):
        return first_derivative(*by_error(model, model.jacobian, x), "model.jacobian")
    return second_derivative(*by_error(model, model.h, x), "model.h")


def by_error(
    model: Any, function: Callable[..., Array], x: Array
) -> tuple[Callable[..., Array], Array]:
    """A function of the state as one of its error, and where that is none."""
    if not hasattr(model, "retract"):
        return function, x
    return lambda dx: function(model.retract(x, dx)), model.difference(x, x)


def residual(model: Any, z: Array, z_hat: Array) -> Array:
    """z minus z_hat, in the model's way."""
    if hasattr(model, "residual"):
        return model.residual(z, z_hat)
    return z - z_hat


def retract(model: Any, x: Array, dx: Array) -> Array:
    """The state that is dx away from x."""
    return model.retract(x, dx) if hasattr(model, "retract") else x + dx


def difference(model: Any, x: Array, y: Array) -> Array:
    """How far x is from y: dx with retract(y, dx) = x."""
    return model.difference(x, y) if hasattr(model, "difference") else x - y


def moved(dynamics: Any, x: Array) -> Array:
    """f(x), without its Jacobian where that costs extra."""
    if hasattr(dynamics, "f"):
        return dynamics.f(x)
    if hasattr(dynamics, "transition"):
        return dynamics.transition(x)[0]
    return dynamics.propagate(x, dynamics.Q)[0]


def transition(dynamics: Dynamics, estimate: Gaussian, Q: Array) -> tuple[Array, Array, Array]:
    """f(x), F and what Q amounts to at the end, of arrays with the axes that they must have.

    Parameters
    ----------
    dynamics : Dynamics
    estimate : Gaussian
    Q : array (..., w, w)

    Returns
    -------
    tuple of array (..., n), array (..., n, n), array (..., n, n)

    Raises
    ------
    ValueError
        Other shapes.
    """
    x, square = estimate.mean, estimate.cov.shape[-2:]
    if hasattr(dynamics, "propagate"):
        f, F, W = dynamics.propagate(x, Q)
        name = "dynamics.propagate"
    elif hasattr(dynamics, "transition"):
        (f, F), W, name = dynamics.transition(x), Q, "dynamics.transition"
    else:
        f, F, W = (
            dynamics.f(x),
            first_derivative(*by_error(dynamics, dynamics.f, x), "dynamics.f"),
            Q,
        )
        name = "dynamics.f"
    validation.core(f"f(x) of {name}", f, x.shape[-1:])
    validation.core(f"F of {name}", F, square)
    return f, F, validation.core("dynamics.Q", W, square)
