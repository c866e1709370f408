"""The two models that a discrete-time system is to a filter: its motion and its measurement."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.jacobians import around, examine
from navfilters.numerics.probing import members, probe
from navfilters.numerics.state_derivatives import first_derivative, second_derivative
from navfilters.types import Array, Gaussian


@dataclass(frozen=True, eq=False)
class DiscreteDynamics:
    """The motion of a discrete-time system, as a filter's dynamics.

    Parameters
    ----------
    system : DiscreteSystem
    u : array (..., K, m), optional
        The inputs of all steps.
    k : int
        The step it starts from.

    References
    ----------
    lecture16, Eqs. (81)-(84), whose index k is k + 1 here.
    """

    system: Any
    u: Array | None = field(default=None, metadata={"axes": 2})
    k: Any = 0

    def at(self, k: int) -> "DiscreteDynamics":
        """The motion from step k, counted from 0, to the next."""
        return DiscreteDynamics(self.system, self.u, k)

    @property
    def Q(self) -> Array:
        """The system's, with the batch axes of the inputs."""
        Q = self.system.Q
        if self.u is None or self.u.ndim == 2:
            return Q
        return Q.__array_namespace__().broadcast_to(Q, (*self.u.shape[:-2], *Q.shape))

    def f(self, x: Array) -> Array:
        """f(x, u_k, 0, k), (..., n)."""
        return self._moved(*self._with_input(x))

    def _moved(self, x: Array, u: Array) -> Array:
        moved = self.system.f(x, u, zeros(x, self.system.Q), self.k)
        return fits("system.f", moved, x.shape[-1:])

    def propagate(self, x: Array, Q: Array) -> tuple[Array, Array, Array]:
        """f(x, u_k, 0, k), F and L Q L^T."""
        x, u = self._with_input(x)
        F, L = self.system.motion_jacobians(x, u, self.k)
        return self._moved(x, u), F, L @ Q @ L.mT

    def hessian(self, x: Array) -> Array:
        """Second derivatives of f in x, (..., n, n, n)."""
        x, u = self._with_input(x)
        w = zeros(x, self.system.Q)
        return _second(self.system.f, self.system.F, x, (u, w, self.k), "system.f")

    def _with_input(self, x: Array) -> tuple[Array, Array]:
        """A state with all batch axes of its input, and the input."""
        xp = x.__array_namespace__()
        if self.u is None:
            return x, xp.zeros(0)
        u = xp.asarray(self.u)[..., self.k, :]
        if u.ndim == 1:
            return x, u
        batch = np.broadcast_shapes(x.shape[:-1], u.shape[:-1])
        return xp.broadcast_to(x, (*batch, x.shape[-1])), u

    def check(self, prior: Gaussian, steps: int) -> None:
        """Every function called once, before any step of a run.

        Parameters
        ----------
        prior : Gaussian
        steps : int

        Raises
        ------
        ValueError
            Another number of inputs than of steps; a function whose value has a wrong shape or
            mixes members.
        TypeError
            A function that has neither a Jacobian nor a derivative by complex step.
        """
        if self.u is not None and self.u.shape[-2] != steps:
            raise ValueError(f"u must have one input per step, {steps}; found {self.u.shape[-2]}")
        x, u = self._with_input(_all_means(prior))
        n, batch, J = x.shape[-1], x.shape[:-1], self.system._jacobians
        at = x, u, zeros(x, self.system.Q), self.k
        members("system.f", self.system.f, at, 2, (n,), batch, whole=True)
        members("system.F", J["F"], at, 2, (n, n), batch, whole=False)
        members("system.L", J["L"], at, 2, (n, len(self.system.Q)), batch, whole=False)
        self.examine(around(prior))

    def examine(self, states: list[Array]) -> None:
        """The automatic Jacobians against differences at some states: TypeError names system.f."""
        for x, u in map(self._with_input, states):
            for name in "FL":
                at = x, u, zeros(x, self.system.Q), self.k
                examine(self.system._jacobians[name], [at])


