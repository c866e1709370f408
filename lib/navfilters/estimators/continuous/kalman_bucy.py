"""Kalman-Bucy filters: linearised about a reference, and extended."""

from typing import Any

import numpy as np

from navfilters.estimators.continuous.checks import (
    arguments,
    checked_signal,
    examine_system,
    probe_system,
    tolerances,
)
from navfilters.estimators.continuous.integration import Trajectory, integrate
from navfilters.estimators.continuous.reference import check_reference, reference_signals
from navfilters.estimators.continuous.system import ContinuousSystem, Reference, Signal
from navfilters.numerics import validation
from navfilters.numerics.jacobians import around
from navfilters.numerics.probing import probe
from navfilters.types import Gaussian


def linearized_kalman_bucy(
    system: ContinuousSystem,
    reference: Reference,
    prior: Gaussian,
    y: Signal,
    t: Any,
    u: Signal | None = None,
    *,
    rtol: float = 1e-8,
    atol: float = 1e-8,
    method: str = "DOP853",
    residual_tol: float = 1e-6,
) -> Trajectory:
    """The Kalman-Bucy filter linearised about a reference trajectory (CT-LKF).

    dx~/dt = A x~ + B u~ - L w_ref + K (y~ - C x~ + M v_ref),   x_hat = x_ref + x~
    dP/dt = A P + P A^T - P C^T (M R M^T)^-1 C P + L Q L^T,   K = P C^T (M R M^T)^-1

    with x~ = x - x_ref, u~ = u - u_ref, y~ = y - h(x_ref, v_ref, t) and Jacobians on the reference.

    Parameters
    ----------
    system : ContinuousSystem
    reference : Reference
    prior : Gaussian
        mean (n,), the state itself and not its deviation, and cov (n, n), at the first time.
    y : callable
        t -> (p,): the measurement signal.
    t : array-like (k,)
        Output times, increasing; the filter runs from the first to the last. Signals that jump
        should jump at one of them.
    u : callable, optional
        t -> (m,): the actual input; by default the reference's.
    rtol, atol : float
        Tolerances of the integrator. atol is in units of the deviations that P has at the time,
        products of them for the covariance itself; for a component that the prior knows exactly
        they start from what the noise makes of it in a thousandth of the time.
    method : str
        Of ``scipy.integrate.solve_ivp``; "LSODA" or "Radau" where P decays much faster than the
        state moves.
    residual_tol : float
        Largest :func:`reference_residual` allowed, as a fraction of the rates' scale.

    Returns
    -------
    Trajectory
        Of x_hat and P.

    Raises
    ------
    ValueError
        A wrong shape or value, a reference that does not satisfy its dynamics, a singular M R M^T;
        before the integration. What y, u or M R M^T become later is reported with its time.
    RuntimeError
        The integrator stopped, with its time and reason; or P, as a correlation, has an eigenvalue
        below -100 max(rtol, atol), at a step or at a time that is asked for, with what to do.

    References
    ----------
    lecture16, Eqs. (5)-(30).
    """
    t, prior, y, y0 = arguments(system, prior, y, t)
    rtol, atol = tolerances(rtol, atol)
    if not (np.ndim(residual_tol) == 0 and residual_tol == np.inf):
        validation.number("residual_tol", residual_tol, least=0, needed="a number of at least 0")
    x_ref, u_ref, w_ref, v_ref = reference_signals(system, reference, t[0], prior.mean.size)
    u = u_ref if u is None else checked_signal("u", u, t[0], u_ref(t[0]).size)
    probe_system(system, x_ref(t[0]), u(t[0]), w_ref(t[0]), v_ref(t[0]), t[0], y0.size)
    at = x_ref(t[0]), u_ref(t[0]), w_ref(t[0]), t[0]
    if at[1].size:
        probe("system.B", system.jacobian("B"), at, (at[0].size, at[1].size), ())
    for s in (t[0], t[t.size // 2], t[-1]):
        examine_system(system, [x_ref(s)], u_ref(s), w_ref(s), v_ref(s), s)
    check_reference(system, reference, t, residual_tol)
    A, B, L, C, M = (system.jacobian(name) for name in "ABLCM")

    def model(s: float, x: np.ndarray) -> tuple[np.ndarray, ...]:
        known = x_ref(s)
        at, sensing = (known, u_ref(s), w_ref(s), s), (known, v_ref(s), s)
        A_s, L_s, C_s, M_s = A(*at), L(*at), C(*sensing), M(*sensing)
        drift = A_s @ x - L_s @ at[2]
        if at[1].size:
            drift = drift + B(*at) @ (u(s) - at[1])
        innovation = y(s) - system.h(*sensing) - C_s @ x + M_s @ sensing[1]
        return drift, innovation, A_s, L_s, C_s, M_s

    start = Gaussian(prior.mean - x_ref(t[0]), prior.cov)
    return integrate(system, model, start, t, rtol, atol, method, x_ref)


def extended_kalman_bucy(
    system: ContinuousSystem,
    prior: Gaussian,
    y: Signal,
    t: Any,
    u: Signal | None = None,
    *,
    rtol: float = 1e-8,
    atol: float = 1e-8,
    method: str = "DOP853",
) -> Trajectory:
    """The Kalman-Bucy filter linearised about its own estimate (CT-EKF).

    dx/dt = f(x, u, 0, t) + K (y - h(x, 0, t)),   K = P C^T (M R M^T)^-1
    dP/dt = A P + P A^T - P C^T (M R M^T)^-1 C P + L Q L^T,   all Jacobians at the estimate

    Parameters
    ----------
    system : ContinuousSystem
    prior : Gaussian
        mean (n,) and cov (n, n) at the first time.
    y : callable
        t -> (p,): the measurement signal.
    t : array-like (k,)
        Output times, increasing; the filter runs from the first to the last.
    u : callable, optional
        t -> (m,): the input. By default none: f sees an array of size 0.
    rtol, atol, method
        As of :func:`linearized_kalman_bucy`.

    Returns
    -------
    Trajectory

    Raises
    ------
    ValueError, RuntimeError
        As of :func:`linearized_kalman_bucy`.

    Notes
    -----
    Both reference noises are zero, the mean of the noise: to first order, the correction that (34)
    needs for any other w_ref leads back to it.

    References
    ----------
    lecture16, Eqs. (31)-(37).
    """
    t, prior, y, y0 = arguments(system, prior, y, t)
    rtol, atol = tolerances(rtol, atol)
    u = checked_signal("u", u, t[0], None)
    no_w, no_v = np.zeros(len(system.Q)), np.zeros(len(system.R))
    probe_system(system, prior.mean, u(t[0]), no_w, no_v, t[0], y0.size)
    examine_system(system, around(prior), u(t[0]), no_w, no_v, t[0])
    A, L, C, M = (system.jacobian(name) for name in "ALCM")

    def model(s: float, x: np.ndarray) -> tuple[np.ndarray, ...]:
        at, sensing = (x, u(s), no_w, s), (x, no_v, s)
        innovation = y(s) - system.h(*sensing)
        return system.f(*at), innovation, A(*at), L(*at), C(*sensing), M(*sensing)

    trajectory = integrate(system, model, prior, t, rtol, atol, method, None)
    examine_system(system, [trajectory.mean[-1]], u(t[-1]), no_w, no_v, t[-1])
    return trajectory
