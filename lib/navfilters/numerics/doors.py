"""Public functions of arrays: what they take is looked at in one place, and told by name."""

import functools
import inspect
from collections.abc import Callable, Collection
from typing import Any, ParamSpec, TypeVar

import numpy as np

from navfilters.numerics.plain_arrays import traced
from navfilters.numerics.validation import SYMMETRY, given
from navfilters.types import Array

P = ParamSpec("P")
T = TypeVar("T")
Sizes = tuple[int | str, ...]


def takes(
    *, symmetric: Collection[str] = (), **axes: str
) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """A function whose arguments are arrays with these last axes, or what becomes one.

    Lists become arrays, and whole numbers real ones. NaN stays: most functions have an answer.

    Parameters
    ----------
    symmetric : names of arguments, optional
        Matrices that must be equal to their transpose to rounding, where NumPy has them.
    **axes : str
        For an argument, its last axes as docstrings have them: "3", "n, n", "" for none. A letter
        is one size in all arguments.

    Returns
    -------
    function of a function
        What it returns raises ValueError: the argument, what is needed, what was found.
    """
    cores: dict[str, Sizes] = {
        name: tuple(int(axis) if axis.isdigit() else axis for axis in core.split(", ") if axis)
        for name, core in axes.items()
    }

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        order = list(inspect.signature(function).parameters)
        checks = [(order.index(name), name, core) for name, core in cores.items()]

        @functools.wraps(function)
        def checked(*args: Any, **options: Any) -> Any:
            known: dict[str, int] = {}
            new = list(args)
            for at, name, core in checks:
                if at < len(new):
                    new[at] = _fitting(name, new[at], core, known, name in symmetric)
                elif name in options:
                    options[name] = _fitting(name, options[name], core, known, name in symmetric)
            return function(*new, **options)

        return checked

    return decorate


def _fitting(name: str, value: Any, core: Sizes, known: dict[str, int], symmetric: bool) -> Array:
    if type(value) is not np.ndarray or value.dtype.char != "d":
        value = _real(name, value)
    shape = value.shape
    found = shape[len(shape) - len(core) :] if core else ()
    if found != core:  # with a letter, or wrong
        wanted = tuple(known.get(axis, axis) if isinstance(axis, str) else axis for axis in core)
        fits = len(shape) >= len(core) and 0 not in found
        for axis, size in zip(core, found, strict=fits):
            if isinstance(axis, str):
                fits = fits and known.setdefault(axis, size) == size
            else:
                fits = fits and axis == size
        if not fits:
            needed = ", ".join(map(str, wanted))
            raise ValueError(f"{name} must have shape (..., {needed}); found {shape}")
    if symmetric and not traced(value):
        _check_symmetric(name, np.asarray(value))
    return value


def _real(name: str, value: Any) -> Array:
    if type(value) is np.ndarray and value.dtype.kind == "c":
        return value  # of a complex step
    value = given(name, value)
    whole = isinstance(value, np.ndarray) and value.dtype.kind in "iu"
    return value.astype(float) if whole else value


def _check_symmetric(name: str, A: np.ndarray) -> None:
    apart = np.abs(A - A.mT)
    deviation = np.sqrt(np.abs(np.diagonal(A, axis1=-2, axis2=-1)))
    allowed = SYMMETRY * deviation[..., :, None] * deviation[..., None, :]
    if (apart > allowed).any():  # NaN is no difference
        raise ValueError(
            f"{name} must be symmetric; found a difference of {np.nanmax(apart):.3g} from its "
            "transpose"
        )
