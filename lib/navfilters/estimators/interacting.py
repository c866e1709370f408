"""The interacting multiple model filter of Blom and Bar-Shalom."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from navfilters.estimators import model_parts
from navfilters.estimators.filter import Filter
from navfilters.estimators.state import FilterState
from navfilters.numerics import validation
from navfilters.types import Array, Gaussian


@dataclass(frozen=True, eq=False)
class Modes:
    """Dynamics of which one is true at a time; elsewhere than in an IMM they are the first.

    Parameters
    ----------
    modes : tuple of Dynamics
        Of one state; they may differ in Q alone. None has ``retract``: means are averaged. If one
        has batch axes all have them.

    Raises
    ------
    ValueError
        Fewer than two; a ``retract``; a Q with batch axes beside one without.
    """

    modes: tuple[Any, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "modes", tuple(self.modes))
        if len(self.modes) < 2:
            raise ValueError(f"modes must be at least two dynamics; found {len(self.modes)}")
        for mode in self.modes:
            if hasattr(mode, "retract"):
                raise ValueError(
                    "modes must have states that are vectors, of which a mean can be taken; found "
                    f"retract in {type(mode).__name__}"
                )
        axes = [np.ndim(mode.Q) for mode in self.modes]
        if len(set(axes)) > 1:
            raise ValueError(f"modes must have Q with as many axes; found {axes}")

    def at(self, k: Array) -> "Modes":
        """Those of step k."""
        return Modes(tuple(model_parts.at(mode, k) for mode in self.modes))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name in ("modes", "at", "check", "examine"):
            raise AttributeError(name)
        return getattr(self.modes[0], name)


class ModeMemory(NamedTuple):
    """What an IMM remembers.

    Parameters
    ----------
    probabilities : array (..., r)
        Of the modes.
    states : tuple of FilterState
        Those of each mode's filter.
    """

    probabilities: Array
    states: tuple[FilterState, ...]


def _likely_to_stay() -> np.ndarray:
    return np.array([[0.95, 0.05], [0.05, 0.95]])


@dataclass(frozen=True, eq=False)
class InteractingModels:
    """A filter for each mode; before each prediction they exchange what they know.

    mu_ij = p_ij mu_i / c_j,   c_j = sum_i p_ij mu_i,   and mode j goes on from the mean and the
    covariance of the mixture of all modes' estimates with weights mu_ij;
    after the update mu_j is proportional to c_j times mode j's likelihood of the innovation

    Parameters
    ----------
    estimator : Filter
        That of every mode; with any moments, variant and rule.
    switching : array (..., r, r)
        p_ij, the probability of mode j after mode i; rows sum to 1.
    probabilities : array (..., r), optional
        Of the modes before any step; by default all alike.

    Raises
    ------
    TypeError
        An estimator that is no Filter; from a step, dynamics that are not ``Modes``.
    ValueError
        Probabilities that are none; from a step, another number of modes.

    Notes
    -----
    The state's estimate, innovation and S are mean and covariance of the modes' mixtures; so its
    log-likelihood is that of one Gaussian. A step without dynamics mixes nothing.

    References
    ----------
    blom1988.
    """

    estimator: Filter = field(default_factory=Filter)
    switching: Array = field(default_factory=_likely_to_stay, metadata={"axes": 2})
    probabilities: Array | None = field(default=None, metadata={"axes": 1})

    def __post_init__(self) -> None:
        if not isinstance(self.estimator, Filter):
            raise TypeError(f"estimator must be a Filter; found {type(self.estimator).__name__}")
        p = _distribution("switching", self.switching, "r, r")
        r = p.shape[-1]
        if p.shape[-2] != r or r < 2:
            raise ValueError(f"switching must have shape (..., r, r), r > 1; found {p.shape}")
        object.__setattr__(self, "switching", p)
        if self.probabilities is not None:
            mu = _distribution("probabilities", self.probabilities, "r")
            if mu.shape[-1] != r:
                raise ValueError(f"probabilities must have shape (..., {r}); found {mu.shape}")
            object.__setattr__(self, "probabilities", mu)

    def init(self, prior: Gaussian) -> FilterState:
        """The state before any step."""
        one = self.estimator.init(prior)
        xp, r = one.estimate.mean.__array_namespace__(), np.shape(self.switching)[-1]
        mu = np.full(r, 1 / r) if self.probabilities is None else self.probabilities
        mu = xp.asarray(mu) + xp.zeros((*one.missed.shape, r))
        return one._replace(memory=ModeMemory(mu, (one,) * r))

    def predict(self, state: FilterState, dynamics: Any, k: Array = 0) -> FilterState:
        """The state one transition later: mixed, and each mode by its own dynamics."""
        if not isinstance(dynamics, Modes):
            raise TypeError(f"dynamics must be Modes; found {type(dynamics).__name__}")
        mu, states = state.memory
        modes = dynamics.modes  # the filter asks each for its step
        if len(modes) != len(states):
            raise ValueError(
                f"dynamics must have {len(states)} modes, as switching; found {len(modes)}"
            )
        xp = mu.__array_namespace__()
        joint = xp.asarray(self.switching) * mu[..., :, None]
        ahead = xp.sum(joint, axis=-2)
        weights = joint / xp.where(ahead > 0, ahead, 1.0)[..., None, :]
        estimates = [one.estimate for one in states]
        mixed = [_mixed(weights[..., j], estimates) for j in range(len(modes))]
        predicted = tuple(
            self.estimator.predict(one._replace(estimate=start), mode, k)
            for one, start, mode in zip(states, mixed, modes, strict=True)
        )
        estimate = _mixed(ahead, [one.estimate for one in predicted])
        return state._replace(estimate=estimate, memory=ModeMemory(ahead, predicted))

    def update(self, state: FilterState, z: Array, sensor: Any, k: Array = 0) -> FilterState:
        """The state after a measurement; nothing measured tells nothing of the modes."""
        mu, states = state.memory
        xp = mu.__array_namespace__()
        states = tuple(self.estimator.update(one, z, sensor, k) for one in states)
        logs = [one.log_likelihood for one in states]
        log = xp.where(mu > 0, xp.stack(xp.broadcast_arrays(*logs), axis=-1), -xp.inf)
        weight = mu * xp.exp(log - xp.max(log, axis=-1, keepdims=True))
        after = weight / xp.sum(weight, axis=-1, keepdims=True)
        gone = xp.isnan(states[0].innovation)
        known = [Gaussian(xp.where(gone, 0.0, one.innovation), one.S) for one in states]
        innovation, S = _mixed(mu, known)
        estimate = _mixed(after, [one.estimate for one in states])
        memory = ModeMemory(after, states)
        innovation = xp.where(gone, xp.nan, innovation)
        return FilterState(estimate, states[0].missed, memory, innovation, S)

    def step(
        self, state: FilterState, z: Array, sensor: Any, dynamics: Any = None, k: Array = 0
    ) -> FilterState:
        """A prediction, where there are dynamics, and an update."""
        if dynamics is not None:
            state = self.predict(state, dynamics, k)
        return self.update(state, z, sensor, k)


def _distribution(name: str, value: Any, core: str) -> np.ndarray:
    array = validation.real_array(name, value, core)
    if (array < 0).any() or (abs(array.sum(axis=-1) - 1) > 1e-9).any():
        raise ValueError(f"{name} must be at least 0 and sum to 1; found {array.tolist()}")
    return array


def _mixed(weights: Array, parts: list[Gaussian]) -> Gaussian:
    """Mean and covariance of a mixture with weights (..., r)."""
    shares = [weights[..., i] for i in range(len(parts))]
    mean = sum(w[..., None] * part.mean for w, part in zip(shares, parts, strict=True))
    cov: Any = 0.0
    for w, part in zip(shares, parts, strict=True):
        off = part.mean - mean
        cov = cov + w[..., None, None] * (part.cov + off[..., :, None] * off[..., None, :])
    return Gaussian(mean, cov)
