"""The same motion and the same sensor with a state in other units."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from navfilters.types import Array, Gaussian


@dataclass(frozen=True, eq=False)
class OtherUnits:
    """A sensor or dynamics whose state is scale * x.

    Parameters
    ----------
    inner : MeasurementModel or Dynamics
        In its own units.
    scale : array (..., n)
        Units of its state in one of the new ones: 1e-3 for metres to become kilometres.
    """

    inner: Any
    scale: Array

    def at(self, k: int) -> "OtherUnits":
        """That of step k."""
        inner = self.inner.at(k) if hasattr(self.inner, "at") else self.inner
        return OtherUnits(inner, self.scale)

    def prior(self, first: Gaussian) -> Gaussian:
        """A first estimate in the new units."""
        return Gaussian(self.scale * first.mean, self._square(first.cov))

    @property
    def R(self) -> Array:
        """The sensor's, of as many members as the scale has."""
        R = self.inner.R
        batch = np.broadcast_shapes(R.shape[:-2], self.scale.shape[:-1])
        return np.broadcast_to(R, (*batch, *R.shape[-2:]))

    @property
    def Q(self) -> Array:
        """The dynamics', in the new units."""
        return self._square(self.inner.Q)

    def h(self, x: Array) -> Array:
        """What the sensor measures."""
        return self.inner.h(x / self.scale)

    def jacobian(self, x: Array) -> Array:
        """H by the new state."""
        return self.inner.jacobian(x / self.scale) / self.scale[..., None, :]

    def transition(self, x: Array) -> tuple[Array, Array]:
        """f(x) and F."""
        return self.propagate(x, self.Q)[:2]

    def propagate(self, x: Array, Q: Array) -> tuple[Array, Array, Array]:
        """f(x), F and W."""
        column, row = self.scale[..., :, None], self.scale[..., None, :]
        outer = column * row
        x, F, W = self.inner.propagate(x / self.scale, Q / outer)
        return self.scale * x, column * F / row, outer * W

    def _square(self, cov: Array) -> Array:
        return self.scale[..., :, None] * cov * self.scale[..., None, :]
