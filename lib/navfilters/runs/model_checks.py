"""Whether models of measurement and motion fit a prior: once, before any update."""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters.numerics import probing, validation
from navfilters.numerics.probing import unwritable
from navfilters.types import Gaussian, MeasurementModel


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
        As :func:`~navfilters.numerics.validation.gaussian` returns it.
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
            found = np.shape(model.jacobian(unwritable(_first(mean))))
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
        probing.probe(name, function, (one,), core, own, finite=False)
        for states in [several, x] if x.size and x.ndim > 1 and len(core) < 3 else [several]:
            batch = np.broadcast_shapes(states.shape[:-1], own)
            probing.members(name, function, (states,), 1, core, batch, own, **options)
