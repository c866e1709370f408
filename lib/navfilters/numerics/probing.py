"""A model's functions, called once before anything is computed with them.

A function may return too few axes, or mix the members of a batch: most products broadcast what they
are given, and the result looks like any other. So each function is called with one state and with
several, and what it gives is compared.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters.numerics import validation

AGREEMENT = 1e-6
"""Largest difference, in parts of the largest element, of a state in a batch from itself alone."""


def probe(
    name: str,
    function: Callable[..., Any],
    arguments: tuple[Any, ...],
    core: tuple[int, ...],
    batch: tuple[int, ...] | None = None,
    *,
    least: tuple[int, ...] = (),
    finite: bool = True,
) -> np.ndarray:
    """Call a function once and look at what it gives.

    Parameters
    ----------
    name : str
        What to call function in an error.
    function : callable
    arguments : tuple
        What to call it with; arrays cannot be written to.
    core : tuple of int
        The trailing axes that its value must have.
    batch : tuple of int, optional
        What the axes in front must broadcast to; by default they are free.
    least : tuple of int
        What must broadcast to the axes in front.
    finite : bool
        False where NaN and infinity are no error.

    Returns
    -------
    ndarray (..., core)

    Raises
    ------
    ValueError
        The call fails on arguments of these sizes or writes to them, or its value has another shape
        or is no array of finite doubles.
    TypeError
        As of :func:`~navfilters.numerics.complex_step.complex_step`.
    """

    def wrong(found: Any, shape: tuple[Any, ...] = ("...", *core)) -> ValueError:
        needed = ", ".join(map(str, shape)) + "," * (len(shape) == 1)
        shapes = ", ".join(str(np.shape(a)) for a in arguments)
        return ValueError(
            f"{name} must return shape ({needed}) from shapes {shapes}; found {found}"
        )

    try:
        value = function(*map(unwritable, arguments))
    except (ValueError, IndexError, AttributeError) as error:
        if "read-only" in str(error):
            raise ValueError(f"{name} must not change its arguments; found {error}") from error
        raise wrong(f"{type(error).__name__}: {error}") from error
    array = validation.real_array(f"the value of {name}", value, "", finite=finite)
    found, size = array.shape, array.ndim - len(core)
    if found[max(0, size) :] != core or size < 0:
        raise wrong(found)
    if batch is not None and not (
        _broadcasts(found[:size], batch) and _broadcasts(least, found[:size])
    ):
        raise wrong(found, (*batch, *core))
    if getattr(value, "dtype", np.float64) in (np.float32, np.float16):
        raise ValueError(
            f"{name} must return doubles; found {value.dtype} (JAX computes in doubles after "
            "jax.config.update('jax_enable_x64', True))"
        )
    return array


def members(
    name: str,
    function: Callable[..., Any],
    arguments: tuple[Any, ...],
    states: int,
    core: tuple[int, ...],
    batch: tuple[int, ...],
    own: tuple[int, ...] = (),
    *,
    whole: bool,
    finite: bool = True,
) -> np.ndarray:
    """Call a function for a whole batch, and for its first and its last member alone.

    Parameters
    ----------
    name : str
        What to call function in an error.
    function : callable
    arguments : tuple
        What to call it with.
    states : int
        How many of them, from the first, are vectors (..., n) with batch axes.
    core : tuple of int
        The trailing axes that its value must have.
    batch : tuple of int
        Those in front of them.
    own : tuple of int
        Those that the function has whatever its arguments: the last of the batch.
    whole : bool
        Whether all batch axes of the states must be in the value; otherwise they may be missing.
    finite : bool
        False where NaN and infinity are no error.

    Returns
    -------
    ndarray (..., core)

    Raises
    ------
    ValueError
        As of :func:`probe`, and a value that changes with the other members.
    """
    lead = np.broadcast_shapes(*(a.shape[:-1] for a in arguments[:states]))
    least = lead if whole else ()
    together = probe(name, function, arguments, core, batch, least=least, finite=finite)
    for corner in (0, -1) if lead and 0 not in batch else ():
        index = tuple(corner % size for size in batch)
        one = (*(_member(a, index, 1) for a in arguments[:states]), *arguments[states:])
        alone = probe(name, function, one, core, own, finite=finite)
        _same(name, _member(together, index, len(core)), _member(alone, index, len(core)))
    return together


def _member(array: np.ndarray, index: tuple[int, ...], axes: int) -> np.ndarray:
    """One member of an array whose batch axes broadcast to those of the index."""
    lead = array.shape[: array.ndim - axes]
    last = index[len(index) - len(lead) :]
    return array[tuple(i if size > 1 else 0 for i, size in zip(last, lead, strict=True))]


def _same(name: str, together: np.ndarray, alone: np.ndarray) -> None:
    if (together == alone).all():
        return
    scale = np.abs(alone).max(initial=0.0, where=np.isfinite(alone))
    if not np.allclose(together, alone, rtol=0, atol=AGREEMENT * scale, equal_nan=True):
        raise ValueError(
            f"{name} must give a state in a batch what it gives it alone; found "
            f"{together.tolist()} in a batch and {alone.tolist()} alone"
        )


def _broadcasts(small: tuple[int, ...], large: tuple[int, ...]) -> bool:
    """Whether an array of the first shape may stand for one of the second."""
    if len(small) > len(large):
        return False
    pairs = zip(small[::-1], large[::-1], strict=False)
    return all(size in (1, wanted) for size, wanted in pairs)


def unwritable(argument: Any) -> Any:
    """The same numbers: a function that works in place would change what others still need.

    Parameters
    ----------
    argument : object

    Returns
    -------
    object
        A view of an array; anything else as it is.
    """
    if not isinstance(argument, np.ndarray):
        return argument
    view = argument.view()
    view.flags.writeable = False
    return view


def first_member(x: np.ndarray, core: int = 1) -> np.ndarray:
    """One member; of an empty batch, ones."""
    return x[(0,) * (x.ndim - core)] if x.size else np.ones(x.shape[-core:])


def alike(
    name: str,
    function: Callable[..., Any],
    x: np.ndarray,
    core: tuple[int, ...],
    own: tuple[int, ...],
    *,
    whole: bool,
    count: int | None = None,
) -> None:
    """One state, several in front of the model's own batch axes, and, but for a Hessian, all."""
    options: dict[str, Any] = {"whole": whole, "finite": False}
    one = first_member(x)
    count = count or 1 + sum(core) + one.size  # no other axis is as long
    near = 1 + 2.0**-10 * np.arange(count)
    several = (near[:, None] * one).reshape(count, *(1,) * len(own), -1)
    with np.errstate(all="ignore"):
        probe(name, function, (one,), core, own, finite=False)
        for states in [several, x] if x.size and x.ndim > 1 and len(core) < 3 else [several]:
            batch = np.broadcast_shapes(states.shape[:-1], own)
            members(name, function, (states,), 1, core, batch, own, **options)
