"""A filter that learns the size of its measurement noise, by variational Bayes."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

from navfilters.estimators import model_parts
from navfilters.estimators.filter import Filter
from navfilters.estimators.rule import sensed
from navfilters.estimators.state import FilterState
from navfilters.estimators.update import absent
from navfilters.numerics import validation
from navfilters.types import Array, Gaussian


class NoiseMemory(NamedTuple):
    """What is known of the noise: inverse-gamma, for each component of z.

    Parameters
    ----------
    alpha : array (..., m), optional
        Shape: half of the measurements that the estimate is worth. None before the first.
    beta : array (..., m), optional
        Scale: the variance is beta / alpha times the sensor's.
    rule : named tuple, optional
        The memory of the filter's rule.
    """

    alpha: Array | None
    beta: Array | None
    rule: Any = None


@dataclass(frozen=True, eq=False)
class VariationalNoise:
    """A filter beside which the variance of each component of the noise is estimated.

    alpha <- rho alpha, beta <- rho beta   at a prediction; at an update alpha <- alpha + 1/2 and,
    so many times, the update with R_i beta_i / alpha_i and
    beta_i <- beta_i(before) + E (z_i - h_i(x))^2 / (2 R_i),   over the updated state

    Parameters
    ----------
    estimator : Filter
        With any moments, variant and rule. E is by its own moments.
    rho : float or array (...)
        How much of the knowledge a prediction keeps, above 0 and up to 1.
    strength : float or array (...)
        The first alpha, positive: how much the sensor's R is trusted at first.
    iterations : int
        Of each update, at least 1.

    Raises
    ------
    TypeError
        An estimator that is no Filter.
    ValueError
        A parameter that is out of range.

    Notes
    -----
    The estimate is of factors of the sensor's R, whose correlations stay. Without dynamics nothing
    is forgotten.

    References
    ----------
    sarkka2009, for a linear model and a diagonal R, there with the variances themselves.
    """

    estimator: Filter = field(default_factory=Filter)
    rho: Array = 0.98
    strength: Array = 5.0
    iterations: int = 3

    def __post_init__(self) -> None:
        if not isinstance(self.estimator, Filter):
            raise TypeError(f"estimator must be a Filter; found {type(self.estimator).__name__}")
        rho = validation.real_array("rho", self.rho, "")
        if not ((rho > 0) & (rho <= 1)).all():
            raise ValueError(f"rho must be above 0 and at most 1; found {self.rho}")
        if not (validation.real_array("strength", self.strength, "") > 0).all():
            raise ValueError(f"strength must be positive; found {self.strength}")
        count = validation.whole_number("iterations", self.iterations, 1)
        object.__setattr__(self, "iterations", count)

    def init(self, prior: Gaussian) -> FilterState:
        """The state before any step."""
        return _with(self.estimator.init(prior), None, None)

    def predict(self, state: FilterState, dynamics: Any, k: Array = 0) -> FilterState:
        """The state one transition later, less sure of its noise."""
        alpha, beta, _ = state.memory
        after = self.estimator.predict(_inner(state), dynamics, k)
        if alpha is None:
            return _with(after, None, None)
        rho = alpha.__array_namespace__().asarray(self.rho)[..., None]
        return _with(after, rho * alpha, rho * beta)

    def update(self, state: FilterState, z: Array, sensor: Any, k: Array = 0) -> FilterState:
        """The state after a measurement; where a component is missing its noise is as it was."""
        z, sensor = model_parts.seen(validation.given("z", z), sensor, k)
        before, (alpha, beta, _) = _inner(state), state.memory
        R = model_parts.noise(sensor, before.estimate.mean)
        xp = R.__array_namespace__()
        variance = xp.linalg.diagonal(R)
        given = xp.asarray(self.strength)[..., None]
        first = xp.where(xp.isnan(z + variance + before.estimate.mean[..., :1]), given, given)
        alpha = first if alpha is None else xp.where(xp.isnan(alpha), first, alpha)
        beta = first if beta is None else xp.where(xp.isnan(beta), first, beta)
        gone = absent(z)
        there = xp.ones_like(alpha) if gone is None else xp.where(gone, 0.0, 1.0)
        more, estimated = alpha + there / 2, beta
        after = before
        for _ in range(self.iterations):
            size = xp.sqrt(estimated / more)
            scaled = _WithNoise(sensor, size[..., :, None] * R * size[..., None, :])
            after = self.estimator.update(before, z, scaled, k)
            moments = self.estimator.moments(after.estimate, scaled)
            spread = moments.P_zz - sensed(after.estimate, moments)[1]
            rest = model_parts.residual(sensor, z, moments.z_hat)
            squares = rest**2 + xp.linalg.diagonal(spread)
            estimated = beta + there * xp.where(there > 0, squares, 0.0) / (2 * variance)
        return _with(after, more, estimated)

    def step(
        self, state: FilterState, z: Array, sensor: Any, dynamics: Any = None, k: Array = 0
    ) -> FilterState:
        """A prediction, where there are dynamics, and an update."""
        if dynamics is not None:
            state = self.predict(state, dynamics, k)
        return self.update(state, z, sensor, k)


def _inner(state: FilterState) -> FilterState:
    return state._replace(memory=state.memory.rule)


def _with(state: FilterState, alpha: Array | None, beta: Array | None) -> FilterState:
    return state._replace(memory=NoiseMemory(alpha, beta, state.memory))


class _WithNoise:
    """A sensor as it is at one update, with another R."""

    def __init__(self, sensor: Any, R: Array) -> None:
        self.sensor, self.R = sensor, R

    def __getattr__(self, name: str) -> Any:
        if name in ("noise", "at", "given", "sensor"):
            raise AttributeError(name)
        return getattr(self.sensor, name)
