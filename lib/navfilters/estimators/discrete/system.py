"""A discrete-time system whose noises need not be additive, as the two models of a filter.

::

    run(FILTERS["EKF"], prior, y, system.sensor, dynamics=system.dynamics(u), z_per_step=True)
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from navfilters.estimators.discrete.models import DiscreteDynamics, DiscreteSensor, fits, zeros
from navfilters.numerics import validation
from navfilters.numerics.jacobians import check_model, jacobian
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class DiscreteSystem:
    """x_k = f(x_{k-1}, u_{k-1}, w_{k-1}, k-1),   y_k = h(x_k, v_k, k),   w ~ N(0, Q),   v ~ N(0, R)

    Its filters take :attr:`sensor` for their model and :meth:`dynamics` for their dynamics. They
    see f and h at zero noise, and L Q L^T and M R M^T as additive noise: the unscented filter too.

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
        abs, norm or .real. Of JAX arrays they are computed in forward mode.

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

    def dynamics(self, u: Any = None) -> DiscreteDynamics:
        """The motion, under known inputs.

        Parameters
        ----------
        u : array-like (K, ..., m), optional
            The inputs of steps 0 to K - 1, one for each of a run's steps. By default none: f sees
            an array of size 0.

        Returns
        -------
        DiscreteDynamics

        Raises
        ------
        ValueError
            A wrong shape, or a value that is not finite.
        """
        if u is None:
            return DiscreteDynamics(self)
        u = validation.real_array("u", u, "")
        if u.ndim < 2 or 0 in u.shape:
            raise ValueError(f"u must have shape (K, ..., m); found {u.shape}")
        return DiscreteDynamics(self, np.moveaxis(u, 0, -2))

    @property
    def sensor(self) -> DiscreteSensor:
        """The measurement."""
        return DiscreteSensor(self)

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
        at, n = (x, u, zeros(x, self.Q), k), x.shape[-1]
        F, L = self._jacobians["F"](*at), self._jacobians["L"](*at)
        return fits("system.F", F, (n, n)), fits("system.L", L, (n, len(self.Q)))

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
        at = x, zeros(x, self.R), k
        H, M = self._jacobians["H"](*at), self._jacobians["M"](*at)
        H = fits("system.H", H, (np.shape(H)[-2] if np.ndim(H) > 1 else 1, x.shape[-1]))
        return H, fits("system.M", M, (H.shape[-2], len(self.R)))
