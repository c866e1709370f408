"""The strong tracking filter of Zhou and Frank as a rule: old information fades as it must."""

from dataclasses import dataclass
from typing import NamedTuple

from navfilters.estimators.rule import Rule, innovation_spread, sensed, zeros
from navfilters.numerics import validation
from navfilters.types import Array, Gaussian, Moments


class FadingMemory(NamedTuple):
    """What the strong tracking rule remembers.

    Parameters
    ----------
    spread : array (..., m, m), optional
        Estimated covariance of the innovations; None, or NaN, before the first.
    factor : array (...)
        The last fading factor; 1 at first.
    faded : int array (...)
        Steps so far with a factor above 1.
    W : array (..., n, n), optional
        What the noise added to P at the prediction before; None without one.
    """

    spread: Array | None
    factor: Array
    faded: Array
    W: Array | None = None


@dataclass(frozen=True, eq=False)
class StrongTracking(Rule):
    """The rule that lets P fade until the innovations are as large as they were; it has no gate.

    P = lambda F P F^T + W,   lambda = max(1, tr N / tr M),
    N = V - beta R - H W H^T,   M = H F P F^T H^T,   V <- (rho V + y y^T) / (rho + 1)

    Parameters
    ----------
    rho : float or array (...)
        Forgetting factor of V, 0 to 1.
    beta : float or array (...)
        Softening factor, at least 1: the larger, the less fades.

    Raises
    ------
    ValueError
        A parameter that is out of range.

    Notes
    -----
    The traces add components as they are: with a metre beside a radian lambda depends on the units
    of z, not on those of the state. Of moments without an H it is P_xz^T P^-1.

    References
    ----------
    zhou1996: the suboptimal fading factor.
    """

    rho: Array = 0.95
    beta: Array = 1.0

    def __post_init__(self) -> None:
        rho = validation.real_array("rho", self.rho, "")
        if not ((rho >= 0) & (rho <= 1)).all():
            raise ValueError(f"rho must be from 0 to 1; found {self.rho}")
        if not (validation.real_array("beta", self.beta, "") >= 1).all():
            raise ValueError(f"beta must be at least 1; found {self.beta}")

    looks = True
    parts = True

    def init(self, prior: Gaussian) -> FadingMemory:
        """No innovation yet."""
        count = zeros(prior)
        return FadingMemory(None, 1.0 + count, count)

    def noise_added(self, memory: FadingMemory, W: Array) -> FadingMemory:
        """W does not fade."""
        return memory._replace(W=W)

    def enlarge(
        self, memory: FadingMemory, prior: Gaussian, y: Array | None, moments: Moments | None
    ) -> tuple[Gaussian, FadingMemory]:
        """P of the class docstring."""
        assert y is not None
        assert moments is not None
        xp = y.__array_namespace__()
        H, R = sensed(prior, moments)
        fresh = 0 * prior.cov if memory.W is None else memory.W
        old = prior.cov - fresh
        V = innovation_spread(memory.spread, y, self.rho)
        N = V - xp.asarray(self.beta)[..., None, None] * R - H @ fresh @ H.mT
        wanted, sensed_old = xp.linalg.trace(N), xp.linalg.trace(H @ old @ H.mT)
        grows = (wanted > sensed_old) & (sensed_old > 0)
        factor = xp.where(grows, wanted / xp.where(grows, sensed_old, 1.0), 1.0)
        P = prior.cov + (factor - 1)[..., None, None] * old
        after = FadingMemory(V, factor, memory.faded + grows, None if memory.W is None else 0 * P)
        return Gaussian(prior.mean, P), after
