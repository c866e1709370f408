"""Whether models of measurement and motion fit a prior: once, before any update."""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters.estimators.model_parts import at, noise
from navfilters.numerics import validation
from navfilters.numerics.probing import alike, first_member, unwritable
from navfilters.runs.difference_checks import manifold, residual
from navfilters.runs.system_checks import refuse_systems
from navfilters.types import Gaussian, MeasurementModel


def number_of_steps(steps: int | None, z: Any, z_per_step: bool) -> int:
    """The number of steps that was given, or the length of z, or 1000."""
    if steps is not None:
        return validation.whole_number("steps", steps, 0)
    if callable(z) or not z_per_step:
        return 1000
    shape = np.shape(validation.plain("z", z))
    if not shape:
        raise ValueError("z must have shape (steps, ..., m); found ()")
    return shape[0]


def start(name: str, prior: Any, model: Any, dynamics: Any) -> Gaussian:
    """A prior, checked: as :func:`~navfilters.numerics.validation.gaussian`, or on a manifold.

    Parameters
    ----------
    name : str
        The prior's, as the caller knows it.
    prior : Gaussian
    model : MeasurementModel
    dynamics : Dynamics or None

    Returns
    -------
    Gaussian

    Raises
    ------
    ValueError
        A wrong shape, a value that is not finite, a covariance that is not one.
    TypeError
        A system in the place of a model.
    """
    refuse_systems(model, dynamics)
    curved = next((m for m in (model, dynamics) if hasattr(m, "retract")), None)
    if curved is None:
        return validation.gaussian(name, prior)
    mean = validation.real_array(f"{name}.mean", prior.mean, "n")
    cov = validation.covariance(f"{name}.cov", prior.cov, definite=False)
    validation.batch(**{f"{name}.mean": mean.shape[:-1], f"{name}.cov": cov.shape[:-2]})
    try:
        with np.errstate(all="ignore"):
            moved = curved.retract(mean, np.zeros((*mean.shape[:-1], cov.shape[-1])))
        validation.core("model.retract", moved, mean.shape[-1:])
    except (ValueError, IndexError) as error:
        raise ValueError(
            f"{name} must hold a state (..., n) and the covariance of its error as model.retract "
            f"takes them; found {mean.shape} and {cov.shape} ({error})"
        ) from error
    return Gaussian(mean, cov)


def measures(model: Any) -> None:
    """ValueError for a model without h, which a filter of ours needs."""
    first = at(model, 0)
    if not (hasattr(first, "h") or hasattr(first, "given")):
        raise ValueError(f"model must have R, and h; found {type(model).__name__}")


def measurements(
    z: Any,
    prior: Gaussian,
    model: MeasurementModel,
    steps: int,
    z_per_step: bool,
    name: str = "prior",
) -> tuple[np.ndarray, tuple[int, ...]]:
    """Measurements that fit the prior, the model's R and the number of steps.

    Parameters
    ----------
    z : array-like (..., m), or (steps, ..., m) with z_per_step
        NaN where it was not measured.
    prior : Gaussian
        As :func:`start` returns it.
    model : MeasurementModel
    steps : int
    z_per_step : bool
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
        Wrong shapes, infinite values, an R that is no covariance, batch axes that do not broadcast.
    """
    axes = "steps, ..., m" if z_per_step else "..., m"
    z = validation.real_array("z", z, "m", finite=False)
    if np.isinf(z).any():
        where = tuple(int(i) for i in np.argwhere(np.isinf(z))[0])
        raise ValueError(
            f"z must be finite, or NaN where it was not measured; found {z[where]} at index {where}"
        )
    if z_per_step and (z.ndim < 2 or z.shape[0] != steps):
        raise ValueError(f"z must have shape ({axes}) with {steps} steps; found {z.shape}")
    shapes = {
        f"{name}.mean": prior.mean.shape[:-1],
        f"{name}.cov": prior.cov.shape[:-2],
        "z": z.shape[1:-1] if z_per_step else z.shape[:-1],
    }
    first = at(model, 0)
    if not hasattr(model, "R"):
        raise ValueError(f"model must have R, and h; found {type(model).__name__}")
    R = validation.covariance("model.R", model.R, definite=False)
    shapes["model.R"] = R.shape[:-2]
    if not hasattr(first, "given"):
        if hasattr(first, "check"):
            first.check(Gaussian(first_member(prior.mean), first_member(prior.cov, 2)), steps)
        _fits(z, prior, first, axes, name)
    return z, validation.batch(**shapes)


def _fits(z: Any, prior: Gaussian, model: MeasurementModel, axes: str, name: str) -> None:
    """Whether a measurement, and a state, are the model's."""
    m = measured_size(model, prior)
    if z.shape[-1] != m:
        raise ValueError(f"z must have shape ({axes}) with m = {m} as in model.R; found {z.shape}")
    size = _state_size(model, prior.mean, m)
    if size not in (None, prior.cov.shape[-1]) and hasattr(model, "retract"):
        raise ValueError(
            f"{name}.cov must have shape (..., {size}, {size}) for this model; found "
            f"{prior.cov.shape}"
        )
    if size not in (None, prior.cov.shape[-1]):
        if hasattr(model, "retract"):
            raise ValueError(
                f"{name}.cov must have shape (..., {size}, {size}), as model.jacobian has {size} "
                f"columns; found {prior.cov.shape}"
            )
        raise ValueError(
            f"{name}.mean must have shape (..., {size}) for this model; found {prior.mean.shape}"
        )


