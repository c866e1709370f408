"""Kalman-Bucy filters of nonlinear systems: about a reference trajectory, and about the estimate.

Mean and covariance are integrated together by ``scipy.integrate.solve_ivp``; of the covariance
only the upper triangle, so that it cannot become asymmetric.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import scipy.integrate
from scipy.integrate import solve_ivp

from navfilters import validation
from navfilters.derivatives import around, check_model, examine, jacobian
from navfilters.probing import probe
from navfilters.types import Array, Gaussian

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
        :func:`~navfilters.derivatives.complex_step`, and compared with differences at the start
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


@dataclass(frozen=True, eq=False)
class Trajectory:
    """What a continuous filter knew at each time.

    Parameters
    ----------
    t : array (k,)
        The output times.
    at : callable
        Time or times (...) between the first and the last of t -> Gaussian, mean (..., n) and cov
        (..., n, n), exactly symmetric, from the integrator's dense output. ValueError outside.
    mean : array (k, n)
    cov : array (k, n, n)
    """

    t: np.ndarray
    at: Callable[[Any], Gaussian] = field(repr=False)
    mean: np.ndarray = field(repr=False)
    cov: np.ndarray = field(repr=False)


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

    Notes
    -----
    Slips of the text: the last P^-1 in (29) is P; (28)-(29) mean the matrices of (15), not of
    (35). Where the reference noise is not zero, w~ and v~ in (18)-(19) have the means -w_ref and
    -v_ref, which (28) lacks: the terms in w_ref and v_ref above.

    References
    ----------
    lecture16, Eqs. (5)-(30).
    """
    t, prior, y, y0 = _door(system, prior, y, t)
    rtol, atol = _tolerances(rtol, atol)
    if not (np.ndim(residual_tol) == 0 and residual_tol == np.inf):
        validation.number("residual_tol", residual_tol, least=0, needed="a number of at least 0")
    x_ref, u_ref, w_ref, v_ref = _signals(system, reference, t[0], prior.mean.size)
    u = u_ref if u is None else _signal("u", u, t[0], u_ref(t[0]).size)
    _probe(system, x_ref(t[0]), u(t[0]), w_ref(t[0]), v_ref(t[0]), t[0], y0.size)
    at = x_ref(t[0]), u_ref(t[0]), w_ref(t[0]), t[0]
    if at[1].size:
        probe("system.B", system.jacobian("B"), at, (at[0].size, at[1].size), ())
    for s in (t[0], t[t.size // 2], t[-1]):
        _examine(system, [x_ref(s)], u_ref(s), w_ref(s), v_ref(s), s)
    _check_reference(system, reference, t, residual_tol)
    A, B, L, C, M = (system.jacobian(name) for name in "ABLCM")

    def model(s, x):
        at, sensing = (x_ref(s), u_ref(s), w_ref(s), s), (x_ref(s), v_ref(s), s)
        A_s, L_s, C_s, M_s = A(*at), L(*at), C(*sensing), M(*sensing)
        drift = A_s @ x - L_s @ at[2]
        if at[1].size:
            drift = drift + B(*at) @ (u(s) - at[1])
        innovation = y(s) - system.h(*sensing) - C_s @ x + M_s @ sensing[1]
        return drift, innovation, A_s, L_s, C_s, M_s

    start = Gaussian(prior.mean - x_ref(t[0]), prior.cov)
    return _integrate(system, model, start, t, rtol, atol, method, x_ref)


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
    Slips of the text: the last P^-1 in (37) is P, and v_0 in (36) is v_ref. Both reference noises
    are zero here, the mean of the noise: to first order, the correction that (34) needs for any
    other w_ref leads back to it.

    References
    ----------
    lecture16, Eqs. (31)-(37).
    """
    t, prior, y, y0 = _door(system, prior, y, t)
    rtol, atol = _tolerances(rtol, atol)
    u = _signal("u", u, t[0], None)
    no_w, no_v = np.zeros(len(system.Q)), np.zeros(len(system.R))
    _probe(system, prior.mean, u(t[0]), no_w, no_v, t[0], y0.size)
    _examine(system, around(prior), u(t[0]), no_w, no_v, t[0])
    A, L, C, M = (system.jacobian(name) for name in "ALCM")

    def model(s, x):
        at, sensing = (x, u(s), no_w, s), (x, no_v, s)
        innovation = y(s) - system.h(*sensing)
        return system.f(*at), innovation, A(*at), L(*at), C(*sensing), M(*sensing)

    trajectory = _integrate(system, model, prior, t, rtol, atol, method, None)
    _examine(system, [trajectory.mean[-1]], u(t[-1]), no_w, no_v, t[-1])
    return trajectory


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


def _integrate(system, model, start, t, rtol, atol, method, origin) -> Trajectory:
    """Mean and Riccati equation together; origin(t) is added to the mean afterwards: Eq. (30)."""
    n = start.mean.size
    upper = np.triu_indices(n)

    def unpack(state):
        P = np.empty((*state.shape[:-1], n, n))
        P[..., upper[0], upper[1]] = P[..., upper[1], upper[0]] = state[..., n:]
        return state[..., :n], P

    def rate(s, state):
        x, P = unpack(state)
        drift, innovation, A, L, C, M = model(s, x)
        try:
            root = np.linalg.cholesky(M @ system.R @ M.T)
        except np.linalg.LinAlgError:
            raise ValueError(
                "M R M^T, from system.M and system.R, must be positive definite; found "
                f"{(M @ system.R @ M.T).tolist()} at t = {s:.6g}"
            ) from None
        whitened = np.linalg.solve(root, np.column_stack([C, innovation]))
        G = whitened[:, :-1] @ P  # G^T G = P C^T R~^-1 C P
        AP = A @ P
        P_dot = AP + AP.T - G.T @ G + L @ system.Q @ L.T
        return np.concatenate([drift + G.T @ whitened[:, -1], P_dot[upper]])

    floor = _smallest_deviations(start, model, system.Q, t)

    def deviations(P):
        variance = np.diagonal(P, axis1=-2, axis2=-1)
        return np.maximum(np.sqrt(np.maximum(variance, 0.0)), floor)

    def tolerance(state):
        d = deviations(unpack(state)[1])
        return atol * np.concatenate([d, np.outer(d, d)[upper]])

    def check(times, P):
        """P >= 0 as a correlation, to a hundred times what the integrator was allowed."""
        d = deviations(P)
        smallest = np.linalg.eigvalsh(P / d[..., :, None] / d[..., None, :])[..., 0]
        limit = -min(100 * max(rtol, atol), 0.1)
        if not (smallest >= limit).all():
            k = np.unravel_index(np.argmax(~(smallest >= limit)), smallest.shape)
            raise RuntimeError(
                f"the covariance is lost at t = {times[k]:.6g}: as a correlation its smallest "
                f"eigenvalue is {smallest[k]:.3g}, where {limit:.3g} is allowed. Reduce rtol and "
                f"atol (now {rtol:g} and {atol:g}), or try method='Radau' or a less vague prior"
            )

    first = np.concatenate([start.mean, start.cov[upper]])
    # Time counts from the start: near zero a float has room for the first steps of a vague prior.
    with np.errstate(all="ignore"):  # a state that overflows stops the integrator, reported below
        solution = solve_ivp(
            lambda s, state: rate(t[0] + s, state),
            (0.0, t[-1] - t[0]),
            first,
            _following(method, tolerance),
            dense_output=True,
            rtol=rtol,
            atol=tolerance(first),
        )
    if not solution.success:
        raise RuntimeError(
            f"integration stopped at t = {t[0] + solution.t[-1]:.6g}: {solution.message}"
        )
    check(t[0] + solution.t, unpack(solution.y.T)[1])

    def at(times):
        times = validation.real_array("times", times, "")
        slack = 1e-9 * (t[-1] - t[0])  # a sum of steps need not end on t[-1] to the last bit
        if times.size and (times.min() < t[0] - slack or times.max() > t[-1] + slack):
            found = f"{times.min():g} to {times.max():g}"
            raise ValueError(f"times must be within {t[0]:g} to {t[-1]:g}; found {found}")
        state = np.moveaxis(solution.sol(times.ravel() - t[0]), 0, -1).reshape(*times.shape, -1)
        mean, P = unpack(state)
        check(times, P)
        if origin is not None:
            mean = mean + np.array([origin(s) for s in times.ravel()]).reshape(mean.shape)
        return Gaussian(mean, P)

    return Trajectory(t, at, *at(t))


def _smallest_deviations(start, model, Q, t) -> np.ndarray:
    """The deviations below which the tolerances do not follow P.

    1e-15 of the prior's. For a component without one, what the noise makes of it in a thousandth of
    the time; 1 if that is nothing.
    """
    n = start.mean.size
    deviation = np.sqrt(np.diagonal(start.cov))
    if (deviation > 0).all():
        return 1e-15 * deviation
    with np.errstate(all="ignore"):
        *_, A, L, _, _ = model(t[0], start.mean)
    h = 1e-3 * (t[-1] - t[0]) / n
    P = start.cov
    for _ in range(n):  # so often noise can pass from one component to the next
        F = np.eye(n) + h * A
        P = F @ P @ F.T + h * L @ Q @ L.T
    grown = np.sqrt(np.diagonal(P))
    grown = np.where((grown > 0) & np.isfinite(grown), grown, 1.0)
    return np.where(deviation > 0, 1e-15 * deviation, grown)


def _following(method: Any, tolerance: Callable) -> Any:
    """The integrator of SciPy with an absolute tolerance that follows the state."""
    base: Any = getattr(scipy.integrate, method, None) if isinstance(method, str) else method
    if not (isinstance(base, type) and issubclass(base, scipy.integrate.OdeSolver)):
        return method  # for SciPy to refuse

    def step(solver):
        solver.atol = tolerance(solver.y)
        if base is scipy.integrate.LSODA:  # which keeps its own
            solver._lsoda_solver._integrator.call_args[1] = solver.atol
        return base._step_impl(solver)

    return type("Following", (base,), {"_step_impl": step})
