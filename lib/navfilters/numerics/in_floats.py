"""Formulas of small matrices for one member: the same operations, on Python's floats.

To call NumPy takes longer than to multiply two by two. So a formula is followed once, with symbols
in the place of numbers, and what it does to them, each sum in its order, becomes a function of
floats. There is one source, and a member has the bits alone that it has among others.
"""

from collections.abc import Callable
from functools import wraps
from inspect import signature
from math import prod
from typing import Any, TypeVar, cast

import numpy as np

from navfilters.types import Array

T = TypeVar("T", bound=Callable[..., Any])
Shape = tuple[int, ...]

SMALL = 2
"""Greatest length of an axis of what is computed in floats; above, NumPy is as fast."""

POINTS = 2 * SMALL + 1
"""The same of an axis of sigma points."""

KNOWN = {name: getattr(np, name) for name in ("ndarray", "array", "hypot", "atan2", "ceil")}
"""What the functions call that are made here."""


def in_floats(formula: T, *, longest: int = SMALL) -> T:
    """A formula that is computed in floats where it is given small arrays of doubles.

    Parameters
    ----------
    formula : callable
        Of arrays, to an array or a tuple of arrays with axes, under any array namespace, by sums,
        differences, products, quotients, ``hypot``, ``atan2`` and ``ceil`` of their elements. What
        it does may depend on their shapes, not on their numbers.
    longest : int
        Greatest length of the first of several axes: ``POINTS`` for a formula of sigma points.

    Returns
    -------
    callable
        The same, to the last bit, of positional arguments.

    Notes
    -----
    A quotient by zero, which floats refuse, is left to the formula itself.
    """
    plans: dict[tuple[Shape, ...], Callable[..., Any]] = {}

    def planned(*arrays: Array) -> Callable[..., Any]:
        shapes = tuple(A.shape for A in arrays)
        if not all(_small(shape, longest) for shape in shapes):
            return formula
        plans[shapes] = _plan(formula, shapes)
        return plans[shapes]

    names = [*signature(formula).parameters]
    known = {"formula": formula, "plans": plans, "planned": planned}
    known |= {"most": longest * SMALL**2, "double": np.dtype(float)}
    return cast(T, wraps(formula)(_function(names, _choice(names), known)))


def _small(shape: Shape, longest: int) -> bool:
    """Of vectors, matrices or points; those of one or two members may have an axis for these."""
    limits = (longest, SMALL, SMALL) if len(shape) > 1 else (SMALL,)
    return 0 < len(shape) <= 3 and all(
        0 < size <= limit for size, limit in zip(shape, limits, strict=False)
    )


def _choice(names: list[str]) -> list[str]:
    """What a function of arrays must do to call the plan for them, or the formula.

    As source, since a loop over so few arrays would take as long as what they are needed for.
    """
    given = ", ".join(names)
    types, dtypes, shapes = (
        [form.format(name) for name in names] for form in ("type({})", "{}.dtype", "{}.shape")
    )
    return [
        f"if {' is '.join(types)} is ndarray and {names[0]}.size <= most:",
        f"    if {' is '.join(dtypes)} is double:",
        "        try:",
        f"            plan = plans.get(({', '.join(shapes)},)) or planned({given})",
        f"            return plan({given})",
        "        except ZeroDivisionError:",
        "            pass",
        f"return formula({given})",
    ]


def _plan(formula: Callable[..., Any], shapes: tuple[Shape, ...]) -> Callable[..., Any]:
    """What a formula does to arrays of these shapes, as a function of them in plain Python."""
    lines: list[str] = []
    symbols = []
    for k, shape in enumerate(shapes):
        elements = [Symbol(f"x{k}_{i}", lines) for i in range(prod(shape))]
        symbols.append(np.array(elements, object).reshape(shape))
        lines.append(f"{_listed(symbols[-1])} = A{k}.tolist()")
    found = formula(*symbols)
    several = found if type(found) is tuple else (found,)
    lines.append(f"return {', '.join(map(_array, several))}")
    return _function([f"A{k}" for k in range(len(shapes))], lines, {})


def _function(arguments: list[str], lines: list[str], known: dict[str, Any]) -> Any:
    names = KNOWN | known
    exec("\n    ".join([f"def function({', '.join(arguments)}):", *lines]), names)
    return names["function"]


def _array(A: Array) -> str:
    """An array as source."""
    flat = f"array({_listed(A.reshape(-1))})"  # faster than lists in a list
    return flat if A.ndim == 1 else f"{flat}.reshape({A.shape})"


def _listed(A: Array) -> str:
    """Its elements as source, in lists of lists."""
    return f"[{', '.join(map(_listed, A))}]" if np.ndim(A) else _text(A)


def _text(number: Any) -> str:
    number = number.item() if isinstance(number, np.ndarray) else number
    return number.name if isinstance(number, Symbol) else repr(float(number))


def _infix(form: str) -> Callable[["Symbol", Any], "Symbol"]:
    def operation(self: "Symbol", other: Any) -> "Symbol":
        if isinstance(other, np.ndarray):
            return NotImplemented  # so that it is done to each of the array's elements
        return self._new(form.format(self.name, _text(other)))

    return operation


class Symbol:
    """A number that is not known yet: what is done to it is written down.

    Parameters
    ----------
    name : str
    lines : list of str
        The assignments so far; each operation adds one.
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
        new = Symbol(f"t{len(self.lines)}", self.lines)
        self.lines.append(f"{new.name} = {expression}")
        return new

    __add__, __radd__ = _infix("{0} + {1}"), _infix("{1} + {0}")
    __sub__, __rsub__ = _infix("{0} - {1}"), _infix("{1} - {0}")
    __mul__, __rmul__ = _infix("{0} * {1}"), _infix("{1} * {0}")
    __truediv__, __rtruediv__ = _infix("{0} / {1}"), _infix("{1} / {0}")
    # What np.hypot, np.atan2 and np.ceil ask of an object.
    hypot = _infix("float(hypot({0}, {1}))")
    arctan2 = _infix("float(atan2({0}, {1}))")

    def __neg__(self) -> "Symbol":
        return self._new(f"-{self.name}")

    def __ceil__(self) -> "Symbol":
        return self._new(f"float(ceil({self.name}))")
