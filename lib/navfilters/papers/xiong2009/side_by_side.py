"""Several filters of one orbit in one flight."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from navfilters.estimators import model_parts
from navfilters.estimators.filter import Filter
from navfilters.estimators.moments import linearized
from navfilters.estimators.prediction import in_parts, predict_linearized
from navfilters.estimators.rule import Rule
from navfilters.estimators.state import FilterState
from navfilters.types import Array, Gaussian


class Flown(NamedTuple):
    """The states of all filters.

    Parameters
    ----------
    states : tuple of FilterState
    """

    states: tuple[FilterState, ...]

    @property
    def estimate(self) -> Gaussian:
        """The estimates of all, one behind the other on the first axis."""
        means, covs = zip(*(state.estimate for state in self.states), strict=True)
        return Gaussian(*_stacked((means, 1), (covs, 2)))


@dataclass(frozen=True)
class SideBySide:
    """Linearised filters that predict together, and look at the measurement each on its own.

    The integration of the orbit costs most of a flight, and of many states it costs little more
    than of a few. Each filter's states are, to the last bit, those of a flight of its own.

    Parameters
    ----------
    filters : tuple of Filter
        With a linearised prediction.

    Raises
    ------
    ValueError
        Others.
    """

    filters: tuple[Filter, ...]

    def __post_init__(self) -> None:
        for one in self.filters:
            if not isinstance(one, Filter) or one.moments is not linearized:
                raise ValueError(f"filters must be of linearized moments; found {one!r}")

    def init(self, prior: Gaussian) -> Flown:
        """The states before any step."""
        return Flown(tuple(one.init(prior) for one in self.filters))

    def predict(self, state: Flown, dynamics: Any, k: int = 0) -> Flown:
        """The states one transition later."""
        dynamics = model_parts.at(dynamics, k)
        rules = [one.rule or Rule() for one in self.filters]
        told = [
            rule.process_noise(before.memory, dynamics.Q)
            for rule, before in zip(rules, state.states, strict=True)
        ]
        means, covs = zip(*(before.estimate for before in state.states), strict=True)
        mean, cov, Q = _stacked((means, 1), (covs, 2), ([noise for noise, _ in told], 2))
        after, W = in_parts(predict_linearized, Gaussian(mean, cov), dynamics, Q)
        return Flown(
            tuple(
                before._replace(estimate=Gaussian(*one), memory=rule.noise_added(memory, added))
                for before, rule, (_, memory), added, *one in zip(
                    state.states, rules, told, W, *after, strict=True
                )
            )
        )

    def update(self, state: Flown, z: Array, sensor: Any, k: int = 0) -> Flown:
        """The states after a measurement."""
        pairs = zip(self.filters, state.states, strict=True)
        return Flown(tuple(one.update(before, z, sensor, k) for one, before in pairs))

    def step(self, state: Flown, z: Array, sensor: Any, dynamics: Any = None, k: int = 0) -> Flown:
        """A prediction, where there are dynamics, and an update."""
        if dynamics is not None:
            state = self.predict(state, dynamics, k)
        return self.update(state, z, sensor, k)


def _stacked(*series: tuple[Any, int]) -> list[np.ndarray]:
    """Arrays of each filter with so many axes of their own; as many batch axes behind the first."""
    axes = max(part.ndim - core for parts, core in series for part in parts)
    stacked = []
    for parts, core in series:
        padded = [part.reshape(*(1,) * (axes + core - part.ndim), *part.shape) for part in parts]
        stacked.append(np.stack(np.broadcast_arrays(*padded)))
    return stacked
