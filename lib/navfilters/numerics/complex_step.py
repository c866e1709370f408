"""Derivatives by complex step, and how they are compared with differences."""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters.numerics import validation

AGREEMENT = 1e-6
"""Largest relative difference from a difference quotient, beyond the quotient's own error."""


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
        real numbers although it depends on x (as after ``.real``, ``abs`` or ``norm``), or is not
        analytic: an element of the Jacobian differs from a central difference quotient.
    ValueError
        x is not a real array of at least one axis.

    Notes
    -----
    ``vecdot`` conjugates, ``abs`` and ``norm`` forget the phase: write sqrt(x @ x) for the norm.
    The quotient is a check with an error bound of its own, never the result. Where f has a kink, or
    its rounding drowns the quotient, there is nothing to compare with, and nothing is refused.
    """
    called = str(name or getattr(f, "__qualname__", repr(f)))
    x = _real_vector(x)
    J = _by_complex_step(f, x, step, called)
    _compare_with_differences(f, x, J, called)
    return J


def _real_vector(x: Any) -> np.ndarray:
    x = np.asarray(validation.plain("x", x))
    if x.dtype.kind not in "iuf" or x.ndim == 0:
        raise ValueError(f"x must be a real array (..., n); found {x.dtype}, shape {x.shape}")
    return x


def _by_complex_step(f: Callable[..., Any], x: np.ndarray, step: float, name: str) -> np.ndarray:
    """The Jacobian as it comes, without the comparison: what a filter calls at every step."""
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


def _depends(f: Callable[..., Any], x: np.ndarray, j: int) -> bool:
    """Whether f changes with component j: a function that ignores it may return real numbers."""
    moved = x.astype(float)
    moved[..., j] += 1e-3 * (1 + np.abs(x[..., j]))
    return not np.array_equal(f(moved), f(x), equal_nan=True)


def _compare_with_differences(
    f: Callable[..., Any], x: np.ndarray, J: np.ndarray, name: str, core: int | None = None
) -> None:
    """Refuse a Jacobian that central difference quotients contradict.

    An element is confirmed by one quotient that is sharp and agrees. It is refused if none
    confirms it, and two, of different lengths, agree with each other and not with it. The value of
    f has core trailing axes; by default those that x has not.
    """
    x = x.astype(float)
    batch = x.ndim - 1
    core = max(J.ndim - x.ndim, min(batch, 1)) if core is None else core
    beside = (..., *(None,) * core, slice(None))  # x's axes beside those of J
    size = np.where(x == 0, 1.0, np.abs(x))
    largest = np.broadcast_to(np.max(size, axis=-1, keepdims=True), x.shape)
    no_scale = np.where(x == 0, 1e-6, 1.0)
    confirmed, refused = (np.zeros(J.shape, bool) for _ in range(2))
    against, margin = np.full(J.shape, np.nan), np.zeros(J.shape)
    lengths = [r * size for r in (1e-3, 1e-2, 1e-4, 1e-5, 1e-7, 1e-9)]
    lengths[1:1] = [1e-3 * largest]
    lengths += [r * size * no_scale for r in (1e-6, 1e-9)]
    with np.errstate(all="ignore"):
        for length in lengths:
            h = 2.0 ** np.round(np.log2(length))  # x + h is then exact, or nearly so
            columns = [_quotient(f, x, h, j, core) for j in range(x.shape[-1])]
            found, error, smooth = (np.stack(p, axis=-1) for p in zip(*columns, strict=True))
            error = error + np.finfo(float).eps * (size / h)[beside] * np.abs(found)
            largest_of = np.maximum(np.abs(J), np.abs(found))
            change = largest_of * size[beside]
            matters = np.maximum(change, 1e-3 * np.max(change, axis=-1, keepdims=True))
            sharp = (error * size[beside] <= 10 * AGREEMENT * matters) | np.isnan(J)
            off = np.abs(J - found)
            agrees = ~(off > error + AGREEMENT * largest_of)
            confirmed = confirmed | (agrees & sharp)
            contradicts = ~agrees & smooth & (error <= 1e-2 * off)
            alike = np.abs(found - against) <= error + margin + 1e-2 * np.abs(found)
            refused = refused | (contradicts & alike)
            first = contradicts & np.isnan(against)
            against, margin = np.where(first, found, against), np.where(first, error, margin)
            if np.all(confirmed):
                return
    refused = refused & ~confirmed
    if refused.any():
        at = tuple(int(k) for k in np.argwhere(refused)[0])
        member, row, j = at[: refused.ndim - 1 - core], at[refused.ndim - 1 - core : -1], at[-1]
        component = f"component {', '.join(map(str, row))}" if row else "the value"
        where = f", in the member at index {member}" if member else ""
        raise TypeError(
            f"{name} must be analytic for its Jacobian by complex step: the derivative of "
            f"{component} in column {j}, with respect to element {j} of the argument, is "
            f"{np.broadcast_to(J, refused.shape)[at]:.6g} by complex step and {against[at]:.6g} by "
            f"differences{where}. abs, norm, vecdot, conj, .real and arrays of real numbers lose "
            "or turn imaginary parts: write sqrt(x @ x) for a norm, where(x.real < 0, -x, x) for "
            "abs; and differences of nearly equal terms lose digits. Give its Jacobian instead "
            "where that cannot be helped"
        )


def _quotient(
    f: Callable[..., Any], x: np.ndarray, h: np.ndarray, j: int, core: int
) -> tuple[np.ndarray, ...]:
    """df/dx_j by differences of sixth order, a bound on its error, and whether to believe both.

    The bound: a hundred times what the sixth order changes in the fourth, and the sixth difference,
    which is large at a kink and, where f is smooth, thirty times its rounding. They hold only where
    the points follow f: not if it turns, or has a spike, between them.
    """
    step = h[..., j]
    middle = np.asarray(f(x)).real

    def at(k: int) -> np.ndarray:
        moved = x.copy()
        moved[..., j] += k * step
        try:
            return np.asarray(f(moved)).real
        except (ValueError, ArithmeticError, IndexError):  # outside of where f is defined
            return np.full(middle.shape, np.nan)

    ahead, behind = [at(k) for k in (1, 2, 3)], [at(-k) for k in (1, 2, 3)]
    eps = np.finfo(middle.dtype if middle.dtype.kind == "f" else float).eps
    a, b, c = (p - q for p, q in zip(ahead, behind, strict=True))
    sums = [p + q for p, q in zip(ahead, behind, strict=True)]
    per_step = 1 / step[(..., *(None,) * core)]
    quotient = (45 * a - 9 * b + c) / 60 * per_step
    fourth = (8 * a - b) / 12 * per_step
    sixth = sums[2] - 6 * sums[1] + 15 * sums[0] - 20 * middle
    largest = np.max(np.abs(np.stack([middle, *ahead, *behind])), axis=0)
    rounding = 20 * eps * largest
    gap = np.abs(quotient - fourth)
    error = 100 * gap + (10 * np.abs(sixth) + rounding) * per_step
    smooth = (gap <= 1e-2 * np.abs(quotient) + rounding * per_step) & (
        np.abs(sixth) <= 1e-2 * (np.abs(a) + np.abs(b) + np.abs(c)) + 10 * rounding
    )
    return quotient, np.where(np.isfinite(error), error, np.inf), smooth
