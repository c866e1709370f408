"""What a spacecraft that navigates by images knows of itself."""

from typing import NamedTuple

from navfilters.types import Array


class NavigationState(NamedTuple):
    """Position, velocity, and the misalignment of the antenna.

    Parameters
    ----------
    r, v : array (..., 3)
        Earth-fixed position, m, and velocity, m/s.
    q_mu : array (..., 4)
        The unit quaternion, scalar last and passive, from the nominal antenna frame to the actual
        one.

    References
    ----------
    pogorelsky2020, Table 1.
    """

    r: Array
    v: Array
    q_mu: Array

    @classmethod
    def of(cls, x: Array) -> "NavigationState":
        """The parts of a state x (..., 10)."""
        return cls(x[..., :3], x[..., 3:6], x[..., 6:])

    @property
    def x(self) -> Array:
        """All of it, (..., 10), with all the batch axes of its parts."""
        xp = self.r.__array_namespace__()
        batch = xp.broadcast_shapes(*(part.shape[:-1] for part in self))
        whole = [xp.broadcast_to(part, (*batch, part.shape[-1])) for part in self]
        return xp.concat(whole, axis=-1)
