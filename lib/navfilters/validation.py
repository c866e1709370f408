"""Checks at the door: what found, what needed, and in which argument."""

from typing import Any

import numpy as np

from navfilters.types import Gaussian, MeasurementModel

SYMMETRY = 1e-9
"""Largest difference of a covariance from its transpose, as a correlation, taken for rounding."""


def real_array(name: str, value: Any, core: str) -> np.ndarray:
    """A finite float64 copy-free view of value with at least the named trailing axes.

    Parameters
    ----------
    name : str
        The argument, as the caller knows it.
    value : array-like
        What was given.
    core : str
        The trailing axes, such as "n, n"; "" for none.

    Returns
    -------
    ndarray (..., core)

    Raises
    ------
    ValueError
        Not real numbers, too few axes, a core of size zero, or values that are not finite.
    """
    axes = len(core.split(", ")) if core else 0
    shape = f"(..., {core})" if core else "(...)"
    needed = f"{name} must be an array {shape} of finite real numbers"
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{needed}; found {type(value).__name__} ({error})") from None
    if array.dtype.kind not in "iuf":
        raise ValueError(f"{needed}; found dtype {array.dtype}")
    array = array.astype(np.float64, copy=False)
    if array.ndim < axes or 0 in array.shape[array.ndim - axes :]:
        raise ValueError(f"{needed}; found shape {array.shape}")
    bad = ~np.isfinite(array)
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
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise ValueError(f"{name} must be an integer of at least {least}; found {value!r}")
    return int(value)


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


def measurements(
    z: Any,
    prior: Gaussian,
    model: MeasurementModel,
    steps: int,
    z_varies: bool,
    name: str = "prior",
) -> tuple[np.ndarray, tuple[int, ...]]:
    """Measurements that fit the prior, the model and the number of steps.

    Parameters
    ----------
    z : array-like (..., m), or (steps, ..., m) with z_varies
    prior : Gaussian
        As :func:`gaussian` returns it.
    model : MeasurementModel
    steps : int
    z_varies : bool
    name : str
        The prior's, as the caller knows it.

    Returns
    -------
    z : ndarray
    batch : tuple of int
        The common batch axes of prior, z and model.

    Raises
    ------
    ValueError
        Wrong shapes, values that are not finite, batch axes that do not broadcast.
    """
    axes = "steps, ..., m" if z_varies else "..., m"
    z = real_array("z", z, "m")
    if z_varies and (z.ndim < 2 or z.shape[0] != steps):
        raise ValueError(f"z must have shape ({axes}) with {steps} steps; found {z.shape}")
    m = np.shape(model.R)[-1]
    if z.shape[-1] != m:
        raise ValueError(f"z must have shape ({axes}) with m = {m} as in model.R; found {z.shape}")
    n = prior.mean.shape[-1]
    one = prior.mean[(slice(1),) * (prior.mean.ndim - 1)]  # a batch may be large
    with np.errstate(all="ignore"):
        try:
            H = model.jacobian(one)
        except (ValueError, IndexError) as error:
            raise ValueError(
                f"{name}.mean must be a state of the model; found shape {prior.mean.shape} "
                f"({error})"
            ) from None
    if H.shape[-1] != n:
        raise ValueError(
            f"{name}.mean must have shape (..., {H.shape[-1]}) for this model; found "
            f"{prior.mean.shape}"
        )
    shapes = {
        f"{name}.mean": prior.mean.shape[:-1],
        f"{name}.cov": prior.cov.shape[:-2],
        "z": z.shape[1:-1] if z_varies else z.shape[:-1],
        "model.R": np.shape(model.R)[:-2],
        "model.jacobian": H.shape[:-2],
    }
    return z, batch(**shapes)
