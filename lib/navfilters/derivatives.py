"""Jacobians of functions for which none was given, exact to rounding."""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters import validation


def complex_step(
    f: Callable[[Any], Any], x: Any, *, step: float = 1e-30, name: str | None = None
) -> np.ndarray:
    """Jacobian of an analytic function, by a step into the imaginary direction.

    df_i/dx_j = Im f_i(x + i step e_j) / step

    Parameters
    ----------
    f : callable
        (..., n) -> (..., m), written with NumPy operations that are analytic in x.
    x : array-like (..., n)
        Where; real.
    step : float
        No difference is taken, so nothing cancels, and the error falls with step^2: any step below
        the square root of the machine precision gives the derivative to rounding.
    name : str, optional
        What to call f in an error; by default its own name.

    Returns
    -------
    ndarray (..., m, n)
        In units of f per unit of x.

    Raises
    ------
    TypeError
        f does not take complex numbers (``arctan2`` and ``hypot`` do not), or returns
        real numbers although it depends on x (as after ``.real``, ``abs`` or ``norm``).
    ValueError
        x is not a real array of at least one axis.

    Notes
    -----
    A sum in which only one term lost its imaginary part cannot be told from a right one: write
    sqrt(x @ x) for the norm, and compare a new f once with differences.
    """
    name = name or getattr(f, "__qualname__", repr(f))
    x = np.asarray(validation.plain("x", x))
    if x.dtype.kind not in "iuf" or x.ndim == 0:
        raise ValueError(f"x must be a real array (..., n); found {x.dtype}, shape {x.shape}")
    columns = []
    for j in range(x.shape[-1]):
        z = x.astype(complex)
        z[..., j] += 1j * step
        try:
            value = np.asarray(validation.plain(f"the value of {name}", f(z)))
        except (TypeError, np.exceptions.ComplexWarning) as error:
            raise TypeError(
                f"{name} must accept complex numbers for its Jacobian by complex step; found "
                f"{type(error).__name__}: {error}. Give its Jacobian instead"
            ) from error
        if not np.iscomplexobj(value) and _depends(f, x, j):
            raise TypeError(
                f"{name} must return complex numbers where it is given some, for its Jacobian by "
                f"complex step; found {value.dtype}. Give its Jacobian instead"
            )
        columns.append(value.imag / step)
    return np.stack(columns, axis=-1)


def _depends(f: Callable, x: np.ndarray, j: int) -> bool:
    """Whether f changes with component j: a function that ignores it may return real numbers."""
    moved = x.astype(float)
    moved[..., j] += 1e-3 * (1 + np.abs(x[..., j]))
    return not np.array_equal(f(moved), f(x), equal_nan=True)


def jacobian(
    function: Callable, position: int, given: Callable | None, *, name: str
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
        Of the same arguments; returns (..., m, n).
    """
    if given is not None:
        return given

    def by_complex_step(*arguments):
        before, after = arguments[:position], arguments[position + 1 :]
        return complex_step(lambda z: function(*before, z, *after), arguments[position], name=name)

    return by_complex_step


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
