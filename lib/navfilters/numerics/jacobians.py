"""Jacobians of a model's functions: given, or by complex step and examined when first needed."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.complex_step import (
    _by_complex_step,
    _compare_with_differences,
    _real_vector,
)
from navfilters.numerics.state_derivatives import first_derivative
from navfilters.types import Array, Gaussian


@dataclass(eq=False)
class ByComplexStep:
    """The Jacobian of a function of several arguments in one of them.

    Called with the function's arguments it returns (..., m, n). The first call, and every
    :meth:`examine`, compares it with differences; later calls do not. Of a JAX array it is computed
    in forward mode.

    Parameters
    ----------
    function : callable
        Of several arguments; returns (..., m).
    position : int
        Which of them, from 0; an array (..., n).
    name : str
        What to call function in an error.
    """

    function: Callable[..., Any]
    position: int
    name: str
    examined: bool = False

    def __call__(self, *arguments: Any) -> Array:
        x = arguments[self.position]
        if hasattr(x, "__array_namespace__") and not isinstance(x, np.ndarray):
            before, after = arguments[: self.position], arguments[self.position + 1 :]
            return first_derivative(lambda z: self.function(*before, z, *after), x, self.name)
        if not self.examined:
            return self.examine(*arguments)
        f, x = self._of_one(arguments)
        return _by_complex_step(f, x, 1e-30, self.name)

    def examine(self, *arguments: Any) -> np.ndarray:
        """The Jacobian, compared with differences; a TypeError as of ``complex_step``.

        Parameters
        ----------
        *arguments
            Of the function.

        Returns
        -------
        ndarray (..., m, n)
        """
        f, x = self._of_one(arguments)
        J = _by_complex_step(f, x, 1e-30, self.name)
        _compare_with_differences(f, x, J, self.name, core=1)
        self.examined = True
        return J

    def _of_one(self, arguments: tuple[Any, ...]) -> tuple[Callable[..., Any], np.ndarray]:
        before, after = arguments[: self.position], arguments[self.position + 1 :]
        x = _real_vector(arguments[self.position])
        return (lambda z: self.function(*before, z, *after)), x


def jacobian(
    function: Callable[..., Any], position: int, given: Callable[..., Any] | None, *, name: str
) -> Callable[..., np.ndarray]:
    """The Jacobian that was given, or that of function in one of its arguments by complex step.

    Parameters
    ----------
    function : callable
        Of several arguments; returns (..., m).
    position : int
        Which of them, from 0; an array (..., n).
    given : callable, optional
        Of the same arguments; returns (..., m, n).
    name : str
        What to call function in an error.

    Returns
    -------
    callable
        Of the same arguments; returns (..., m, n). By complex step it is compared with differences
        when first called, and whenever :func:`examine` asks.
    """
    return ByComplexStep(function, position, name) if given is None else given


def examine(derivative: Callable[..., Any], points: list[tuple[Any, ...]]) -> None:
    """Compare a Jacobian by complex step with differences; one that was given is left alone.

    Parameters
    ----------
    derivative : callable
        What :func:`jacobian` returned.
    points : list of tuple
        Arguments to call it with. Where the function is not defined nothing is compared.

    Raises
    ------
    TypeError
        As of :func:`~navfilters.numerics.complex_step.complex_step`.
    """
    if not isinstance(derivative, ByComplexStep):
        return
    for arguments in points:
        with suppress(ValueError, ArithmeticError, IndexError):
            derivative.examine(*arguments)


def around(estimate: Gaussian) -> list[np.ndarray]:
    """Where to look at a Jacobian: the mean, and all its elements a deviation more, and less.

    At the mean alone much is hidden: x abs(x) has the derivative 0 at 0, by any method.

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n).

    Returns
    -------
    list of ndarray (..., n)
    """
    deviation = np.sqrt(np.diagonal(estimate.cov, axis1=-2, axis2=-1))
    return [estimate.mean, estimate.mean + deviation, estimate.mean - deviation]


def check_model(model: Any, functions: tuple[str, ...], derivatives: tuple[str, ...]) -> None:
    """Check a frozen system f, h, Q, R when it is made, and make Q and R arrays.

    Parameters
    ----------
    model : dataclass instance
        With two covariances Q and R.
    functions, derivatives : tuple of str
        Attributes that must be callable; those that may be None.

    Raises
    ------
    TypeError
        A function that cannot be called.
    ValueError
        Q or R is not a single positive semidefinite matrix.
    """
    for name in functions + derivatives:
        value = getattr(model, name)
        if not callable(value) and (value is not None or name in functions):
            raise TypeError(f"{name} must be callable; found {value!r}")
    for name in ("Q", "R"):
        value = validation.covariance(name, getattr(model, name), definite=False)
        if value.ndim != 2:
            raise ValueError(f"{name} must have shape (n, n); found {value.shape}")
        object.__setattr__(model, name, value)