def models(model: Any, motion: Any, prior: Gaussian, steps: int, name: str = "prior") -> None:
    """Check the models of measurement and motion, as they are at the first step.

    Parameters
    ----------
    model : MeasurementModel
    motion : Dynamics or None
    prior : Gaussian
    steps : int
    name : str
        The prior's, as the caller knows it.

    Raises
    ------
    ValueError
        As of :func:`sensor` and :func:`dynamics`; or as a model's own ``check`` has it.
    """
    first = at(model, 0)
    if hasattr(first, "check"):
        first.check(prior, steps)
    elif not hasattr(first, "given"):
        sensor(first, prior, name=name)
    if motion is not None:
        moving = at(motion, 0)
        moving.check(prior, steps) if hasattr(moving, "check") else dynamics(moving, prior)


def sensor(model: MeasurementModel, prior: Gaussian, *, name: str = "prior") -> None:
    """Check what a model has of h, jacobian, hessian and the differences that are its own.

    Parameters
    ----------
    model : MeasurementModel
        R (..., m, m) has all batch axes of the model.
    prior : Gaussian
    name : str
        The prior's, as the caller knows it.

    Raises
    ------
    ValueError
        A function whose value has another shape, or changes with the other members of the batch.
    """
    m, n, mean = measured_size(model, prior), prior.cov.shape[-1], prior.mean
    own = np.shape(model.R)[:-2]
    manifold("model", model, prior, own)
    for part, core in (("h", (m,)), ("jacobian", (m, n)), ("hessian", (m, n, n))):
        function = getattr(model, part, None)
        if function is None:
            continue
        try:
            alike(f"model.{part}", function, mean, core, own, whole=part == "h")
        except NotImplementedError:  # none that the filter needs, it may be
            continue
        except ValueError as error:
            raise ValueError(
                f"{error}; {name}.mean must be a state of the model: found shape {mean.shape}"
            ) from error
    residual(model, prior, m)


def dynamics(model: Any, prior: Gaussian) -> None:
    """Check a model's f, transition, propagate and differences, those it has, and its Q.

    Parameters
    ----------
    model : Dynamics
        Q (..., n, n) has all batch axes of the model.
    prior : Gaussian

    Raises
    ------
    ValueError
        As of :func:`sensor`; a Q that is no covariance; neither f nor transition nor propagate.
    """
    n, mean = prior.cov.shape[-1], prior.mean
    known = [part for part in ("f", "transition", "propagate") if hasattr(model, part)]
    if not (known and hasattr(model, "Q")):
        raise ValueError(
            "dynamics must have Q and one of f, transition and propagate; found "
            f"{type(model).__name__}"
        )
    size = None if "propagate" in known else n
    Q = validation.covariance("dynamics.Q", model.Q, size, definite=False)
    own = Q.shape[:-2]
    manifold("dynamics", model, prior, own)

    def parts(name: str, count: int) -> list[Callable[[Any], Any]]:
        seen: dict[Any, tuple[Any, ...]] = {}  # the parts are asked for at the same states

        def of_tuple(x: Any) -> tuple[Any, ...]:
            key = x.shape, x.tobytes()
            if key not in seen:
                found = getattr(model, name)(*((x, Q) if name == "propagate" else (x,)))
                if not (isinstance(found, tuple) and len(found) == count):
                    needed = "(f(x), F)" if count == 2 else "(f(x), F, W)"
                    raise ValueError(f"a tuple {needed} is needed; found {type(found).__name__}")
                seen[key] = found
            return seen[key]

        def part(i: int) -> Callable[[Any], Any]:
            return lambda x: of_tuple(x)[i]

        return [part(i) for i in range(count)]

    state, square = mean.shape[-1:], (n, n)
    if "f" in known:
        alike("dynamics.f", model.f, mean, state, own, whole=True)
    states = 1 + 2 * n + mean.shape[-1]  # longer than any axis of any part
    for name, count in (("transition", 2), ("propagate", 3)):
        if name in known:
            called = f"dynamics.{name}"
            of_x, of_F, *of_W = parts(name, count)
            alike(f"f(x) of {called}", of_x, mean, state, own, whole=True, count=states)
            alike(f"F of {called}", of_F, mean, square, own, whole=False)
            for W in of_W:
                alike(f"W of {called}", W, mean, square, own, whole=False)


def measured_size(model: MeasurementModel, prior: Gaussian) -> int:
    """The number of components of a measurement."""
    if not hasattr(model, "noise"):
        return np.shape(model.R)[-1]
    with np.errstate(all="ignore"):
        return np.shape(noise(model, first_member(prior.mean)))[-1]


def _state_size(model: MeasurementModel, mean: np.ndarray, m: int) -> int | None:
    """The n of a jacobian (..., m, n), if it can be had: the state may be another model's."""
    try:
        with np.errstate(all="ignore"):
            found = np.shape(model.jacobian(unwritable(first_member(mean))))
    except Exception:  # whatever it is, the probe will find it again
        return None
    return found[-1] if found[-2:-1] == (m,) else None
