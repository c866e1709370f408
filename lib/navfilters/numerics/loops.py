"""A loop in Python, or compiled under JAX."""

import importlib
from collections.abc import Callable
from typing import Any


def is_jax(xp: Any) -> bool:
    """Whether an array namespace is JAX's.

    Parameters
    ----------
    xp : module

    Returns
    -------
    bool
    """
    return xp.__name__.startswith("jax")


def repeat(step: Callable[[Any, Any], Any], start: Any, count: int, xp: Any) -> Any:
    """The last of so many steps, each of the one before.

    Parameters
    ----------
    step : callable
        (k, carry) -> carry, with k from 0. Under JAX it is traced once, with a traced k.
    start : array or tuple of array
        The first carry.
    count : int
    xp : module
        Array namespace of the carry.

    Returns
    -------
    array or tuple of array
    """
    if is_jax(xp):
        return importlib.import_module("jax").lax.fori_loop(0, count, step, start)
    for k in range(count):
        start = step(k, start)
    return start
