"""An image as a sensor: its centre pixel makes the measurement, and its time the attitude."""

from dataclasses import dataclass, field, replace
from typing import Any

from navfilters.space.navigation_state import NavigationState
from navfilters.space.pose import difference, retract
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class Pixel:
    """The sensor of one image, once its centre pixel is known.

    Parameters
    ----------
    geometry : SarGeometry
    r_f : array (..., 3)
        Earth-fixed position of the pixel, m.
    """

    geometry: Any
    r_f: Array

    @property
    def R(self) -> Array:
        """Covariance of the noise of the measurement, the pixel's error left out, (4, 4)."""
        return self.geometry.R

    def noise(self, x: Array) -> Array:
        """R + B, (..., 4, 4), at the state x (..., 10): see ``SarGeometry.noise``."""
        return self.geometry.noise(NavigationState.of(x), self.r_f)

    def h(self, x: Array) -> Array:
        """The expected measurement, (..., 4)."""
        return self.geometry.h(NavigationState.of(x), self.r_f)

    def jacobian(self, x: Array) -> Array:
        """H, (..., 4, 9), by the error of the state."""
        return self.geometry.jacobian(NavigationState.of(x), self.r_f)

    retract = staticmethod(retract)
    difference = staticmethod(difference)


@dataclass(frozen=True, eq=False)
class SarPass:
    """A series of images: the geometry with the body's attitude at each.

    Parameters
    ----------
    geometry : SarGeometry
    T_e_b : array (steps, 3, 3)
        Attitude of the body at each update.
    """

    geometry: Any
    T_e_b: Array = field(metadata={"axes": 3})

    @property
    def R(self) -> Array:
        """That of the geometry."""
        return self.geometry.R

    def at(self, k: Array) -> Any:
        """The geometry at update k, from 0."""
        xp = self.T_e_b.__array_namespace__()
        return replace(self.geometry, T_e_b=xp.take(self.T_e_b, k, axis=0))

    retract = staticmethod(retract)
    difference = staticmethod(difference)