@dataclass(frozen=True, eq=False)
class DiscreteSensor:
    """The measurement of a discrete-time system, as a filter's model.

    Parameters
    ----------
    system : DiscreteSystem
    k : int
        The step of the measurement: that of a run's first step is 1.

    References
    ----------
    lecture16, Eqs. (85)-(88).
    """

    system: Any
    k: Any = 1

    def at(self, k: int) -> "DiscreteSensor":
        """The measurement after the motion from step k, counted from 0."""
        return DiscreteSensor(self.system, k + 1)

    @property
    def R(self) -> Array:
        """The system's, (v, v)."""
        return self.system.R

    def h(self, x: Array) -> Array:
        """h(x, 0, k), (..., p)."""
        value = validation.given("system.h", self.system.h(x, zeros(x, self.R), self.k))
        if value.ndim < x.ndim:
            lead = ", ".join(map(str, x.shape[:-1]))
            raise ValueError(f"system.h must have shape ({lead}, p); found {value.shape}")
        return value

    def jacobian(self, x: Array) -> Array:
        """H, (..., p, n)."""
        H = self.system._jacobians["H"](x, zeros(x, self.R), self.k)
        return fits("system.H", H, (np.shape(H)[-2] if np.ndim(H) > 1 else 1, x.shape[-1]))

    def noise(self, x: Array) -> Array:
        """M R M^T, (..., p, p)."""
        M = self.system._jacobians["M"](x, zeros(x, self.R), self.k)
        M = fits("system.M", M, (np.shape(M)[-2] if np.ndim(M) > 1 else 1, len(self.R)))
        return M @ self.R @ M.mT

    def hessian(self, x: Array) -> Array:
        """Second derivatives of h in x, (..., p, n, n)."""
        at = zeros(x, self.R), self.k
        return _second(self.system.h, self.system.H, x, at, "system.h")

    def check(self, prior: Gaussian, steps: int) -> None:
        """Every function called once, before any step of a run.

        Parameters
        ----------
        prior : Gaussian
        steps : int
            Unused.

        Raises
        ------
        ValueError, TypeError
            As of :meth:`DiscreteDynamics.check`.
        """
        x, J, v = _all_means(prior), self.system._jacobians, len(self.R)
        at, batch, n = (x, zeros(x, self.R), self.k), x.shape[:-1], x.shape[-1]
        alone = x[(0,) * (x.ndim - 1)] if x.size else np.ones(n)
        p = probe("system.h", self.system.h, (alone, *at[1:]), ()).shape[-1:] or (1,)
        members("system.h", self.system.h, at, 1, p, batch, whole=True)
        members("system.H", J["H"], at, 1, (*p, n), batch, whole=False)
        members("system.M", J["M"], at, 1, (*p, v), batch, whole=False)
        self.examine(around(prior))

    def examine(self, states: list[Array]) -> None:
        """The automatic Jacobians against differences at some states: TypeError names system.h."""
        for name in "HM":
            at = [(x, zeros(x, self.R), self.k) for x in states]
            examine(self.system._jacobians[name], at)


def fits(name: str, value: Any, shape: tuple[int, ...]) -> Array:
    """What a function gave, as an array with these trailing axes."""
    return validation.core(name, validation.given(name, value), shape)


def zeros(x: Array, covariance: Array) -> Array:
    """No noise, of x's kind of array."""
    return x.__array_namespace__().zeros(covariance.shape[-1])


def _second(
    function: Callable[..., Array],
    jacobian: Callable[..., Array] | None,
    x: Array,
    rest: tuple[Any, ...],
    name: str,
) -> Any:
    """Second derivatives in x, of a function or of its Jacobian."""
    if jacobian is None:
        return second_derivative(lambda y: function(y, *rest), x, name)
    return first_derivative(lambda y: jacobian(y, *rest), x, name)


def _all_means(prior: Gaussian) -> Array:
    """The means, with the batch axes of the covariances too."""
    batch = np.broadcast_shapes(prior.mean.shape[:-1], prior.cov.shape[:-2])
    return np.broadcast_to(prior.mean, (*batch, prior.mean.shape[-1]))
