"""Whether a value is what it seems: plain numbers, and of the shape that a product needs."""

import sys
from numbers import Number
from typing import Any

import numpy as np

from navfilters.types import Array


def plain(name: str, value: Any) -> Any:
    """A value, if it means no more than its numbers, in their order.

    Parameters
    ----------
    name : str
        The argument, as the caller knows it.
    value : object

    Returns
    -------
    object
        The same; of a masked array that masks nothing, its data.

    Raises
    ------
    ValueError
        Masked entries, a unit, or another kind of ndarray: ``asarray`` would drop them unseen.
    """
    if type(value) is np.ndarray or isinstance(value, Number):
        return value
    if isinstance(value, list | tuple):
        for item in value:
            if type(item) is not float:
                plain(name, item)
        return value
    if isinstance(value, np.ma.MaskedArray):
        masked = np.argwhere(np.ma.getmaskarray(value))
        if len(masked):
            where = tuple(int(i) for i in masked[0])
            raise ValueError(
                f"{name} must have no masked entries, whose fill values would be taken for "
                f"numbers; found {len(masked)} masked, the first at index {where}: leave them out"
            )
        return plain(name, value.data)
    kind = f"{type(value).__module__}.{type(value).__qualname__}"
    for unit in ("units", "unit"):
        found = getattr(value, unit, None)
        if found is not None:
            raise ValueError(
                f"{name} must be plain numbers; found {kind} in {found}, which would be dropped: "
                "convert to the units that are meant, and give its numbers alone"
            )
    if isinstance(value, np.ndarray) and not isinstance(value, np.memmap):
        raise ValueError(
            f"{name} must be a plain array; found {kind}, whose own rules would be dropped: give "
            "np.asarray of it, with the shape that is meant"
        )
    return value


def core(name: str, array: Array, shape: tuple[int, ...]) -> Array:
    """An array, if its trailing axes are these: others may broadcast to a wrong product.

    Parameters
    ----------
    name : str
        What to call it in an error.
    array : array with at least these axes
    shape : tuple of int

    Returns
    -------
    array
        The same.

    Raises
    ------
    ValueError
        Naming it, the shape found and the shape needed.
    """
    found = array.shape if hasattr(array, "shape") else np.shape(array)
    if found[-len(shape) :] != shape:
        needed = ", ".join(map(str, shape))
        raise ValueError(f"{name} must have shape (..., {needed}); found {found}")
    return array


def has_bool(value: Any) -> bool:
    """Whether a list holds a bool, which NumPy takes for 0 or 1 among numbers.

    Parameters
    ----------
    value : object

    Returns
    -------
    bool
    """
    if isinstance(value, list | tuple):
        return any(has_bool(item) for item in value)
    return isinstance(value, bool | np.bool_)


def traced(value: Any) -> bool:
    """Whether JAX is compiling and value is known by its shape alone.

    Parameters
    ----------
    value : object

    Returns
    -------
    bool
    """
    jax = sys.modules.get("jax")
    return jax is not None and isinstance(value, jax.core.Tracer)
