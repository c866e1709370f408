"""Another reading of the adaptive filter: the newest innovation enters the Q of its own step."""

from dataclasses import dataclass, field
from typing import Any

from navfilters.estimators.adaptive import AdaptiveNoise
from navfilters.estimators.filter import Filter
from navfilters.estimators.state import FilterState
from navfilters.types import Array, Dynamics, Gaussian, MeasurementModel


@dataclass(frozen=True)
class CurrentNoise:
    """The adaptive filter whose Q_t is made of the innovations up to y_t.

    Each step is taken twice: to see the innovation, and with the Q that it leads to.

    Parameters
    ----------
    rule : AdaptiveNoise

    References
    ----------
    xiong2009, Eqs. (A.16), (46).
    """

    rule: AdaptiveNoise = field(default_factory=AdaptiveNoise)

    def init(self, prior: Gaussian) -> FilterState:
        """The state before any step."""
        return self._filter(self.rule).init(prior)

    def step(
        self,
        state: FilterState,
        z: Array,
        sensor: MeasurementModel,
        dynamics: Dynamics,
        k: Array = 0,
    ) -> FilterState:
        """A prediction and an update; as of :meth:`navfilters.estimators.filter.Filter.step`."""
        adaptive = self._filter(self.rule)
        seen = adaptive.step(state, z, sensor, dynamics, k).memory
        window = state._replace(memory=seen._replace(factor=state.memory.factor))
        return self._filter(None).update(adaptive.predict(window, dynamics, k), z, sensor, k)

    @staticmethod
    def _filter(rule: Any) -> Filter:
        return Filter(rule=rule, form="short")
