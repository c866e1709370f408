"""A system and a reference in continuous time, checked."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.jacobians import check_model, examine, jacobian
from navfilters.numerics.probing import probe
from navfilters.types import Array

Signal = Callable[[float], Array]


@dataclass(frozen=True, eq=False)
class ContinuousSystem:
    """dx/dt = f(x, u, w, t),   y = h(x, v, t),   w ~ N(0, Q),   v ~ N(0, R), both white

    Parameters
    ----------
    f : callable
        (x, u, w, t) -> (n,), with x (n,), u (m,), w (w,).
    h : callable
        (x, v, t) -> (p,), with v (v,). M R M^T must be positive definite wherever the filter goes.
    Q : array (w, w)
        Spectral density of the process noise, in w's units squared times time.
    R : array (v, v)
        Spectral density of the measurement noise, in v's units squared times time.
    A, B, L : callable, optional
        (x, u, w, t) -> (n, n), (n, m), (n, w): the Jacobians of f in x, u and w.
    C, M : callable, optional
        (x, v, t) -> (p, n), (p, v): the Jacobians of h in x and v. Those not given are computed by
        :func:`~navfilters.numerics.complex_step.complex_step`, and compared with differences at
        the start
        and the end of a filter: f and h must be analytic, without abs, norm or .real.

    Raises
    ------
    TypeError
        A function that cannot be called.
    ValueError
        Q or R is not a covariance.

    References
    ----------
    lecture16, Eqs. (1)-(4) and (15). Where (9) has J_x f and J_v f, those of h are meant.
    """

    f: Callable[..., Array]
    h: Callable[..., Array]
    Q: Array
    R: Array
    A: Callable[..., Array] | None = None
    B: Callable[..., Array] | None = None
    L: Callable[..., Array] | None = None
    C: Callable[..., Array] | None = None
    M: Callable[..., Array] | None = None

    def __post_init__(self) -> None:
        check_model(self, ("f", "h"), ("A", "B", "L", "C", "M"))

    def jacobian(self, name: str) -> Callable[..., Array]:
        """The Jacobian of that name: the one given, or one by complex step.

        Parameters
        ----------
        name : {"A", "B", "L", "C", "M"}

        Returns
        -------
        callable
        """
        return self._jacobians[name]

    @cached_property
    def _jacobians(self) -> dict[str, Callable[..., Array]]:
        """All five; one object each, which knows whether it was compared with differences."""
        owners = {"f": "ABL", "h": "CM"}
        return {
            J: jacobian(getattr(self, f), i, getattr(self, J), name=f"system.{f}")
            for f, names in owners.items()
            for i, J in enumerate(names)
        }


@dataclass(frozen=True)
class Reference:
    """A trajectory that satisfies dx/dt = f(x, u, w, t), to linearise about.

    Parameters
    ----------
    x : callable
        t -> (n,).
    u : callable, optional
        t -> (m,); by default there is no input, and f sees an array of size 0.
    w, v : callable, optional
        t -> (w,), (v,): reference noise; by default zero.

    References
    ----------
    lecture16, Eqs. (5)-(7).
    """

    x: Signal
    u: Signal | None = None
    w: Signal | None = None
    v: Signal | None = None


def reference_residual(
    system: ContinuousSystem, reference: Reference, t: Any
) -> tuple[np.ndarray, np.ndarray]:
    """How far a reference is from satisfying its own dynamics.

    (x(b) - x(a) - integral of f(x, u, w, t) over [a, b]) / (b - a),   b - a small

    Parameters
    ----------
    system : ContinuousSystem
    reference : Reference
    t : array (k,)
        Increasing. [a, b] runs over each interval of t, cut into pieces of a 200th of the whole
        or less; intervals shorter than 1e-6 of the whole are left out.

    Returns
    -------
    times : array (N,)
        The middle of each interval.
    residual : array (N, n)
        In the state's units per time: dx/dt - f averaged over the interval, by a 5-point Gauss
        rule. No difference quotient, so a trajectory's own rounding is not enlarged.

    References
    ----------
    lecture16, Eq. (6).
    """
    t = _times(t)
    x, u, w, _ = _signals(system, reference, t[0], None)
    span = t[-1] - t[0]
    pieces = [
        np.linspace(start, end, 1 + int(np.ceil(200 * (end - start) / span)))
        for start, end in itertools.pairwise(t)
        if end - start > 1e-6 * span
    ]
    a = np.concatenate([piece[:-1] for piece in pieces])
    b = np.concatenate([piece[1:] for piece in pieces])
    nodes, weights = np.polynomial.legendre.leggauss(5)
    times = (a + b)[:, None] / 2 + (b - a)[:, None] / 2 * nodes
    rates = [[system.f(x(s), u(s), w(s), s) for s in row] for row in times]
    change = np.array([x(end) - x(start) for start, end in zip(a, b, strict=True)])
    return (a + b) / 2, change / (b - a)[:, None] - np.einsum("k,ikn->in", weights / 2, rates)


def _check_reference(system, reference, t, tol) -> None:
    """Eq. (6), to a fraction tol of the largest |f| + |A| |x| + |B| |u| + |L| |w|.

    The terms give a scale where f itself is zero to rounding: at an equilibrium.
    """
    x, u, w, _ = _signals(system, reference, t[0], None)
    times, residual = reference_residual(system, reference, t)
    scale = np.zeros(residual.shape[1])
    for s in times:
        at = x(s), u(s), w(s), s
        rate = np.abs(system.f(*at))
        for name, value in zip("ABL", at, strict=False):
            if value.size:
                rate = rate + np.abs(system.jacobian(name)(*at)) @ np.abs(value)
        scale = np.maximum(scale, rate)
    excess = np.abs(residual) - tol * scale
    if not excess.max() <= 0:
        k, i = np.unravel_index(np.argmax(excess), excess.shape)
        raise ValueError(
            f"reference must satisfy dx/dt = f(x, u, w, t) to {tol:g} of its rates; found a "
            f"residual of {residual[k, i]:.3g} in component {i} at t = {times[k]:.6g}, where at "
            f"most {tol * scale[i]:.3g} is allowed"
        )


def _signals(system, reference, t0, n) -> tuple[Signal, Signal, Signal, Signal]:
    """x, u, w and v of a reference, checked, with zeros for what it does not give."""
    if not isinstance(reference, Reference):
        raise TypeError(f"reference must be a Reference; found {type(reference).__name__}")
    return (
        _signal("reference.x", reference.x, t0, n),
        _signal("reference.u", reference.u, t0, None),
        _signal("reference.w", reference.w, t0, len(system.Q)),
        _signal("reference.v", reference.v, t0, len(system.R)),
    )


def _signal(name: str, value: Any, t0: float, size: int | None) -> Signal:
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

    def checked(s):
        array = np.asarray(validation.plain(name, value(s)))
        if array.shape != wanted or array.dtype.kind not in "iuf" or not np.isfinite(array).all():
            found = array if array.shape == wanted else f"shape {array.shape}"
            size = ", ".join(map(str, wanted))
            raise ValueError(
                f"{name} must return shape ({size},), finite; found {found} at t = {s}"
            )
        return array

    checked(t0)
    return checked


def _tolerances(rtol: Any, atol: Any) -> tuple[float, float]:
    relative = validation.number("rtol", rtol, least=1e-13, needed="in [1e-13, 1)")
    if relative >= 1:
        raise ValueError(f"rtol must be in [1e-13, 1); found {rtol!r}")
    return relative, validation.number("atol", atol, above=0, needed="a finite positive number")


def _door(system, prior, y, t):
    """What both filters check: t, prior and y; and y at the first time."""
    if not isinstance(system, ContinuousSystem):
        raise TypeError(f"system must be a ContinuousSystem; found {type(system).__name__}")
    t = _times(t)
    prior = validation.gaussian("prior", prior)
    if prior.mean.ndim != 1 or prior.cov.ndim != 2:
        found = f"{prior.mean.shape} and {prior.cov.shape}"
        raise ValueError(f"prior must have shapes (n,) and (n, n), no batch axes; found {found}")
    y = _signal("y", y, t[0], None)
    return t, prior, y, y(t[0])


def _times(t: Any) -> np.ndarray:
    t = validation.real_array("t", t, "k")
    if t.ndim != 1 or t.size < 2 or (np.diff(t) <= 0).any():
        raise ValueError(f"t must be at least two increasing times; found shape {t.shape}, {t}")
    return t


def _probe(system, x, u, w, v, t, p) -> None:
    """Every function of the system, called once, and R~ = M R M^T."""
    n, at, sensing = x.size, (x, u, w, t), (x, v, t)
    probe("system.f", system.f, at, (n,), ())
    probe("system.A", system.jacobian("A"), at, (n, n), ())
    probe("system.L", system.jacobian("L"), at, (n, w.size), ())
    probe("system.h", system.h, sensing, (p,), ())
    probe("system.C", system.jacobian("C"), sensing, (p, n), ())
    M = probe("system.M", system.jacobian("M"), sensing, (p, v.size), ())
    validation.covariance("M R M^T, from system.M and system.R,", M @ system.R @ M.T, definite=True)


def _examine(system, states, u, w, v, t) -> None:
    """The automatic Jacobians against differences, at some states."""
    with np.errstate(all="ignore"):
        for name in "ABL" if u.size else "AL":
            examine(system.jacobian(name), [(x, u, w, t) for x in states])
        for name in "CM":
            examine(system.jacobian(name), [(x, v, t) for x in states])
