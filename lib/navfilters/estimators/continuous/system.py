"""A system and a reference in continuous time."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from navfilters.numerics.jacobians import check_model, jacobian
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
        the start and the end of a filter: f and h must be analytic, without abs, norm or .real.

    Raises
    ------
    TypeError
        A function that cannot be called.
    ValueError
        Q or R is not a covariance.

    References
    ----------
    lecture16, Eqs. (1)-(4) and (15).
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
