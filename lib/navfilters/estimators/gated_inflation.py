"""A gate on the normalised innovation squared, behind which P is enlarged."""

from dataclasses import dataclass
from typing import NamedTuple

from navfilters.estimators.rule import Rule, sensed, zeros
from navfilters.numerics import validation
from navfilters.numerics.chi_square import quantile
from navfilters.numerics.loops import is_jax
from navfilters.numerics.small_matrices import matmul, right_divide
from navfilters.types import Array, Gaussian, Moments

NEWTON_STEPS = 10
"""Of the factor; the last digits stand after five or six."""


class GateMemory(NamedTuple):
    """What the gated rule remembers.

    Parameters
    ----------
    factor : array (...)
        The last factor; 1 where the gate was closed.
    opened : int array (...)
        Steps so far at which it was open.
    """

    factor: Array
    opened: Array


@dataclass(frozen=True, eq=False)
class GatedInflation(Rule):
    """The rule that enlarges P where an innovation is one that chi-square finds too large.

    P <- lambda P   if y^T S^-1 y exceeds the quantile of chi-square with m degrees of freedom,
    with y^T (lambda H P H^T + R)^-1 y = m, or with a fixed lambda

    Parameters
    ----------
    probability : float
        Of a consistent filter's innovation to stay below the gate.
    factor : float or array (...), optional
        A fixed lambda, at least 1. By default what brings the normalised innovation squared of the
        step to its expectation m.
    largest : float or array (...)
        Bound of lambda, which need not exist where H P H^T is singular.

    Raises
    ------
    ValueError
        A parameter that is out of range.

    Notes
    -----
    It remembers nothing of earlier innovations. The units of the state and of z do not matter.

    References
    ----------
    barshalom2001, section 11.2: the test, and a noise level that grows until the test is passed.
    There it is Q that grows, and up to the gate.
    """

    probability: float = 0.99
    factor: Array | None = None
    largest: Array = 1e6

    def __post_init__(self) -> None:
        value = validation.number("probability", self.probability)
        if not 0 < value < 1:
            raise ValueError(f"probability must be between 0 and 1; found {self.probability}")
        object.__setattr__(self, "probability", value)
        for name in ("largest",) if self.factor is None else ("factor", "largest"):
            given = validation.real_array(name, getattr(self, name), "")
            if not (given >= 1).all():
                raise ValueError(f"{name} must be at least 1; found {given.min()}")

    looks = True

    def init(self, prior: Gaussian) -> GateMemory:
        """Never open."""
        count = zeros(prior)
        return GateMemory(1.0 + count, count)

    def enlarge(
        self, memory: GateMemory, prior: Gaussian, y: Array | None, moments: Moments | None
    ) -> tuple[Gaussian, GateMemory]:
        """lambda P where the gate is open."""
        assert y is not None
        assert moments is not None
        xp, m = y.__array_namespace__(), y.shape[-1]
        spread = matmul(sensed(prior, moments)[0], moments.P_xz)
        opened = _solved(moments.P_zz, y)[1] > quantile(self.probability, m)
        bound = xp.asarray(self.largest)
        if self.factor is None:
            steps = NEWTON_STEPS if is_jax(xp) or opened.any() else 0  # none for closed gates
            factor = _to_expectation(y, moments.P_zz, spread, bound, steps)
        else:
            factor = xp.minimum(xp.asarray(self.factor), bound)
        factor = xp.where(opened, factor, 1.0)
        P = factor[..., None, None] * prior.cov
        return Gaussian(prior.mean, P), GateMemory(factor, memory.opened + opened)


def _solved(S: Array, y: Array) -> tuple[Array, Array]:
    """S^-1 y, (..., m), and y^T S^-1 y, (...)."""
    u = right_divide(y[..., None, :], S)[..., 0, :]
    return u, u.__array_namespace__().sum(u * y, axis=-1)


def _to_expectation(y: Array, S: Array, spread: Array, bound: Array, steps: int) -> Array:
    """The lambda with y^T (S + (lambda - 1) spread)^-1 y = m, where that is above 1.

    Newton's method on the inverse of the square, which is concave in lambda: from 1 it comes
    nearer with each step and never beyond.
    """
    xp, m = y.__array_namespace__(), y.shape[-1]
    factor = xp.minimum(1.0 + 0 * y[..., 0], bound)
    for _ in range(steps):
        u, square = _solved(S + (factor - 1)[..., None, None] * spread, y)
        slope = xp.sum(u * matmul(spread, u[..., None])[..., 0], axis=-1)
        slope = xp.where(slope > 0, slope, xp.inf)  # where P is not sensed there is no factor
        factor = xp.minimum(factor + square * (square / m - 1) / slope, bound)
    return factor
