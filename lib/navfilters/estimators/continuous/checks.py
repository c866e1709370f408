"""What a Kalman-Bucy filter is given, checked: errors name the argument and the time."""

from collections.abc import Iterable
from math import isfinite
from typing import Any

import numpy as np

from navfilters.estimators.continuous.system import ContinuousSystem, Signal
from navfilters.numerics import validation
from navfilters.numerics.jacobians import examine
from navfilters.numerics.probing import probe
from navfilters.types import Gaussian


def arguments(
    system: Any, prior: Any, y: Any, t: Any
) -> tuple[np.ndarray, Gaussian, Signal, np.ndarray]:
    """What both filters check: t, prior and y; and y at the first time."""
    if not isinstance(system, ContinuousSystem):
        raise TypeError(f"system must be a ContinuousSystem; found {type(system).__name__}")
    t = increasing_times(t)
    prior = validation.gaussian("prior", prior)
    if prior.mean.ndim != 1 or prior.cov.ndim != 2:
        found = f"{prior.mean.shape} and {prior.cov.shape}"
        raise ValueError(f"prior must have shapes (n,) and (n, n), no batch axes; found {found}")
    y = checked_signal("y", y, t[0], None)
    return t, prior, y, y(t[0])


def increasing_times(t: Any) -> np.ndarray:
    t = validation.real_array("t", t, "k")
    if t.ndim != 1 or t.size < 2 or (np.diff(t) <= 0).any():
        raise ValueError(f"t must be at least two increasing times; found shape {t.shape}, {t}")
    return t


def checked_signal(name: str, value: Any, t0: float, size: int | None) -> Signal:
    """A function of time that checks what it returns, an array of that size or of its first.

    None is a signal of zeros, of size 0 if none is known.
    """
    if value is None and name not in ("y", "reference.x"):
        zeros = np.zeros(size or 0)
        return lambda s: zeros
    if not callable(value):
        raise TypeError(f"{name} must be a function of time; found {type(value).__name__}")
    first = np.shape(validation.plain(name, value(t0)))
    wanted = (size,) if size is not None else first if len(first) == 1 else ("m",)

    def checked(s: float) -> np.ndarray:
        array = np.asarray(validation.plain(name, value(s)))
        if (
            array.shape != wanted
            or array.dtype.kind not in "iuf"
            or not all(map(isfinite, array.tolist()))
        ):
            found = array if array.shape == wanted else f"shape {array.shape}"
            size = ", ".join(map(str, wanted))
            raise ValueError(
                f"{name} must return shape ({size},), finite; found {found} at t = {s}"
            )
        return array

    checked(t0)
    return checked


def tolerances(rtol: Any, atol: Any) -> tuple[float, float]:
    relative = validation.number("rtol", rtol, least=1e-13, needed="in [1e-13, 1)")
    if relative >= 1:
        raise ValueError(f"rtol must be in [1e-13, 1); found {rtol!r}")
    return relative, validation.number("atol", atol, above=0, needed="a finite positive number")


def probe_system(
    system: ContinuousSystem,
    x: np.ndarray,
    u: np.ndarray,
    w: np.ndarray,
    v: np.ndarray,
    t: float,
    p: int,
) -> None:
    """Every function of the system, called once, and R~ = M R M^T."""
    n, at, sensing = x.size, (x, u, w, t), (x, v, t)
    probe("system.f", system.f, at, (n,), ())
    probe("system.A", system.jacobian("A"), at, (n, n), ())
    probe("system.L", system.jacobian("L"), at, (n, w.size), ())
    probe("system.h", system.h, sensing, (p,), ())
    probe("system.C", system.jacobian("C"), sensing, (p, n), ())
    M = probe("system.M", system.jacobian("M"), sensing, (p, v.size), ())
    validation.covariance("M R M^T, from system.M and system.R,", M @ system.R @ M.T, definite=True)


def examine_system(
    system: ContinuousSystem,
    states: Iterable[np.ndarray],
    u: np.ndarray,
    w: np.ndarray,
    v: np.ndarray,
    t: float,
) -> None:
    """The automatic Jacobians against differences, at some states."""
    with np.errstate(all="ignore"):
        for name in "ABL" if u.size else "AL":
            examine(system.jacobian(name), [(x, u, w, t) for x in states])
        for name in "CM":
            examine(system.jacobian(name), [(x, v, t) for x in states])
