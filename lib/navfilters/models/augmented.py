"""A sensor of some of the states, of a filter that has more of them."""

from dataclasses import dataclass
from typing import Any

from navfilters.numerics import validation
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class Augmented:
    """z = h(the first states) + B x: more states, such as velocities, and biases among them.

    Parameters
    ----------
    sensor : MeasurementModel
        Of the first states alone, with ``jacobian``; its ``residual`` is this one's. None of
        ``noise``, ``given`` and ``at``, which would be lost.
    own : int
        How many those are.
    B : array (..., m, n)
        How the n states add to the measurement: a column with a 1 for a bias, zeros for the rest.

    Raises
    ------
    ValueError
        An ``own`` that is not 1 to n, a B that does not have the rows of the sensor's R, a sensor
        with more than can be passed on, or without ``jacobian``.
    """

    sensor: Any
    own: int
    B: Array

    def __post_init__(self) -> None:
        lost = [part for part in ("noise", "given", "at") if hasattr(self.sensor, part)]
        if lost or not hasattr(self.sensor, "jacobian"):
            found = f"{lost[0]}, which would be lost" if lost else "no jacobian"
            raise ValueError(
                "sensor must have R, h and jacobian, and no noise, given or at; found "
                f"{type(self.sensor).__name__} with {found}"
            )
        B = validation.real_array("B", self.B, "m, n")
        m, own = self.sensor.R.shape[-1], validation.whole_number("own", self.own, 1)
        if B.shape[-2] != m:
            raise ValueError(f"B must have shape (..., {m}, n), as sensor.R; found {B.shape}")
        if own > B.shape[-1]:
            raise ValueError(f"own must be at most {B.shape[-1]}, the columns of B; found {own}")
        object.__setattr__(self, "B", B)

    @property
    def R(self) -> Array:
        """The sensor's, (..., m, m)."""
        return self.sensor.R

    def h(self, x: Array) -> Array:
        """h + B x, (..., m)."""
        B = x.__array_namespace__().asarray(self.B)
        return self.sensor.h(x[..., : self.own]) + (B @ x[..., None])[..., 0]

    def jacobian(self, x: Array) -> Array:
        """(..., m, n)."""
        xp = x.__array_namespace__()
        H = self.sensor.jacobian(x[..., : self.own])
        rest = xp.zeros((*H.shape[:-1], x.shape[-1] - self.own))
        return xp.concat([H, rest], axis=-1) + xp.asarray(self.B)

    def residual(self, z: Array, z_hat: Array) -> Array:
        """The sensor's, (..., m)."""
        if hasattr(self.sensor, "residual"):
            return self.sensor.residual(z, z_hat)
        return z - z_hat
