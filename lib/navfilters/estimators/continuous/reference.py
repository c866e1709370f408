"""Whether a reference satisfies its own dynamics."""

import itertools
from typing import Any

import numpy as np

from navfilters.estimators.continuous.checks import checked_signal, increasing_times
from navfilters.estimators.continuous.system import ContinuousSystem, Reference, Signal


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
    t = increasing_times(t)
    x, u, w, _ = reference_signals(system, reference, t[0], None)
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


def check_reference(
    system: ContinuousSystem, reference: Reference, t: np.ndarray, tol: float
) -> None:
    """Eq. (6), to a fraction tol of the largest |f| + |A| |x| + |B| |u| + |L| |w|.

    The terms give a scale where f itself is zero to rounding: at an equilibrium.
    """
    x, u, w, _ = reference_signals(system, reference, t[0], None)
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


def reference_signals(
    system: ContinuousSystem, reference: Reference, t0: float, n: int | None
) -> tuple[Signal, Signal, Signal, Signal]:
    """x, u, w and v of a reference, checked, with zeros for what it does not give."""
    if not isinstance(reference, Reference):
        raise TypeError(f"reference must be a Reference; found {type(reference).__name__}")
    return (
        checked_signal("reference.x", reference.x, t0, n),
        checked_signal("reference.u", reference.u, t0, None),
        checked_signal("reference.w", reference.w, t0, len(system.Q)),
        checked_signal("reference.v", reference.v, t0, len(system.R)),
    )
