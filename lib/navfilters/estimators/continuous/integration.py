"""Integrate an estimate and its covariance together, from measurement to measurement."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from navfilters.estimators.continuous.system import ContinuousSystem, Signal
from navfilters.numerics import validation
from navfilters.types import Gaussian

Linearized = Callable[[float, np.ndarray], tuple[np.ndarray, ...]]
"""Time and estimate -> drift, innovation, A, L, C, M."""


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


def integrate(
    system: ContinuousSystem,
    model: Linearized,
    start: Gaussian,
    t: np.ndarray,
    rtol: float,
    atol: float,
    method: Any,
    origin: Signal | None,
) -> Trajectory:
    """Mean and Riccati equation together; origin(t) is added to the mean afterwards: Eq. (30)."""
    n = start.mean.size
    upper = np.triu_indices(n)
    places = np.empty((n, n), int)
    places[upper] = places.T[upper] = np.arange(n, n + len(upper[0]))

    def unpack(state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return state[..., :n], state.take(places, axis=-1)

    def rate(s: float, state: np.ndarray) -> np.ndarray:
        x, P = unpack(state)
        drift, innovation, A, L, C, M = model(s, x)
        seen, noise = np.concatenate([C, innovation[:, None]], axis=1), M @ system.R @ M.T
        if noise.size == 1 and noise[0, 0] > 0:
            whitened = seen * (1 / np.sqrt(noise))  # what LAPACK does, without its calls
        else:
            try:
                whitened = np.linalg.solve(np.linalg.cholesky(noise), seen)
            except np.linalg.LinAlgError:
                raise ValueError(
                    "M R M^T, from system.M and system.R, must be positive definite; found "
                    f"{noise.tolist()} at t = {s:.6g}"
                ) from None
        G = whitened[:, :-1] @ P  # G^T G = P C^T R~^-1 C P
        AP = A @ P
        P_dot = AP + AP.T - G.T @ G + L @ system.Q @ L.T
        return np.concatenate([drift + G.T @ whitened[:, -1], P_dot[upper]])

    floor = _smallest_deviations(start, model, system.Q, t)

    def deviations(P: np.ndarray) -> np.ndarray:
        variance = np.diagonal(P, axis1=-2, axis2=-1)
        return np.maximum(np.sqrt(np.maximum(variance, 0.0)), floor)

    def tolerance(state: np.ndarray) -> np.ndarray:
        d = deviations(unpack(state)[1])
        return atol * np.concatenate([d, np.outer(d, d)[upper]])

    def check(times: np.ndarray, P: np.ndarray) -> None:
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

    from scipy.integrate import solve_ivp  # as long to import as the rest of the library

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

    def at(times: Any) -> Gaussian:
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


def _smallest_deviations(
    start: Gaussian, model: Linearized, Q: np.ndarray, t: np.ndarray
) -> np.ndarray:
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


def _following(method: Any, tolerance: Callable[..., Any]) -> Any:
    """The integrator of SciPy with an absolute tolerance that follows the state."""
    import scipy.integrate

    base: Any = getattr(scipy.integrate, method, None) if isinstance(method, str) else method
    if not (isinstance(base, type) and issubclass(base, scipy.integrate.OdeSolver)):
        return method  # for SciPy to refuse

    def step(solver: Any) -> Any:
        solver.atol = tolerance(solver.y)
        if base is scipy.integrate.LSODA:  # which keeps its own
            solver._lsoda_solver._integrator.call_args[1] = solver.atol
        return base._step_impl(solver)

    return type("Following", (base,), {"_step_impl": step})
