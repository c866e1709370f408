"""Checks at the door: what found, what needed, and in which argument."""

import operator
from typing import Any

import numpy as np

from navfilters.numerics.plain_arrays import core, has_bool, plain, traced
from navfilters.types import Gaussian

__all__ = [
    "batch",
    "core",
    "covariance",
    "flag",
    "gaussian",
    "given",
    "number",
    "plain",
    "real_array",
    "traced",
    "whole_number",
]

SYMMETRY = 1e-9
"""Largest difference of a covariance from its transpose, as a correlation, taken for rounding."""


def given(name: str, value: Any) -> Any:
    """An array as it is, or anything array-like as one: for calls too frequent for real_array.

    Parameters
    ----------
    name : str
        The argument, as the caller knows it.
    value : array-like
        Also of JAX, traced or not.

    Returns
    -------
    array
        Of real numbers; whole ones become them.

    Raises
    ------
    ValueError
        As of :func:`real_array`, but of a plain array only the type of its elements is looked at.
    """
    if type(value) is np.ndarray and value.dtype.char == "d":
        return value  # what is nearly always given
    known = type(value) is np.ndarray or (
        hasattr(value, "__array_namespace__") and not isinstance(value, np.ndarray | np.generic)
    )
    if known and value.dtype.kind in "iu":
        return value.astype(float)  # a model may make its value of the state's own type
    if known and value.dtype.kind == "f":
        return value
    return real_array(name, value, "", finite=False)


def real_array(name: str, value: Any, core: str, *, finite: bool = True) -> np.ndarray:
    """A finite float64 copy-free view of value with at least the named trailing axes.

    Parameters
    ----------
    name : str
        The argument, as the caller knows it.
    value : array-like
        What was given.
    core : str
        The trailing axes, such as "n, n"; "" for none.
    finite : bool
        False where NaN and infinity mean something.

    Returns
    -------
    ndarray (..., core)

    Raises
    ------
    ValueError
        Not real numbers, too few axes, a core of size zero, or values that are not finite; or what
        :func:`plain` refuses.
    """
    axes = len(core.split(", ")) if core else 0
    shape = f"(..., {core})" if core else "(...)"
    needed = f"{name} must be an array {shape} of {'finite ' * finite}real numbers"
    try:
        array = np.asarray(plain(name, value))
    except (ValueError, TypeError) as error:
        if str(error).startswith(f"{name} must"):
            raise
        raise ValueError(f"{needed}; found {type(value).__name__} ({error})") from None
    if array.dtype.kind not in "iuf" or has_bool(value):
        found = "a bool" if array.dtype.kind in "iuf" else f"dtype {array.dtype}"
        raise ValueError(f"{needed}; found {found}")
    with np.errstate(over="ignore"):  # of longer doubles: found infinite below
        array = array.astype(np.float64, copy=False)
    if array.ndim < axes or 0 in array.shape[array.ndim - axes :]:
        raise ValueError(f"{needed}; found shape {array.shape}")
    bad = ~np.isfinite(array) if finite else np.False_
    if bad.any():
        where = tuple(int(i) for i in np.argwhere(bad)[0])
        raise ValueError(f"{needed}; found {array[where]} at index {where}")
    return array


