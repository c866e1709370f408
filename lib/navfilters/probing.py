"""A model's functions, called once before anything is computed with them.

A function may return too few axes, or mix the members of a batch: most products broadcast what they
are given, and the result looks like any other. So each function is called with one state and with
several, and what it gives is compared.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters import validation
from navfilters.types import Gaussian, MeasurementModel

AGREEMENT = 1e-6
"""Largest difference, in parts of the largest element, of a state in a batch from itself alone."""


def probe(
    name: str,
    function: Callable,
    arguments: tuple,
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
        As of :func:`~navfilters.derivatives.complex_step`.
    """

    def wrong(found: Any, shape: tuple = ("...", *core)) -> ValueError:
        needed = ", ".join(map(str, shape)) + "," * (len(shape) == 1)
        shapes = ", ".join(str(np.shape(a)) for a in arguments)
        return ValueError(
            f"{name} must return shape ({needed}) from shapes {shapes}; found {found}"
        )

    try:
        value = function(*map(_unwritable, arguments))
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
    function: Callable,
    arguments: tuple,
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


def measurements(
    z: Any,
    prior: Gaussian,
    model: MeasurementModel,
    steps: int,
    z_varies: bool,
    name: str = "prior",
) -> tuple[np.ndarray, tuple[int, ...]]:
    """Measurements that fit the prior, the model's R and the number of steps.

    Parameters
    ----------
    z : array-like (..., m), or (steps, ..., m) with z_varies
    prior : Gaussian
        As :func:`~navfilters.validation.gaussian` returns it.
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
        Wrong shapes, values that are not finite, an R that is no covariance, batch axes that do not
        broadcast.
    """
    axes = "steps, ..., m" if z_varies else "..., m"
    z = validation.real_array("z", z, "m")
    if z_varies and (z.ndim < 2 or z.shape[0] != steps):
        raise ValueError(f"z must have shape ({axes}) with {steps} steps; found {z.shape}")
    if not hasattr(model, "R"):
        found = type(model).__name__
        raise ValueError(f"model must have R, and h with its derivatives; found {found}")
    R = validation.covariance("model.R", model.R, definite=False)
    m = R.shape[-1]
    if z.shape[-1] != m:
        raise ValueError(f"z must have shape ({axes}) with m = {m} as in model.R; found {z.shape}")
    size = _state_size(model, prior.mean, m)
    if size not in (None, prior.mean.shape[-1]):
        raise ValueError(
            f"{name}.mean must have shape (..., {size}) for this model; found {prior.mean.shape}"
        )
    shapes = {
        f"{name}.mean": prior.mean.shape[:-1],
        f"{name}.cov": prior.cov.shape[:-2],
        "z": z.shape[1:-1] if z_varies else z.shape[:-1],
        "model.R": R.shape[:-2],
    }
    return z, validation.batch(**shapes)


def sensor(model: MeasurementModel, mean: np.ndarray, *, name: str = "prior") -> None:
    """Check a model's h, jacobian and hessian, those that it has, at the states of a prior.

    Parameters
    ----------
    model : MeasurementModel
        R (..., m, m) has all batch axes of the model.
    mean : ndarray (..., n)
    name : str
        The prior's, as the caller knows it.

    Raises
    ------
    ValueError
        A function whose value has another shape, or changes with the other members of the batch.
    """
    m, n = np.shape(model.R)[-1], mean.shape[-1]
    own = np.shape(model.R)[:-2]
    for part, core in (("h", (m,)), ("jacobian", (m, n)), ("hessian", (m, n, n))):
        function = getattr(model, part, None)
        if function is None:
            continue
        try:
            _alike(f"model.{part}", function, mean, core, own, whole=part == "h")
        except NotImplementedError:  # none that the filter needs, it may be
            continue
        except ValueError as error:
            raise ValueError(
                f"{error}; {name}.mean must be a state of the model: found shape {mean.shape}"
            ) from error


def dynamics(model: Any, mean: np.ndarray, *, name: str) -> None:
    """Check a model's transition, its Q and its accumulate.

    Parameters
    ----------
    model : Dynamics
        Q (..., n, n) has all batch axes of the model.
    mean : ndarray (..., n)
    name : str
        The model's, as the caller knows it.

    Raises
    ------
    ValueError
        As of :func:`sensor`, and a Q that is no covariance.
    """
    n = mean.shape[-1]
    Q = validation.covariance(f"{name}.Q", getattr(model, "Q", None), n, definite=False)
    own = Q.shape[:-2]

    def part(i: int) -> Callable:
        def of_transition(x):
            pair = model.transition(x)
            if not (isinstance(pair, tuple) and len(pair) == 2):
                raise ValueError(f"a pair (f(x), F) is needed; found {type(pair).__name__}")
            return pair[i]

        return of_transition

    _alike(f"f(x) of {name}.transition", part(0), mean, (n,), own, whole=True)
    _alike(f"F of {name}.transition", part(1), mean, (n, n), own, whole=False)
    if getattr(model, "accumulate", None) is not None:
        noise = f"{name}.accumulate"
        _alike(noise, lambda x: model.accumulate(model.Q, x), mean, (n, n), own, whole=False)


def _state_size(model: MeasurementModel, mean: np.ndarray, m: int) -> int | None:
    """The n of a jacobian (..., m, n), if it can be had: the state may be another model's."""
    try:
        with np.errstate(all="ignore"):
            found = np.shape(model.jacobian(_unwritable(_first(mean))))
    except Exception:  # whatever it is, the probe will find it again
        return None
    return found[-1] if found[-2:-1] == (m,) else None


def _first(x: np.ndarray) -> np.ndarray:
    """One member; of an empty batch, ones."""
    return x[(0,) * (x.ndim - 1)] if x.size else np.ones(x.shape[-1])


def _alike(
    name: str,
    function: Callable,
    x: np.ndarray,
    core: tuple[int, ...],
    own: tuple[int, ...],
    *,
    whole: bool,
) -> None:
    """One state, several in front of the model's own batch axes, and, but for a Hessian, all."""
    options: dict[str, Any] = {"whole": whole, "finite": False}
    one = _first(x)
    count = 1 + sum(core) + one.size  # no other axis is as long
    near = 1 + 2.0**-10 * np.arange(count)
    several = (near[:, None] * one).reshape(count, *(1,) * len(own), -1)
    with np.errstate(all="ignore"):
        probe(name, function, (one,), core, own, finite=False)
        for states in [several, x] if x.size and x.ndim > 1 and len(core) < 3 else [several]:
            batch = np.broadcast_shapes(states.shape[:-1], own)
            members(name, function, (states,), 1, core, batch, own, **options)


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


def _unwritable(argument: Any) -> Any:
    """The same numbers: a function that works in place would change what others still need."""
    if not isinstance(argument, np.ndarray):
        return argument
    view = argument.view()
    view.flags.writeable = False
    return view
