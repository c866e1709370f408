"""Formulas of small matrices for one member: the same operations, on Python's floats.

To call NumPy takes longer than to multiply two by two. So a formula is followed once with symbols
in the place of numbers, and what it does to them, each sum in its order, becomes a function of
floats. There is one source, and a member has the bits alone that it has among others.
"""

from collections.abc import Callable
from functools import wraps
from math import prod
from typing import Any, TypeVar

import numpy as np

from navfilters.types import Array

T = TypeVar("T", bound=Callable[..., Any])
Shape = tuple[int, ...]

SMALL = 2
"""Greatest length of an axis of what is computed in floats; above, NumPy is as fast."""

POINTS = 2 * SMALL + 1
"""The same of the axis of sigma points."""

DOUBLE = np.dtype(float)


def in_floats(formula: T, *, longest: int = SMALL) -> T:
    """A formula that is computed in floats where it is given small arrays of doubles.

    Parameters
    ----------
    formula : callable
        Of arrays, to an array or a tuple of arrays with an axis or two, by sums, differences,
        products, quotients, ``hypot``, ``atan2`` and ``ceil``, under any array namespace. What it
        does may depend on the shapes, not on the numbers.
    longest : int
        Greatest length of a first axis of two: ``POINTS`` where it is that of sigma points, over
        which no product is left to BLAS.

    Returns
    -------
    callable
        The same, to the last bit.

    Notes
    -----
    A quotient by zero, which floats refuse, is left to the formula itself.
    """
    ndarray, most = np.ndarray, longest * SMALL * SMALL
    plans: dict[tuple[Shape, ...], Callable[..., Any]] = {}

    @wraps(formula)
    def chosen(*arrays: Array) -> Any:
        if arrays[0].size > most:  # at once where it is not for floats
            return formula(*arrays)
        for A in arrays:
            if type(A) is not ndarray or A.dtype is not DOUBLE:
                return formula(*arrays)
        shapes = tuple([A.shape for A in arrays])
        plan = plans.get(shapes)
        if plan is None:
            if not all(_small(shape, longest) for shape in shapes):
                return formula(*arrays)
            plan = plans[shapes] = _plan(formula, shapes)
        try:
            return plan(*arrays)
        except ZeroDivisionError:
            return formula(*arrays)

    return chosen  # type: ignore[return-value]


def _small(shape: Shape, longest: int) -> bool:
    """Of a vector, a matrix or a point's; also of a member or two with an axis for members."""
    limits = (SMALL,) if len(shape) == 1 else (longest, SMALL, SMALL)
    return 0 < len(shape) <= 3 and all(
        0 < size <= limit for size, limit in zip(shape, limits, strict=False)
    )


def _plan(formula: Callable[..., Any], shapes: tuple[Shape, ...]) -> Callable[..., Any]:
    """What a formula does to arrays of these shapes, as a function of them in plain Python."""
    lines: list[str] = []
    symbols = []
    for k, shape in enumerate(shapes):
        names = [Symbol(f"x{k}_{i}", lines) for i in range(prod(shape))]
        symbols.append(np.array(names, object).reshape(shape))
        lines.append(f"{_listed(symbols[-1])} = A{k}.tolist()")
    found = formula(*symbols)
    several = found if type(found) is tuple else (found,)
    lines.append(f"return {', '.join(map(_made, several))}")
    given = ", ".join(f"A{k}" for k in range(len(shapes)))
    made: dict[str, Any] = {
        "array": np.array,
        "hypot": np.hypot,
        "atan2": np.atan2,
        "ceil": np.ceil,
    }
    exec("\n    ".join([f"def plan({given}):", *lines]), made)
    return made["plan"]


def _made(A: Array) -> str:
    """An array as source."""
    flat = f"array({_listed(A.reshape(-1))})"
    return flat if A.ndim == 1 else f"{flat}.reshape{A.shape}"


def _listed(A: Array) -> str:
    """Its elements as source, in lists of lists."""
    return f"[{', '.join(map(_listed, A))}]" if np.ndim(A) else _text(A)


def _text(number: Any) -> str:
    number = number.item() if isinstance(number, np.ndarray) else number
    return number.name if isinstance(number, Symbol) else repr(float(number))


def _infix(form: str) -> Callable[["Symbol", Any], "Symbol"]:
    """An operation of two numbers, whose first is a symbol."""

    def operation(self: "Symbol", other: Any) -> "Symbol":
        if isinstance(other, np.ndarray):
            return NotImplemented  # to each of its elements
        return self._new(form.format(self.name, _text(other)))

    return operation


class Symbol:
    """A number that is not known yet: what is done to it is written down.

    Parameters
    ----------
    name : str
    lines : list of str
        The assignments so far, to which each operation adds one.
    """

    __slots__ = ("lines", "name")
    ndim = 0

    def __init__(self, name: str, lines: list[str]) -> None:
        self.name, self.lines = name, lines

    def __array_namespace__(self) -> Any:
        return np

    def __getitem__(self, index: Any) -> Array:
        return np.array(self, object)[index]

    def _new(self, expression: str) -> "Symbol":
        self.lines.append(f"t{len(self.lines)} = {expression}")
        return Symbol(f"t{len(self.lines) - 1}", self.lines)

    __add__, __radd__ = _infix("{0} + {1}"), _infix("{1} + {0}")
    __sub__, __rsub__ = _infix("{0} - {1}"), _infix("{1} - {0}")
    __mul__, __rmul__ = _infix("{0} * {1}"), _infix("{1} * {0}")
    __truediv__, __rtruediv__ = _infix("{0} / {1}"), _infix("{1} / {0}")

    def __neg__(self) -> "Symbol":
        return self._new(f"-{self.name}")

    def __ceil__(self) -> "Symbol":
        return self._new(f"float(ceil({self.name}))")

    def hypot(self, other: Any) -> "Symbol":
        """What ``np.hypot`` asks of an object."""
        return self._new(f"float(hypot({self.name}, {_text(other)}))")

    def arctan2(self, other: Any) -> "Symbol":
        """What ``np.atan2`` asks of an object."""
        return self._new(f"float(atan2({self.name}, {_text(other)}))")
