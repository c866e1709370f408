"""The discrete-time extended Kalman filter, with noise that need not be additive.

    posterior --predict--> prior --update--> posterior

The update is :func:`~navfilters.estimators.update.kalman_update`, as of every other filter here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from navfilters.estimators.update import kalman_update
from navfilters.numerics import validation
from navfilters.numerics.jacobians import around, check_model, examine, jacobian
from navfilters.numerics.probing import members
from navfilters.types import Array, Gaussian, Moments


@dataclass(frozen=True, eq=False)
class DiscreteSystem:
    """x_k = f(x_{k-1}, u_{k-1}, w_{k-1}, k-1),   y_k = h(x_k, v_k, k),   w ~ N(0, Q),   v ~ N(0, R)

    Parameters
    ----------
    f : callable
        (x, u, w, k) -> (..., n): from step k to step k + 1, with x (..., n), u (..., m), w (w,).
    h : callable
        (x, v, k) -> (..., p): the measurement at step k, with v (v,).
    Q : array (w, w)
        Covariance of the process noise, in w's units squared.
    R : array (v, v)
        Covariance of the measurement noise, in v's units squared.
    F, L : callable, optional
        (x, u, w, k) -> (..., n, n) and (..., n, w): the Jacobians of f in x and w.
    H, M : callable, optional
        (x, v, k) -> (..., p, n) and (..., p, v): the Jacobians of h in x and v. Those not given are
        computed by :func:`~navfilters.numerics.complex_step.complex_step`,
        and compared with differences when they are first needed: f and h must be analytic, without
        abs, norm or .real.

    Raises
    ------
    TypeError
        A function that cannot be called.
    ValueError
        Q or R is not a covariance.

    References
    ----------
    lecture16, Eqs. (38)-(41), (73)-(78).
    """

    f: Callable[..., Array]
    h: Callable[..., Array]
    Q: Array
    R: Array
    F: Callable[..., Array] | None = None
    L: Callable[..., Array] | None = None
    H: Callable[..., Array] | None = None
    M: Callable[..., Array] | None = None

    def __post_init__(self) -> None:
        check_model(self, ("f", "h"), ("F", "L", "H", "M"))

    @cached_property
    def _jacobians(self) -> dict[str, Callable[..., Array]]:
        """F, L, H and M, given or by complex step; one object each, which knows its past."""
        of_f = (self.f, "system.f")
        of_h = (self.h, "system.h")
        wanted = {"F": (*of_f, 0), "L": (*of_f, 2), "H": (*of_h, 0), "M": (*of_h, 1)}
        return {
            J: jacobian(function, position, getattr(self, J), name=name)
            for J, (function, name, position) in wanted.items()
        }

    def motion_jacobians(self, x: Array, u: Array, k: int) -> tuple[Array, Array]:
        """F (..., n, n) and L (..., n, w) at the state x, with w = 0: Eqs. (81)-(82).

        Parameters
        ----------
        x : array (..., n)
        u : array (..., m)
        k : int
            The step that f starts from.

        Returns
        -------
        tuple of array
        """
        at, n = (x, u, np.zeros(len(self.Q)), k), x.shape[-1]
        F, L = self._jacobians["F"](*at), self._jacobians["L"](*at)
        return _fits("system.F", F, (n, n)), _fits("system.L", L, (n, len(self.Q)))

    def measurement_jacobians(self, x: Array, k: int) -> tuple[Array, Array]:
        """H (..., p, n) and M (..., p, v) at the state x, with v = 0: Eqs. (85)-(86).

        Parameters
        ----------
        x : array (..., n)
        k : int
            The step of the measurement.

        Returns
        -------
        tuple of array
        """
        at = x, np.zeros(len(self.R)), k
        H, M = self._jacobians["H"](*at), self._jacobians["M"](*at)
        H = _fits("system.H", H, (np.shape(H)[-2] if np.ndim(H) > 1 else 1, x.shape[-1]))
        return H, _fits("system.M", M, (H.shape[-2], len(self.R)))


def predict(system: DiscreteSystem, posterior: Gaussian, u: Array, k: int) -> Gaussian:
    """The motion update, from step k to step k + 1.

    x_{k+1|k} = f(x_{k|k}, u_k, 0, k),   P_{k+1|k} = F P_{k|k} F^T + L Q L^T

    Parameters
    ----------
    system : DiscreteSystem
    posterior : Gaussian
        mean (..., n), cov (..., n, n), after the measurement of step k.
    u : array (..., m)
        The known input over the step; of size 0 where there is none.
    k : int
        The step it starts from.

    Returns
    -------
    Gaussian
        The prior of step k + 1.

    References
    ----------
    lecture16, Eqs. (81)-(84), whose index k is k + 1 here; L_k in (49) is the
    L_{k-1} of (84).
    """
    posterior, u = _given("posterior", posterior), validation.given("u", u)
    F, L = system.motion_jacobians(posterior.mean, u, k)
    P = F @ posterior.cov @ F.mT + L @ system.Q @ L.mT
    moved = system.f(posterior.mean, u, np.zeros(len(system.Q)), k)
    return Gaussian(_fits("system.f", moved, posterior.mean.shape[-1:]), (P + P.mT) / 2)


def update(system: DiscreteSystem, prior: Gaussian, y: Array, k: int) -> Gaussian:
    """The measurement update at step k.

    y_hat = h(x, 0, k),   S = H P H^T + M R M^T,   K = P H^T S^-1,
    x+ = x + K (y - y_hat),   P+ = (I - K H) P

    Parameters
    ----------
    system : DiscreteSystem
    prior : Gaussian
        mean (..., n), cov (..., n, n), before the measurement of step k.
    y : array (..., p)
        The measurement.
    k : int
        The step.

    Returns
    -------
    Gaussian
        The posterior of step k. Not finite where S is singular.

    References
    ----------
    lecture16, Eqs. (85)-(91). (66) carries a noise term that its own expectation removes; (68) and
    (87) have the estimate x_hat where they print x.
    """
    prior, y = _given("prior", prior), validation.given("y", y)
    H, M = system.measurement_jacobians(prior.mean, k)
    P_xz = prior.cov @ H.mT
    S = H @ P_xz + M @ system.R @ M.mT
    y_hat = _fits("system.h", system.h(prior.mean, np.zeros(len(system.R)), k), y.shape[-1:])
    return kalman_update(prior, y, Moments(y_hat, S, P_xz))


def extended_kalman_filter(
    system: DiscreteSystem, prior: Gaussian, y: Any, u: Any = None
) -> Gaussian:
    """The discrete-time extended Kalman filter over K measurements.

    Parameters
    ----------
    system : DiscreteSystem
    prior : Gaussian
        mean (..., n), cov (..., n, n): the estimate at step 0, before any measurement.
    y : array-like (K, ..., p)
        The measurements of steps 1 to K.
    u : array-like (K, ..., m), optional
        The inputs of steps 0 to K - 1. By default none: f sees an array of size 0.

    Returns
    -------
    Gaussian
        mean (K + 1, ..., n), cov (K + 1, ..., n, n): the prior, then each posterior. NaN from the
        step that cannot be computed.

    Raises
    ------
    ValueError
        A wrong shape, a value that is not finite, a covariance that is not one; before any step.
    TypeError
        system is not a DiscreteSystem, or one of its functions has neither a Jacobian nor a
        derivative by complex step.

    References
    ----------
    lecture16, the algorithm of Eqs. (73)-(91).
    """
    if not isinstance(system, DiscreteSystem):
        raise TypeError(f"system must be a DiscreteSystem; found {type(system).__name__}")
    prior = validation.gaussian("prior", prior)
    y = _per_step("y", y, "K, p")
    u = np.zeros((len(y), 0)) if u is None else _per_step("u", u, "K, m")
    if len(u) != len(y):
        raise ValueError(f"u must have one input per measurement, {len(y)}; found {len(u)}")
    prior = _check(system, prior, y, u)
    state, states = prior, [prior]
    with np.errstate(all="ignore"):  # a member that fails is NaN in the result: that is its report
        for k in range(len(y)):
            state = update(system, predict(system, state, u[k], k), y[k], k + 1)
            states.append(state)
        _examine(system, [state.mean], u[-1], len(y) - 1)  # where it has come to
    return Gaussian(np.stack([s.mean for s in states]), np.stack([s.cov for s in states]))


def _fits(name: str, value: Any, shape: tuple[int, ...]) -> Array:
    """What a function gave, as an array with these trailing axes."""
    return validation.core(name, validation.given(name, value), shape)


def _given(name: str, value: Gaussian) -> Gaussian:
    """A Gaussian of arrays that fit together; their values are not looked at."""
    mean = validation.given(f"{name}.mean", value.mean)
    return Gaussian(mean, _fits(f"{name}.cov", value.cov, mean.shape[-1:] * 2))


def _per_step(name: str, value: Any, axes: str) -> np.ndarray:
    """An array whose first axis is the step."""
    array = validation.real_array(name, value, "")
    if array.ndim < 2 or 0 in array.shape:
        wanted = ", ..., ".join(axes.split(", "))
        raise ValueError(f"{name} must have shape ({wanted}); found {array.shape}")
    return array


def _check(system: DiscreteSystem, prior: Gaussian, y: np.ndarray, u: np.ndarray) -> Gaussian:
    """Every function of the system, called once; the prior, with all the batch axes."""
    batch = validation.batch(
        **{
            "prior.mean": prior.mean.shape[:-1],
            "prior.cov": prior.cov.shape[:-2],
            "y": y.shape[1:-1],
            "u": u.shape[1:-1],
        }
    )
    n, w, v, p = prior.mean.shape[-1], len(system.Q), len(system.R), y.shape[-1]
    prior = Gaussian(
        np.broadcast_to(prior.mean, (*batch, n)), np.broadcast_to(prior.cov, (*batch, n, n))
    )
    at, sensing = (prior.mean, u[0], np.zeros(w), 0), (prior.mean, np.zeros(v), 1)
    J = system._jacobians
    members("system.f", system.f, at, 2, (n,), batch, whole=True)
    members("system.F", J["F"], at, 2, (n, n), batch, whole=False)
    members("system.L", J["L"], at, 2, (n, w), batch, whole=False)
    members("system.h", system.h, sensing, 1, (p,), batch, whole=True)
    members("system.H", J["H"], sensing, 1, (p, n), batch, whole=False)
    members("system.M", J["M"], sensing, 1, (p, v), batch, whole=False)
    with np.errstate(all="ignore"):
        _examine(system, around(prior), u[0], 0)
    return prior


def _examine(system: DiscreteSystem, states: list[np.ndarray], u: np.ndarray, k: int) -> None:
    """The automatic Jacobians against differences: f's from step k, h's at the step after it."""
    no_w, no_v = np.zeros(len(system.Q)), np.zeros(len(system.R))
    for name, J in system._jacobians.items():
        examine(J, [(x, u, no_w, k) if name in "FL" else (x, no_v, k + 1) for x in states])