def covariance(name: str, value: Any, size: int | None = None, *, definite: bool) -> np.ndarray:
    """A symmetric covariance (..., n, n), positive definite or semidefinite.

    Parameters
    ----------
    name : str
        The argument, as the caller knows it.
    value : array-like
        What was given.
    size : int, optional
        The n that is needed.
    definite : bool
        Whether zero eigenvalues are refused too.

    Returns
    -------
    ndarray (..., n, n)
        The symmetric part.

    Raises
    ------
    ValueError
        Wrong shape, not finite, not symmetric, or not (semi)definite; with the value found.
    """
    array = real_array(name, value, "n, n")
    rows, columns = array.shape[-2:]
    if rows != columns or (size is not None and rows != size):
        wanted = "(..., n, n)" if size is None else f"(..., {size}, {size})"
        raise ValueError(f"{name} must have shape {wanted}; found {array.shape}")
    deviation = np.sqrt(np.abs(np.diagonal(array, axis1=-2, axis2=-1)))
    deviation = np.where(deviation > 0, deviation, 1.0)
    correlation = array / deviation[..., :, None] / deviation[..., None, :]  # units must not decide
    if np.max(np.abs(correlation - correlation.mT), initial=0.0) > SYMMETRY:
        found = np.max(np.abs(array - array.mT))
        raise ValueError(
            f"{name} must be symmetric; found a difference of {found:.3g} from its transpose"
        )
    array = array / 2 + array.mT / 2
    smallest = np.min(np.linalg.eigvalsh((correlation + correlation.mT) / 2), initial=np.inf)
    rounding = 8 * rows * np.finfo(float).eps
    still = np.diagonal(array, axis1=-2, axis2=-1) == 0
    covaries = (still[..., None] & (array != 0)).any()  # of what does not vary
    if covaries or smallest < (rounding if definite else -rounding):
        needed = "definite" if definite else "semidefinite"
        found = np.min(np.linalg.eigvalsh(array))
        raise ValueError(
            f"{name} must be symmetric positive {needed}; found smallest eigenvalue {found:.3g}"
        )
    return array


def gaussian(name: str, value: Any) -> Gaussian:
    """A Gaussian whose mean and covariance fit together.

    Parameters
    ----------
    name : str
        The argument, as the caller knows it.
    value : Gaussian
        mean (..., n), cov (..., n, n).

    Returns
    -------
    Gaussian of ndarray

    Raises
    ------
    ValueError
        Naming ``name``, what is wrong with it, and what is needed.
    """
    if not isinstance(value, Gaussian):
        raise ValueError(f"{name} must be a Gaussian(mean, cov); found {type(value).__name__}")
    mean = real_array(f"{name}.mean", value.mean, "n")
    cov = covariance(f"{name}.cov", value.cov, mean.shape[-1], definite=False)
    return Gaussian(mean, cov)


def whole_number(name: str, value: Any, least: int) -> int:
    """A count.

    Parameters
    ----------
    name : str
        The argument, as the caller knows it.
    value : int
        Also NumPy's, and an integer array without axes.
    least : int
        The smallest that is allowed.

    Returns
    -------
    int

    Raises
    ------
    ValueError
        Not an integer, or too small; a bool is no count.
    """
    try:
        number = None if isinstance(value, bool) else operator.index(plain(name, value))
    except TypeError:
        number = None
    if number is None or number < least:
        raise ValueError(f"{name} must be an integer of at least {least}; found {value!r}")
    return number


def number(
    name: str,
    value: Any,
    *,
    above: float = -np.inf,
    least: float = -np.inf,
    needed: str = "a finite real number",
) -> float:
    """One real number.

    Parameters
    ----------
    name : str
        The argument, as the caller knows it.
    value : float
        Also an int, NumPy's numbers, and an array without axes.
    above, least : float
        It must be larger than above and at least least.
    needed : str
        What to call such a number in an error.

    Returns
    -------
    float

    Raises
    ------
    ValueError
        Not one number, not finite, or out of range; a bool is no number.
    """
    try:
        array = real_array(name, value, "")
    except ValueError:
        plain(name, value)  # what this refuses has a cure of its own
        array = np.zeros(1)
    if array.ndim or array <= above or array < least:
        raise ValueError(f"{name} must be {needed}; found {value!r}")
    return float(array)


def flag(name: str, value: Any) -> bool:
    """Yes or no.

    Parameters
    ----------
    name : str
        The argument, as the caller knows it.
    value : bool
        Also NumPy's.

    Returns
    -------
    bool

    Raises
    ------
    ValueError
        Anything else: of an array or a string it would not be clear what is meant.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} must be True or False; found {value!r}")
    return bool(value)


def batch(**shapes: tuple[int, ...]) -> tuple[int, ...]:
    """The common batch shape of several arguments.

    Parameters
    ----------
    **shapes : tuple of int
        The leading axes of each argument, by its name.

    Returns
    -------
    tuple of int

    Raises
    ------
    ValueError
        When they do not broadcast, naming each.
    """
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError:
        found = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(f"leading (batch) axes must broadcast; found {found}") from None
